// A window with an OpenGL context and its events.
#pragma once

#include <functional>
#include <string>

#include "engine/input.hpp"

struct GLFWwindow;

namespace fathom::viewer {

/// One at a time, on the main thread.
class Window {
 public:
  /// Throws `Error{unavailable}` without a display or OpenGL 4.5. `wait_for_display`: at most one picture per refresh.
  Window(const std::string& title, int width, int height, bool wait_for_display);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Receives events, except those that the panel consumes.
  void set_handler(std::function<void(const engine::InputEvent&)> handler) { handler_ = std::move(handler); }
  /// Receives files dropped on the window.
  void set_drop_handler(std::function<void(const std::string&)> handler) { drop_handler_ = std::move(handler); }
  void set_title(const std::string& title);
  void close();
  bool closing() const;
  void poll();
  void begin_panel();
  void draw_panel();
  void show();

  bool key_down(int key) const;
  int width() const;  ///< pixels, ≥ 1
  int height() const;
  float mouse_x() const { return mouse_x_; }
  float mouse_y() const { return mouse_y_; }

 private:
  void listen();
  void tell(engine::InputKind kind, int code, int modifiers, float x, float y);

  GLFWwindow* window_ = nullptr;
  std::function<void(const engine::InputEvent&)> handler_;
  std::function<void(const std::string&)> drop_handler_;
  float mouse_x_ = 0, mouse_y_ = 0;
};

}  // namespace fathom::viewer
