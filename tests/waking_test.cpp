// What falls asleep, and what wakes it.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::waking_test {
namespace {

using namespace test;

BodyDef kinematic(const Shape& shape, Vec3 position) {
  BodyDef def;
  def.motion = MotionType::kinematic;
  def.shape = shape;
  def.pose.position = position;
  return def;
}

}  // namespace

TEST(Waking, ALoadRisesWithItsLiftAfterAnyWait) {
  for (const bool adds : {false, true})
    for (const Vec3 speed : {Vec3{0, 0, 0.5f}, Vec3{0.5f, 0, 0}, Vec3{0, 0, -0.3f}, Vec3{0, 0, 0.01f}}) {
      World world(sleepy_world());
      world.add(ground());
      const BodyId lift = world.add(kinematic(box({2, 2, 0.1f}), {0, 0, 3}));
      const BodyId load = world.add(cube({0, 0, 3.6f})), top = world.add(cube({0, 0, 4.6f}));
      run(world, 120);
      EXPECT_FALSE(world.is_awake(load));
      if (adds)
        world.add_velocity(lift, speed, {});
      else
        world.set_velocity(lift, speed, {});
      run(world, 60);
      EXPECT_TRUE(world.is_awake(load));
      const Vec3 moved = world.pose(lift).position - Vec3{0, 0, 3};
      EXPECT_LT(length(world.pose(load).position - moved - Vec3{0, 0, 3.6f}), 0.02f) << speed.x << ' ' << speed.z;
      EXPECT_LT(length(world.pose(top).position - moved - Vec3{0, 0, 4.6f}), 0.03f) << speed.x << ' ' << speed.z;
    }
}

TEST(Waking, ATurntableTakesItsLoadAlong) {
  World world(sleepy_world());
  const BodyId table = world.add(kinematic(box({2, 2, 0.1f}), {0, 0, 3}));
  const BodyId load = world.add(cube({0, 0, 3.6f}));
  run(world, 120);
  ASSERT_FALSE(world.is_awake(load));
  world.set_velocity(table, {}, {0, 0, 1});
  run(world, 60);
  EXPECT_NEAR(world.velocity(load).angular.z, 1, 0.02f);
}

/// A net weight or drift so small that the speed is below `SleepSettings::linear_speed` for far longer than its time.
TEST(Waking, WhatNothingTouchesNeverStops) {
  for (const Shape& shape : {sphere(0.5f), box({0.5f, 0.5f, 0.5f})}) {
    WorldDef def = sleepy_world();
    def.gravity = {0, 0, -0.078f};
    World sinking(def);
    const BodyId sinker = sinking.add(dynamic(shape, {0, 0, 0}));
    run(sinking, 600);
    EXPECT_NEAR(sinking.pose(sinker).position.z, -3.9f, 0.02f);

    def.gravity = {};
    World drifting(def);
    BodyDef moving = dynamic(shape, {0, 0, 0});
    moving.velocity.linear = {0.04f, 0, 0};
    const BodyId drifter = drifting.add(moving);
    moving.velocity = {{}, 0, {0.02f, 0, 0}, 0};
    moving.pose.position = {0, 5, 0};
    const BodyId turning = drifting.add(moving);
    run(drifting, 600);
    EXPECT_NEAR(drifting.pose(drifter).position.x, 0.4f, 1e-3f);
    EXPECT_NEAR(drifting.velocity(turning).angular.x, 0.02f, 1e-5f);
  }
}

TEST(Waking, WhatDriftsTogetherNeverStops) {
  WorldDef def = sleepy_world();
  def.gravity = {};
  World world(def);
  std::vector<BodyId> ids;
  for (int i = 0; i < 3; ++i) {
    BodyDef one = cube({1.005f * static_cast<float>(i), 0, 0});
    one.velocity.linear = {0, 0.04f, 0};
    ids.push_back(world.add(one));
  }
  run(world, 600);
  for (const BodyId id : ids) EXPECT_NEAR(world.pose(id).position.y, 0.4f, 5e-3f);
}

