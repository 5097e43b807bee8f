// Contacts as supports: their rows, and the motion and momentum of bodies that they hold.
#pragma once

#include "device/constraint_rows.hpp"

namespace fathom::device {

template <ConstraintPart... written>
FATHOM_HD ContactImpulses load_impulses(const Constraints<written...>& constraints, std::uint32_t k) {
  const Quad* const rows = rows_of(constraints, k);
  const Quad n = rows[impulse_row * tile_width], f = rows[(impulse_row + 1) * tile_width];
  ContactImpulses p;
  p.normal[0] = n.x, p.normal[1] = n.y, p.normal[2] = n.z, p.normal[3] = n.w;
  p.slide_1 = f.x, p.slide_2 = f.y, p.twist = f.z, p.step = f.w;
  return p;
}

/// Vectors from A's and B's centres to a contact's centre (m).
struct ContactArms {
  Vec3 a, b;
};
template <ConstraintPart... written>
FATHOM_HD ContactArms load_arms(const Constraints<written...>& constraints, std::uint32_t k) {
  const Quad* const rows = rows_of(constraints, k);
  const Quad q1 = rows[tile_width], q2 = rows[2 * tile_width];
  return {{q1.z, q1.w, q2.x}, {q2.y, q2.z, q2.w}};
}

/// `touching_points` of constraint k.
template <ConstraintPart... written>
FATHOM_HD std::uint32_t touching_points(const Constraints<written...>& constraints, std::uint32_t k,
                                        const ContactImpulses& impulses) {
  const Quad* const rows = rows_of(constraints, k);
  SupportPoints points;
  points.count = static_cast<int>(constraints.heads[k].bits & point_bits);
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= points.count) continue;
    const Quad p = rows[(first_point_row + static_cast<std::uint32_t>(i)) * tile_width];
    points.x[i] = p.x, points.y[i] = p.y, points.separation[i] = p.z;
  }
  return touching_points(points, impulses, load_arms(constraints, k).b);
}

/// Rows of constraint k, without weights.
template <ConstraintPart... written>
FATHOM_HD SupportRows load_support(const Constraints<written...>& constraints, std::uint32_t k, bool b_is_upper) {
  const Quad* const rows = rows_of(constraints, k);
  const Quad q0 = rows[0], q1 = rows[tile_width], q4 = rows[4 * tile_width];
  const ContactArms arms = load_arms(constraints, k);
  SupportRows r{};
  r.n = {q0.x, q0.y, q0.z};
  r.t1 = {q0.w, q1.x, q1.y};
  r.arm_upper = b_is_upper ? arms.b : arms.a;
  r.arm_lower = b_is_upper ? arms.a : arms.b;
  r.friction = q4.z;
  if (constraints.heads[k].has(row_extra)) {
    const ContactSurface& surface = constraints.extras[k].surface;
    r.friction *= smallest_friction(surface.grain_1, surface.grain_2);
  }
  r.twist_radius = q4.w;
  r.up = b_is_upper ? 1.0f : -1.0f;
  const std::uint32_t count = constraints.heads[k].bits & point_bits;
  for (std::uint32_t i = 0; i < max_manifold_points; ++i) {
    if (i >= count) continue;
    const Quad p = rows[(first_point_row + i) * tile_width];
    r.x[i] = p.x, r.y[i] = p.y;
  }
  return r;
}

/// Whether contacts can push a body that takes part in the step.
template <BodyPart... written>
FATHOM_HD bool is_pushable(const Bodies<written...>& bodies, std::uint32_t i) {
  const BodyConstants& c = bodies.constants[i];
  return c.is_living() && c.is_dynamic() && c.inverse_mass > 0 && bodies.is_awake(i);
}

/// Equal for obstacles that move as one: those with the same velocity that do not turn. `is_surface`: its surface
/// moves.
FATHOM_HD std::uint32_t motion_key(const Velocity& v, std::uint32_t i, bool is_surface) {
  if (is_surface || !(v.angular == Vec3{})) return i;
  std::uint32_t key = 0x80000000u;
  for (const float part : {v.linear.x, v.linear.y, v.linear.z})
    key = (key ^ __builtin_bit_cast(std::uint32_t, part + 0.0f)) * 0x9e3779b1u, key ^= key >> 15;
  return key | 0x80000000u;
}

/// The velocity of a body if it moves as one with what its structure rests on.
template <BodyPart... written>
FATHOM_HD Velocity common_motion(const Bodies<written...>& bodies, const Structure& structure, std::uint32_t i) {
  Velocity v;
  if (!structure.has_moving_base()) return v;
  const Velocity& base = bodies.velocities[structure.first_base];
  const Vec3 arm = bodies.poses[i].position - bodies.poses[structure.first_base].position;
  v.linear = base.linear + cross(base.angular, arm);
  v.linear += surface_velocity(bodies, structure.first_base);
  v.angular = base.angular;
  return v;
}

/// A body's inverse mass and inertia, as used by its contacts in this step.
struct SupportMass {
  float inverse_mass, inverse_inertia;
  SymMat3 inverse_tensor;  ///< world axes

  template <BodyPart... written>
  FATHOM_HD SupportMass(const Bodies<written...>& bodies, const Counters& counters, std::uint32_t i)
      : inverse_mass(bodies.constants[i].inverse_mass), inverse_inertia(bodies.constants[i].inverse_inertia) {
    const float inverse_scale = 1.0f / inertia_scale(bodies, counters, i);
    inverse_mass *= inverse_scale;
    inverse_inertia *= inverse_scale;
    if (is_anisotropic(inverse_mass, inverse_inertia))
      inverse_tensor = world_inertia<SymMat3>(bodies, i, inverse_mass, inverse_inertia);
  }
  FATHOM_HD Wrench momentum(Vec3 linear, Vec3 angular) const {
    return {(1.0f / inverse_mass) * linear, ask([&](const auto& inertia) { return moment_of(inertia, angular); })};
  }
  FATHOM_HD Vec3 spin(Vec3 momentum) const {
    return ask([&](const auto& inertia) { return inertia.spun_by(momentum); });
  }

 private:
  template <class Act>
  FATHOM_HD Vec3 ask(const Act& act) const {
    return with_inverse_inertia(inverse_mass, inverse_inertia, inverse_tensor, act);
  }
};

}  // namespace fathom::device
