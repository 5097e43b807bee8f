#include "pictures.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <utility>

#include "plan.hpp"
#ifdef FATHOM_HAS_RENDER
#include "render/egl_context.hpp"
#include "render/stage.hpp"
#endif

namespace fathom::campaign {

#ifdef FATHOM_HAS_RENDER

struct Painter::Drawing {
  std::unique_ptr<render::OffscreenContext> context;  // null without OpenGL
  std::optional<render::Stage> stage;                 // for the current run

  Drawing() {
    try {
      context = render::make_offscreen_context();
    } catch (const Error&) {
      // The report then says that there are no pictures.
    }
  }

  void begin(const World& world) {
    render::StageSettings settings;
    settings.width = 480, settings.height = 270, settings.enlargement = 2;
    // Scenes without gravity are shown under water.
    const bool water = length_squared(world.gravity()) == 0;
    settings.look = water ? render::LookKind::water : render::LookKind::daylight;
    stage.emplace(settings);
  }
};

void Painter::visit(const Case& what, std::uint64_t step, const World& world) {
  const bool due = step == 0 || step == steps_ / 2 || step == steps_;
  if (!due || !wanted(what)) return;
  if (!drawing_) drawing_ = std::make_unique<Drawing>();
  if (!drawing_->context) return;
  if (step == 0) drawing_->begin(world);
  world.wait();
  const std::string moment = fmt::format("{:.3g} s", static_cast<double>(step) / 60);
  const std::string file = fmt::format("pictures/{}-{}.png", key_of(what), step);
  std::filesystem::create_directories(store_.path("pictures"));
  render::write_png(drawing_->stage->draw(world), store_.path(file));
  pictures_.push_back({what.environment, label_of(what), moment, file});
  if (step == steps_) drawing_->stage.reset();
}

#else

struct Painter::Drawing {};
void Painter::visit(const Case&, std::uint64_t, const World&) {}

#endif

Painter::Painter(const Store& store, std::string device, std::uint64_t steps)
    : store_(store), device_(std::move(device)), steps_(steps) {}

Painter::~Painter() = default;

bool Painter::wanted(const Case& c) const {
  // The middle of the published sizes: large enough to pile up, small enough to see.
  if (c.round != 1 || c.bodies != (c.environment == "pyramid" ? 385 : 1'000)) return false;
  return c.set == "fathom" ? c.simulator == "native" && c.threads == 1 : c.simulator == "device" && c.device == device_;
}

std::vector<Picture> Painter::take() { return std::exchange(pictures_, {}); }

}  // namespace fathom::campaign
