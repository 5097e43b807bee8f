// Bodies that spin by more than half a turn per step: wheels, propellers, drills.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::spin_test {
namespace {

using namespace test;

TEST(Spin, FastSpinsTurnAsFarAsTheyShould) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device})
    for (const float speed : {100.0f, 187.0f, 700.0f, 1500.0f, 3000.0f}) {
      WorldDef def = quiet_world();
      def.simulator = simulator;
      def.device = test_device();
      def.gravity = {};
      World world(def);
      std::vector<BodyId> ids;
      for (int i = 0; i < 3; ++i) {
        BodyDef one = dynamic(i == 1 ? box({1, 0.1f, 0.2f}) : sphere(0.5f), {5.0f * static_cast<float>(i), 0, 0});
        one.velocity.angular = {0, 0, speed};
        if (i == 2) one.motion = MotionType::kinematic;
        ids.push_back(world.add(one));
      }
      run(world, 60);
      const double angle = static_cast<double>(speed) * 60 * static_cast<double>(def.dt);
      for (std::size_t i = 0; i < ids.size(); ++i) {
        const Quat q = world.pose(ids[i]).rotation;
        const double off = std::remainder(2 * std::atan2(static_cast<double>(q.z), static_cast<double>(q.w)) - angle,
                                          2 * static_cast<double>(pi));
        EXPECT_NEAR(off, 0, 0.02) << speed << " rad/s, body " << i;
        EXPECT_NEAR(world.velocity(ids[i]).angular.z, speed, 1e-4f * speed) << "body " << i;
      }
    }
}

TEST(Spin, WhatIsCutIsToldOnce) {
  std::vector<std::string> told;
  WorldDef def = quiet_world();
  def.log = [&](std::string_view line) { told.emplace_back(line); };
  World world(def);
  const BodyId id = world.add(cube({0, 0, 5}));
  world.set_velocity(id, {0, 0, 900}, {3800, 0, 0});
  EXPECT_TRUE(told.empty());
  world.set_velocity(id, {}, {0, 5000, 0});
  world.set_velocity(id, {2000, 0, 0}, {});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("rad/s"), std::string::npos) << told[0];
}

}  // namespace
}  // namespace fathom::spin_test
