// Contacts that a lasting load presses deep rise to a depth that may last.
#include "dynamics/lift.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <fathom/world.hpp>
#include <limits>
#include <random>
#include <vector>

#include "dynamics/softness.hpp"
#include "world_fixture.hpp"

namespace fathom::test::lift_test {
namespace {

/// m, of the deepest contact point.
float deepest(const World& world) {
  float depth = 0;
  world.for_each_contact([&](const ContactInfo& c) {
    for (int p = 0; p < c.point_count; ++p) depth = max(depth, -c.points[p].separation);
  });
  return depth;
}

WorldDef world_of(SimulatorKind simulator) {
  WorldDef def = quiet_world();
  def.simulator = simulator;
  def.device = "host";
  return def;
}

/// A slab of a tonne on four balls of 10 kg, 10 cm in radius; the ground is at 0.5 m.
struct LoadedBalls {
  World world;
  std::vector<BodyId> balls;
  BodyId slab;

  explicit LoadedBalls(SimulatorKind simulator) : world(world_of(simulator)) {
    world.add(ground());
    for (const float x : {-1.0f, 1.0f})
      for (const float y : {-1.0f, 1.0f}) balls.push_back(world.add(dynamic(sphere(0.1f), {x, y, 0.6f}, 10)));
    slab = world.add(dynamic(box({1.5f, 1.5f, 0.25f}), {0, 0, 0.95f}, 1000));
  }
  void run(float seconds) {
    for (int i = 0; i < static_cast<int>(seconds / world.definition().dt); ++i) world.step();
  }
};

}  // namespace

class Lifts : public testing::TestWithParam<SimulatorKind> {};
INSTANTIATE_TEST_SUITE_P(Simulators, Lifts, testing::Values(SimulatorKind::native, SimulatorKind::device));

TEST(Lift, GrowsWhileTheContactIsTooDeepAndFadesOnceItIsNot) {
  std::mt19937 random(1);
  const auto any = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
  for (int trial = 0; trial < 100000; ++trial) {
    const float half = std::exp2(any(-11, 9)), dt = 1 / any(15, 1000), lasting = lasting_depth(half);
    const float lift = any(0, 1) < 0.3f ? 0.0f : any(0, half), depth = any(-0.5f, 4) * lasting;
    const float next = next_lift(lift, depth, std::exp2(any(0, 12)), half, dt);
    ASSERT_LE(lasting, 0.1f * half);
    ASSERT_GE(next, 0) << trial;
    ASSERT_LE(next, half) << trial;
    if (depth < 0) {
      ASSERT_EQ(next, 0) << trial;
    } else if (depth < 0.5f * lasting) {
      ASSERT_LE(next, lift) << trial;
    } else if (depth <= lasting) {
      ASSERT_EQ(next, lift) << trial;
    } else {
      ASSERT_GE(next, lift) << trial;
    }
  }
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  EXPECT_EQ(next_lift(0.01f, nan, 10, 0.1f, 0.016f), 0);
  EXPECT_EQ(next_lift(0.01f, -infinite, 10, 0.1f, 0.016f), 0);
  EXPECT_LE(next_lift(0.01f, infinite, 10, 0.1f, 0.016f), 0.1f);
  // It vanishes once the load is light, in steps of any length.
  for (const float dt : {1.0f, 0.2f, 0.01f}) {
    float lift = 0.1f;
    for (int i = 0; i < static_cast<int>(10 / dt); ++i) lift = next_lift(lift, 0, 1, 0.1f, dt);
    EXPECT_EQ(lift, 0) << dt;
  }
}

TEST_P(Lifts, WhatCarriesMuchIsNotDeepForLong) {
  LoadedBalls s(GetParam());
  s.run(30);
  EXPECT_LT(deepest(s.world), 0.003f);
  EXPECT_NEAR(s.world.pose(s.slab).position.z, 0.95f, 0.004f);
  for (const BodyId ball : s.balls) EXPECT_LT(length(s.world.velocity(ball).linear), 0.01f);
}

// Bodies freed from a lasting load neither hop nor float.
TEST_P(Lifts, WhatIsRelievedStaysOnTheGround) {
  LoadedBalls s(GetParam());
  s.run(30);
  s.world.remove(s.slab);
  float highest = 0, fastest = 0;
  for (int i = 0; i < 120; ++i) {
    s.world.step();
    for (const BodyId ball : s.balls) {
      highest = max(highest, s.world.pose(ball).position.z);
      fastest = max(fastest, length(s.world.velocity(ball).linear));
    }
  }
  EXPECT_LT(highest, 0.605f);
  EXPECT_LT(fastest, 0.3f);
  for (const BodyId ball : s.balls) EXPECT_NEAR(s.world.pose(ball).position.z, 0.6f, 0.002f);
}

// The push-out limit is one of velocity: the impulse that carries a load has no limit, whatever the depth at which the
// spring reaches it. Otherwise balls and boxes sink by more than 0.2 m under a thousand times their weight.
TEST_P(Lifts, WhatIsPressedSinksAsFarAsItsSpringGivesWayAndRisesAgain) {
  for (const int substeps : {4, 8})
    for (const float load : {100.0f, 300.0f, 1000.0f})
      for (const Shape& shape : {sphere(0.5f), box({0.5f, 0.5f, 0.5f})}) {
        WorldDef def = world_of(GetParam());
        def.solver.substeps = substeps;
        World world(def);
        world.add(ground());
        const BodyId body = world.add(dynamic(shape, {0, 0, 1}, 1));
        const float weights = load * length(def.gravity), sag = weights * contact_sag(def);
        float lowest = 1, z = 1;
        for (int i = 0; i < 1800; ++i) {
          world.apply_force(body, {0, 0, -weights});
          world.step();
          z = world.pose(body).position.z;
          lowest = min(lowest, z);
        }
        EXPECT_GT(lowest, 1 - 1.8f * sag - 0.001f) << substeps << " substeps, " << load << " weights";
        EXPECT_NEAR(z, 1, 0.008f) << substeps << " substeps, " << load << " weights";
      }
}

}  // namespace fathom::test::lift_test
