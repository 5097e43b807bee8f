// The camera and its controls: orbiting a point, or flying.
#pragma once

#include "render/camera.hpp"

namespace fathom::viewer {

class CameraControls {
 public:
  /// Frames the whole box.
  void look_at(const Aabb& box, float aspect);

  void orbit(float dx, float dy);  ///< mouse movement in pixels
  void pan(float dx, float dy, int height);
  void zoom(float notches);
  /// Flight along the camera's axes (right, up, ahead), in units of its distance per second.
  void fly(Vec3 direction, float seconds);

  render::Camera camera() const;

 private:
  Vec3 target_{0, 0, 1};
  float azimuth_ = -0.96f, elevation_ = 0.42f, distance_ = 20;
};

}  // namespace fathom::viewer
