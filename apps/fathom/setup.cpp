#include "setup.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <thread>
#include <vector>

#include "engine/config.hpp"
#include "scene/environments.hpp"
#include "scene/heap.hpp"
#include "scene/scene_file.hpp"
#include "scene/suggest.hpp"

namespace fathom::cli {
namespace {

constexpr std::uint64_t default_steps = 1800;
constexpr double most_steps = 1e9;

bool looks_like_file(const std::string& scene) {
  return scene.ends_with(".toml") || scene.find('/') != std::string::npos || std::filesystem::exists(scene);
}

std::int64_t size_in_bodies(const Environment& environment, const RunOptions& options) {
  if (!options.layers) return options.bodies.value_or(environment.default_bodies);
  if (!environment.bodies_of_layers) {
    throw Error(ErrorCode::invalid_argument,
                std::string(environment.name) + " has no layers; give its size with --bodies");
  }
  if (*options.layers < 1) {
    throw Error(ErrorCode::invalid_argument, "--layers must be at least 1, not " + std::to_string(*options.layers));
  }
  return environment.bodies_of_layers(*options.layers);
}

[[noreturn]] void refuse_unknown(const std::string& scene) {
  std::vector<std::string_view> known;
  for (const Environment& environment : environments()) known.push_back(environment.name);
  known.push_back("heap");
  throw Error(ErrorCode::invalid_argument,
              "there is no environment '" + scene + "' (a scene file's name ends in .toml)" + suggestion(scene, known));
}

Scene read_heap(const RunOptions& options) {
  if (options.bodies || options.layers) {
    throw Error(ErrorCode::invalid_argument,
                "a heap's seed says how many bodies it has; leave --bodies and --layers out and try another --seed");
  }
  return make_heap(options.seed.value_or(1)).scene;
}

Scene read_scene(const RunOptions& options) {
  if (options.seed && options.scene != "heap")
    throw Error(ErrorCode::invalid_argument, "--seed says which heap it is; '" + options.scene + "' has none");
  if (const Environment* environment = find_environment(options.scene)) {
    return environment->make(size_in_bodies(*environment, options));
  }
  if (options.scene == "heap") return read_heap(options);
  if (!looks_like_file(options.scene)) refuse_unknown(options.scene);
  if (options.bodies || options.layers) {
    throw Error(ErrorCode::invalid_argument,
                "--bodies and --layers size an environment; a scene file says itself what it holds");
  }
  return load_scene(options.scene);
}

template <class T, class U>
void override_with(T& value, const std::optional<U>& given) {
  if (given) value = *given;
}

/// Options that the chosen algorithms do not read would seem to work.
void check_options(const RunOptions& options, const WorldDef& world) {
  const auto require = [](bool makes_sense, const char* complaint) {
    if (!makes_sense) throw Error(ErrorCode::invalid_argument, complaint);
  };
  const bool device = world.simulator == SimulatorKind::device;
  require(!options.device || world.simulator != SimulatorKind::native,
          "--device is for the device simulator and the hybrid; leave --device out, or --simulator native");
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

Scene make_scene(const RunOptions& options) {
  Scene scene = read_scene(options);
  options.config.load().override_world(scene.world);
  override_with(scene.world.simulator, options.simulator);
  override_with(scene.world.device, options.device);
  // Who names a device wants it used.
  if (options.device && !options.simulator) scene.world.simulator = SimulatorKind::device;
  if (options.preset) apply(*options.preset, scene.world);
  override_with(scene.world.ahead, options.ahead);
  override_with(scene.world.threads, options.threads);
  override_with(scene.world.dt, options.dt);
  override_with(scene.world.broad_phase, options.broad_phase);
  override_with(scene.world.sweep_axis, options.sweep_axis);
  override_with(scene.world.partition, options.partition);
  override_with(scene.world.solver.marking_rounds, options.marking_rounds);
  override_with(scene.world.solver.warm_start, options.warm_start);
  override_with(scene.world.solver.iterations, options.iterations);
  override_with(scene.world.solver.substeps, options.substeps);
  override_with(scene.world.solver.method, options.solver);
  override_with(scene.world.sleep.enabled, options.sleep);
  check_options(options, scene.world);
  // The report says how many threads there were.
  if (scene.world.threads == 0)
    scene.world.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return scene;
}

files::FileNames inputs_of(const RunOptions& options) {
  files::FileNames names;
  if (!find_environment(options.scene) && options.scene != "heap") names.reads("the scene", options.scene);
  names.reads("--config", options.config.file);
  return names;
}

std::uint64_t steps_to_run(const RunOptions& options, const WorldDef& world) {
  if (options.steps) return *options.steps;
  if (!options.seconds) return default_steps;
  const double steps = std::round(*options.seconds / static_cast<double>(world.dt));
  if (steps < 1 || steps > most_steps) {
    throw Error(ErrorCode::invalid_argument,
                "--seconds comes to less than one step or more than 10⁹; change it or --dt");
  }
  return static_cast<std::uint64_t>(steps);
}

}  // namespace fathom::cli
