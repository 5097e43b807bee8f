// The device's data of bodies, by device index: one array for each item that some kernel reads without the others.
//
// A device index is not a World's slot: bodies that are added together are laid out along a space-filling curve, so
// neighbours in space are neighbours in memory, and an index is not reused before a step has dropped its last owner's
// contacts.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>

#include "device/access.hpp"
#include "device/support_arrays.hpp"
#include "dynamics/forces.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/solver_body.hpp"
#include "geometry/geometry.hpp"
#include "terrain/surface_view.hpp"
#include "world/filter.hpp"

namespace fathom::device {

inline constexpr std::uint32_t none = 0xffffffffu;

/// `BodyConstants::bits`.
enum BodyBits : std::uint32_t {
  motion_bits = 3,    ///< MotionType
  living_bit = 4,     ///< the index holds a body
  isotropic_bit = 8,  ///< its inertia is a multiple of the identity
  can_sleep_bit = 16,
  filtered_bit = 32,  ///< its filter may keep others out
  bullet_bit = 64,
  moving_surface_bit = 128,  ///< its surface has a velocity
  shape_shift = 8,           ///< ShapeType
  shape_bits = 7,
  friction_rule_shift = 12,
  restitution_rule_shift = 16,
  rule_bits = 15,
  child_bit = 1 << 20,          ///< the index holds no body but a child of a compound (pieces.hpp)
  friction_axis_bit = 1 << 21,  ///< its friction depends on direction
  asks_bit = 1 << 22,           ///< the application is asked about its contacts (ask.hpp)
  filters_bit = 1 << 23,        ///< … about its pairs
};

/// Data of a body that steps only read: four quads.
struct alignas(16) BodyConstants {
  std::uint32_t bits = 0;
  float radius = 0;           ///< of the bounding sphere (m)
  float inverse_mass = 0;     ///< 1/kg
  float inverse_inertia = 0;  ///< for isotropic bodies (1/(kg·m²)), else 0
  Vec3 half_extents;
  float shape_radius = 0;
  float gravity_scale = 0, linear_damping = 0, angular_damping = 0;
  std::uint32_t hull = 0;  ///< index of the shape's hull or surface; for a compound, number of its children
  float friction = 0, restitution = 0;
  std::int32_t group = 0;  ///< of its filter
  /// For a compound, index of its first child; for a child, index of its body; for a surface, the first of the indices
  /// that stand for its patches where contacts are ranked (`ranked_pieces`).
  std::uint32_t link = none;

