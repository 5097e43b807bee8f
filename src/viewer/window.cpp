// OpenGL's loader comes first: GLFW would include the system's header.
#include <epoxy/gl.h>
// clang-format off
#include <GLFW/glfw3.h>
// clang-format on
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <fathom/error.hpp>

#include "render/gl_objects.hpp"
#include "viewer/window.hpp"

namespace fathom::viewer {
namespace {

std::string last_complaint;

Window& window_of(GLFWwindow* window) { return *static_cast<Window*>(glfwGetWindowUserPointer(window)); }

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
  const std::string why = last_complaint.empty() ? "" : " (" + last_complaint + ")";
  throw Error(ErrorCode::unavailable, what + why + "; " + remedy);
}

void style_panel() {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.WindowBorderSize = 0;
  style.ItemSpacing = {8, 5};
  style.Colors[ImGuiCol_WindowBg] = {0.06f, 0.08f, 0.11f, 0.86f};
  style.Colors[ImGuiCol_TitleBgActive] = {0.13f, 0.20f, 0.28f, 1.0f};
  // Otherwise ImGui would write window positions to a file in the working directory.
  ImGui::GetIO().IniFilename = nullptr;
}

}  // namespace

void Window::tell(engine::InputKind kind, int code, int modifiers, float x, float y) {
  if (!handler_) return;
  // GLFW's first four modifiers are also the engine's.
  handler_({kind, static_cast<std::uint8_t>(modifiers & 15), static_cast<std::uint16_t>(std::max(code, 0)), x, y});
}

void Window::listen() {
  using engine::InputKind;
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int modifiers) {
    if (action != GLFW_RELEASE && ImGui::GetIO().WantTextInput) return;
    const InputKind kind = action == GLFW_PRESS     ? InputKind::key_pressed
                           : action == GLFW_RELEASE ? InputKind::key_released
                                                    : InputKind::key_repeated;
    window_of(w).tell(kind, key, modifiers, 0, 0);
  });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int modifiers) {
    const bool pressed = action == GLFW_PRESS;
    if (pressed && ImGui::GetIO().WantCaptureMouse) return;
    Window& self = window_of(w);
    self.tell(pressed ? InputKind::mouse_pressed : InputKind::mouse_released, button, modifiers, self.mouse_x_,
              self.mouse_y_);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) {
    Window& self = window_of(w);
    self.mouse_x_ = static_cast<float>(x);
    self.mouse_y_ = static_cast<float>(y);
    self.tell(InputKind::mouse_moved, 0, 0, self.mouse_x_, self.mouse_y_);
  });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double x, double y) {
    if (ImGui::GetIO().WantCaptureMouse) return;
    window_of(w).tell(InputKind::mouse_scrolled, 0, 0, static_cast<float>(x), static_cast<float>(y));
  });
  glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int width, int height) {
    window_of(w).tell(InputKind::window_resized, 0, 0, static_cast<float>(width), static_cast<float>(height));
  });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int focused) {
    window_of(w).tell(focused ? InputKind::window_focused : InputKind::window_unfocused, 0, 0, 0, 0);
  });
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
    if (count > 0 && window_of(w).drop_handler_) window_of(w).drop_handler_(paths[0]);
  });
  glfwSetWindowCloseCallback(window_, [](GLFWwindow* w) { window_of(w).tell(InputKind::window_closed, 0, 0, 0, 0); });
}

Window::Window(const std::string& title, int width, int height, bool wait_for_display) {
  last_complaint.clear();
  glfwSetErrorCallback([](int, const char* text) { last_complaint = text; });
  if (!glfwInit()) {
    refuse("no window can be opened",
           "set DISPLAY, use 'xvfb-run fathom view …', or draw without a window: fathom render");
  }
  glfwWindowHint(GLFW_CLIENT_API, GLFW_OPENGL_API);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (!window_) {
    glfwTerminate();
    refuse("no window with OpenGL 4.5 can be opened",
           "update the graphics driver, or draw in software with LIBGL_ALWAYS_SOFTWARE=1 and Mesa");
  }
  glfwMakeContextCurrent(window_);
  try {
    render::require_gl();
  } catch (...) {
    glfwDestroyWindow(window_);
    glfwTerminate();
    throw;
  }
  glfwSwapInterval(wait_for_display ? 1 : 0);
  listen();
  ImGui::CreateContext();
  ImGui::GetIO().DisplaySize = {static_cast<float>(width), static_cast<float>(height)};  // until the first frame
  style_panel();
  // Forwards events to the callbacks of `listen`.
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 450 core");
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::set_title(const std::string& title) { glfwSetWindowTitle(window_, title.c_str()); }
void Window::close() { glfwSetWindowShouldClose(window_, GLFW_TRUE); }
bool Window::closing() const { return glfwWindowShouldClose(window_); }
void Window::poll() { glfwPollEvents(); }

void Window::begin_panel() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void Window::draw_panel() {
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width(), height());
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::show() { glfwSwapBuffers(window_); }

bool Window::key_down(int key) const { return !ImGui::GetIO().WantTextInput && glfwGetKey(window_, key) == GLFW_PRESS; }

int Window::width() const {
  int w = 0, h = 0;
  glfwGetFramebufferSize(window_, &w, &h);
  return std::max(w, 1);
}

int Window::height() const {
  int w = 0, h = 0;
  glfwGetFramebufferSize(window_, &w, &h);
  return std::max(h, 1);
}

}  // namespace fathom::viewer
