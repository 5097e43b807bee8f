#include "viewer/engine_window.hpp"

#include <cmath>
#include <optional>

#include "render/render_target.hpp"
#include "render/renderer.hpp"
#include "viewer/window.hpp"

namespace fathom::viewer {
namespace {

constexpr float floor_half_width = 5.0f;  // m, of boxes that are drawn as floors

/// From linear light to sRGB (IEC 61966-2-1).
std::uint8_t encoded(float linear) {
  const float c = clamp(linear, 0, 1);
  const float s = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(255 * s));
}

bool is_floor(const Shape& shape) {
  if (shape.is_surface()) return true;
  return shape.type == ShapeType::box && shape.half_extents.x >= floor_half_width &&
         shape.half_extents.y >= floor_half_width;
}

}  // namespace

class EngineWindow::Impl {
 public:
  explicit Impl(const EngineWindowSettings& settings)
      : vsync(settings.wait_for_display),
        window(settings.title, settings.width, settings.height, settings.wait_for_display),
        renderer(render::settings_for_context()) {
    window.set_handler([this](const engine::InputEvent& event) { events.push_back(event); });
  }

  void take_bodies(const engine::DrawFrame& frame) {
    std::vector<render::DrawnBody> bodies;
    std::vector<render::Colour> colours;
    for (std::uint32_t i = 0; i < frame.bodies.size(); ++i) {
      const engine::GraphicsBody& body = frame.bodies[i];
      bodies.push_back({i, body.shape, is_floor(body.shape)});
      colours.push_back({encoded(body.colour.r), encoded(body.colour.g), encoded(body.colour.b)});
    }
    renderer.set_bodies(bodies);
    renderer.set_colours(colours);
    revision = frame.revision;
  }

  /// Bounds of all entities but floors (m).
  static Aabb bounds(const engine::DrawFrame& frame) {
    std::optional<Aabb> box;
    for (std::size_t i = 0; i < frame.bodies.size(); ++i) {
      if (is_floor(frame.bodies[i].shape)) continue;
      const Aabb here{frame.poses[i].position, frame.poses[i].position};
      box = box ? merged(*box, here) : here;
    }
    return grown(box.value_or(Aabb{}), 2);
  }

  void draw(const engine::DrawFrame& frame) {
    if (!revision || *revision != frame.revision) take_bodies(frame);
    const int width = window.width(), height = window.height();
    if (!target || target->width() != width || target->height() != height) target.emplace(width, height);
    renderer.poses().write(frame.poses);
    const Aabb box = bounds(frame);
    render::Frame picture;
    picture.camera.eye = frame.camera.eye;
    picture.camera.target = frame.camera.target;
    picture.camera.field_of_view = frame.camera.vertical_field;
    picture.look = render::daylight(length(box.upper - box.lower));
    picture.shadows = render::shadow_region(box, picture.camera);
    picture.time = static_cast<float>(frame.time);
    renderer.draw(picture, target->framebuffer(), width, height);
    target->copy_to_window();
    window.show();
  }

  bool vsync;
  Window window;
  render::Renderer renderer;
  std::optional<render::OffscreenTarget> target;
  std::optional<std::uint64_t> revision;
  std::vector<engine::InputEvent> events;
};

EngineWindow::EngineWindow(const EngineWindowSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
EngineWindow::~EngineWindow() = default;

void EngineWindow::poll(std::vector<engine::InputEvent>& events) {
  impl_->window.poll();
  events.insert(events.end(), impl_->events.begin(), impl_->events.end());
  impl_->events.clear();
}

void EngineWindow::draw(const engine::DrawFrame& frame) { impl_->draw(frame); }
bool EngineWindow::has_vsync() const { return impl_->vsync; }
void EngineWindow::set_title(std::string_view title) { impl_->window.set_title(std::string(title)); }

void EngineWindow::save(const std::string& path) const {
  render::Image image;
  if (impl_->target) impl_->target->read(image);
  render::write_png(image, path);
}

}  // namespace fathom::viewer
