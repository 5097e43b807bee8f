// Bodies: ids, materials, filters and the definition a body is created from.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <fathom/shape.hpp>
#include <optional>

namespace fathom {

/// Names a body. `index` addresses `World::poses()` and `World::velocities()` for the life of the body; the generation
/// distinguishes bodies that reuse an index.
struct BodyId {
  std::uint32_t index = 0xffffffffu;  ///< its slot, for life
  std::uint32_t generation = 0;       ///< how often the slot was used before

  friend bool operator==(BodyId, BodyId) = default;
};

/// How a body moves.
enum class MotionType : std::uint8_t {
  fixed,      ///< "static": never moves
  kinematic,  ///< moves at its set velocity or to a pose (World::move_to); pushes others, but is not pushed
  dynamic,    ///< moved by forces and contacts
};

/// How the two materials of a contact combine into one coefficient. If their rules differ, the one later in this list
/// wins.
enum class CombineRule : std::uint8_t { average, minimum, geometric_mean, multiply, maximum };

/// Properties of a body's surface.
struct Material {
  float friction = 0.5f;                                    ///< Coulomb coefficient, ≥ 0
  float restitution = 0.0f;                                 ///< 0 … 1
  CombineRule friction_rule = CombineRule::geometric_mean;  ///< how two bodies' friction becomes one
  CombineRule restitution_rule = CombineRule::maximum;      ///< how two bodies' restitution becomes one
  /// For spheres and capsules, ≥ 0: slows rolling as if the normal force acted this fraction of the radius ahead of the
  /// contact. A ball decelerates at 5/7 g times this value, and stays at rest on slopes up to this tangent. Typical
  /// values are 0.001 (steel) to 0.05 (a soft ball). A contact uses the larger of its bodies' values and the larger
  /// radius.
  float rolling_resistance = 0.0f;
  /// Velocity of the surface relative to the body, such as a conveyor belt's (m/s, at most 1e6; in the body's axes, or
  /// in those of the compound's child with this material). Only the component tangential to the contact counts.
  /// Friction brings bodies on the surface to this velocity and reacts on the body: one that is free to move drives off
  /// the opposite way.
  Vec3 surface_velocity{};
  /// Anisotropic friction, as of skis, runners and treads. If this is a unit vector, `friction` acts across it and
  /// `friction_along` along it, and what is in between lies on an ellipse; zero: `friction` acts in all directions. In
  /// the body's axes, or in those of the compound's child with this material. Where it is oblique to the contact's
  /// plane, its projection counts, and the coefficient along that passes from `friction_along` to `friction` with the
  /// squared sine of the angle. The two materials of a contact combine along and across the more anisotropic one's
  /// axis.
  Vec3 friction_axis{};
  float friction_along = 0.5f;  ///< Coulomb coefficient along `friction_axis`, ≥ 0
};

/// Two bodies of the same non-zero group collide if it is positive and do not if it is negative, whatever their masks.
/// Otherwise they collide if the category of each is in the mask of the other. See also `World::exclude`.
struct Filter {
  std::uint64_t category = 1;              ///< bits, usually one
  std::uint64_t mask = ~std::uint64_t{0};  ///< categories that it collides with
  std::int32_t group = 0;                  ///< 0: none
  std::uint32_t reserved = 0;              ///< padding
};

/// The definition of a body. The origin of the body's frame is its centre of mass (see `hull`).
struct BodyDef {
  MotionType motion = MotionType::dynamic;  ///< fixed, kinematic or dynamic
  Pose pose{};                              ///< of the centre of mass; the rotation is normalised
  Velocity velocity{};                      ///< zero for a fixed body
  Shape shape{};                            ///< what collides
  Material material{};                      ///< friction and restitution
  Filter filter{};                          ///< what it collides with
  /// Mass (kg); if absent, density times the shape's volume.
  std::optional<float> mass{};
  float density = 1000.0f;  ///< kg/m³; used if `mass` is absent
  /// Inertia about the centre of mass in body axes (kg·m²), instead of the solid shape's. Must be positive definite,
  /// with no principal moment larger than the sum of the other two.
  std::optional<SymMat3> inertia{};
  float gravity_scale = 1.0f;    ///< factor on the world's gravity
  float linear_damping = 0.0f;   ///< 1/s, ≥ 0
  float angular_damping = 0.0f;  ///< 1/s, ≥ 0
  bool can_sleep = true;         ///< whether it may fall asleep with its island
  bool sensor = false;           ///< pushes nothing and is not pushed; reports what is inside (sensor.hpp)
  /// When fast, it is swept against all bodies; other bodies are swept only against those that cannot be pushed (as in
  /// Box2D and Box3D). For projectiles and other small, fast bodies: costs a search per fast pair and step.
  bool bullet = false;
  /// Calls the application before the body's contacts are solved (`World::set_pre_solve_callback`).
  bool pre_solve = false;
  /// Calls the application before the body's pairs become contacts (`World::set_filter_callback`).
  bool custom_filter = false;
  std::uint64_t user_data = 0;  ///< belongs to the application
};

}  // namespace fathom