  FATHOM_HD MotionType motion() const { return static_cast<MotionType>(bits & motion_bits); }
  FATHOM_HD bool is_dynamic() const { return motion() == MotionType::dynamic; }
  FATHOM_HD bool is_living() const { return bits & living_bit; }
  FATHOM_HD bool is_isotropic() const { return bits & isotropic_bit; }
  FATHOM_HD bool is_bullet() const { return bits & bullet_bit; }
  FATHOM_HD bool has_moving_surface() const { return bits & moving_surface_bit; }
  FATHOM_HD bool has_friction_axis() const { return bits & friction_axis_bit; }
  FATHOM_HD bool is_filtered() const { return bits & filtered_bit; }
  FATHOM_HD bool is_child() const { return bits & child_bit; }
  FATHOM_HD bool is_compound() const { return shape() == ShapeType::compound; }
  FATHOM_HD bool is_surface() const { return shape() == ShapeType::mesh || shape() == ShapeType::height_field; }
  FATHOM_HD CombineRule friction_rule() const {
    return static_cast<CombineRule>(bits >> friction_rule_shift & rule_bits);
  }
  FATHOM_HD CombineRule restitution_rule() const {
    return static_cast<CombineRule>(bits >> restitution_rule_shift & rule_bits);
  }
  FATHOM_HD ShapeType shape() const { return static_cast<ShapeType>(bits >> shape_shift & shape_bits); }
};
static_assert(sizeof(BodyConstants) == 64);

FATHOM_HD float half_thickness(const BodyConstants& c) {
  return half_thickness(c.shape(), c.half_extents, c.shape_radius);
}

/// What few surfaces have.
struct alignas(16) SurfaceTraits {
  Vec3 velocity;  ///< m/s, body axes
  float friction_along = 0;
  Vec3 friction_axis;  ///< body axes
  float unused = 0;
};

inline SurfaceTraits traits_of(const Material& m) { return {m.surface_velocity, m.friction_along, m.friction_axis, 0}; }
/// `moving_surface_bit` and `friction_axis_bit` of a body with this material.
inline std::uint32_t trait_bits(const Material& m) {
  return (m.surface_velocity == Vec3{} ? 0u : 1u * moving_surface_bit) |
         (m.friction_axis == Vec3{} ? 0u : 1u * friction_axis_bit);
}

/// A body's filter without its group.
struct FilterMasks {
  std::uint64_t category = 1, mask = ~std::uint64_t{0};
};

/// Inertia in body axes and its inverse (kg·m²), read only for anisotropic bodies, and data read only by round
/// contacts.
struct BodyTensors {
  SymMat3 inertia, inverse;
  float rolling_resistance = 0;
};

/// State flags of a body.
enum BodyFlags : std::uint32_t {
  awake_flag = 1,
  isolated_flag = 2,  ///< stopped because its state was not finite
  forced_flag = 4,    ///< `forces`, or `targets` for a kinematic body, has an entry for the next step
  edited_flag = 8,    ///< its velocity is new, its boxes are not updated yet
};

/// Position of the body's island in the published flags; its 28 bits suffice for the maximum number of bodies.
inline constexpr std::uint32_t island_shift = 4;

/// Changes to a body since the last search for pairs; stored with its fat box, which every reader loads anyway.
enum Changes : std::uint32_t {
  box_change = 1,     ///< the fat box is new
  drop_contacts = 2,  ///< earlier contacts are invalid
  mix_materials = 4,  ///< friction and restitution of its contacts must be mixed again
  wake_partners = 8,  ///< bodies that rest on it wake
  joint_change = 16,  ///< its joints have changed
};

/// See `Bodies::before`.
inline constexpr float has_arrived = 2;

/// A box as two quads; the fourth elements carry notes.
struct alignas(16) NotedBox {
  Vec3 lower;
  std::uint32_t changes = 0;
  Vec3 upper;
  std::uint32_t level = 0;  ///< grid level

  FATHOM_HD Aabb box() const { return {lower, upper}; }
};

/// A box that overlaps nothing.
FATHOM_HD NotedBox no_box() {
  constexpr float far = 3e38f;
  return {{far, far, far}, 0, {-far, -far, -far}, 0};
}

struct alignas(16) Quad {
  float x, y, z, w;

  FATHOM_HD Vec3 xyz() const { return {x, y, z}; }
};

FATHOM_HD Quad quad(Vec3 v, float w) { return {v.x, v.y, v.z, w}; }

/// A SolverBody in the device's solver: quads, each of which is loaded and stored as a unit. The fourth elements are
/// inverse mass (of `moved`) and inverse inertia (of `turned`) until the solver begins, then the number of times the
/// quad was written (solve.hpp).
struct alignas(64) SolverQuads {
  Quad linear, angular, moved, turned;

  SolverQuads() = default;
  FATHOM_HD explicit SolverQuads(const SolverBody& b)
      : linear(quad(b.linear, 0)),
        angular(quad(b.angular, 0)),
        moved(quad(b.moved, b.inverse_mass)),
        turned(quad(b.turned, b.inverse_inertia)) {}

