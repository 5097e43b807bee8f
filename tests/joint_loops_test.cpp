// Random mechanisms with loops of joints, which are solved directly (dynamics/loop_closure.hpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dynamics/loop_closure.hpp"
#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::joint_loops_test {
namespace {

class JointLoops : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, JointLoops, testing::ValuesIn(joint_worlds), joint_world_name);

Pose frame(const World& world, BodyId body, Vec3 at, Quat rotation) {
  const Pose& pose = world.pose(body);
  return {inverse_rotate(pose.rotation, at - pose.position), 0, conjugate(pose.rotation) * rotation};
}

/// 3 to 16 boxes with balls, hinges and welds between them, some hanging, and up to four extra joints.
void add_mechanism(World& world, Generator& random, Filter filter, bool may_hang) {
  const auto number = [&](float from, float to) { return uniform(random, from, to); };
  const unsigned count = 3 + static_cast<unsigned>(random()) % 14;
  const float ratio = random() % 2 ? 3.0f : 30.0f;
  std::vector<BodyId> bodies;
  for (std::uint32_t i = 0; i < count; ++i) {
    BodyDef body;
    body.pose.position = {0, 0, 8};
    if (i > 0)
      body.pose.position = world.pose(bodies[random() % i]).position +
                           Vec3{number(-0.6f, 0.6f), number(-0.6f, 0.6f), number(-0.6f, 0.6f)};
    body.pose.rotation = any_rotation(random);
    body.shape = box({number(0.05f, 0.3f), number(0.05f, 0.3f), number(0.05f, 0.3f)});
    body.mass = std::pow(ratio, number(0, 1)), body.filter = filter;
    body.velocity.angular = {number(-5, 5), number(-5, 5), number(-5, 5)};
    bodies.push_back(world.add(body));
  }
  const auto join = [&](BodyId a, BodyId b, std::size_t type) {
    const Vec3 at = 0.5f * (world.pose(a).position + world.pose(b).position);
    const Quat axes = any_rotation(random);
    const Pose on_a = frame(world, a, at, axes), on_b = frame(world, b, at, axes);
    world.add_joint(type == 0   ? ball_joint(a, b, on_a.position, on_b.position)
                    : type == 1 ? revolute_joint(a, b, on_a, on_b)
                                : fixed_joint(a, b, on_a, on_b));
  };
  if (random() % 2 && may_hang) world.add_joint(ball_joint(add_anchor(world, {0, 0, 8}), bodies[0], {}, {}));
  for (std::uint32_t i = 1; i < count; ++i) join(bodies[i], bodies[random() % i], random() % 3);
  for (auto loops = 1 + random() % 4; loops > 0; --loops) {
    const BodyId a = bodies[random() % count], b = bodies[random() % count];
    if (a != b) join(a, b, random() % 2);
  }
}

TEST_P(JointLoops, KeepTogetherAndGainNoEnergy) {
  for (unsigned seed = 1; seed <= 25; ++seed) {
    World world(GetParam().quiet());
    Generator random(seed);
    add_mechanism(world, random, {1, 0}, true);
    world.step();
    float mass = 0, widest = 0;
    for (const BodyId id : world.bodies()) mass += world.motion(id) == MotionType::dynamic ? world.mass(id) : 0;
    const float before = energy(world);
    float most = before;
    for (int step = 0; step < 300; ++step) {
      world.step();
      most = std::max(most, energy(world));
      // Spins that joints do not allow have ended by the tenth step.
      if (step > 10) widest = std::max(widest, widest_gap(world));
    }
    EXPECT_LT(most - before, 0.02f * 9.81f * 8 * mass) << "seed " << seed;
    EXPECT_LT(widest, 0.02f) << "seed " << seed;
  }
}

