// Bodies and measurements that several cases share. Sums are in double, so that they measure the engine, not
// themselves.
#pragma once

#include <cmath>
#include <fathom/world.hpp>
#include <optional>

#include "math/vec3d.hpp"

namespace fathom::validate {

inline constexpr double g = 9.81;  // m/s²

inline double wide(float a) { return static_cast<double>(a); }
inline float narrow(double a) { return static_cast<float>(a); }

/// A fixed slab whose surface is at z = 0.
inline BodyDef floor_slab(Material material = {}, float half_side = 100) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({half_side, half_side, 0.5f});
  def.pose.position.z = -0.5f;
  def.material = material;
  return def;
}

inline BodyDef body(const Shape& shape, Vec3 position, std::optional<float> mass = 1.0f, Material material = {}) {
  BodyDef def;
  def.shape = shape;
  def.mass = mass;
  def.pose.position = position;
  def.material = material;
  return def;
}

inline Quat turn_about(Vec3 axis, double angle) {
  const Vec3 n = normalize(axis);
  const float s = narrow(std::sin(0.5 * angle));
  return {narrow(std::cos(0.5 * angle)), s * n.x, s * n.y, s * n.z};
}

inline void steps(World& world, int count) {
  for (int i = 0; i < count; ++i) world.step();
}

/// Number of steps in `seconds` of simulated time.
inline int step_count(const World& world, double seconds) {
  return static_cast<int>(std::lround(seconds / wide(world.definition().dt)));
}

inline double speed(const World& world, BodyId id) { return wide(length(world.velocity(id).linear)); }

/// Spin angular momentum in the body's axes (kg·m²/s).
inline Vec3 body_momentum(const World& world, BodyId id) {
  const Vec3 spin = inverse_rotate(world.pose(id).rotation, world.velocity(id).angular);
  return world.mass_properties(id).inertia * spin;
}

/// Angular momentum about the centre of mass (kg·m²/s, world).
inline Vec3 spin_momentum(const World& world, BodyId id) {
  return rotate(world.pose(id).rotation, body_momentum(world, id));
}

inline double kinetic_energy(const World& world, BodyId id) {
  const Vec3 v = world.velocity(id).linear;
  const Vec3 spin = inverse_rotate(world.pose(id).rotation, world.velocity(id).angular);
  const double square = wide(v.x) * wide(v.x) + wide(v.y) * wide(v.y) + wide(v.z) * wide(v.z);
  return 0.5 * (wide(world.mass(id)) * square + wide(dot(spin, body_momentum(world, id))));
}

/// Kinetic energy plus potential energy above z = 0, in the suite's gravity.
inline double energy(const World& world, BodyId id) {
  return kinetic_energy(world, id) + wide(world.mass(id)) * g * wide(world.pose(id).position.z);
}

inline bool all_finite(const World& world) {
  for (const BodyId id : world.bodies()) {
    const Velocity& v = world.velocity(id);
    if (!is_finite(world.pose(id)) || !is_finite(v.linear) || !is_finite(v.angular)) return false;
  }
  return true;
}

}  // namespace fathom::validate