  /// Valid before the solver begins.
  FATHOM_HD SolverBody body() const {
    SolverBody b;
    b.linear = linear.xyz(), b.angular = angular.xyz(), b.moved = moved.xyz(), b.turned = turned.xyz();
    b.inverse_mass = moved.w, b.inverse_inertia = turned.w;
    return b;
  }
};

/// A body in a sweep over the overflow (mass_splitting.hpp): its sums of velocity, in units of 2⁻³⁰ m/s and rad/s,
/// two's complement, because sums of integers do not depend on the order of their terms.
struct SplitBody {
  std::uint64_t linear[3], angular[3];
  std::uint32_t parts;  ///< number of constraints that act on it
};

/// Hulls of all shapes, in device memory.
struct HullRecord {
  std::uint32_t vertices = 0, edges = 0, planes = 0, face_edges = 0;  ///< offset in each array
  int vertex_count = 0, edge_count = 0, face_count = 0;
  float inner = 0, outer = 0, radius = 0;  ///< see HullView
};
/// A bit for each type of shape.
FATHOM_HD constexpr std::uint32_t shape_bit(ShapeType type) { return 1u << static_cast<std::uint32_t>(type); }
/// In addition: there are bullets, or `SurfaceTraits`.
inline constexpr std::uint32_t bullets_bit = 1u << 31, traits_bit = 1u << 30;
/// Several bodies that cannot be pushed have faces.
inline constexpr std::uint32_t seams_bit = 1u << 29;
/// Some body has asked the application.
inline constexpr std::uint32_t questions_bit = 1u << 28;

struct HullArrays {
  const HullRecord* hulls = nullptr;
  const Vec3* vertices = nullptr;
  const Hull::HalfEdge* edges = nullptr;
  const Hull::Plane* planes = nullptr;
  const std::uint16_t* face_edges = nullptr;
  const std::uint16_t* vertex_edges = nullptr;  ///< parallel to `vertices`

  FATHOM_HD HullView view(std::uint32_t index) const {
    const HullRecord h = hulls[index];
    return {.vertices = vertices + h.vertices,
            .edges = edges + h.edges,
            .planes = planes + h.planes,
            .face_edges = face_edges + h.face_edges,
            .vertex_count = h.vertex_count,
            .edge_count = h.edge_count,
            .face_count = static_cast<std::int16_t>(h.face_count),
            .inner = h.inner,
            .outer = h.outer,
            .radius = h.radius,
            .vertex_edges = vertex_edges + h.vertices};
  }
};

/// Parts of the device's body data, for `Bodies`.
enum BodyPart : std::uint8_t {
  body_data,
  body_state,
  body_colours,
  body_islands,
  body_fast_pairs,
  body_supports,
  body_solver
};

/// One array per item, by device index; the parts `written` may be written (access.hpp).
template <BodyPart... written>
struct Bodies {
  template <class T, BodyPart part>
  using Of = Array<T, part, written...>;

  // Given by the application.
  Of<std::uint32_t, body_data> slots;  ///< World's slot of each body, or `none`
  Of<BodyConstants, body_data> constants;
  Of<BodyTensors, body_data> tensors;
  Of<FilterMasks, body_data> filters;  ///< read if one of two bodies `is_filtered`
  Of<Force, body_data> forces;
  Of<Pose, body_data> targets;  ///< poses of kinematic bodies at the end of the step
  /// Of bodies with `has_moving_surface` or `has_friction_axis`; null if there never were any.
  Of<SurfaceTraits, body_data> traits;
  Of<Pose, body_data> child_poses;  ///< of children in their compounds; null if there never were any
  HullArrays hulls;
  const SurfaceView* surfaces;

  // Moved by steps.
  Of<Pose, body_state> poses;
  Of<Velocity, body_state> velocities;
  Of<std::uint32_t, body_state> flags;
  Of<float, body_state> slow_time;  ///< s
  Of<NotedBox, body_state> fat;     ///< the broad phase's boxes
  Of<NotedBox, body_state> known;   ///< the fat boxes that pairs were last searched with
  Of<Aabb, body_state> boxes;       ///< covers the next step's motion

  // Contacts and joints of a body.
  Of<std::uint64_t, body_colours> colours;             ///< used by them
  Of<std::uint64_t, body_colours> further;             ///< colours from `further_colour` on
  Of<std::uint64_t, body_colours> joint_colours;       ///< the part of `colours` used by joints
  Of<std::uint32_t, body_colours> touching;            ///< number of contacts and joints
  Of<std::uint64_t, body_colours> recoloured;          ///< `colours` during recolouring
  Of<std::uint64_t, body_colours> further_recoloured;  ///< `further` during recolouring
  Of<std::uint64_t, body_colours> best;                ///< priority of the contact that chooses its colour next

  // Islands.
  Of<std::uint32_t, body_islands> island;        ///< while it sleeps: shared with all bodies that wake with it
  Of<std::uint32_t, body_islands> parent;        ///< in the union-find forest of islands
  Of<std::uint32_t, body_islands> island_slow;   ///< minimum slow time of the island, as bits
  Of<std::uint32_t, body_islands> island_woken;  ///< number of the step that woke it
  Of<std::uint32_t, body_islands> isolated_in;   ///< number of the step that isolated it

