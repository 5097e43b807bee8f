#include "scene/scene_file.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "scene/scene_bodies.hpp"
#include "scene/scene_joints.hpp"
#include "scene/toml_reader.hpp"
#include "scene/world_preset.hpp"

namespace fathom {
namespace {

constexpr std::array<std::pair<std::string_view, Solver>, 2> solvers{
    {{"soft", Solver::soft}, {"impulse", Solver::impulse}}};
constexpr std::array<std::pair<std::string_view, BroadPhase>, 2> broad_phases{
    {{"tree", BroadPhase::tree}, {"sweep", BroadPhase::sweep}}};
constexpr std::array<std::pair<std::string_view, Partition>, 2> partitions{
    {{"colours", Partition::colours}, {"cells", Partition::cells}}};
constexpr std::array<std::pair<std::string_view, Preset>, 2> presets{
    {{"fathom", Preset::fathom}, {"dissertation", Preset::dissertation}}};
constexpr std::array<std::pair<std::string_view, SimulatorKind>, 3> simulators{
    {{"native", SimulatorKind::native}, {"device", SimulatorKind::device}, {"hybrid", SimulatorKind::hybrid}}};

std::string written(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

/// Calls `read` with a section of the file, if present.
template <class Read>
void read_section(const TomlTable& root, std::string_view key, std::initializer_list<std::string_view> known,
                  Read read) {
  const toml::node* node = root.find(key);
  if (!node) return;
  read(TomlTable(root.as_table(*node, key), "[" + std::string(key) + "]", root.file(), known));
}

/// Records where the table sets world settings, by the names of configuration keys.
void note(const TomlTable& table, Scene& scene,
          std::initializer_list<std::pair<std::string_view, std::string_view>> keys) {
  for (const auto& [key, name] : keys)
    if (const toml::node* node = table.find(key))
      scene.said["simulator." + std::string(name)] =
          std::string(table.file()) + ":" + std::to_string(node->source().begin.line);
}

/// What a world would refuse, NaN included, is refused with the range.
void read_dt(const TomlTable& table, float& dt) {
  const toml::node* node = table.find("dt");
  const std::optional<double> given = node && node->is_number() ? node->value<double>() : std::nullopt;
  if (given && !(*given >= 1e-6 && *given <= 1))
    table.fail(*node, "'dt' must be between 1e-6 and 1 s, not " + written(*given) + "; typically 1/60: 0.0166667");
  table.read("dt", dt);
}

void read_world(const TomlTable& root, Scene& scene) {
  read_section(root, "world", {"gravity", "dt", "max_bodies", "ground_height"}, [&](const TomlTable& table) {
    table.read("gravity", scene.world.gravity);
    read_dt(table, scene.world.dt);
    auto max_bodies = static_cast<int>(scene.world.max_bodies);
    table.read("max_bodies", max_bodies, 1, max_bodies);
    scene.world.max_bodies = static_cast<std::uint32_t>(max_bodies);
    table.read("ground_height", scene.ground_height);
    note(table, scene, {{"gravity", "gravity"}, {"dt", "dt"}, {"max_bodies", "max_bodies"}});
  });
}

void read_solver(const TomlTable& root, Scene& scene) {
  SolverSettings& solver = scene.world.solver;
  read_section(root, "solver",
               {"method", "warm_start", "direct_joints", "substeps", "iterations", "marking_rounds", "contact_hertz",
                "contact_damping_ratio", "push_out_velocity", "restitution_threshold", "max_linear_speed"},
               [&](const TomlTable& table) {
                 table.read_choice<Solver>("method", solver.method, solvers);
                 table.read("warm_start", solver.warm_start);
                 table.read("direct_joints", solver.direct_joints);
                 table.read("marking_rounds", solver.marking_rounds, 1, 255);
                 table.read("substeps", solver.substeps, 1, SolverSettings::max_substeps);
                 table.read("iterations", solver.iterations, 1, 1000);
                 table.read("contact_hertz", solver.contact_hertz, Range::positive);
                 table.read("contact_damping_ratio", solver.contact_damping_ratio, Range::not_negative);
                 table.read("push_out_velocity", solver.push_out_velocity, Range::not_negative);
                 table.read("restitution_threshold", solver.restitution_threshold, Range::not_negative);
                 table.read("max_linear_speed", solver.max_linear_speed, Range::positive);
                 for (const auto& [key, value] : table.table())
                   note(table, scene, {{key.str(), key.str() == "method" ? "solver" : key.str()}});
               });
}

void read_sleep(const TomlTable& root, Scene& scene) {
  SleepSettings& sleep = scene.world.sleep;
  read_section(root, "sleep", {"enabled", "linear_speed", "time"}, [&](const TomlTable& table) {
    table.read("enabled", sleep.enabled);
    table.read("linear_speed", sleep.linear_speed, Range::not_negative);
    table.read("time", sleep.time, Range::not_negative);
    note(table, scene, {{"enabled", "sleep"}, {"linear_speed", "sleep_linear_speed"}, {"time", "sleep_time"}});
  });
}

void read_simulator(const TomlTable& root, Scene& scene) {
  WorldDef& world = scene.world;
  read_section(
      root, "simulator", {"kind", "device", "preset", "ahead", "threads", "broad_phase", "sweep_axis", "partition"},
      [&](const TomlTable& table) {
        table.read_choice<SimulatorKind>("kind", world.simulator, simulators);
        table.read("device", world.device);
        table.read("ahead", world.ahead, 0, 16);
        table.read("threads", world.threads, 0, WorldDef::max_threads);
        table.read_choice<BroadPhase>("broad_phase", world.broad_phase, broad_phases);
        table.read_choice<Partition>("partition", world.partition, partitions);
        table.read("sweep_axis", world.sweep_axis, Range::not_negative);
        if (world.sweep_axis == Vec3{}) {
          table.fail(*table.find("sweep_axis"), "'sweep_axis' has no length; one component must be greater than 0");
        }
        Preset preset = Preset::fathom;
        table.read_choice<Preset>("preset", preset, presets);
        if (table.has("preset")) scene.preset = preset;
        if (table.has("device") && table.has("kind") && world.simulator == SimulatorKind::native)
          table.fail(*table.find("device"),
                     "'device' applies to the simulators device and hybrid only; remove it or kind = \"native\"");
        note(table, scene, {{"kind", "kind"}, {"device", "device"}, {"ahead", "device_ahead"}});
        for (const char* key : {"preset", "threads", "broad_phase", "partition", "sweep_axis"})
          note(table, scene, {{key, key}});
      });
  // Naming a device implies using it.
  if (scene.said.contains("simulator.device") && !scene.said.contains("simulator.kind"))
    world.simulator = SimulatorKind::device;
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
      {"name", "world", "solver", "sleep", "simulator", "kicks", "materials", "shapes", "body", "joint", "exclude"});
  Scene scene;
  scene.name = std::filesystem::path(file).stem().string();
  root.read("name", scene.name);
  read_world(root, scene);
  read_solver(root, scene);
  read_sleep(root, scene);
  read_simulator(root, scene);
  if (scene.preset)
    apply_but(*scene.preset, scene.world, [&](std::string_view key) { return scene.said.contains(key); });
  read_kicks(root, scene);
  read_bodies(root, scene);
  read_joints(root, scene);
  read_excluded(root, scene);
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

Scene parse_scene(std::string_view text, std::string_view file) { return read_scene(parse_toml(text, file), file); }

Scene load_scene(const std::string& path) { return parse_scene(read_text(path), path); }

}  // namespace fathom
