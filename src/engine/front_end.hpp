// What the engine needs from a window and a renderer. Front ends implement it (GLFW, off-screen, a test); the engine
// itself provides only a headless one.
#pragma once

#include <cstdint>
#include <fathom/profile.hpp>
#include <fathom/shape.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/input.hpp"

namespace fathom::engine {

/// Linear red, green, blue and opacity, each 0 … 1.
struct Colour {
  float r = 0.7f, g = 0.7f, b = 0.7f, a = 1.0f;

  friend bool operator==(const Colour&, const Colour&) = default;
};

/// How an entity looks: a shape in the entity's frame.
struct GraphicsBody {
  Shape shape;
  Colour colour;
  Pose local;
};

/// The camera's position and view (m, z up).
struct Camera {
  Vec3 eye{12, -12, 8};
  Vec3 target{0, 0, 1};
  float vertical_field = 0.9f;  ///< rad
};

/// What to draw in a frame. Valid during `FrontEnd::draw` only.
struct DrawFrame {
  /// Look and world pose of every drawn entity, in the same order.
  std::span<const GraphicsBody> bodies;
  std::span<const Pose> poses;
  /// Changes whenever `bodies` does; while it stays the same, reading `poses` is enough.
  std::uint64_t revision = 0;
  Camera camera;
  std::uint64_t frame = 0;   ///< number of the frame, from 1
  std::uint64_t step = 0;    ///< the step whose state is drawn; with interpolation the later of two
  double time = 0;           ///< s simulated
  double frame_seconds = 0;  ///< duration of the last frame (s)
  double speed = 1;          ///< achieved simulated seconds per second of wall time
  bool paused = false;
  const Profile* profile = nullptr;  ///< of the drawn step; null before the first
};

/// Source of events and target of frames. Called only by the thread that runs the engine.
class FrontEnd {
 public:
  virtual ~FrontEnd() = default;
  FrontEnd() = default;
  FrontEnd(const FrontEnd&) = delete;
  FrontEnd& operator=(const FrontEnd&) = delete;

  /// Appends the events since the last call. `window_closed` ends the run unless a handler consumes it.
  virtual void poll(std::vector<InputEvent>& events) = 0;
  virtual void draw(const DrawFrame& frame) = 0;
  /// True if `draw` waits for the display, so the engine need not pace frames.
  virtual bool has_vsync() const { return false; }
  /// Sets the title or status line, if there is one.
  virtual void set_title(std::string_view) {}
};

/// No window: no events, nothing drawn.
class HeadlessFrontEnd final : public FrontEnd {
 public:
  void poll(std::vector<InputEvent>&) override {}
  void draw(const DrawFrame&) override {}
};

}  // namespace fathom::engine
