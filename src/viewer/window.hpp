// A window with an OpenGL context, and what the hands do in it.
#pragma once

#include <functional>
#include <memory>
#include <string>

struct GLFWwindow;

namespace fathom::viewer {

/// What happens in the window. Keys and buttons are GLFW's; nothing is called for what the panel takes.
struct WindowEvents {
  std::function<void(int key, int modifiers)> key_pressed;
  std::function<void(int button, bool pressed)> mouse_button;
  std::function<void(float dx, float dy)> mouse_moved;
  std::function<void(float notches)> scrolled;
};

/// One at a time, on the main thread.
class Window {
 public:
  /// Throws `Error{unavailable}` without a display or OpenGL 4.5. `wait_for_display`: a picture a refresh at most.
  Window(const std::string& title, int width, int height, bool wait_for_display);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void set_events(WindowEvents events) { events_ = std::move(events); }
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
  static Window& of(GLFWwindow* window);

  GLFWwindow* window_ = nullptr;
  WindowEvents events_;
  float mouse_x_ = 0, mouse_y_ = 0;
};

}  // namespace fathom::viewer
