// Draws bodies with instancing: at most two draw calls for each kind of shape and for each hull and surface, after as
// many for the shadow map. Reads shapes, colours and poses; knows nothing about simulation.
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

/// A body to draw. Its pose is at index `slot` of the pose buffer, its colour at index `slot` of the colours.
struct DrawnBody {
  std::uint32_t slot = 0;
  Shape shape;
  bool ground = false;  ///< a floor: drawn with a grid in the look's ground colours; a box casts no shadow
};

/// A line from `a` to `b`, `width` pixels wide; a dot if both are the same point.
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
  Aabb shadows{};                        ///< m, bounds of what may cast shadows; the smaller, the finer the shadows
  float time = 0;                        ///< s, moves the light under water
  std::span<const Mark> marks{};         ///< hidden behind bodies
  std::span<const Mark> marks_on_top{};  ///< never hidden
};

struct RendererSettings {
  int shadow_size = 4096;  ///< texels along a side of the shadow map; 0: no shadows
  int shadow_taps = 3;     ///< shadow-map samples per pixel along each axis
  bool share_device_poses = true;
};

/// Settings for the current context; cheaper per pixel if it renders in software.
RendererSettings settings_for_context();

/// Belongs to the context that is current when it is created.
class Renderer {
 public:
  /// Throws `Error{unavailable}` if the context lacks a required feature.
  explicit Renderer(const RendererSettings& settings = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  void set_bodies(std::span<const DrawnBody> bodies);
  /// Colours by slot. Alpha below 255: the body is asleep and drawn dimmed.
  void set_colours(std::span<const Colour> colours);
  PoseBuffer& poses();

  /// Draws into the framebuffer, which must have a float depth buffer (see mat4.hpp).
  void draw(const Frame& frame, GLuint framebuffer, int width, int height);
  /// Draw calls of the last picture.
  int draw_calls() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The region that shadows should cover: the part of the box near the camera's target.
Aabb shadow_region(const Aabb& box, const Camera& camera);

}  // namespace fathom::render