// Impulses that nothing in a loop responds to must not be applied again and again, as after hits on directly solved
// loops.
TEST_P(JointLoops, OnTheGroundGainNoEnergy) {
  for (unsigned seed = 1; seed <= 25; ++seed) {
    World world(GetParam().quiet());
    world.add(ground());
    Generator random(seed);
    add_mechanism(world, random, {2, 1}, false);
    float mass = 0;
    for (const BodyId id : world.bodies()) mass += world.motion(id) == MotionType::dynamic ? world.mass(id) : 0;
    world.step();
    const float before = energy(world);
    float most = before;
    for (int step = 0; step < 600; ++step) world.step(), most = std::max(most, energy(world));
    EXPECT_LT(most - before, 0.02f * 9.81f * 8 * mass) << "seed " << seed;
  }
}

// More than eight loops are left to sweeps, and none of their joints is forgotten.
TEST_P(JointLoops, ANetHangsTogether) {
  World world(GetParam().quiet());
  constexpr int side = 6;
  std::vector<BodyId> knots;
  for (int i = 0; i < side * side; ++i) {
    const Vec3 at{0.3f * static_cast<float>(i % side), 0.3f * static_cast<float>(i / side), 8};
    knots.push_back(world.add(dynamic(sphere(0.05f), at, 1)));
    if (i % side > 0) world.add_joint(ball_joint(knots.back(), knots[knots.size() - 2], {-0.15f, 0, 0}, {0.15f, 0, 0}));
    if (i >= side)
      world.add_joint(ball_joint(knots.back(), knots[knots.size() - 1 - side], {0, -0.15f, 0}, {0, 0.15f, 0}));
  }
  world.add_joint(ball_joint(add_anchor(world, {0, 0, 8}), knots.front(), {}, {}));
  run(world, 600);
  EXPECT_LT(widest_gap(world), 0.1f);
}

constexpr std::uint32_t closures = 3, rows = closure_rows * closures;
using Rows = std::array<double, rows>;

/// By Gaussian elimination.
Rows solved(std::array<Rows, rows> a, Rows x) {
  for (std::uint32_t k = 0; k < rows; ++k)
    for (std::uint32_t i = 0; i < rows; ++i) {
      if (i == k) continue;
      const double share = a[i][k] / a[k][k];
      for (std::uint32_t j = k; j < rows; ++j) a[i][j] -= share * a[k][j];
      x[i] -= share * x[k];
    }
  for (std::uint32_t i = 0; i < rows; ++i) x[i] /= a[i][i];
  return x;
}

// Some of the responses are zero, so that only softness regularises them.
TEST(LoopClosure, SolvesItsRows) {
  constexpr float softness = 0.01f;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Generator random(seed);
    const auto rank = 4 + random() % (rows - 3);
    std::vector<float> memory(LoopClosure::size(closures));
    const LoopClosure closure(memory.data(), closures);
    std::array<Rows, rows> factor{}, softened{};
    for (Rows& row : factor)
      for (double& x : row) x = static_cast<double>(uniform(random, -0.5f, 0.5f));
    Rows wanted{}, yields{};
    for (std::uint32_t i = 0; i < rows; ++i) {
      closure.softness(i) = softness, closure.more(i) = 0;
      closure.total(i) = uniform(random, 0, 1), closure.error(i) = uniform(random, -0.5f, 0.5f);
      for (std::uint32_t j = 0; j < rows; ++j)
        for (std::uint32_t k = 0; k < rank; ++k) softened[i][j] += factor[i][k] * factor[j][k];
      softened[i][i] += static_cast<double>(softness);
      for (std::uint32_t j = 0; j <= i; ++j) closure.response(i, j) = static_cast<float>(softened[i][j]);
      yields[i] = static_cast<double>(softness * closure.total(i));
      wanted[i] = -static_cast<double>(closure.error(i));
    }
    for (int pass = 0; pass < yielding_passes; ++pass) {
      yields = solved(softened, yields);
      for (double& yield : yields) yield *= static_cast<double>(softness);
    }
    for (std::uint32_t i = 0; i < rows; ++i) wanted[i] -= yields[i];
    wanted = solved(softened, wanted);
    closure.factorise();
    closure.solve();
    for (std::uint32_t i = 0; i < rows; ++i)
      EXPECT_NEAR(closure.more(i), wanted[i], 2e-3 * (1 + std::abs(wanted[i]))) << seed;
  }
}

}  // namespace
}  // namespace fathom::test::joint_loops_test
