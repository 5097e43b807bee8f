// Sensors: bodies that push nothing and are not pushed, but tell what is inside them.
//
// A body is a sensor if its `BodyDef::sensor` is set: fixed, kinematic or dynamic, of any shape. After each step those
// bodies are inside whose shapes touch or overlap its own, sleeping ones too, if the filters of both let them collide
// (filters of a compound's children count for contacts alone). Sensors do not see sensors, and fixed sensors do not see
// fixed bodies. Triangle surfaces see, and are seen, from outside alone, and do not see each other.
//
// Sensors also see bodies on their way through a step, on a straight line from where they were to where they are,
// relative to the sensor and turned as at the step's end: a bullet that crosses a sensor within a step enters and
// leaves it in that step.
//
// Sensors are evaluated when the step is over, so a world that has some waits for each step, whatever
// `WorldDef::ahead` says.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>

namespace fathom {

/// A body that entered a sensor, or left it, or was removed while it was inside.
struct SensorEvent {
  BodyId sensor;           ///< the sensor
  BodyId body;             ///< the other one
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};

}  // namespace fathom
