// Draws bodies: instanced, at most two draw calls for each kind of shape and for each hull and surface, after the same
// for the shadow map. Reads shapes, colours and poses and knows nothing of who moves them.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <fathom/shape.hpp>
#include <memory>
#include <span>
#include <vector>

#include "render/camera.hpp"
#include "render/colour.hpp"
#include "render/look.hpp"
#include "render/pose_buffer.hpp"

namespace fathom::render {

/// A body to draw. Its pose is number `slot` of the pose buffer, its colour number `slot` of the colours.
struct DrawnBody {
  std::uint32_t slot = 0;
  Shape shape;
  bool ground = false;  ///< a floor: it is drawn with a grid in the look's ground colours, and a box throws no shadow
};

/// A line from `a` to `b`, so many pixels wide; a dot where both are one point.
struct Mark {
  Vec3 a;
  float width = 2;
  Vec3 b;
  Colour colour;
};
static_assert(sizeof(Mark) == 32);

/// What a picture shows besides the bodies.
struct Frame {
  Camera camera;
  Look look;
  Aabb shadows{};                        ///< m, what may throw shadows; the smaller, the finer they are
  float time = 0;                        ///< s, moves the light under water
  std::span<const Mark> marks{};         ///< hidden behind bodies
  std::span<const Mark> marks_on_top{};  ///< never hidden
};

struct RendererSettings {
  int shadow_size = 4096;  ///< texels along a side of the shadow map; 0: no shadows
  int shadow_taps = 3;     ///< samples of it a pixel, along each axis
  bool share_device_poses = true;
};

/// What suits the current context: less work a pixel where it draws in software.
RendererSettings settings_for_context();

/// Belongs to the context that is current when it is made.
class Renderer {
 public:
  /// Throws `Error{unavailable}` where the context lacks what is needed.
  explicit Renderer(const RendererSettings& settings = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  void set_bodies(std::span<const DrawnBody> bodies);
  /// Colours by slot. Alpha below 255: the body sleeps and is drawn dimmed.
  void set_colours(std::span<const Colour> colours);
  PoseBuffer& poses();

  /// Draws into the framebuffer, whose depth buffer must be a float's (see mat4.hpp).
  void draw(const Frame& frame, GLuint framebuffer, int width, int height);
  /// Draw calls of the last picture.
  int draw_calls() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The region that a camera's shadows should cover: of the box what lies near what the camera looks at.
Aabb shadow_region(const Aabb& box, const Camera& camera);

}  // namespace fathom::render
