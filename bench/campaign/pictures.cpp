#include "pictures.hpp"

#include <algorithm>
#include <filesystem>

#include "plan.hpp"
#ifdef FATHOM_HAS_RENDER
#include "render/egl_context.hpp"
#include "render/stage.hpp"
#endif

namespace fathom::campaign {

#ifdef FATHOM_HAS_RENDER
namespace {

constexpr int width = 480, height = 270;

struct Subject {
  Case what;
  std::string label;
};

/// The size in the middle of the published ones: large enough to pile up, small enough to see.
std::vector<Subject> subjects(const Campaign& campaign) {
  std::vector<Subject> all;
  for (const Measurement& run : campaign.runs) {
    const std::string& environment = run.what.environment;
    const bool seen = std::ranges::any_of(all, [&](const Subject& s) { return s.what.environment == environment; });
    if (seen) continue;
    const int threads = table_threads(campaign.where.threads);
    const std::int64_t bodies = environment == "pyramid" ? 385 : 1'000;
    all.push_back({{environment, bodies, "native", "", threads, "fathom"}, "Fathom, native"});
    all.push_back({{environment, bodies, "device", "auto", threads, "published"}, "published algorithms, device"});
  }
  return all;
}

bool draw(const Store& store, Campaign& campaign, const Subject& subject, const std::function<bool()>& go_on) {
  Scene scene = make_scene(subject.what);
  World world(scene.world);
  SceneInstance instance(scene, world);
  render::StageSettings settings;
  settings.width = width, settings.height = height, settings.enlargement = 2;
  // What drifts without gravity drifts in water.
  settings.look = scene.ground_height ? render::LookKind::daylight : render::LookKind::water;
  render::Stage stage(settings);
  for (std::uint64_t step = 0;; ++step) {
    if (step % (published_steps / 2) == 0) {
      world.wait();
      const std::string moment = std::to_string(step / 60) + " s";
      const std::string file = "pictures/" + key_of(subject.what) + "-" + std::to_string(step / 60) + "s.png";
      render::write_png(stage.draw(world), store.path(file));
      campaign.pictures.push_back({subject.what.environment, subject.label, moment, file});
    }
    if (step == published_steps) return true;
    if (!go_on()) return false;
    instance.prepare_step();
    world.step();
  }
}

}  // namespace

void draw_pictures(const Store& store, Campaign& campaign, const std::function<bool()>& go_on) {
  std::unique_ptr<render::OffscreenContext> context;
  try {
    context = render::make_offscreen_context();
  } catch (const Error&) {
    return;  // a machine without OpenGL: the report then says that there are no pictures
  }
  std::filesystem::create_directories(store.path("pictures"));
  for (const Subject& subject : subjects(campaign)) {
    const auto drawn = std::ranges::count_if(campaign.pictures, [&](const Picture& p) {
      return p.environment == subject.what.environment && p.label == subject.label;
    });
    if (drawn > 0) continue;
    const std::size_t before = campaign.pictures.size();
    try {
      if (!draw(store, campaign, subject, go_on)) campaign.pictures.resize(before);
    } catch (const Error&) {
      campaign.pictures.resize(before);  // what cannot be run is said beside the figures
    }
    if (!go_on()) return;
    store.save(campaign);
  }
}
#else
void draw_pictures(const Store&, Campaign&, const std::function<bool()>&) {}
#endif

}  // namespace fathom::campaign
