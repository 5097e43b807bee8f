#include "viewer/controls.hpp"

#include <cmath>

namespace fathom::viewer {
namespace {

constexpr float radians_per_pixel = 0.006f;
constexpr float steepest = 1.55f;  // rad, almost straight down
constexpr float field_of_view = 0.8f;

}  // namespace

void CameraControls::look_at(const Aabb& box, float aspect) {
  const render::Camera camera = render::camera_on(box, azimuth_, elevation_, aspect, field_of_view);
  target_ = camera.target;
  distance_ = distance(camera.eye, camera.target);
}

void CameraControls::orbit(float dx, float dy) {
  azimuth_ -= radians_per_pixel * dx;
  elevation_ = clamp(elevation_ + radians_per_pixel * dy, -steepest, steepest);
}

void CameraControls::pan(float dx, float dy, int height) {
  const render::CameraAxes a = render::axes(camera());
  const float metres = 2 * distance_ * std::tan(0.5f * field_of_view) / static_cast<float>(height);
  target_ += metres * (dy * a.up - dx * a.right);
}

void CameraControls::zoom(float notches) { distance_ = clamp(distance_ * std::exp(-0.12f * notches), 0.2f, 1e4f); }

void CameraControls::fly(Vec3 direction, float seconds) {
  const render::CameraAxes a = render::axes(camera());
  const float metres = 0.8f * max(distance_, 5.0f) * seconds;
  target_ += metres * (direction.x * a.right + direction.y * a.up - direction.z * a.back);
}

render::Camera CameraControls::camera() const {
  render::Camera camera;
  camera.target = target_;
  camera.eye = target_ + distance_ * render::direction_of(azimuth_, elevation_);
  camera.field_of_view = field_of_view;
  camera.near = max(0.02f, 0.002f * distance_);
  return camera;
}

}  // namespace fathom::viewer
