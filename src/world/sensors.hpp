// Which bodies are in which sensor, found after each step.
//
// All simulators share this code: it uses the query tree and exact distances. So the same poses give the same events,
// sensors see sleeping bodies and pairs unknown to broad phases, and the step itself, device kernels included, does
// nothing for sensors. The price: after each step of a world with sensors a device copies its poses to the host, which
// `WorldDef::ahead` cannot hide. Worlds without sensors read no body.
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

  /// Stores the bodies' poses.
  void begin_step(const Simulator& simulator);
  void end_step(const Simulator& simulator);
  /// Bodies inside after the last step, ascending.
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
  std::vector<Pose> before_;                              // by slot, at its start
  std::vector<std::uint32_t> fast_;                       // bodies that moved farther than their own radius
  float reach_ = 0;                                       // largest movement of the others (m)
  std::vector<std::uint32_t> candidates_;                 // for one sensor
  std::vector<Presence> present_, passed_, came_, left_;  // passed: through a sensor within the step
  std::vector<SensorEvent> events_;
};

}  // namespace fathom
