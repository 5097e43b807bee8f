// Tests of worlds that run on several simulators, whatever FATHOM_TEST_VARIANT says.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "world_fixture.hpp"

namespace fathom::test {

/// The parameter is the simulator.
class OnSimulator : public testing::TestWithParam<SimulatorKind> {
 protected:
  static WorldDef on_simulator(WorldDef def) {
    def.simulator = GetParam();
    def.device = test_device();
    return def;
  }
  static WorldDef world_def() { return on_simulator(sleepy_world()); }
};

/// For INSTANTIATE_TEST_SUITE_P.
inline std::string simulator_name(const testing::TestParamInfo<SimulatorKind>& info) {
  return info.param == SimulatorKind::native ? "native" : info.param == SimulatorKind::device ? "device" : "hybrid";
}

inline BodyDef fixed_body(const Shape& shape, Vec3 position, float friction = 0.5f) {
  BodyDef def;
  def.motion = MotionType::fixed, def.shape = shape, def.pose.position = position;
  def.material.friction = friction;
  return def;
}

}  // namespace fathom::test
