// The velocity that takes a kinematic body to a pose. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// Rotation vector (rad, world axes) of a unit quaternion, |φ| ≤ π. A quarter of half the angle has a tangent of at
/// most 0.2, where five terms of the arctangent's series are exact to rounding; tan(a/2) = tan a / (1 + √(1 + tan² a)).
FATHOM_HD Vec3 rotation_vector(Quat q) {
  const Vec3 v = q.w < 0 ? -q.vector() : q.vector();
  const float sine = length(v);
  if (!(sine > 0)) return {};
  float t = sine / (1 + abs(q.w));
  for (int i = 0; i < 2; ++i) t = t / (1 + fathom::sqrt(fma(t, t, 1.0f)));
  const float x = t * t;
  const float series = fma(x, fma(x, fma(x, fma(x, 1.0f / 9, -1.0f / 7), 1.0f / 5), -1.0f / 3), 1.0f);
  return (16 * t * series / sine) * v;
}

/// The velocity that takes a body from pose `from` to pose `to` in `dt` (s), turning the shorter way; zero where the
/// distance is too long for a float.
FATHOM_HD Velocity velocity_between(const Pose& from, const Pose& to, float dt) {
  const float rate = 1 / dt;
  const Vec3 linear = rate * (to.position - from.position);
  const Vec3 angular = rate * rotation_vector(to.rotation * conjugate(from.rotation));
  if (!is_finite(linear)) return {};
  return {linear, 0, angular, 0};
}

FATHOM_HD bool is_moving(const Velocity& v) { return length_squared(v.linear) + length_squared(v.angular) > 0; }

}  // namespace fathom
