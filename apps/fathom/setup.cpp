#include "setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <thread>
#include <vector>

#include "engine/scene_entities.hpp"
#include "engine/simulator_choice.hpp"
#include "exec/devices.hpp"
#include "scene/environments.hpp"
#include "scene/heap.hpp"
#include "scene/scene_file.hpp"
#include "scene/suggest.hpp"

namespace fathom::cli {
namespace {

constexpr std::uint64_t default_steps = 1800;
constexpr double max_steps = 1e9;

/// Random scenes determined by a seed.
struct HeapMaker {
  std::string_view name;
  Heap (*make)(std::uint64_t seed);
};
constexpr HeapMaker heaps[] = {
    {"heap", make_heap}, {"surface_heap", make_surface_heap}, {"joint_heap", make_joint_heap}};

const HeapMaker* find_heap(std::string_view name) {
  const auto found = std::ranges::find(heaps, name, &HeapMaker::name);
  return found == std::end(heaps) ? nullptr : found;
}

bool looks_like_file(const std::string& scene) {
  return scene.ends_with(".toml") || scene.find('/') != std::string::npos || std::filesystem::exists(scene);
}

std::int64_t size_in_bodies(const Environment& environment, const RunOptions& options) {
  if (!options.layers) return options.bodies.value_or(environment.default_bodies);
  if (!environment.bodies_of_layers) {
    throw Error(ErrorCode::invalid_argument,
                std::string(environment.name) + " has no layers; give its size with --bodies");
  }
  return environment.bodies_of_layers(*options.layers);
}

[[noreturn]] void refuse_unknown(const std::string& scene) {
  std::vector<std::string_view> known;
  for (const Environment& environment : environments()) known.push_back(environment.name);
  for (const HeapMaker& heap : heaps) known.push_back(heap.name);
  throw Error(ErrorCode::invalid_argument,
              "there is no environment '" + scene + "' (a scene file's name ends in .toml)" + suggestion(scene, known));
}

Scene read_heap(const HeapMaker& heap, const RunOptions& options) {
  if (options.bodies || options.layers) {
    throw Error(ErrorCode::invalid_argument,
                "a heap's seed says how many bodies it has; leave --bodies and --layers out and try another --seed");
  }
  return heap.make(options.seed.value_or(1)).scene;
}

Scene read_scene(const RunOptions& options) {
  const HeapMaker* heap = find_heap(options.scene);
  if (options.seed && !heap)
    throw Error(ErrorCode::invalid_argument, "--seed says which heap it is; '" + options.scene + "' has none");
  if (const Environment* environment = find_environment(options.scene)) {
    return environment->make(size_in_bodies(*environment, options));
  }
  if (heap) return read_heap(*heap, options);
  if (!looks_like_file(options.scene)) refuse_unknown(options.scene);
  if (options.bodies || options.layers) {
    throw Error(ErrorCode::invalid_argument,
                "--bodies and --layers size an environment; a scene file says itself what it holds");
  }
  if (is_recording(options.scene))
    throw Error(ErrorCode::invalid_argument,
                options.scene + ": is a recording, not a scene; 'fathom replay' repeats it, 'fathom render' draws it");
  return load_scene(options.scene);
}

std::string size_note(const RunOptions& options) {
  const Environment* environment = find_environment(options.scene);
  if (!options.bodies || !environment || !environment->rounded) return {};
  const std::int64_t rounded = environment->rounded(*options.bodies);
  return rounded == *options.bodies ? std::string()
                                    : fmt::format(" (--bodies {} is rounded to {})", *options.bodies, rounded);
}

/// The world would name its own setting.
void check_capacity(const Setup& setup) {
  const std::size_t bodies = setup.scene.bodies.size();
  if (const WorldDef& world = setup.scene.world; bodies > world.max_bodies)
    throw Error(ErrorCode::capacity,
                fmt::format("{} has {} bodies with what stands still, but simulator.max_bodies is {} ({}); raise it",
                            setup.scene.name, bodies, world.max_bodies, setup.config.origin("simulator.max_bodies")));
}

using Simulator = engine::Settings::Simulator;

/// Overrides the configuration with an option, if given.
template <class T, class U>
void give(engine::Config& config, const char* key, const char* option, T Simulator::*value,
          const std::optional<U>& given) {
  if (given) config.give(key, option, [&](engine::Settings& settings) { settings.simulator.*value = *given; });
}

void give_options(engine::Config& config, const RunOptions& o) {
  give_simulator(config, o.simulator);
  give(config, "simulator.device_ahead", "--ahead", &Simulator::device_ahead, o.ahead);
  give(config, "simulator.preset", "--preset", &Simulator::preset, o.preset);
  give(config, "simulator.dt", "--dt", &Simulator::dt, o.dt);
  give(config, "simulator.broad_phase", "--broad-phase", &Simulator::broad_phase, o.broad_phase);
  give(config, "simulator.sweep_axis", "--sweep-axis", &Simulator::sweep_axis, o.sweep_axis);
  give(config, "simulator.partition", "--partition", &Simulator::partition, o.partition);
  give(config, "simulator.marking_rounds", "--marking-rounds", &Simulator::marking_rounds, o.marking_rounds);
  give(config, "simulator.warm_start", "--warm-start", &Simulator::warm_start, o.warm_start);
  give(config, "simulator.direct_joints", "--direct-joints", &Simulator::direct_joints, o.direct_joints);
  give(config, "simulator.iterations", "--iterations", &Simulator::iterations, o.iterations);
  give(config, "simulator.substeps", "--substeps", &Simulator::substeps, o.substeps);
  give(config, "simulator.solver", "--solver", &Simulator::solver, o.solver);
  give(config, "simulator.sleep", "--sleep", &Simulator::sleep, o.sleep);
}

engine::Config config_of(const RunOptions& options, const Scene& scene) {
  engine::Config config = options.config.load();
  engine::take_over_world(scene, config);
  give_options(config, options);
  return config;
}

/// Throws `Error` if the command line names a device and the native simulator. Files and scenes may: what the command
/// line says of the other takes precedence over them.
void check_simulator(const engine::Config& config, const SimulatorOptions& options) {
  const bool sets_kind = config.origin("simulator.kind") == "--set";
  const bool sets_native = sets_kind && config->simulator.kind == SimulatorKind::native;
  if (options.simulator ? *options.simulator != SimulatorKind::native : !sets_native) return;
  if (!options.device && config.origin("simulator.device") != "--set") return;
  throw Error(ErrorCode::invalid_argument,
              fmt::format("{} applies to the simulators device and hybrid only; remove it or {}",
                          options.device ? "--device" : "--set simulator.device",
                          options.simulator ? "--simulator native" : "--set simulator.kind=native"));
}

/// Says who names the device, too.
void check_device_name(const engine::Config& config) {
  try {
    exec::parse_device(config->simulator.device);
  } catch (const Error& error) {
    throw Error(error.code(), config.origin("simulator.device") + ": " + error.what());
  }
}

/// Options that the chosen algorithms do not read would only seem to work.
void check_options(const RunOptions& options, const WorldDef& world) {
  const auto require = [](bool makes_sense, const char* complaint) {
    if (!makes_sense) throw Error(ErrorCode::invalid_argument, complaint);
  };
  const bool device = world.simulator == SimulatorKind::device;
  require(!options.sweep_axis || world.broad_phase == BroadPhase::sweep,
          "--sweep-axis is the axis of the sweep; add --broad-phase sweep");
  require(!options.marking_rounds || (device && world.partition == Partition::cells),
          "--marking-rounds are those of cells on a device; add --partition cells and --device");
  require(!options.iterations || world.solver.method == Solver::impulse,
          "--iterations are those of the solver impulse; add --solver impulse");
  require(!options.ahead || *options.ahead == 0 || device,
          "--ahead is for the device simulator alone; add --simulator device");
}

}  // namespace

void give_simulator(engine::Config& config, const SimulatorOptions& options) {
  check_simulator(config, options);
  give(config, "simulator.kind", "--simulator", &Simulator::kind, options.simulator);
  give(config, "simulator.device", "--device", &Simulator::device, options.device);
  give(config, "simulator.threads", "--threads", &Simulator::threads, options.threads);
  check_device_name(config);
  // Naming a device or simulator rules out a fallback.
  if (options.device || options.simulator)
    config.give("simulator.fallback", options.device ? "--device" : "--simulator",
                [](engine::Settings& settings) { settings.simulator.fallback = false; });
}

engine::Config make_config(const RunOptions& options) {
  if (options.scene.empty() && (options.bodies || options.layers || options.seed))
    throw Error(ErrorCode::invalid_argument,
                "--bodies, --layers and --seed are those of an environment; name one, e.g. 'drift', or leave them out");
  return config_of(options, options.scene.empty() ? Scene{} : read_scene(options));
}

Setup make_setup(const RunOptions& options) {
  Setup setup{read_scene(options), {}, {}};
  setup.config = config_of(options, setup.scene);
  setup.scene.world = setup.config.world_definition();
  check_options(options, setup.scene.world);
  check_capacity(setup);
  setup.size_note = size_note(options);
  return setup;
}

void choose_device(Setup& setup) {
  WorldDef& world = setup.scene.world;
  if (setup.config->simulator.fallback && world.simulator != SimulatorKind::native) {
    const auto& log = setup.config->log;
    engine::Log warnings({std::max(engine::LogLevel::warning, engine::log_level_named(log.level)), log.console});
    engine::choose_simulator(setup.config, warnings);
    world = setup.config.world_definition();
  }
  // The report states the number of threads.
  if (world.threads == 0) world.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

Scene make_scene(const RunOptions& options) {
  Setup setup = make_setup(options);
  choose_device(setup);
  return std::move(setup.scene);
}

bool is_recording(const std::string& path) {
  char head[8] = {};
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;  // reading a pipe would take its beginning away
  std::ifstream(path, std::ios::binary).read(head, sizeof head);
  return std::string_view(head, sizeof head) == "FATHOMRC";
}

files::FileNames inputs_of(const RunOptions& options) {
  files::FileNames names;
  if (!find_environment(options.scene) && !find_heap(options.scene)) names.reads("the scene", options.scene);
  names.reads("--config", options.config.file);
  return names;
}

std::uint64_t steps_to_run(const RunOptions& options, const WorldDef& world) {
  if (options.steps) return *options.steps;
  if (!options.seconds) return default_steps;
  const double steps = std::round(*options.seconds / static_cast<double>(world.dt));
  if (steps < 1 || steps > max_steps) {
    throw Error(ErrorCode::invalid_argument,
                "--seconds comes to less than one step or more than 10⁹; change it or --dt");
  }
  return static_cast<std::uint64_t>(steps);
}

}  // namespace fathom::cli
