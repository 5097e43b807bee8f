// The camera under its controls: around a point, or in flight.
#pragma once

#include "render/camera.hpp"

namespace fathom::viewer {

class CameraControls {
 public:
  /// Looks at the whole box.
  void look_at(const Aabb& box, float aspect);

  void orbit(float dx, float dy);  ///< pixels that the mouse moved
  void pan(float dx, float dy, int height);
  void zoom(float notches);
  /// Flight: m along the camera's own axes (right, up, ahead), in units of its distance a second.
  void fly(Vec3 direction, float seconds);

  render::Camera camera() const;

 private:
  Vec3 target_{0, 0, 1};
  float azimuth_ = -0.96f, elevation_ = 0.42f, distance_ = 20;
};

}  // namespace fathom::viewer
