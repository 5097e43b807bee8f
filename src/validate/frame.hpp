// A pose in double precision.
#pragma once

#include <cmath>
#include <fathom/math.hpp>

#include "math/vec3d.hpp"

namespace fathom::validate {

/// The rotation's columns, and the origin.
struct Frame {
  Vec3d x, y, z, origin;

  explicit Frame(const Pose& pose) : origin(to_double(pose.position)) {
    double w = to_double(pose.rotation.w), a = to_double(pose.rotation.x), b = to_double(pose.rotation.y),
           c = to_double(pose.rotation.z);
    const double scale = 1 / std::sqrt(w * w + a * a + b * b + c * c);
    w *= scale, a *= scale, b *= scale, c *= scale;
    x = {1 - 2 * (b * b + c * c), 2 * (a * b + w * c), 2 * (a * c - w * b)};
    y = {2 * (a * b - w * c), 1 - 2 * (a * a + c * c), 2 * (b * c + w * a)};
    z = {2 * (a * c + w * b), 2 * (b * c - w * a), 1 - 2 * (a * a + b * b)};
  }
  /// To the world, and back.
  Vec3d operator()(Vec3d p) const { return origin + p.x * x + p.y * y + p.z * z; }
  Vec3d local(Vec3d p) const { return {dot(x, p - origin), dot(y, p - origin), dot(z, p - origin)}; }
};

}  // namespace fathom::validate
