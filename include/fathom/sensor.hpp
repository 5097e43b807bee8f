// Sensors: bodies that push nobody and are pushed by nobody, but tell who is in them.
//
// Any body is one whose BodyDef says `sensor`: fixed, kinematic or dynamic, of any shape. After each step it has in it
// the bodies whose shapes its own touches or overlaps, asleep ones too, where the filters of both let them collide
// (those of a compound's children count for contacts alone). Sensors do not see sensors, and fixed ones see no fixed
// bodies. Surfaces of triangles see, and are seen, from outside alone, and not each other.
//
// Bodies are followed on their way through a step, too, on a straight line from where they were to where they are,
// relative to the sensor and turned as at the step's end: a bullet that crosses a sensor within a step begins and ends
// in it in that step.
//
// Sensors are looked at when the step is over, so a world that has some waits for each step, whatever
// `WorldDef::ahead`.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>

namespace fathom {

/// A body that came into a sensor, or left it, or was removed while it was in it.
struct SensorEvent {
  BodyId sensor, body;
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};

}  // namespace fathom
