// Sensors: bodies that push nothing and are not pushed, but report what is inside them.
//
// A body with `BodyDef::sensor` is a sensor: fixed, kinematic or dynamic, of any shape. After each step a body is
// inside a sensor if their shapes touch or overlap and their filters let them collide, even if it is asleep (the
// filters of a compound's children count only for contacts). Sensors do not see sensors, and fixed sensors do not see
// fixed bodies. Triangle surfaces see, and are seen, only from outside, and do not see each other.
//
// Sensors also see bodies during the step, on a straight line from the start to the end position relative to the
// sensor, with the rotation at the step's end: a bullet that crosses a sensor within a step enters and leaves it in
// that step.
//
// Sensors are evaluated at the end of a step, so a world with sensors waits for each step regardless of
// `WorldDef::ahead`.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>

namespace fathom {

/// A body that entered or left a sensor, or was removed while inside.
struct SensorEvent {
  BodyId sensor;           ///< the sensor
  BodyId body;             ///< the other one
  std::uint64_t step = 0;  ///< `World::step_count()` after that step
};

}  // namespace fathom
