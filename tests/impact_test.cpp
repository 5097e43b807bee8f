// Impacts on native and device: whatever part of a step they fall into, and what momentum is left of a hit.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "dynamics/overload.hpp"
#include "simulator_fixture.hpp"
#include "test_surfaces.hpp"

namespace fathom::test::impact_test {
namespace {

class Impact : public OnSimulator {};
INSTANTIATE_TEST_SUITE_P(Simulators, Impact, testing::Values(SimulatorKind::native, SimulatorKind::device),
                         simulator_name);

// An impact so late in a step that the body does not get deep within it has no contact before the next step. A body
// that was held back at the triangle had lost its velocity by then: one fall in twenty ended without a rebound.
TEST_P(Impact, ReboundsFromTrianglesWhereverInAStepItFalls) {
  for (const float size : {0.002f, 0.04f, 0.3f})
    for (const Shape& shape : {sphere(size), box({size, size, size})})
      for (int phase = 0; phase < 50; ++phase) {
        World world(world_def());
        world.add(fixed_body(flat_mesh(2, 10), {}, 0));
        BodyDef falling;
        falling.shape = shape;
        falling.pose.position = {1.1f, 0.3f, size + 0.5f + 0.002f * static_cast<float>(phase)};
        falling.material.friction = 0, falling.material.restitution = 0.8f;
        const BodyId body = world.add(falling);
        const float fall = falling.pose.position.z - size;
        float highest = 0;
        for (int i = 0; i < 60; ++i) {
          world.step();
          if (world.velocity(body).linear.z > 0) highest = max(highest, world.pose(body).position.z - size);
        }
        EXPECT_GT(highest, 0.9f * 0.64f * fall) << "size " << size << ", phase " << phase;
      }
}

/// A column of cubes of this edge (m) that stands on smooth ground, after a second.
std::vector<BodyId> column_on_ice(World& world, int cubes, float edge) {
  world.add(fixed_body(box({100 * edge, 100 * edge, edge}), {0, 0, -edge}, 0));
  std::vector<BodyId> column;
  for (int i = 0; i < cubes; ++i) {
    const float half = 0.5f * edge;
    column.push_back(world.add(dynamic(box({half, half, half}), {0, 0, half + static_cast<float>(i) * edge})));
  }
  run(world, 60);
  return column;
}
/// Mean velocity of bodies of equal mass along x (m/s).
float mean_speed(const World& world, const std::vector<BodyId>& bodies) {
  float sum = 0;
  for (const BodyId body : bodies) sum += world.velocity(body).linear.x;
  return sum / static_cast<float>(bodies.size());
}

// Inertia that loads add swallowed three fifths of the momentum of a hit on four cubes of 3 cm, and slowed four dice of
// 2 cm down to half their acceleration.
TEST_P(Impact, ASmallColumnKeepsTheMomentumOfAHit) {
  for (const auto& [cubes, edge, share] : {std::tuple{4, 0.03f, 0.75f}, {8, 0.1f, 0.88f}}) {
    World world(world_def());
    std::vector<BodyId> bodies = column_on_ice(world, cubes, edge);
    const float speed = 2 * std::sqrt(9.81f * edge);
    BodyDef ball = dynamic(sphere(0.4f * edge), {-1.5f * edge, 0, 0.5f * edge});
    ball.velocity.linear = {speed, 0, 0};
    bodies.push_back(world.add(ball));
    run(world, 60);
    EXPECT_GT(mean_speed(world, bodies) * static_cast<float>(bodies.size()), share * speed) << edge << " m";
  }
}

// Ten cubes stand, and the inertia that their load adds gives the momentum that it takes up back a sixth of a second
// later, so they fall no further behind.
TEST_P(Impact, ASmallColumnSlidesDownASlopeAsFastAsOneCube) {
  const float in_half_a_second = 0.5f * 9.81f * std::sin(0.1f);
  for (const auto& [cubes, behind] : {std::pair{1, 0.06f}, {4, 0.06f}, {10, 0.25f}}) {
    World world(world_def());
    const std::vector<BodyId> column = column_on_ice(world, cubes, 0.02f);
    EXPECT_NEAR(world.pose(column.back()).position.z, 0.02f * (static_cast<float>(cubes) - 0.5f), 0.005f);
    world.set_gravity({9.81f * std::sin(0.1f), 0, -9.81f * std::cos(0.1f)});
    run(world, 30);
    const float speed = mean_speed(world, column);
    EXPECT_NEAR(speed, in_half_a_second, behind) << cubes << " cubes";
    run(world, 30);
    EXPECT_GT(mean_speed(world, column) - speed, in_half_a_second - 0.06f) << cubes << " cubes";
  }
}

// Momentum that added inertia takes up comes back whole, unless the inertia goes while much is owed.
TEST(OwedMomentum, ComesBack) {
  OwedMomentum owed;
  const float scale = 5;
  Velocity v;
  Velocity before = v;
  v.linear.x += 0.2f / scale, v.angular.z += 0.3f / scale;  // an impulse that would give 0.2 m/s and 0.3 rad/s
  for (int step = 0; step < 400; ++step) {
    owed.take(scale, v.linear - before.linear, v.angular - before.angular, {0, 0, 1});
    before = v;
    const Velocity given = owed.give(scale, 0.1f, 0.16f);
    v.linear += given.linear, v.angular += given.angular;
  }
  EXPECT_NEAR(v.linear.x, 0.2f, 1e-3f);
  EXPECT_NEAR(v.angular.z, 0.3f, 1e-3f);
}

TEST(OwedMomentum, IsNoneOfTheLoad) {
  OwedMomentum owed;
  owed.take(5, {0, 0, 1}, {1, 1, 0}, {0, 0, 1});
  EXPECT_FALSE(owed.any());
}

TEST(OwedMomentum, MovesNobodyFasterThanAFall) {
  OwedMomentum owed;
  owed.take(1000, {0.5f, 0, 0}, {0, 0, 2}, {0, 0, 1});
  const Velocity given = owed.give(1, 0.1f, 0.16f);
  EXPECT_NEAR(length(given.linear), 0.16f, 1e-5f);
  EXPECT_NEAR(length(given.angular), 1.6f, 1e-5f);
  EXPECT_FALSE(owed.any());
}

}  // namespace
}  // namespace fathom::test::impact_test
