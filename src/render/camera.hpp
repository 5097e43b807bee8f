// The camera of a picture.
#pragma once

#include <fathom/math.hpp>

#include "render/mat4.hpp"

namespace fathom::render {

struct Camera {
  Vec3 eye{10, -10, 6};
  Vec3 target{0, 0, 0};
  float field_of_view = 0.7f;  ///< rad, vertical
  float near = 0.05f;          ///< m
};

/// Unit axes of the picture in the world; z is up, and a camera that looks straight up or down has y up.
struct CameraAxes {
  Vec3 right, up, back;
};
CameraAxes axes(const Camera& camera);

/// World to clip space (see mat4.hpp).
Mat4 view_projection(const Camera& camera, float aspect);

/// Unit direction through a point of the picture, x and y from −1 (left, bottom) to 1.
Vec3 direction_through(const Camera& camera, float aspect, float x, float y);

/// Direction from the target to the eye: azimuth about z from +x, elevation above the horizon (rad).
Vec3 direction_of(float azimuth, float elevation);

/// A camera that sees the whole box from that direction.
Camera camera_on(const Aabb& box, float azimuth, float elevation, float aspect, float field_of_view = 0.7f);

}  // namespace fathom::render