/// Slow, and close enough to a fixed body to have a contact with it, but not carried by it.
TEST(Waking, WhatSinksAlongAWallNeverStops) {
  WorldDef def = sleepy_world();
  def.gravity = {0, 0, -0.02f};
  World world(def);
  BodyDef wall = ground();
  wall.shape = box({0.5f, 50, 50});
  world.add(wall);
  const BodyId id = world.add(cube({1.005f, 0, 0}));
  run(world, 600);
  EXPECT_NEAR(world.pose(id).position.z, -1, 0.02f);
}

TEST(Waking, WhatFloatsStillFallsAsleep) {
  WorldDef def = sleepy_world();
  def.gravity = {};
  World world(def);
  const BodyId alone = world.add(cube({0, 0, 0}));
  run(world, 60);
  EXPECT_FALSE(world.is_awake(alone));
}

TEST(Waking, WhatRestsFallsAsleep) {
  World world(sleepy_world());
  world.add(ground());
  std::vector<BodyId> ids;
  for (const Shape& shape : {box({0.5f, 0.5f, 0.5f}), sphere(0.5f), capsule(0.5f, 0.5f)})
    ids.push_back(world.add(dynamic(shape, {3.0f * static_cast<float>(ids.size()), 0, 1})));
  for (int i = 0; i < 4; ++i) ids.push_back(world.add(cube({-5, 0, 1.0f + static_cast<float>(i)})));
  run(world, 120);
  for (const BodyId id : ids) EXPECT_FALSE(world.is_awake(id)) << id.index;
}

/// Contacts push bodies out of each other by moving them, without a velocity that would outlast the step.
TEST(Waking, WhatIsPushedOutFallsAsleepOutside) {
  WorldDef def = sleepy_world();
  for (const float size : {0.02f, 0.5f, 5.0f})
    for (const float depth : {0.1f, 0.6f, 1.5f})  // relative to the size
      for (const Shape& shape :
           {sphere(size), capsule(size, size), box({size, size, size}), box({3 * size, 2 * size, size})})
        for (const bool floats : {false, true}) {
          SCOPED_TRACE(std::to_string(size) + " m, " + std::to_string(depth) + ", shape " +
                       std::to_string(static_cast<int>(shape.type)) + (floats ? ", floating" : ""));
          def.gravity = floats ? Vec3{} : Vec3{0, 0, -9.81f};
          World world(def);
          // Lying, so that being pushed out does not tip it over.
          const Quat turn = shape.type == ShapeType::capsule ? axis_angle({0, 1, 0}, 0.5f * 3.14159265f) : Quat{};
          BodyDef below = dynamic(shape, {0, 0, 0.5f + size}, 1000 * size * size * size);
          below.pose.rotation = turn;
          BodyDef above = below;
          above.pose.position.z += (2 - depth) * size;
          if (floats) {
            world.add(below);
          } else {
            BodyDef deep = ground();
            deep.shape = box({500, 500, 50});
            deep.pose.position.z = -49.5f;
            world.add(deep);
            above.pose.position.z = 0.5f + size - depth * size;
          }
          const BodyId id = world.add(above);
          int steps = 0;
          for (; steps < 1200 && world.is_awake(id); ++steps) world.step();
          // Floating bodies may keep a little drift.
          EXPECT_TRUE(floats || steps < 1200) << "it falls asleep";
          world.for_each_contact([&](const ContactInfo& c) {
            for (int p = 0; p < c.point_count; ++p) EXPECT_GT(c.points[p].separation, -0.05f * size - 1e-3f);
          });
        }
}

