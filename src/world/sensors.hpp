// Who is in which sensor, found when a step is over.
//
// One piece of code serves all simulators: it asks the tree that answers queries and their exact distances. So the same
// poses give the same events, sleepers and what no broad phase pairs are seen, and a step does nothing for sensors, on
// a device no kernel. The price is that a device's poses come to the host after each step of a world with sensors,
// which `WorldDef::ahead` then cannot hide. Worlds without sensors do not look at a body.
#pragma once

#include <fathom/sensor.hpp>
#include <span>
#include <vector>

#include "world/event_list.hpp"

namespace fathom {

class ByteReader;
class ByteWriter;
class Simulator;

struct Presence {
  BodyId sensor, body;
};

class Sensors {
 public:
  EventList<SensorEvent> begun, ended;

  /// Notes where bodies are.
  void begin_step(const Simulator& simulator);
  void end_step(const Simulator& simulator);
  /// Of the last step, bodies ascending.
  std::span<const Presence> inside(BodyId sensor) const;

  /// `step`: the last one, whose events are saved.
  void save(ByteWriter& write, std::uint64_t step) const;
  void restore(ByteReader& in);

 private:
  void look_at_movements(const Simulator& simulator, std::span<const Pose> poses);
  void look_at(std::uint32_t sensor, const Simulator& simulator, std::span<const Pose> poses);
  bool was_inside(const Presence& presence) const;

  std::vector<Presence> inside_;  // by sensor, then body

  // Within a step.
  std::vector<Pose> before_;                              // by slot, as it began
  std::vector<std::uint32_t> fast_;                       // bodies that moved farther than their own radius
  float reach_ = 0;                                       // m that the others moved at most
  std::vector<std::uint32_t> candidates_;                 // for one sensor
  std::vector<Presence> present_, passed_, came_, left_;  // passed: within the step
  std::vector<SensorEvent> events_;
};

}  // namespace fathom
