// Trees of rigid joints are solved directly (dynamics/mechanism.hpp).
#include <gtest/gtest.h>

#include <cmath>

#include "joint_worlds.hpp"
#include "native/solver_kernels.hpp"
#include "random.hpp"

namespace fathom::test::mechanisms_test {
namespace {

constexpr JointWorlds native{"native", SimulatorKind::native}, device{"device", SimulatorKind::device};

// 1,000 kg on fifty links of 1 kg.
TEST(Mechanisms, AChainCarriesAThousandTimesItsLinks) {
  for (const JointWorlds& worlds : {native, device}) {
    World world(worlds.quiet());
    const Chain chain(world, add_anchor(world, {}), {}, {0, 0, -1}, 50);
    const BodyId weight = world.add(dynamic(sphere(0.2f), {0, 0, -25.2f}, 1000));
    world.add_joint(ball_joint(chain.links.back(), weight, {0, 0, 0.5f * Chain::length}, {0, 0, 0.2f}));
    run(world, 600);
    EXPECT_LT(widest_gap(world), 1e-5f) << worlds.name;
    EXPECT_NEAR(world.reaction(chain.joints[0]).force.z, 9.81f * 1050, 1) << worlds.name;
  }
}

// A double pendulum of small balls on long arms, released level: the balls' own inertia says nothing about how fast
// they swing.
TEST(Mechanisms, SmallBallsOnLongArmsKeepTheirEnergy) {
  for (const JointWorlds& worlds : {native, device}) {
    World world(worlds.quiet());
    BodyId before = add_anchor(world, {});
    for (int i = 0; i < 2; ++i) {
      const BodyId ball = world.add(dynamic(sphere(0.1f), {static_cast<float>(i + 1), 0, 0}, 1));
      world.set_filter(ball, {1, 0});
      world.add_joint(ball_joint(before, ball, {}, {-1, 0, 0}));
      before = ball;
    }
    const float fall = 3 * 9.81f;
    for (int i = 0; i < 1200; ++i) {
      world.step();
      ASSERT_LT(std::abs(energy(world)), 0.02f * fall) << worlds.name << " at step " << i;
    }
  }
}

// Chains of all lengths that swing with all loads gain no energy.
TEST(Mechanisms, GainNoEnergy) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    Generator random(seed);
    World world(native.quiet());
    const int count = 1 + static_cast<int>(random() % 12);
    const Chain chain(world, add_anchor(world, {}), {}, {1, 0, 0}, count);
    if (seed % 2) {
      const float x = Chain::length * static_cast<float>(count) + 0.1f;
      const BodyId weight = world.add(dynamic(sphere(0.1f), {x, 0, 0}, uniform(random, 1, 100)));
      world.set_filter(weight, {1, 0});
      world.add_joint(ball_joint(chain.links.back(), weight, {0, 0, 0.5f * Chain::length}, {-0.1f, 0, 0}));
    }
    for (const BodyId id : chain.links) world.set_filter(id, {1, 0});
    float weight = 0;
    for (const BodyId id : world.bodies()) weight += 9.81f * world.mass(id);
    const float scale = weight * Chain::length * static_cast<float>(count);
    for (int i = 0; i < 300; ++i) {
      world.step();
      ASSERT_LT(energy(world), 0.01f * scale) << seed << " at step " << i;
    }
  }
}

// Nets, trees, loops, springs and heaps at once: the same bits for every vector width and any number of threads.
TEST(Mechanisms, AreTheSameAtEveryWidthAndForAnyNumberOfThreads) {
  const auto hash = [](int threads) {
    Generator random(9);
    World world(native.sleepy(threads));
    world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({30, 30, 0.5f})});
    std::vector<BodyId> bodies;
    for (int i = 0; i < 600; ++i) {
      const Vec3 at{uniform(random, -6, 6), uniform(random, -6, 6), uniform(random, 0.5f, 8)};
      bodies.push_back(world.add(i % 2 ? dynamic(box({0.2f, 0.1f, 0.15f}), at, 1) : dynamic(sphere(0.2f), at, 2)));
    }
    for (int i = 0; i + 1 < 600; ++i) {
      if (i % 7 == 0) continue;
      JointDef joint = ball_joint(bodies[i], bodies[i + 1], {0.3f, 0, 0}, {-0.3f, 0, 0});
      joint.hertz = i % 11 == 0 ? 3.0f : 0.0f;
      world.add_joint(joint);
      if (i % 14 == 3) world.add_joint(ball_joint(bodies[i], bodies[i + 3], {0, 0.3f, 0}, {0, -0.3f, 0}));
    }
    run(world, 90);
    return world.state_hash();
  };
  const std::uint64_t expected = hash(1);
  for (const int threads : {2, 4}) EXPECT_EQ(hash(threads), expected) << threads;
  for (const char* name : {"AVX3", "AVX2", "single"}) {
    if (!native::select_kernels(name)) continue;
    EXPECT_EQ(hash(2), expected) << name;
    native::select_kernels(nullptr);
  }
}

TEST(Mechanisms, ALoopHolds) {
  World world(native.quiet());
  const BodyId top = add_anchor(world, {});
  std::vector<BodyId> ring;
  constexpr int count = 8;
  const float side = 0.5f, radius = 0.5f * side / std::tan(pi / count);
  for (int i = 0; i < count; ++i) {
    const float angle = 2 * pi * static_cast<float>(i) / count;
    BodyDef def =
        dynamic(box({0.5f * side, 0.05f, 0.05f}), {radius * std::sin(angle), 0, -radius + radius * std::cos(angle)}, 1);
    def.pose.rotation = axis_angle({0, 1, 0}, angle);
    ring.push_back(world.add(def));
  }
  for (int i = 0; i < count; ++i)
    world.add_joint(ball_joint(ring[i], ring[(i + 1) % count], {0.5f * side, 0, 0}, {-0.5f * side, 0, 0}));
  world.add_joint(ball_joint(top, ring[0], {}, {}));
  run(world, 600);
  EXPECT_LT(widest_gap(world), 1e-3f);
}

}  // namespace
}  // namespace fathom::test::mechanisms_test
