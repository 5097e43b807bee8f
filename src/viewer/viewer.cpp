// clang-format off
#include <epoxy/gl.h>
#include <GLFW/glfw3.h>
// clang-format on

#include "viewer/viewer.hpp"

#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/render_target.hpp"
#include "render/renderer.hpp"
#include "render/world_picture.hpp"
#include "viewer/controls.hpp"
#include "viewer/panel.hpp"
#include "viewer/preferences.hpp"
#include "viewer/window.hpp"

namespace fathom::viewer {
namespace {

using Clock = std::chrono::steady_clock;
using namespace fathom::render;

constexpr int max_steps_a_frame = 4;  // beyond this, simulated time falls behind

bool draws_in_software() { return gl_description().find("llvmpipe") != std::string::npos; }

class Viewer {
 public:
  Viewer(const SceneMaker& make, const Choice& choice, const ViewerSettings& settings)
      : settings_(settings),
        session_(make, choice),
        window_("Fathom", settings.width, settings.height, settings.frames == 0),
        renderer_(settings_for_context()) {
    state_.overlays = settings.overlays;
    state_.colouring = settings.colouring;
    state_.speed = settings.speed;
    state_.show_panel = settings.panel;
    state_.paused = settings.paused;
    state_.show_help = settings.help;
    begin_scene();
    window_.set_handler([this](const engine::InputEvent& event) { on_event(event); });
    window_.set_drop_handler([this](const std::string& path) { open(path); });
  }

  void run() {
    Clock::time_point last = Clock::now();
    for (std::uint64_t frame = 1; !window_.closing() && !(settings_.ended && settings_.ended()); ++frame) {
      const Clock::time_point now = Clock::now();
      const float seconds = std::chrono::duration<float>(now - last).count();
      last = now;
      state_.frame_ms += 0.1f * (1000 * seconds - state_.frame_ms);
      window_.poll();
      fly(seconds);
      advance(seconds);
      const bool ends = settings_.frames > 0 && frame >= settings_.frames;
      draw();
      if (ends && !settings_.screenshot.empty()) save_window(settings_.screenshot);
      window_.show();
      if (ends) return;
    }
  }

  Preferences preferences() const {
    return {window_.width(), window_.height(), state_.speed,  state_.show_panel,
            state_.overlays, state_.colouring, settings_.look};
  }

  ViewResult result() const {
    const World& world = session_.world();
    return {session_.scene().name, world.step_count(), world.time(), world.state_hash(), {}};
  }

 private:
  /// Left edge of the scene beside the panel, and its width (pixels).
  int scene_left() const {
    if (!state_.show_panel) return 0;
    const float display = ImGui::GetIO().DisplaySize.x;
    const float scale = display > 0 ? static_cast<float>(window_.width()) / display : 1;
    return std::min(static_cast<int>(scale * panel_width()), window_.width() - 1);
  }
  int scene_width() const { return window_.width() - scene_left(); }
  float aspect() const { return static_cast<float>(scene_width()) / static_cast<float>(window_.height()); }

  /// The scene's look, unless the user chose one.
  LookKind own_look() const {
    return length_squared(session_.world().gravity()) == 0 ? LookKind::water : LookKind::daylight;
  }
  /// For this scene, those that follow, and the next run.
  void choose_look(LookKind look) {
    state_.look = look;
    settings_.look.reset();
    if (look != own_look()) settings_.look = look;
  }

  void begin_scene() {
    picture_ = {};
    owed_ = 0;
    picture_.update(session_.world(), renderer_, state_.colouring);
    state_.look = settings_.look.value_or(own_look());
    frame_all();
    window_.set_title(session_.scene().name + " · Fathom");
  }

  Aabb seen_box() const {
    Aabb box = picture_.moving();
    if (const auto ground = picture_.ground_height(); ground && *ground < box.upper.z) box.lower.z = *ground;
    return box;
  }

  void frame_all() { controls_.look_at(seen_box(), aspect()); }

  void choose(const Choice& choice) {
    try {
      state_.message.clear();
      session_.choose(choice);
      begin_scene();
    } catch (const Error& error) {
      state_.message = error.what();
    }
  }

  void open(const std::string& path) {
    Choice choice = session_.choice();
    choice.scene = path;
    choice.bodies.reset();
    choose(choice);
  }

