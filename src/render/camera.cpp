#include "render/camera.hpp"

#include <cmath>

namespace fathom::render {

CameraAxes axes(const Camera& camera) {
  const Vec3 back = normalize(camera.eye - camera.target, {0, -1, 0});
  const Vec3 right = normalize(cross({0, 0, 1}, back), {1, 0, 0});
  return {right, cross(back, right), back};
}

Mat4 view_projection(const Camera& camera, float aspect) {
  const CameraAxes a = axes(camera);
  return perspective_matrix(1 / std::tan(0.5f * camera.field_of_view), aspect, camera.near) *
         view_matrix(camera.eye, a.right, a.up, a.back);
}

Vec3 direction_through(const Camera& camera, float aspect, float x, float y) {
  const CameraAxes a = axes(camera);
  const float half_height = std::tan(0.5f * camera.field_of_view);
  return normalize(x * aspect * half_height * a.right + y * half_height * a.up - a.back);
}

Vec3 direction_of(float azimuth, float elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
}

Camera camera_on(const Aabb& box, float azimuth, float elevation, float aspect, float field_of_view) {
  Camera camera;
  camera.field_of_view = field_of_view;
  camera.target = centre(box);
  const Vec3 direction = direction_of(azimuth, elevation);
  camera.eye = camera.target + direction;
  const CameraAxes a = axes(camera);
  const float half_height = std::tan(0.5f * field_of_view), half_width = aspect * half_height;
  // Each corner must lie within the four side planes of the view.
  float distance = 0;
  const Vec3 half = half_extents(box);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p{corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z};
    const float across = abs(dot(p, a.right)) / half_width, upwards = abs(dot(p, a.up)) / half_height;
    distance = max(distance, max(across, upwards) + dot(p, a.back));
  }
  const float margin = 1.06f;
  camera.eye = camera.target + (margin * distance) * direction;
  camera.near = max(0.02f, 0.002f * distance);
  return camera;
}

}  // namespace fathom::render
