// `fathom view`: a run in a window.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "exec/devices.hpp"
#include "measure/system.hpp"
#include "setup.hpp"
#include "validators.hpp"
#include "view_options.hpp"
#include "viewer/preferences.hpp"

namespace fathom::cli {
namespace {

/// The command line's options, with the panel's choices applied.
RunOptions chosen(RunOptions options, const viewer::Choice& choice, const viewer::Choice& first) {
  if (choice.scene != first.scene || choice.bodies != first.bodies) options.layers.reset();
  if (choice.scene != first.scene) options.seed.reset();
  options.scene = choice.scene;
  options.bodies = choice.bodies;
  options.simulator.simulator = choice.simulator;
  options.simulator.device.reset();
  if (!choice.device.empty()) options.simulator.device = choice.device;
  if (choice.simulator != first.simulator || choice.device != first.device)
    std::erase_if(options.config.sets, [](const std::string& set) {
      return set.starts_with("simulator.kind=") || set.starts_with("simulator.device=");
    });
  options.simulator.threads = choice.threads;
  options.substeps = choice.substeps;
  options.solver = choice.solver;
  options.broad_phase = choice.broad_phase;
  options.sleep = choice.sleep;
  return options;
}

std::vector<viewer::SimulatorChoice> simulators() {
  std::vector<viewer::SimulatorChoice> list{{"native", SimulatorKind::native, ""}};
  for (const exec::DeviceInfo& device : exec::list_devices()) {
    if (!device.available) continue;
    std::string name(exec::name_of(device.backend));
    if (device.backend != exec::Backend::host) name += ":" + std::to_string(device.index);
    list.push_back({"device, " + name, SimulatorKind::device, name});
  }
  return list;
}

/// The settings of the last run, unless an option says otherwise.
void remember(const ViewOptions& options, viewer::ViewerSettings& settings) {
  settings.preferences = viewer::preferences_file();
  if (settings.preferences.empty()) return;
  const viewer::Preferences last = viewer::load_preferences(settings.preferences);
  const viewer::ViewerSettings defaults;
  if (options.overlays.empty()) settings.overlays = last.overlays;
  if (settings.colouring == defaults.colouring) settings.colouring = last.colouring;
  if (!settings.look) settings.look = last.look;
  if (settings.width == defaults.width && settings.height == defaults.height)
    settings.width = last.width, settings.height = last.height;
  settings.speed = last.speed;
  settings.panel = last.show_panel;
}

}  // namespace

int view(const ViewOptions& options) {
  const RunOptions& run = options.run;
  inputs_of(run).writes("--screenshot", options.settings.screenshot);
  viewer::Choice first;
  first.scene = run.scene;
  first.bodies = run.bodies;
  first.simulator = run.simulator.simulator;
  first.device = run.simulator.device.value_or("");
  first.threads = run.simulator.threads;
  first.substeps = run.substeps;
  first.solver = run.solver;
  first.broad_phase = run.broad_phase;
  first.sleep = run.sleep;
  viewer::ViewerSettings settings = options.settings;
  settings.simulators = simulators();
  settings.overlays = viewer::parse_overlays(options.overlays);
  // A fixed number of frames must look the same for everybody.
  if (settings.frames == 0) remember(options, settings);
  const InterruptGuard interrupt;
  settings.ended = [] { return InterruptGuard::requested(); };
  const viewer::ViewResult result = viewer::view(
      [&](const viewer::Choice& choice) { return make_scene(chosen(run, choice, first)); }, first, settings);
  if (!result.warning.empty()) tell("fathom: the settings are not remembered: " + result.warning + "\n");
  // A fixed number of frames is a run like any other, whose result can be compared.
  if (settings.frames > 0)
    fmt::print("{}: {} steps, {:.2f} s simulated\n  state hash             {:016x}\n", result.scene, result.steps,
               result.time, result.state_hash);
  return InterruptGuard::requested() ? interrupted : finished;
}

void declare_view(CLI::App& command, ViewOptions& options) {
  declare_scene(command, options.run);
  viewer::ViewerSettings& settings = options.settings;
  declare_picture_size(command, settings.width, settings.height, "Size of the window (1280x800)");
  declare_look(command, settings.look);
  declare_colouring(command, settings.colouring);
  command
      .add_option("--overlays", options.overlays,
                  "Drawn at the start: boxes,points,normals,impulses,graph,joints,reactions, and "
                  "through (seen through bodies)")
      ->type_name("LIST");
  command.add_flag("--paused", settings.paused, "Start paused");
  command.add_flag("--show-help", settings.help, "Start with the list of keys");
  auto* frames = command
                     .add_option("--frames", settings.frames,
                                 "End after this many frames of one step each, and print the state hash")
                     ->type_name("N")
                     ->check(whole_number(1));
  command.add_option("--screenshot", settings.screenshot, "Write the last of --frames, with the panel")
      ->type_name("FILE.png")
      ->check(CLI::Validator(
          [](std::string& name) -> std::string {
            return name.ends_with(".png") ? std::string() : "must be a name that ends in .png, not " + name;
          },
          ""))
      ->needs(frames);
  command.footer(
      "Keys: H lists them. Examples:\n"
      "  fathom view pyramid --layers 15\n"
      "  fathom view layers --bodies 5000 --overlays points,impulses\n"
      "  xvfb-run -a fathom view drift --frames 60 --screenshot drift.png");
}

}  // namespace fathom::cli
