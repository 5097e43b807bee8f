// Tall columns, held by the direct solution of supports (dynamics/support.hpp), on every simulator.
#include <gtest/gtest.h>

#include <vector>

#include "world_fixture.hpp"

namespace fathom::test::columns_test {
namespace {

double energy(const World& world, const std::vector<BodyId>& ids) {
  double sum = 0;
  for (const BodyId id : ids) {
    const Velocity& v = world.velocity(id);
    const double mass = static_cast<double>(world.mass(id));
    const Vec3 spin = inverse_rotate(world.pose(id).rotation, v.angular);
    sum += 0.5 * mass * static_cast<double>(length_squared(v.linear)) +
           0.5 * static_cast<double>(dot(spin, world.mass_properties(id).inertia * spin)) +
           9.81 * mass * static_cast<double>(world.pose(id).position.z);
  }
  return sum;
}

struct Momentum {
  Vec3 linear, angular;  ///< about the origin
};
Momentum momentum(const World& world, const std::vector<BodyId>& ids) {
  Momentum sum;
  for (const BodyId id : ids) {
    const Velocity& v = world.velocity(id);
    const Quat q = world.pose(id).rotation;
    const Vec3 p = world.mass(id) * v.linear;
    sum.linear += p;
    sum.angular +=
        cross(world.pose(id).position, p) + rotate(q, world.mass_properties(id).inertia * inverse_rotate(q, v.angular));
  }
  return sum;
}

/// Cubes on the ground, with the storeys `gap` apart, each offset by `offset` from the one below.
std::vector<BodyId> add_column(World& world, int storeys, float gap, float offset) {
  std::vector<BodyId> ids;
  for (int i = 0; i < storeys; ++i) {
    const auto k = static_cast<float>(i);
    ids.push_back(world.add(cube({offset * k, 0, 1 + (1 + gap) * k})));
  }
  return ids;
}

TEST(Columns, OfThirtyStandStill) {
  World world(quiet_world());
  world.add(ground());
  const std::vector<BodyId> ids = add_column(world, 30, 0, 0);
  for (int i = 0; i < 900; ++i) world.step();
  const Vec3 top = world.pose(ids.back()).position;
  EXPECT_NEAR(top.x, 0, 1e-3f);
  EXPECT_NEAR(top.z, 30, 1e-3f);
  double ground_reaction = 0;
  world.for_each_contact([&](const ContactInfo& c) {
    if (c.b == ids.front() || c.a == ids.front())
      for (int p = 0; p < c.point_count; ++p)
        if (c.points[p].position.z < 0.6f) ground_reaction += static_cast<double>(c.points[p].impulse) * 60;
  });
  EXPECT_NEAR(ground_reaction, 30 * 9.81, 0.01 * 30 * 9.81);
}

constexpr float gaps[] = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.7f};

TEST(Columns, ThatFallIntoPlaceGainNoEnergy) {
  for (const float gap : gaps) {
    World world(quiet_world());
    world.add(ground());
    const std::vector<BodyId> ids = add_column(world, 24, gap, 0);
    const double start = energy(world, ids);
    for (int i = 0; i < 300; ++i) {
      world.step();
      ASSERT_LE(energy(world, ids), start * (1 + 1e-6)) << "step " << i << ", gaps of " << gap << " m";
    }
  }
}

// Taller ones may fall: every impact tilts the storeys above it a little more, whichever way it began.
TEST(Columns, OfSixteenThatFallIntoPlaceStand) {
  for (const float gap : gaps) {
    World world(quiet_world());
    world.add(ground());
    const std::vector<BodyId> ids = add_column(world, 16, gap, 0);
    for (int i = 0; i < 900; ++i) world.step();
    EXPECT_LT(world.pose(ids.back()).position.z, 16.1f) << "gaps of " << gap << " m";
    EXPECT_GT(world.pose(ids.back()).position.z, 15.9f) << "gaps of " << gap << " m";
  }
}

// A direct solution holds no more than contacts can: a column that leans too far topples.
TEST(Columns, LeanAsFarAsTheyMayAndNoFarther) {
  for (const float offset : {0.04f, 0.09f}) {
    World world(quiet_world());
    world.add(ground());
    const std::vector<BodyId> ids = add_column(world, 14, 0, offset);
    for (int i = 0; i < 600; ++i) world.step();
    if (13 * offset < 1)
      EXPECT_NEAR(world.pose(ids.back()).position.z, 14, 0.01f);
    else
      EXPECT_LT(world.pose(ids.back()).position.z, 10);
  }
}

TEST(Columns, ThatStandOnNothingFixedKeepTheirMomentum) {
  World world(quiet_world());
  std::vector<BodyId> ids{world.add(dynamic(box({2, 2, 0.25f}), {0, 0, 0.25f}, 20))};
  for (int i = 0; i < 20; ++i)
    ids.push_back(world.add(cube({0.002f * static_cast<float>(i), 0, 1 + static_cast<float>(i)})));
  const Vec3 force{3, 0, 2 * 40 * 9.81f};
  Momentum expected = momentum(world, ids);
  for (int i = 0; i < 120; ++i) {
    Vec3 torque;
    for (const BodyId id : ids) torque += cross(world.pose(id).position, world.mass(id) * Vec3{0, 0, -9.81f});
    torque += cross(world.pose(ids[0]).position, force);
    world.apply_force(ids[0], force);
    world.step();
    expected.linear += (1.0f / 60) * (force - Vec3{0, 0, 40 * 9.81f});
    expected.angular += (1.0f / 60) * torque;
  }
  const Momentum found = momentum(world, ids);
  EXPECT_LT(length(found.linear - expected.linear), 1e-3f * length(expected.linear));
  // The torque above is that at the start of the step.
  EXPECT_LT(length(found.angular - expected.angular), 0.02f * length(expected.linear));
  EXPECT_GT(world.velocity(ids.back()).linear.z, 15) << "the slab carries the column up";
}

// Many columns, which are held in groups of islands, and beside a pyramid that all threads share.
TEST(Columns, DoNotDependOnThreads) {
  for (const int layers : {0, 12}) {
    std::uint64_t expected = 0;
    for (const int threads : {1, 2, 5}) {
      WorldDef def = quiet_world(threads);
      World world(def);
      world.add(ground());
      for (int i = 0; i < 800; ++i) {
        const auto column = static_cast<float>(i / 16), storey = static_cast<float>(i % 16);
        world.add(cube({3 * column, 0.01f * static_cast<float>(i % 3), 1 + storey}));
        if (i % 64 != 0) continue;
        BodyDef ball = dynamic(sphere(0.4f), {3 * column, -3, 8}, 2);
        ball.velocity.linear = {0, 4, 2};
        world.add(ball);
      }
      for (int l = 0; l < layers; ++l)
        for (int i = 0; i < (layers - l) * (layers - l); ++i)
          world.add(cube({1.05f * (static_cast<float>(i % (layers - l)) + 0.5f * static_cast<float>(l)),
                          10 + 1.05f * (static_cast<float>(i / (layers - l)) + 0.5f * static_cast<float>(l)),
                          1 + static_cast<float>(l)}));
      for (int i = 0; i < 90; ++i) world.step();
      if (threads == 1) expected = world.state_hash();
      EXPECT_EQ(world.state_hash(), expected) << threads << " threads, " << layers << " layers";
    }
  }
}

TEST(Columns, ContinueBitForBitFromASnapshot) {
  const auto build = [](World& world) {
    world.add(ground());
    add_column(world, 20, 0, 0.005f);
    BodyDef ball = dynamic(sphere(0.5f), {-4, 0, 9}, 3);
    ball.velocity.linear = {5, 0, 1};
    world.add(ball);
  };
  World straight(quiet_world());
  build(straight);
  for (int i = 0; i < 30; ++i) straight.step();
  std::vector<std::byte> bytes;
  straight.save(bytes);
  World restored(quiet_world());
  restored.restore(bytes);
  for (int i = 0; i < 90; ++i) {
    straight.step();
    restored.step();
    ASSERT_EQ(straight.state_hash(), restored.state_hash()) << "step " << i;
  }
}

}  // namespace
}  // namespace fathom::test::columns_test
