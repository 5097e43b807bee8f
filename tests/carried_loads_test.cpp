// Loads on bodies that a program moves: they ride along, and what is jammed is not thrown.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

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

Pose at(Vec3 position) {
  Pose pose;
  pose.position = position;
  return pose;
}

/// A free-standing stack of cubes of `size` m, from the height `bottom` (m) up.
struct Stack {
  std::vector<BodyId> cubes;
  float size;

  Stack(World& world, int count, float side, Vec3 bottom) : size(side) {
    for (int i = 0; i < count; ++i)
      cubes.push_back(world.add(
          dynamic(box(0.5f * size * Vec3{1, 1, 1}), bottom + Vec3{0, 0, (static_cast<float>(i) + 0.5f) * size})));
  }
  /// How far its top is, in cubes, from where it would be if the stack had moved by `way`.
  float off(const World& world, Vec3 bottom, Vec3 way = {}) const {
    const Vec3 top = bottom + way + Vec3{0, 0, (static_cast<float>(cubes.size()) - 0.5f) * size};
    return distance(world.pose(cubes.back()).position, top) / size;
  }
};

// Obstacles that move as one are one base. Held by neither, the stack fell.
TEST_P(CarriedLoads, AStackRidesOnTwoPlatesThatMoveTogether) {
  constexpr float size = 0.05f;
  World world(quiet());
  for (const float x : {-1.5f, 1.5f}) {
    const BodyId plate = world.add(kinematic({1.5f * size, 3 * size, 0.5f * size}, {x * size, 0, -0.5f * size}));
    world.set_velocity(plate, {0.05f, 0, 0.1f}, {});
  }
  const Stack stack(world, 8, size, {});
  for (const BodyId cube : stack.cubes) world.set_velocity(cube, {0.05f, 0, 0.1f}, {});
  run(world, 600);
  EXPECT_LT(stack.off(world, {}, {0.5f, 0, 1}), 0.1f);
}

// It held the stack up and down with its own motion, and let go of it again.
TEST_P(CarriedLoads, APlateAboveAStackDoesNotDisturbIt) {
  constexpr float size = 0.05f;
  World world(quiet());
  world.add(ground());
  const Stack stack(world, 4, size, {0, 0, 0.5f});
  const Vec3 above{0, 0, 0.5f + 4.22f * size};
  const BodyId plate = world.add(kinematic({size, size, 0.2f * size}, above));
  for (int i = 0; i < 1500; ++i) {
    if (i >= 75 && i % 75 < 2) world.move_to(plate, at(above + Vec3{0, 0, i % 75 == 0 ? 0.1f * size : 0.0f}));
    world.step();
  }
  EXPECT_LT(stack.off(world, {0, 0, 0.5f}), 0.05f);
}

TEST_P(CarriedLoads, TappingABoardDoesNotFellItsStack) {
  constexpr float size = 0.05f;
  World world(quiet());
  world.add(ground());
  world.add(dynamic(box({10 * size, 10 * size, 0.2f * size}), {0, 0, 0.5f + 0.2f * size}));
  const Vec3 bottom{0, 6 * size, 0.5f + 0.4f * size};
  const Stack stack(world, 8, size, bottom);
  const Vec3 touch{0, -6 * size, 0.5f + 1.4f * size};
  BodyDef def = kinematic({size, size, size}, touch);
  def.shape = sphere(size), def.material.friction = 0;
  const BodyId finger = world.add(def);
  for (int i = 0; i < 900; ++i) {
    const float swing = 0.1f * size * std::sin(2 * pi * static_cast<float>(i) / 30);
    world.move_to(finger, at(touch + Vec3{0, 0, std::max(-0.002f * size, swing)}));
    world.step();
  }
  EXPECT_LT(stack.off(world, bottom), 0.2f);
}

// A deck's new velocity must not fall into one substep: friction would slip, and the stacks tip.
TEST_P(CarriedLoads, SmallStacksStandOnASwayingDeck) {
  constexpr float size = 0.05f, fraction = 0.15f;  // of gravity; a stack of four tips at a quarter
  for (const float period : {0.2f, 0.5f, 2.0f}) {
    World world(quiet());
    const BodyId deck = world.add(kinematic({1, 1, 0.05f}, {0, 0, -0.05f}));
    const Stack stack(world, 4, size, {});
    const float omega = 2 * pi / period, amplitude = fraction * 9.81f / (omega * omega);
    run(world, 60);
    float way = 0;
    for (int i = 1; i <= 360; ++i) {
      const float time = static_cast<float>(i) / 60;
      way = min(time, 1.0f) * amplitude * std::sin(omega * time);
      world.move_to(deck, at({way, 0, -0.05f}));
      world.step();
    }
    EXPECT_LT(stack.off(world, {}, {way, 0, 0}), 0.02f) << period;
  }
}

// A stack that follows the tangent drifts outwards by (ω Δt)² / 2 of its radius in every step: here 10 mm/s.
TEST_P(CarriedLoads, SmallStacksStayOnATurntable) {
  constexpr float spin = 2, radius = 0.3f, size = 0.05f;
  for (const int count : {1, 2, 4}) {
    World world(quiet());
    const BodyId disc = world.add(kinematic({1, 1, 0.05f}, {0, 0, -0.05f}));
    world.set_velocity(disc, {}, {0, 0, spin});
    const Stack stack(world, count, size, {radius, 0, 0});
    for (const BodyId cube : stack.cubes) world.set_velocity(cube, {0, spin * radius, 0}, {0, 0, spin});
    run(world, 300);
    for (const BodyId cube : stack.cubes) {
      const Vec3 at = world.pose(cube).position;
      EXPECT_NEAR(std::hypot(at.x, at.y), radius, 2e-3f) << count;
    }
  }
}

// Nothing rides along that friction does not take along.
TEST_P(CarriedLoads, AStackOnASlipperyDeckGainsWhatFrictionGives) {
  constexpr float friction = 0.05f;
  World world(quiet());
  BodyDef deck_def = kinematic({5, 5, 0.05f}, {0, 0, -0.05f});
  deck_def.material.friction = 2 * friction * friction;  // the geometric mean with the cubes' 0.5 is `friction`
  const BodyId deck = world.add(deck_def);
  const Stack stack(world, 4, 0.05f, {});
  run(world, 60);
  for (int i = 1; i <= 60; ++i) {
    world.set_velocity(deck, {0.3f * 9.81f * static_cast<float>(i) / 60, 0, 0}, {});
    world.step();
  }
  for (const BodyId cube : stack.cubes)
    EXPECT_NEAR(world.velocity(cube).linear.x, friction * 9.81f, 0.05f * friction * 9.81f);
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