  void undo() {
    const std::uint64_t generation = session_.generation();
    session_.undo();
    state_.message.clear();
    if (session_.generation() != generation) begin_scene();
  }

  void advance(float seconds) {
    if (settings_.frames > 0) {  // the same pictures on any machine
      if (!state_.paused) session_.step();
      return;
    }
    if (state_.paused) {
      owed_ = 0;
      if (state_.single_step) {
        session_.remember();
        session_.step();
      }
      state_.single_step = false;
      return;
    }
    const float dt = session_.world().definition().dt;
    owed_ = std::min(owed_ + state_.speed * seconds, static_cast<float>(max_steps_a_frame) * dt);
    const double before = session_.world().time();
    for (; owed_ >= dt; owed_ -= dt) session_.step();
    const auto made = static_cast<float>(session_.world().time() - before);
    if (seconds > 0) state_.reached_speed += std::min(1.0f, seconds) * (made / seconds - state_.reached_speed);
  }

  void draw() {
    const int left = scene_left(), width = scene_width(), height = window_.height();
    if (!target_ || target_->width() != width || target_->height() != height) target_.emplace(width, height, samples_);
    picture_.update(session_.world(), renderer_, state_.colouring);
    OverlayMarks marks;
    add_overlays(session_.world(), state_.overlays, marks);
    if (session_.grip()) add_grip(session_.world(), *session_.grip(), marks);
    const Aabb box = seen_box();
    const float size = length(box.upper - box.lower);
    Frame frame;
    frame.camera = controls_.camera();
    frame.look = state_.look == LookKind::water ? under_water(size, box.upper.z + 0.5f * size) : daylight(size);
    frame.shadows = shadow_region(grown(box, 1), frame.camera);
    frame.time = static_cast<float>(session_.world().time());
    frame.marks = marks.hidden;
    frame.marks_on_top = marks.on_top;
    renderer_.draw(frame, target_->framebuffer(), width, height);
    target_->copy_to_window(left);
    window_.begin_panel();
    const LookKind look = state_.look;
    const PanelRequest request = draw_panel(session_, settings_.simulators, state_);
    if (state_.look != look) choose_look(state_.look);
    window_.draw_panel();
    if (request.undo) undo();
    if (request.choice) choose(*request.choice);
    if (request.reset) choose(session_.choice());
    if (request.shoot) shoot(0, 0);
  }

  // --- hands --------------------------------------------------------------------------------------------------------

  Vec3 direction_under_mouse() const { return direction_through(controls_.camera(), aspect(), mouse_x(), mouse_y()); }
  // Position in the scene, from −1 to 1.
  float mouse_x() const {
    return 2 * (window_.mouse_x() - static_cast<float>(scene_left())) / static_cast<float>(scene_width()) - 1;
  }
  float mouse_y() const { return 1 - 2 * window_.mouse_y() / static_cast<float>(window_.height()); }

  void shoot(float x, float y) {
    const Camera camera = controls_.camera();
    try {
      session_.shoot(camera.eye, direction_through(camera, aspect(), x, y));
    } catch (const Error& error) {
      state_.message = error.what();
    }
  }

  void on_event(const engine::InputEvent& event) {
    switch (event.kind) {
      case engine::InputKind::key_pressed:
        return on_key(event.code);
      case engine::InputKind::mouse_pressed:
        return on_button(event.code, true);
      case engine::InputKind::mouse_released:
        return on_button(event.code, false);
      case engine::InputKind::mouse_scrolled:
        return controls_.zoom(event.y);
      case engine::InputKind::mouse_moved:
        on_move(event.x - last_x_, event.y - last_y_);
        last_x_ = event.x;
        last_y_ = event.y;
        return;
      default:
        return;
    }
  }

  void on_button(int button, bool pressed) {
    if (!pressed) {
      hand_ = Hand::free;
      session_.release();
      return;
    }
    const bool shift = window_.key_down(GLFW_KEY_LEFT_SHIFT) || window_.key_down(GLFW_KEY_RIGHT_SHIFT);
    if (button == GLFW_MOUSE_BUTTON_MIDDLE || shift) {
      hand_ = Hand::pans;
    } else if (button == GLFW_MOUSE_BUTTON_LEFT && session_.grab(controls_.camera().eye, direction_under_mouse())) {
      hand_ = Hand::drags;
    } else {
      hand_ = Hand::turns;
    }
  }

