// Kinematic bodies bound islands, groups and domains as fixed bodies do: nothing about them depends on the threads.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::test::kinematic_boundaries_test {
namespace {

BodyDef kinematic(Vec3 half_extents, Vec3 position, Vec3 linear = {}, Vec3 angular = {}) {
  BodyDef def;
  def.motion = MotionType::kinematic;
  def.shape = box(half_extents);
  def.pose.position = position;
  def.velocity = {linear, 0, angular, 0};
  return def;
}

/// Twenty-four tables side by side that turn, rise, slide, move faster than bodies may, or stand still, with stacks of
/// two on each: so many islands that they are solved in groups.
class Tables {
 public:
  explicit Tables(World& world) : world_(world) {
    world.add(ground());
    for (int i = 0; i < 24; ++i) add_table(i);
  }

  void step(int number) {
    for (std::size_t i = 0; i < tables_.size(); ++i) {
      const BodyId id = tables_[i];
      if (i % 6 == 1 && number % 20 == 0) world_.set_velocity(id, {0, 0, number % 40 == 0 ? 0.6f : -0.6f}, {});
      if (i % 6 != 2) continue;
      Pose pose = world_.pose(id);
      pose.position.x += 0.01f;
      pose.rotation = axis_angle({0, 0, 1}, 0.01f * static_cast<float>(number)) * Quat{};
      world_.move_to(id, pose);
    }
    world_.step();
  }

 private:
  void add_table(int i) {
    const Vec3 middle{static_cast<float>(i % 6) * 12, static_cast<float>(i / 6) * 12, 2};
    const Vec3 linear[] = {{}, {0, 0, 0.6f}, {}, {0.8f, 0.3f, 0}, {0, 5, 0}, {}};
    const Vec3 angular[] = {{0, 0, 1.5f}, {}, {}, {0, 0, 0.4f}, {}, {}};
    tables_.push_back(world_.add(kinematic({4, 4, 0.2f}, middle, linear[i % 6], angular[i % 6])));
    for (int k = 0; k < 32; ++k) {
      const Vec3 place{1.3f * static_cast<float>(k % 4) - 2, 1.3f * static_cast<float>(k / 4 % 4) - 2,
                       0.71f + 1.01f * static_cast<float>(k / 16)};
      BodyDef body = k % 5 == 4 ? dynamic(sphere(0.5f), middle + place) : cube(middle + place);
      body.material.restitution = k % 7 == 6 ? 0.5f : 0.0f;
      const BodyId id = world_.add(body);
      if (k == 0) hang_from(tables_.back(), middle, id);
    }
  }

  /// A pendulum of two balls, a door, and a spring to a body of the stacks: solved directly and in sweeps.
  void hang_from(BodyId table, Vec3 middle, BodyId other) {
    const auto ball = [&](Vec3 at) { return world_.add(dynamic(sphere(0.2f), middle + at)); };
    const BodyId upper = ball({5, 0, 0}), lower = ball({5.6f, 0, 0}), door = ball({0, 5, 0});
    world_.add_joint(ball_joint(table, upper, {4.5f, 0, 0}, {-0.5f, 0, 0}));
    world_.add_joint(ball_joint(upper, lower, {0.3f, 0, 0}, {-0.3f, 0, 0}));
    world_.add_joint(revolute_joint(table, door, {{0, 4.5f, 0}, 0, {}}, {{0, -0.5f, 0}, 0, {}}));
    JointDef spring = generic_joint(table, other, {{-2, -2, 0.7f}, 0, {}}, {});
    for (JointAxis& axis : spring.axes) axis.mode = AxisMode::free;
    spring.axis(JointAxisName::x).drive_position(0.2f, 50, 5);
    world_.add_joint(spring);
  }

