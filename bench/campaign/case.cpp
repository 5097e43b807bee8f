#include "case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "engine/scene_entities.hpp"
#include "measure/counted.hpp"
#include "scene/environments.hpp"

namespace fathom::campaign {
namespace {

constexpr std::array<SimulatorName, 3> simulator_table{{
    {"native", SimulatorKind::native, false},
    {"device", SimulatorKind::device, true},
    {"hybrid", SimulatorKind::hybrid, true},
}};

constexpr std::array<AlgorithmSet, 2> set_table{{
    {"fathom", "this engine's defaults", Preset::fathom},
    {"dissertation", "the dissertation's algorithms", Preset::dissertation},
}};

template <class Table>
const auto& find(const Table& table, std::string_view name, const char* what) {
  const auto found = std::ranges::find_if(table, [&](const auto& entry) { return entry.name == name; });
  if (found == table.end()) throw Error(ErrorCode::invalid_argument, fmt::format("there is no {} '{}'", what, name));
  return *found;
}

}  // namespace

std::string key_of(const Case& c) {
  std::string key = fmt::format("{}-{}-{}{}{}-{}t-{}", c.environment, c.bodies, c.simulator,
                                c.device.empty() ? "" : "-", c.device, c.threads, c.set);
  if (c.round > 1) key += fmt::format("-{}", c.round);
  std::erase(key, ':');
  return key;
}

std::string label_of(const Case& c) {
  std::string label = c.simulator;
  if (!c.device.empty()) label += " on " + c.device;
  if (c.simulator != "device" || c.device == "host")
    label += ", " + counted(static_cast<std::uint64_t>(c.threads), "thread");
  return c.set == "fathom" ? label : label + ", " + c.set;
}

std::span<const SimulatorName> simulators() { return simulator_table; }
std::span<const AlgorithmSet> algorithm_sets() { return set_table; }

Scene make_scene(const Case& c) {
  const Environment* environment = find_environment(c.environment);
  if (!environment) throw Error(ErrorCode::invalid_argument, "there is no environment '" + c.environment + "'");
  Scene scene = environment->make(c.bodies);
  engine::Config config;
  engine::take_over_world(scene, config);
  const auto give = [&](const char* key, auto engine::Settings::Simulator::*value, const auto& given) {
    config.give(key, "the case", [&](engine::Settings& settings) { settings.simulator.*value = given; });
  };
  using Simulator = engine::Settings::Simulator;
  give("simulator.kind", &Simulator::kind, find(simulators(), c.simulator, "simulator").kind);
  give("simulator.preset", &Simulator::preset, find(algorithm_sets(), c.set, "set of algorithms").preset);
  give("simulator.threads", &Simulator::threads, c.threads);
  if (!c.device.empty()) {
    give("simulator.device", &Simulator::device, c.device);
    give("simulator.device_ahead", &Simulator::device_ahead, published_ahead);
  }
  scene.world = config.world_definition();
  return scene;
}

}  // namespace fathom::campaign
