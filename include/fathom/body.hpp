// Bodies: ids, materials, filters and the definition a body is created from.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <fathom/shape.hpp>
#include <optional>

namespace fathom {

/// Names a body. `index` addresses `World::poses()` and `World::velocities()` as long as the body lives;
/// the generation tells a reused index from the body that had it before.
struct BodyId {
  std::uint32_t index = 0xffffffffu;  ///< its slot, for life
  std::uint32_t generation = 0;       ///< how often the slot was used before

  friend bool operator==(BodyId, BodyId) = default;
};

/// How a body moves.
enum class MotionType : std::uint8_t {
  fixed,      ///< "static": never moves
  kinematic,  ///< moves with the velocity it is given, or to a pose (World::move_to); pushes, is not pushed
  dynamic,    ///< moves by forces and contacts
};

/// How the two materials of a contact become one coefficient. Of two different rules the one later in
/// this list wins.
enum class CombineRule : std::uint8_t { average, minimum, geometric_mean, multiply, maximum };

/// What a body's surface is like.
struct Material {
  float friction = 0.5f;                                    ///< Coulomb coefficient, ≥ 0
  float restitution = 0.0f;                                 ///< 0 … 1
  CombineRule friction_rule = CombineRule::geometric_mean;  ///< how two bodies' friction becomes one
  CombineRule restitution_rule = CombineRule::maximum;      ///< how two bodies' restitution becomes one
  /// For spheres and capsules, ≥ 0: a rolling one brakes as if the normal force acted ahead of the contact by this part
  /// of its radius. A ball then decelerates by 5/7 g times this value, and stays on slopes up to this tangent. Typical
  /// values are 0.001 (steel) to 0.05 (a soft ball). The larger of two bodies' values counts, times the larger radius.
  float rolling_resistance = 0.0f;
  /// At which the surface moves against the body (m/s, body's axes; in a compound those of the child whose material it
  /// is), as of a conveyor belt; at most 1e6. Friction takes what lies on it to that speed, and acts on the body in
  /// return: one that is not held drives off the other way. Of it counts what is along the contact.
  Vec3 surface_velocity{};
};

/// Two bodies of one group, other than 0, collide where it is positive and do not where it is negative, whatever their
/// masks. Others collide where each one's category is in the other's mask. See also `World::exclude`.
struct Filter {
  std::uint64_t category = 1;              ///< bits, mostly one
  std::uint64_t mask = ~std::uint64_t{0};  ///< categories that it collides with
  std::int32_t group = 0;                  ///< 0: none
  std::uint32_t reserved = 0;              ///< padding
};

/// What a body is created from. The body's frame is centred at its centre of mass (see `hull`).
struct BodyDef {
  MotionType motion = MotionType::dynamic;  ///< fixed, kinematic or dynamic
  Pose pose{};                              ///< of the centre of mass; the rotation is normalised
  Velocity velocity{};                      ///< zero for a fixed body
  Shape shape{};                            ///< what collides
  Material material{};                      ///< friction and restitution
  Filter filter{};                          ///< what it collides with
  /// Mass (kg); where absent it follows from the density and the shape's volume.
  std::optional<float> mass{};
  float density = 1000.0f;  ///< kg/m³, without `mass`
  /// Inertia about the centre of mass in body axes (kg·m²) in place of the solid shape's; must be positive definite,
  /// and no principal moment larger than the sum of the other two.
  std::optional<SymMat3> inertia{};
  float gravity_scale = 1.0f;    ///< factor on the world's gravity
  float linear_damping = 0.0f;   ///< 1/s, ≥ 0
  float angular_damping = 0.0f;  ///< 1/s, ≥ 0
  bool can_sleep = true;         ///< whether it may fall asleep with its island
  bool sensor = false;           ///< pushes nothing and is not pushed; tells what is inside (sensor.hpp)
  /// Swept against all bodies when it is fast, where others are swept only against those that cannot be pushed (as in
  /// Box2D and Box3D). For shots and other small, fast bodies: it costs a search per fast pair and step.
  bool bullet = false;
  /// The application is asked about its contacts before they are solved (`World::set_pre_solve_callback`). Not on the
  /// device simulator.
  bool pre_solve = false;
  /// And about its pairs before they become contacts (`World::set_filter_callback`). Not on the device simulator.
  bool custom_filter = false;
  std::uint64_t user_data = 0;  ///< belongs to the application
};

}  // namespace fathom
