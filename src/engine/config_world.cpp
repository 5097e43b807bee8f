// One world definition from a scene, a configuration and options. The last to set a value wins; a preset sets
// everything that it decides.
#include "engine/config_world.hpp"

#include <algorithm>
#include <utility>

#include "engine/config_keys.hpp"
#include "scene/world_preset.hpp"

namespace fathom::engine {
namespace {

constexpr std::string_view preset_key = "simulator.preset", kind_key = "simulator.kind",
                           device_key = "simulator.device";

template <class From, class To>
void copy(const From& from, To& to) {
  to = static_cast<To>(from);
}

bool differs(std::string_view key, const WorldDef& a, const WorldDef& b) {
  bool found = false;
  for_each_world_key([&](std::string_view name, auto, auto in_world) {
    if (name == key) found = in_world(a) != in_world(b);
  });
  return found;
}

}  // namespace

Setter Config::setter_of(std::string_view key) const {
  if (const auto found = origins_.find(key); found != origins_.end()) return found->second.setter;
  return base_.said.contains(key) ? Setter::scene : Setter::nobody;
}

Setter Config::setter_of_preset() const {
  return std::max(setter_of(preset_key), base_.preset ? Setter::scene : Setter::nobody);
}

bool Config::is_decided_by_preset(std::string_view key) const {
  const Setter setter = setter_of_preset();
  if (setter == Setter::nobody || setter_of(key) >= setter) return false;
  return std::ranges::find(settings_of(values_.simulator.preset), key) != settings_of(values_.simulator.preset).end();
}

// Naming a device implies using it.
bool Config::device_implies_simulator() const {
  const SimulatorKind kind = setter_of(kind_key) > Setter::scene ? values_.simulator.kind : base_.world.simulator;
  return kind != SimulatorKind::hybrid && setter_of(device_key) > setter_of(kind_key);
}

bool Config::is_set(std::string_view key) const { return settled().counts(key); }

bool Config::counts(std::string_view key) const { return setter_of(key) > Setter::scene && !is_decided_by_preset(key); }

std::string Config::origin_of(std::string_view key) const {
  if (is_decided_by_preset(key))
    return values_.simulator.preset == Preset::dissertation ? "preset dissertation" : "preset fathom";
  if (key == kind_key && device_implies_simulator()) return origin_of(device_key);
  if (const auto found = origins_.find(key); found != origins_.end()) return found->second.text;
  if (const auto found = base_.said.find(key); found != base_.said.end()) return found->second;
  return differs(key, base_.world, WorldDef{}) ? base_.name : "default";
}

void Config::set_base(WorldBase base) {
  note_edits();
  base_ = std::move(base);
  settle();
}

void Config::give(std::string_view key, std::string_view option, const std::function<void(Settings&)>& change,
                  Setter setter) {
  note_edits();
  change(values_);
  origins_[std::string(key)] = {setter, std::string(option)};
  settle();
}

void Config::note_edits() {
  for (const ConfigKey& key : config_keys())
    if (key.get(values_) != key.get(settled_)) origins_[key.name] = {Setter::program, "program"};
  for (const auto& [action, keys] : values_.actions)
    if (const auto before = settled_.actions.find(action); before == settled_.actions.end() || before->second != keys)
      origins_[std::string(action_prefix) + action] = {Setter::program, "program"};
}

Config Config::settled() const {
  Config now = *this;
  now.note_edits();
  now.settle();
  return now;
}

// Sets the world settings to the result of base, keys and preset.
void Config::settle() {
  Settings::Simulator& settings = values_.simulator;
  if (base_.preset && setter_of(preset_key) <= Setter::scene) settings.preset = *base_.preset;
  WorldDef world = base_.world;
  for_each_world_key([&](std::string_view key, auto in_settings, auto in_world) {
    if (counts(key)) copy(in_settings(settings), in_world(world));
  });
  if (device_implies_simulator()) world.simulator = SimulatorKind::device;
  // Last, because what it decides depends on other settings, such as the simulator.
  if (setter_of_preset() > Setter::nobody)
    apply_but(settings.preset, world, [&](std::string_view key) { return !is_decided_by_preset(key); });
  for_each_world_key(
      [&](std::string_view, auto in_settings, auto in_world) { copy(in_world(world), in_settings(settings)); });
  settled_ = values_;
}

WorldDef Config::world_definition(std::function<void(std::string_view)> log) const {
  const Config now = settled();
  WorldDef world = base_.world;
  for_each_world_key([&](std::string_view, auto in_settings, auto in_world) {
    copy(in_settings(now.values_.simulator), in_world(world));
  });
  world.log = std::move(log);
  return world;
}

}  // namespace fathom::engine
