#include "scene/scene_file.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "scene/scene_bodies.hpp"
#include "scene/scene_joints.hpp"
#include "scene/toml_reader.hpp"

namespace fathom {
namespace {

constexpr std::array<std::pair<std::string_view, Solver>, 2> solvers{
    {{"soft", Solver::soft}, {"impulse", Solver::impulse}}};
constexpr std::array<std::pair<std::string_view, BroadPhase>, 2> broad_phases{
    {{"tree", BroadPhase::tree}, {"sweep", BroadPhase::sweep}}};
constexpr std::array<std::pair<std::string_view, Partition>, 2> partitions{
    {{"colours", Partition::colours}, {"cells", Partition::cells}}};
constexpr std::array<std::pair<std::string_view, Preset>, 2> presets{
    {{"fathom", Preset::fathom}, {"published", Preset::published}}};
constexpr std::array<std::pair<std::string_view, SimulatorKind>, 3> simulators{
    {{"native", SimulatorKind::native}, {"device", SimulatorKind::device}, {"hybrid", SimulatorKind::hybrid}}};

/// Calls `read` with a section of the file where it is there.
template <class Read>
void read_section(const TomlTable& root, std::string_view key, std::initializer_list<std::string_view> known,
                  Read read) {
  const toml::node* node = root.find(key);
  if (!node) return;
  read(TomlTable(root.as_table(*node, key), "[" + std::string(key) + "]", root.file(), known));
}

void read_world(const TomlTable& root, Scene& scene) {
  read_section(root, "world", {"gravity", "dt", "max_bodies", "ground_height"}, [&](const TomlTable& table) {
    table.read("gravity", scene.world.gravity);
    table.read("dt", scene.world.dt, Range::positive);
    if (scene.world.dt < 1e-6f || scene.world.dt > 1)
      table.fail(*table.find("dt"), "'dt' must be between 1e-6 and 1 s, typically 1/60: 0.0166667");
    const std::uint32_t most = scene.world.max_bodies;
    table.read("max_bodies", scene.world.max_bodies);
    if (scene.world.max_bodies < 1 || scene.world.max_bodies > most) {
      table.fail(*table.find("max_bodies"), "'max_bodies' must be between 1 and " + std::to_string(most));
    }
    table.read("ground_height", scene.ground_height);
  });
}

void read_solver(const TomlTable& root, SolverSettings& solver) {
  read_section(root, "solver",
               {"method", "warm_start", "substeps", "iterations", "marking_rounds", "contact_hertz",
                "contact_damping_ratio", "push_out_velocity", "restitution_threshold", "max_linear_speed"},
               [&](const TomlTable& table) {
                 table.read_choice<Solver>("method", solver.method, solvers);
                 table.read("warm_start", solver.warm_start);
                 table.read("marking_rounds", solver.marking_rounds, 1, 255);
                 table.read("substeps", solver.substeps, 1, 1000);
                 table.read("iterations", solver.iterations, 1, 1000);
                 table.read("contact_hertz", solver.contact_hertz, Range::positive);
                 table.read("contact_damping_ratio", solver.contact_damping_ratio, Range::not_negative);
                 table.read("push_out_velocity", solver.push_out_velocity, Range::not_negative);
                 table.read("restitution_threshold", solver.restitution_threshold, Range::not_negative);
                 table.read("max_linear_speed", solver.max_linear_speed, Range::positive);
               });
}

void read_sleep(const TomlTable& root, SleepSettings& sleep) {
  read_section(root, "sleep", {"enabled", "linear_speed", "time"}, [&](const TomlTable& table) {
    table.read("enabled", sleep.enabled);
    table.read("linear_speed", sleep.linear_speed, Range::not_negative);
    table.read("time", sleep.time, Range::not_negative);
  });
}

const std::initializer_list<std::string_view> simulator_keys{"kind",    "device",      "preset",     "ahead",
                                                             "threads", "broad_phase", "sweep_axis", "partition"};

/// The preset comes before all that changes parts of it.
void read_preset(const TomlTable& root, Scene& scene) {
  read_section(root, "simulator", simulator_keys, [&](const TomlTable& table) {
    table.read_choice<SimulatorKind>("kind", scene.world.simulator, simulators);
    Preset preset = Preset::fathom;
    table.read_choice<Preset>("preset", preset, presets);
    if (table.find("preset")) apply(preset, scene.world);
  });
}

void read_simulator(const TomlTable& root, Scene& scene) {
  read_section(root, "simulator", simulator_keys, [&](const TomlTable& table) {
    table.read("device", scene.world.device);
    table.read("ahead", scene.world.ahead, 0, 16);
    table.read("threads", scene.world.threads, 0, 1024);
    table.read_choice<BroadPhase>("broad_phase", scene.world.broad_phase, broad_phases);
    table.read_choice<Partition>("partition", scene.world.partition, partitions);
    table.read("sweep_axis", scene.world.sweep_axis, Range::not_negative);
    if (scene.world.sweep_axis == Vec3{}) {
      table.fail(*table.find("sweep_axis"), "'sweep_axis' has no length; one component must be greater than 0");
    }
  });
}

void read_kicks(const TomlTable& root, Scene& scene) {
  read_section(root, "kicks", {"interval", "linear", "angular", "seed"}, [&](const TomlTable& table) {
    Kicks kicks;
    table.read("interval", kicks.interval, 1);
    table.read("linear", kicks.linear, Range::not_negative);
    table.read("angular", kicks.angular, Range::not_negative);
    table.read("seed", kicks.seed);
    scene.kicks = kicks;
  });
}

Scene read_scene(const toml::table& file_table, std::string_view file) {
  const TomlTable root(
      file_table, "a scene", file,
      {"name", "world", "solver", "sleep", "simulator", "kicks", "materials", "shapes", "body", "joint"});
  Scene scene;
  scene.name = std::filesystem::path(file).stem().string();
  root.read("name", scene.name);
  read_world(root, scene);
  read_preset(root, scene);
  read_solver(root, scene.world.solver);
  read_sleep(root, scene.world.sleep);
  read_simulator(root, scene);
  read_kicks(root, scene);
  read_bodies(root, scene);
  read_joints(root, scene);
  return scene;
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw Error(ErrorCode::file, path + ": " + why);
}

std::string read_text(const std::string& path) {
  if (!std::filesystem::exists(path)) refuse(path, "no such file; give the path of a scene (*.toml)");
  if (std::filesystem::is_directory(path)) refuse(path, "is a folder; give the path of a scene (*.toml)");
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) refuse(path, "cannot be read; check its permissions");
  return text.str();
}

}  // namespace

Scene parse_scene(std::string_view text, std::string_view file) {
  try {
    return read_scene(toml::parse(text, file), file);
  } catch (const toml::parse_error& error) {
    fail_at(file, error.source(), std::string(error.description()));
  }
}

Scene load_scene(const std::string& path) { return parse_scene(read_text(path), path); }

}  // namespace fathom