TEST(Waking, AnotherGravityWakesWhatItMoves) {
  World world(sleepy_world());
  world.add(ground());
  const BodyId a = world.add(cube({0, 0, 1})), b = world.add(cube({0, 0, 2}));
  BodyDef light = cube({5, 0, 1.5f});
  light.gravity_scale = 0;
  const BodyId weightless = world.add(light);
  run(world, 120);
  for (const BodyId id : {a, b, weightless}) ASSERT_FALSE(world.is_awake(id));
  world.set_gravity(world.gravity());
  EXPECT_FALSE(world.is_awake(a));
  world.set_gravity({0, 0, 2});
  EXPECT_TRUE(world.is_awake(a));
  run(world, 60);
  for (const BodyId id : {a, b}) EXPECT_GT(world.velocity(id).linear.z, 1.9f);
  EXPECT_FALSE(world.is_awake(weightless));
}

TEST(Waking, ASlipperyGroundWakesWhatItHeld) {
  WorldDef def = sleepy_world();
  def.gravity = {2, 0, -9.5f};
  World world(def);
  const BodyId floor = world.add(ground());
  const BodyId id = world.add(cube({0, 0, 1}));
  run(world, 120);
  ASSERT_FALSE(world.is_awake(id));
  world.set_material(floor, {.friction = 0, .friction_rule = CombineRule::minimum});
  run(world, 60);
  EXPECT_GT(world.velocity(id).linear.x, 1.5f);
}

TEST(Waking, AFixedBodyAddedOrMovedIntoSleepersWakesThem) {
  for (const bool moves : {false, true}) {
    World world(sleepy_world());
    world.add(ground());
    const BodyId id = world.add(cube({0, 0, 1})), far = world.add(cube({8, 0, 1}));
    BodyDef block;
    block.motion = MotionType::fixed;
    block.shape = box({0.5f, 0.5f, 0.5f});
    block.pose.position = {0, 20, 1};
    const BodyId moved = world.add(block);
    run(world, 120);
    ASSERT_FALSE(world.is_awake(id));
    block.pose.position = {0.8f, 0, 1};
    if (moves)
      world.set_pose(moved, block.pose);
    else
      world.add(block);
    world.step();
    EXPECT_TRUE(world.is_awake(id));
    EXPECT_FALSE(world.is_awake(far));
    run(world, 120);
    EXPECT_LT(world.pose(id).position.x, -0.15f);
  }
}

namespace {

/// A body that was quarantined in flight, and one that was later moved below it.
struct WithQuarantined {
  World world;
  BodyId below, above;

  explicit WithQuarantined(const WorldDef& def) : world(def) {
    world.add(ground());
    above = world.add(cube({0, 0, 3}));
    for (int i = 0; i < 2; ++i) world.apply_force(above, {3e38f, 0, 0});
    world.step();
    quarantined = world.quarantined().size();
    below = world.add(kinematic(box({0.5f, 0.5f, 0.5f}), {0, 0, 2}));
    run(world, 10);
  }
  std::size_t quarantined;
};

}  // namespace

TEST(Waking, WhatHappensToOthersFreesNoQuarantinedBody) {
  for (int what = 0; what < 6; ++what) {
    WithQuarantined scene(sleepy_world());
    World& world = scene.world;
    ASSERT_EQ(scene.quarantined, 1u);
    const Vec3 place = world.pose(scene.above).position;
    EXPECT_EQ(place, (Vec3{0, 0, 3}));
    if (what == 0) world.remove(scene.below);
    if (what == 1) world.set_pose(scene.below, {{5, 0, 10}, 0, {}});
    if (what == 2) world.set_material(scene.below, {.friction = 0.1f});
    if (what == 3) world.set_gravity({0, 0, -5});
    if (what == 4) world.set_filter(scene.below, {.category = 2});
    if (what == 5) world.set_velocity(scene.below, {0, 0, -1}, {});
    run(world, 60);
    EXPECT_EQ(world.pose(scene.above).position, place) << what;
    if (what > 1) continue;
    world.set_velocity(scene.above, {}, {});
    run(world, 60);
    EXPECT_LT(world.pose(scene.above).position.z, 1.1f);
  }
}

}  // namespace fathom::waking_test
