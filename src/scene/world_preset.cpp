#include "scene/world_preset.hpp"

#include <array>

namespace fathom {

std::span<const std::string_view> settings_of(Preset preset) {
  // Only `dissertation` sets the last one.
  static constexpr std::array<std::string_view, 7> keys{
      "simulator.broad_phase",       "simulator.partition",    "simulator.solver", "simulator.warm_start",
      "simulator.push_out_velocity", "simulator.device_ahead", "simulator.sleep"};
  return std::span(keys).first(preset == Preset::dissertation ? keys.size() : keys.size() - 1);
}

void apply_but(Preset preset, WorldDef& world, const std::function<bool(std::string_view key)>& stays) {
  WorldDef decided = world;
  apply(preset, decided);
  const auto take = [&](std::string_view key, auto& value, const auto& from) {
    if (!stays(key)) value = from;
  };
  take("simulator.broad_phase", world.broad_phase, decided.broad_phase);
  take("simulator.partition", world.partition, decided.partition);
  take("simulator.solver", world.solver.method, decided.solver.method);
  take("simulator.warm_start", world.solver.warm_start, decided.solver.warm_start);
  take("simulator.push_out_velocity", world.solver.push_out_velocity, decided.solver.push_out_velocity);
  take("simulator.device_ahead", world.ahead, decided.ahead);
  take("simulator.sleep", world.sleep.enabled, decided.sleep.enabled);
}

}  // namespace fathom
