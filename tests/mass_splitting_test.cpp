// Bodies with more contacts or joints than there are colours: on the device their overflow acts at once
// (device/mass_splitting.hpp), on its host back end or on FATHOM_TEST_DEVICE.
#include "device/mass_splitting.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fathom/joint.hpp"
#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::mass_splitting_test {
namespace {

WorldDef on_device(WorldDef def) {
  def.simulator = SimulatorKind::device;
  def.device = test::test_device();
  return def;
}

/// The largest overflow of these steps.
std::uint32_t max_overflow(World& world, int steps) {
  std::uint32_t overflow = 0;
  for (int step = 0; step < steps; ++step) {
    world.step();
    overflow = std::max(overflow, world.profile().counts.overflow);
  }
  return overflow;
}

BodyDef fixed(const Shape& shape, Vec3 position) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = shape;
  def.pose.position = position;
  return def;
}

/// One body in the solver, with room for its parts.
struct Parts {
  device::SolverQuads solver{SolverBody{}};
  device::SplitBody split{};
  device::Bodies<device::body_solver> bodies{};
  device::MassSplitting<device::Bodies<device::body_solver>> splitting{bodies};

  Parts() { bodies.solver = &solver, bodies.split = &split; }
};

TEST(MassSplitting, BodiesTakeTheMeanOfTheirPartsInAnyOrder) {
  test::Generator random(5);
  std::vector<Vec3> velocities(1000);
  for (Vec3& v : velocities) v = test::uniform(random, 0, 100) * test::on_sphere(random);
  Vec3 mean;
  for (const Vec3 v : velocities) mean += (1.0f / 1000) * v;
  const auto merged = [&] {
    Parts parts;
    const Vec3 before{3, -2, 1};
    parts.solver.linear = device::quad(before, 7), parts.solver.angular = device::quad(Vec3{}, 7);
    for (std::size_t k = 0; k < velocities.size(); ++k) parts.splitting.count(0);
    EXPECT_EQ(parts.splitting.parts(0), 1000.0f);
    for (const Vec3 v : velocities) parts.splitting.add(0, before + v, 0.5f * v);
    EXPECT_EQ(parts.solver.linear.xyz(), before);
    parts.splitting.merge(0);
    EXPECT_EQ(parts.splitting.parts(0), 1.0f);
    EXPECT_EQ(parts.solver.linear.w, 7.0f);
    EXPECT_LT(length(parts.solver.linear.xyz() - (before + mean)), 1e-4f);
    EXPECT_LT(length(parts.solver.angular.xyz() - 0.5f * mean), 1e-4f);
    parts.splitting.merge(0);  // nothing is left
    return parts.solver;
  };
  const device::SolverQuads in_order = merged();
  std::reverse(velocities.begin(), velocities.end());
  const device::SolverQuads reversed = merged();
  EXPECT_EQ(in_order.linear.xyz(), reversed.linear.xyz());
  EXPECT_EQ(in_order.angular.xyz(), reversed.angular.xyz());
}

TEST(MassSplitting, UncountedPartsAddUp) {
  Parts parts;
  for (int k = 0; k < 3; ++k) parts.splitting.add(0, {1, 0, 0}, {0, 0, -2});
  parts.splitting.merge(0);
  EXPECT_EQ(parts.solver.linear.xyz(), (Vec3{3, 0, 0}));
  EXPECT_EQ(parts.solver.angular.xyz(), (Vec3{0, 0, -6}));
}