  World& world_;
  std::vector<BodyId> tables_;
};

std::uint64_t hash_of_tables(WorldDef def) {
  def.solver.max_linear_speed = 4;
  World world(def);
  Tables tables(world);
  for (int i = 0; i < 90; ++i) tables.step(i);
  EXPECT_TRUE(world.quarantined().empty());
  return world.state_hash();
}

TEST(KinematicBoundaries, ThreadsDoNotMatterToManyIslandsOnTables) {
  for (const bool soft : {true, false}) {
    WorldDef def = quiet_world(1);
    if (!soft) def.solver.method = Solver::impulse;
    const std::uint64_t expected = hash_of_tables(def);
    for (const int threads : {2, 4}) {
      def.threads = threads;
      EXPECT_EQ(hash_of_tables(def), expected) << threads << " threads, soft " << soft;
    }
  }
}

/// A pyramid that is solved in domains, on a floor that turns and rises, through which two ploughs are driven, each
/// with a ball on a joint. One body fails along the way.
struct LargeHeap {
  explicit LargeHeap(World& world) {
    world.add(kinematic({40, 40, 0.5f}, {}, {0.2f, 0, 0.3f}, {0, 0, 0.2f}));
    const BodyId ploughs[] = {world.add(kinematic({1, 1, 1}, {-14, 0, 2}, {9, 0, 0})),
                              world.add(kinematic({0.5f, 2, 1}, {3, 14, 2}, {0, -9, 0}, {0, 0, 3}))};
    for (const BodyId plough : ploughs) {
      const Vec3 at = world.pose(plough).position;
      const BodyId ball = world.add(dynamic(sphere(0.3f), at + Vec3{0, 0, 2}, 3));
      world.add_joint(ball_joint(plough, ball, {0, 0, 1.4f}, {0, 0, -0.6f}));
    }
    add_pyramid(world, 18);
    // Far away, so that it must not affect the domains.
    world.add(kinematic({1, 1, 1}, {3000, 0, 2}, {0, 1, 0}));
  }
};

TEST(KinematicBoundaries, ThreadsDoNotMatterToLargeHeapsOnMovingFloors) {
  const auto hash = [](WorldDef def) {
    World world(def);
    LargeHeap heap(world);
    for (int step = 0; step < 70; ++step) {
      if (step == 40) world.apply_force(world.bodies()[500], {std::numeric_limits<float>::max(), 0, 0});
      world.step();
      if (step == 20) {
        EXPECT_GT(world.profile().counts.manifolds, 7000u);
      }
    }
    return world.state_hash();
  };
  for (const bool soft : {true, false}) {
    WorldDef def = quiet_world(1);
    if (!soft) def.solver.method = Solver::impulse;
    const std::uint64_t expected = hash(def);
    for (const int threads : {2, 4}) {
      def.threads = threads;
      EXPECT_EQ(hash(def), expected) << threads << " threads, soft " << soft;
    }
  }
}

TEST(KinematicBoundaries, AFloorCarriesALargeHeapAlong) {
  World world(quiet_world(2));
  const BodyId floor = world.add(kinematic({40, 40, 0.5f}, {}, {0.5f, 0, 0}));
  add_pyramid(world, 18);
  std::vector<Vec3> start;
  for (const BodyId id : world.bodies()) start.push_back(world.pose(id).position);
  run(world, 180);
  const Vec3 moved = world.pose(floor).position;
  EXPECT_NEAR(moved.x, 1.5f, 1e-3f);
  std::size_t i = 0;
  float worst = 0;
  for (const BodyId id : world.bodies())
    worst = std::max(worst, length(world.pose(id).position - start[i++] - Vec3{moved.x, 0, 0}));
  EXPECT_LT(worst, 0.12f);
}

TEST(KinematicBoundaries, TwoPilesOnOneTableAreTwoIslands) {
  World world(sleepy_world());
  const BodyId table = world.add(kinematic({8, 2, 0.1f}, {0, 0, 3}));
  const BodyId left = world.add(cube({-5, 0, 3.6f})), right = world.add(cube({5, 0, 3.6f}));
  world.add(cube({-5, 0, 4.6f})), world.add(cube({5, 0, 4.6f}));
  run(world, 120);
  EXPECT_FALSE(world.is_awake(left) || world.is_awake(right));
  world.apply_impulse(left, {0, 1, 0});
  run(world, 5);
  EXPECT_TRUE(world.is_awake(left));
  EXPECT_FALSE(world.is_awake(right));
  world.set_velocity(table, {0, 0, 0.5f}, {});
  run(world, 120);
  EXPECT_TRUE(world.is_awake(left) && world.is_awake(right));
  world.set_velocity(table, {}, {});
  run(world, 150);
  EXPECT_FALSE(world.is_awake(left) || world.is_awake(right));
}

TEST(KinematicBoundaries, SleepOnLiftsDoesNotDependOnThreads) {
  const auto hash = [](int threads) {
    World world(sleepy_world(threads));
    std::vector<BodyId> lifts, loads;
    for (int i = 0; i < 200; ++i) {
      const Vec3 at{4 * static_cast<float>(i % 20), 4 * static_cast<float>(i / 20), 0};
      lifts.push_back(world.add(kinematic({1.5f, 1.5f, 0.2f}, at)));
      for (int k = 0; k < 2; ++k)
        loads.push_back(world.add(cube(at + Vec3{0, 0, 0.71f + 1.01f * static_cast<float>(k)})));
    }
    for (int step = 0; step < 330; ++step) {
      for (std::size_t i = 0; i < lifts.size(); ++i) {
        if (step == 100 && i % 3 == 0) world.set_velocity(lifts[i], {0, 0, 0.4f}, {0, 0, 0.2f});
        if (step == 160) world.set_velocity(lifts[i], {}, {});
      }
      world.step();
      if (step == 99 || step == 329) {
        for (const BodyId id : loads) EXPECT_FALSE(world.is_awake(id)) << step;
      }
      if (step == 150) {
        for (std::size_t i = 0; i < loads.size(); ++i) EXPECT_EQ(world.is_awake(loads[i]), i / 2 % 3 == 0);
      }
    }
    return world.state_hash();
  };
  const std::uint64_t expected = hash(1);
  for (const int threads : {2, 4}) EXPECT_EQ(hash(threads), expected) << threads;
}

}  // namespace
}  // namespace fathom::test::kinematic_boundaries_test
