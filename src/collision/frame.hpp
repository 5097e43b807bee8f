// Pose of one shape in the frame of the other, with a matrix: cheaper than a quaternion for many points.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

struct Frame {
  Mat3 rotation;
  Vec3 position;
};

FATHOM_HD Frame make_frame(const Pose& pose) { return {to_matrix(pose.rotation), pose.position}; }
FATHOM_HD Frame inverse(const Frame& f) { return {transpose(f.rotation), -transpose_mul(f.rotation, f.position)}; }
FATHOM_HD Vec3 transform(const Frame& f, Vec3 v) { return f.rotation * v + f.position; }

}  // namespace fathom