/// A rock with 625 grains on it, of which it can have colours for 120. Returns the grains; the rock is body 0.
std::vector<BodyId> add_rock_and_grains(World& world, float gap) {
  world.add(test::dynamic(box({2.5f, 2.5f, 1}), {0, 0, 1.5f}, 60'000));
  test::Generator random(11);
  std::vector<BodyId> grains;
  for (int i = 0; i < 25; ++i)
    for (int j = 0; j < 25; ++j) {
      const float x = 0.19f * static_cast<float>(i - 12), y = 0.19f * static_cast<float>(j - 12);
      const float z = 2.58f + test::uniform(random, 0, gap);
      grains.push_back(world.add(test::dynamic(box({0.08f, 0.08f, 0.08f}), {x, y, z}, 4)));
    }
  return grains;
}

TEST(MassSplitting, GrainsComeToRestOnARock) {
  World world(on_device(test::sleepy_world()));
  world.add(test::ground());
  const std::vector<BodyId> grains = add_rock_and_grains(world, 0.3f);
  EXPECT_GT(max_overflow(world, 240), 400u);
  EXPECT_EQ(world.profile().counts.active, 0u);
  for (const BodyId id : grains) EXPECT_NEAR(world.pose(id).position.z, 2.58f, 2e-3f);
}

TEST(MassSplitting, KeepsMomentum) {
  WorldDef def = on_device(test::quiet_world());
  def.gravity = {};
  World world(def);
  const std::vector<BodyId> grains = add_rock_and_grains(world, 0.3f);
  for (const BodyId id : grains) world.set_velocity(id, {1, 0, -5}, {});
  EXPECT_GT(max_overflow(world, 30), 100u);
  Vec3 sum;
  for (const BodyId id : world.bodies()) sum += world.mass(id) * world.velocity(id).linear;
  const float whole = 4 * 625;
  EXPECT_NEAR(sum.x, whole, 1e-4f * whole);
  EXPECT_NEAR(sum.y, 0, 1e-4f * whole);
  EXPECT_NEAR(sum.z, -5 * whole, 5e-4f * whole);
}

TEST(MassSplitting, IsTheSameForAnyNumberOfThreadsAndAfterASnapshot) {
  const auto run = [](int threads, bool restores) {
    World world(on_device(test::quiet_world(threads)));
    world.add(test::ground());
    add_rock_and_grains(world, 0.1f);
    test::run(world, 20);
    EXPECT_GT(world.profile().counts.overflow, 100u);
    if (restores) world.restore(test::saved(world));
    test::run(world, 20);
    return world.state_hash();
  };
  const std::uint64_t hash = run(1, false);
  EXPECT_EQ(run(2, false), hash);
  EXPECT_EQ(run(4, false), hash);
  EXPECT_EQ(run(1, true), hash);
}

// Most of the plate's contacts are near misses. If each had a part of the plate, the few that carry it would push a
// plate that is too light, and it would rock forever.
TEST(MassSplitting, APlateOnManyBumpsComesToRest) {
  World world(on_device(test::sleepy_world()));
  test::Generator random(3);
  for (int i = -6; i <= 6; ++i)
    for (int j = -6; j <= 6; ++j)
      world.add(fixed(sphere(0.3f), {static_cast<float>(i), static_cast<float>(j), test::uniform(random, -0.02f, 0)}));
  const BodyId plate = world.add(test::dynamic(box({5, 5, 0.1f}), {0, 0, 0.5f}, 20'000));
  for (int k = 0; k < 30; ++k) {
    const auto half = [&] { return test::uniform(random, 0.1f, 0.5f); };
    const auto place = [&] { return test::uniform(random, -4, 4); };
    world.add(test::dynamic(box({half(), half(), half()}), {place(), place(), test::uniform(random, 1.2f, 4)}, 500));
  }
  EXPECT_GT(max_overflow(world, 600), 100u);
  EXPECT_EQ(world.profile().counts.active, 0u);
  EXPECT_NEAR(world.pose(plate).position.z, 0.4f, 5e-3f);
}

TEST(MassSplitting, HoldsMoreJointsThanThereAreColours) {
  World world(on_device(test::quiet_world()));
  const BodyId hub = world.add(test::dynamic(box({2, 2, 0.3f}), {0, 0, 4}, 5000));
  const BodyId post = world.add(fixed(sphere(0.1f), {0, 0, 5}));
  world.add_joint(fixed_joint(post, hub, {}, {.position = {0, 0, 1}}));
  std::vector<BodyId> weights;
  for (int k = 0; k < 200; ++k) {
    const float angle = 0.0314159f * static_cast<float>(k);
    const Vec3 at{1.9f * std::cos(angle), 1.9f * std::sin(angle), -0.3f};
    weights.push_back(world.add(test::dynamic(sphere(0.01f), at + Vec3{0, 0, 3.8f}, 2)));
    world.add_joint(ball_joint(hub, weights.back(), at, {0, 0, 0.2f}));
  }
  test::run(world, 120);
  EXPECT_GT(world.profile().counts.overflow, 100u);
  for (const BodyId id : weights) EXPECT_NEAR(world.pose(id).position.z, 3.5f, 2e-3f);
}

}  // namespace
}  // namespace fathom::mass_splitting_test