  void on_move(float dx, float dy) {
    if (hand_ == Hand::turns) controls_.orbit(dx, dy);
    if (hand_ == Hand::pans) controls_.pan(dx, dy, window_.height());
    if (hand_ == Hand::drags) {
      const Camera camera = controls_.camera();
      session_.drag(camera.eye, direction_under_mouse(), -axes(camera).back);
    }
  }

  void fly(float seconds) {
    const auto way = [this](int ahead, int back) {
      return static_cast<float>(window_.key_down(ahead)) - static_cast<float>(window_.key_down(back));
    };
    const Vec3 direction{way(GLFW_KEY_D, GLFW_KEY_A), way(GLFW_KEY_E, GLFW_KEY_Q), way(GLFW_KEY_W, GLFW_KEY_S)};
    if (length_squared(direction) > 0) controls_.fly(direction, seconds);
  }

  void toggle_colouring(Colouring colouring) {
    state_.colouring = state_.colouring == colouring ? Colouring::start : colouring;
  }

  void on_key(int key) {
    OverlayChoice& o = state_.overlays;
    switch (key) {
      case GLFW_KEY_SPACE:
        state_.paused = !state_.paused;
        break;
      case GLFW_KEY_PERIOD:
        state_.paused = state_.single_step = true;
        break;
      case GLFW_KEY_R:
        choose(session_.choice());
        break;
      case GLFW_KEY_C:
        frame_all();
        break;
      case GLFW_KEY_F:
        shoot(mouse_x(), mouse_y());
        break;
      case GLFW_KEY_1:
        o.boxes = !o.boxes;
        break;
      case GLFW_KEY_2:
        o.points = !o.points;
        break;
      case GLFW_KEY_3:
        o.normals = !o.normals;
        break;
      case GLFW_KEY_4:
        o.impulses = !o.impulses;
        break;
      case GLFW_KEY_5:
        o.graph = !o.graph;
        break;
      case GLFW_KEY_6:
        o.joints = !o.joints;
        break;
      case GLFW_KEY_7:
        o.reactions = !o.reactions;
        break;
      case GLFW_KEY_X:
        o.see_through = !o.see_through;
        break;
      case GLFW_KEY_Z:
        undo();
        break;
      case GLFW_KEY_I:
        toggle_colouring(Colouring::island);
        break;
      case GLFW_KEY_V:
        toggle_colouring(Colouring::speed);
        break;
      case GLFW_KEY_U:
        choose_look(state_.look == LookKind::water ? LookKind::daylight : LookKind::water);
        break;
      case GLFW_KEY_TAB:
        state_.show_panel = !state_.show_panel;
        break;
      case GLFW_KEY_P:
        take_picture();
        break;
      case GLFW_KEY_H:
      case GLFW_KEY_F1:
        state_.show_help = !state_.show_help;
        break;
      case GLFW_KEY_ESCAPE:
        window_.close();
        break;
      default:
        break;
    }
  }

  void take_picture() {
    if (!target_) return;
    try {
      Image image;
      target_->read(image);
      write_png(image, "fathom.png");
      state_.message = "fathom.png was written";
    } catch (const Error& error) {
      state_.message = error.what();
    }
  }

  /// The window's content, with the panel.
  void save_window(const std::string& path) const {
    Image image{window_.width(), window_.height(), {}};
    read_window(image);
    write_png(image, path);
  }

  enum class Hand { free, turns, pans, drags };

  ViewerSettings settings_;
  Session session_;
  Window window_;
  Renderer renderer_;
  WorldPicture picture_;
  std::optional<OffscreenTarget> target_;
  CameraControls controls_;
  ViewState state_;
  Hand hand_ = Hand::free;
  int samples_ = draws_in_software() ? 1 : 4;  // per pixel
  float last_x_ = 0, last_y_ = 0;              // of the mouse
  float owed_ = 0;                             // s of simulated time not yet simulated
};

}  // namespace

ViewResult view(const SceneMaker& make, const Choice& choice, const ViewerSettings& settings) {
  Viewer viewer(make, choice, settings);
  viewer.run();
  ViewResult result = viewer.result();
  try {
    if (!settings.preferences.empty()) save_preferences(settings.preferences, viewer.preferences());
  } catch (const Error& error) {
    result.warning = error.what();
  }
  return result;
}

}  // namespace fathom::viewer
