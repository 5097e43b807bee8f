// Loads on bodies that a program moves: they ride along, and what is jammed is not thrown.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "random.hpp"
#include "simulator_fixture.hpp"

namespace fathom::test::carried_loads_test {
namespace {

class CarriedLoads : public OnSimulator {
 protected:
  static WorldDef quiet() { return on_simulator(quiet_world()); }
};
INSTANTIATE_TEST_SUITE_P(Simulators, CarriedLoads,
                         testing::Values(SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid),
                         simulator_name);

BodyDef kinematic(Vec3 half_extents, Vec3 position) {
  BodyDef def;
  def.motion = MotionType::kinematic, def.shape = box(half_extents), def.pose.position = position;
  return def;
}

// A light crate under a heavy load is solved with more inertia than it has. That must not make it slide off a platform
// that accelerates with a sixth of what friction can hold.
TEST_P(CarriedLoads, RideOnAnAcceleratingPlatform) {
  for (const float height : {0.01f, 0.05f})
    for (const float ratio : {1.0f, 10.0f, 50.0f}) {
      World world(quiet());
      const BodyId platform = world.add(kinematic({50, 1, 0.5f}, {0, 0, 0}));
      const BodyId crate = world.add(dynamic(box({0.05f, 0.05f, 0.5f * height}), {0, 0, 0.5f + 0.5f * height}));
      const BodyId load = world.add(dynamic(box({0.05f, 0.05f, 0.05f}), {0, 0, 0.55f + height}, ratio));
      float speed = 0;
      for (int i = 0; i < 240; ++i) {
        if (i >= 60) speed += 0.1f * 9.81f / 60;
        world.set_velocity(platform, {speed, 0, 0}, {});
        world.step();
      }
      const float at = world.pose(platform).position.x;
      EXPECT_NEAR(world.pose(crate).position.x, at, 1e-3f) << height << ' ' << ratio;
      EXPECT_NEAR(world.pose(load).position.x, at, 2e-3f) << height << ' ' << ratio;
    }
}

// A lift presses a crate by a twentieth of its height against a ceiling, waits, and goes down again. While it waits
// nothing moves, so nothing but the solver's own renewal of strain bounds the impulses.
TEST_P(CarriedLoads, AJammedCrateIsNotThrown) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    Generator random(seed);
    World world(quiet());
    const BodyId lift = world.add(kinematic({1, 1, 0.1f}, {0, 0, -0.1f}));
    BodyDef ceiling;
    ceiling.motion = MotionType::fixed, ceiling.shape = box({1.5f, 1.5f, 0.1f}), ceiling.pose.position = {0, 0, 1.6f};
    world.add(ceiling);
    BodyDef body = dynamic(box({0.25f, 0.25f, 0.25f}), {uniform(random, 0, 0.3f), 0, 0.26f}, 100);
    body.pose.rotation = axis_angle({0, 0, 1}, uniform(random, 0, 6));
    const BodyId crate = world.add(body);
    float fastest = 0;
    for (int i = 0; i < 900; ++i) {
      const float top = world.pose(lift).position.z + 0.1f;
      const bool presses = i < 600;
      world.set_velocity(lift, {0, 0, presses ? (top < 1.025f ? 0.3f : 0.0f) : (top > 0 ? -0.3f : 0.0f)}, {});
      world.step();
      fastest = std::max(fastest, length(world.velocity(crate).linear));
    }
    EXPECT_LT(fastest, 2) << seed;
  }
}

}  // namespace
}  // namespace fathom::test::carried_loads_test
