// Random numbers for tests: the same with every standard library, unlike the libraries' own distributions.
#pragma once

#include <fathom/math.hpp>
#include <random>

namespace fathom::test {

using Generator = std::mt19937;

inline float uniform(Generator& random, float lo, float hi) {
  return lo + (hi - lo) * (static_cast<float>(random() >> 8) * 0x1p-24f);
}
/// In the cube from −1 to 1.
inline Vec3 in_cube(Generator& random) {
  const float x = uniform(random, -1, 1), y = uniform(random, -1, 1), z = uniform(random, -1, 1);
  return {x, y, z};
}
inline Vec3 on_sphere(Generator& random) {
  for (;;) {
    const Vec3 v = in_cube(random);
    const float l = length(v);
    if (l > 0.1f && l < 1) return (1 / l) * v;
  }
}
inline Quat any_rotation(Generator& random) {
  for (;;) {
    const Vec3 v = in_cube(random);
    const Quat q{uniform(random, -1, 1), v.x, v.y, v.z};
    const float l = dot(q, q);
    if (l > 0.01f && l < 1) return normalize(q);
  }
}
inline Pose any_pose(Generator& random, float reach) {
  const Vec3 position = reach * in_cube(random);
  return {position, 0, any_rotation(random)};
}

}  // namespace fathom::test