  // For bodies in fast pairs and bodies that strayed (`MoveBodies`).
  Of<std::uint32_t, body_fast_pairs> fast;  ///< these bodies, `Counters::fast_bodies` of them, in any order
  /// At the start of the step; `reserved` is 1 if the body strayed, else 0. Of a kinematic body that has stopped at its
  /// target: `has_arrived`.
  Of<Pose, body_fast_pairs> before;
  Of<Pose, body_fast_pairs> ends;                    ///< end poses of bodies held back by non-dynamic ones; for bullets
  Of<std::uint32_t, body_fast_pairs> fast_pair;      ///< the first of its fast pairs, `none` between steps
  Of<std::uint32_t, body_fast_pairs> fixed_contact;  ///< the first of its `fixed_contacts`; null: no seams

  // Supports.
  Of<BodySupport, body_supports> support;
  Of<SupportNode, body_supports> nodes;
  Of<SupportMove, body_supports> moves;
  Of<Structure, body_supports> structures;    ///< indexed by the least of their bodies
  Of<std::uint32_t, body_supports> by_level;  ///< bodies of structures

  // For bodies in contact, within a step.
  Of<SolverQuads, body_solver> solver;
  Of<BodyMotion, body_solver> motion;
  Of<WarmStart, body_solver> warm;
  Of<WorldInertia, body_solver> inertia;
  Of<SplitBody, body_solver> split;  ///< zero between sweeps; read only if there is an overflow

  template <BodyPart... fewer>
  FATHOM_HD operator Bodies<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Bodies<fewer...>, *this);
  }

  /// For a body that is not a hull.
  FATHOM_HD Geometry simple_geometry(std::uint32_t i) const {
    const BodyConstants& c = constants[i];
    return {c.shape(), c.shape_radius, c.half_extents};
  }
  FATHOM_HD Geometry geometry(std::uint32_t i) const {
    Geometry g = simple_geometry(i);
    if (g.type == ShapeType::hull) g.hull = hulls.view(constants[i].hull);
    return g;
  }
  /// For calls by a whole team.
  FATHOM_HD Geometry geometry_for_team(std::uint32_t i) const {
    Geometry g = geometry(i);
    g.hull.is_for_team = true;
    return g;
  }
  /// Bounds of a piece with this pose (m, world axes).
  FATHOM_HD Aabb bounds(std::uint32_t i, const Pose& pose) const {
    const BodyConstants& c = constants[i];
    return c.is_surface() ? fathom::bounds(surfaces[c.hull].bounds, pose) : fathom::bounds(geometry(i), pose);
  }
  FATHOM_HD bool is_awake(std::uint32_t i) const { return flags[i] & awake_flag; }
};

/// All may be written.
using BodyArrays =
    Bodies<body_data, body_state, body_colours, body_islands, body_fast_pairs, body_supports, body_solver>;

/// Whether the filters of two bodies allow them to collide.
template <BodyPart... written>
FATHOM_HD bool may_collide(const Bodies<written...>& bodies, std::uint32_t i, std::uint32_t j) {
  if (!bodies.constants[i].is_filtered() && !bodies.constants[j].is_filtered()) return true;
  const FilterMasks &a = bodies.filters[i], &b = bodies.filters[j];
  return may_collide(Filter{a.category, a.mask, bodies.constants[i].group},
                     Filter{b.category, b.mask, bodies.constants[j].group});
}

/// Acceleration of body i with this orientation, under the application's force and `gravity` (m/s²).
template <BodyPart... written>
FATHOM_HD Acceleration forced_acceleration(const Bodies<written...>& bodies, std::uint32_t i, Quat rotation,
                                           Vec3 gravity) {
  const BodyConstants& c = bodies.constants[i];
  const Force f = bodies.forces[i];
  Acceleration a{gravity, {}};
  add_forces(a, rotation, c.inverse_mass, c.inverse_inertia, bodies.tensors[i].inverse, f.force, f.torque);
  return a;
}

}  // namespace fathom::device
