// Round bodies that hang or rock gain no energy: forces act along the arms of the middle of the step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <utility>
#include <vector>

#include "world_variants.hpp"

namespace fathom::test::rocking_test {
namespace {

class Rocking : public testing::TestWithParam<Variant> {
 protected:
  WorldDef world_def() const { return quiet_world(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Variants, Rocking, testing::ValuesIn(all_variants),
                         [](const testing::TestParamInfo<Variant>& variant) {
                           return std::string(variant.param.name);
                         });

/// A capsule of this radius (m) between two points.
ChildShape bar(Vec3 from, Vec3 to, float radius) {
  const Vec3 up{0, 0, 1}, way = to - from, direction = normalize(way), turn = cross(up, direction);
  ChildShape child;
  child.shape = capsule(radius, 0.5f * length(way));
  child.pose.position = 0.5f * (from + to);
  const bool is_down = direction.z < -0.999f;
  child.pose.rotation = is_down ? Quat{0, 1, 0, 0} : normalize(Quat{1 + direction.z, turn.x, turn.y, turn.z});
  return child;
}

/// A ring of capsules in the plane y = 0, its wire 0.1 times its radius thick.
Shape ring(float radius) {
  constexpr int parts = 24;
  std::vector<ChildShape> children;
  const auto corner = [&](int i) {
    const float angle = 2 * pi * static_cast<float>(i) / parts;
    return Vec3{radius * std::cos(angle), 0, radius * std::sin(angle)};
  };
  for (int i = 0; i < parts; ++i) children.push_back(bar(corner(i), corner(i + 1), 0.1f * radius));
  return compound(children);
}

/// A ball of 0.5 · `size` whose weight is a small heavy ball at 0.15 · `size` below its centre.
Shape weighted_ball(float size) {
  ChildShape shell, weight;
  shell.shape = sphere(0.5f * size), shell.density = 0.01f;
  weight.shape = sphere(0.1f * size), weight.density = 100, weight.pose.position = {0, 0, -0.15f * size};
  return compound(std::vector{shell, weight});
}

/// J/kg.
float energy_of(const World& world, BodyId id) {
  return kinetic_energy(world, id) / world.mass(id) + 9.81f * world.pose(id).position.z;
}

/// The largest rise of a body's energy above that after half a second, within `seconds`, in units of what lifts it by
/// `size` (m).
float gain_of(World& world, BodyId id, float size, int seconds) {
  run(world, 30);
  const float begin = energy_of(world, id);
  float most = begin;
  for (int i = 0; i < 60 * seconds; ++i) world.step(), most = std::max(most, energy_of(world, id));
  return (most - begin) / (9.81f * size);
}

// It swung up by itself, and over the peg within a minute.
TEST_P(Rocking, ARingOnAPegSwingsNoHigher) {
  for (const auto& [size, friction] : {std::pair{1.0f, 0.0f}, {1.0f, 0.3f}, {1.0f, 1.0f}, {0.1f, 0.3f}, {0.1f, 1.0f}}) {
    World world(world_def());
    BodyDef peg{.motion = MotionType::fixed, .shape = capsule(0.02f * size, size)};
    peg.pose.rotation = axis_angle({1, 0, 0}, 0.5f * pi), peg.material.friction = friction;
    world.add(peg);
    const float down = (0.3f - 0.05f) * size, angle = 0.3f;
    BodyDef hung = dynamic(ring(0.3f * size), {down * std::sin(angle), 0, -down * std::cos(angle)});
    hung.pose.rotation = axis_angle({0, 1, 0}, -angle), hung.material.friction = friction;
    const BodyId id = world.add(hung);
    EXPECT_LT(gain_of(world, id, size, 20), 2e-3f) << size << " m, friction " << friction;
    EXPECT_LT(length(world.pose(id).position), 0.3f * size) << "off the peg";
  }
}

// It rocked ever farther, until it turned over.
TEST_P(Rocking, AWeightedBallRocksNoFarther) {
  for (const float size : {1.0f, 0.1f})
    for (const float friction : {0.0f, 1.0f}) {
      // The velocity bias of `impulse` gives small bodies energy of its own.
      if (GetParam().solver == Solver::impulse && size < 1) continue;
      World world(world_def());
      BodyDef plane = ground();
      plane.material.friction = friction;
      world.add(plane);
      const float angle = 0.3f, low = 0.148f * size;
      BodyDef ball =
          dynamic(weighted_ball(size), {-low * std::sin(angle), 0, 0.5f + 0.5f * size - low * std::cos(angle)});
      ball.pose.rotation = axis_angle({0, 1, 0}, angle), ball.material.friction = friction;
      const BodyId id = world.add(ball);
      EXPECT_LT(gain_of(world, id, size, 20), 1e-3f) << size << " m, friction " << friction;
    }
}

// Arms of balls do not turn: they roll on as before, whatever they roll on.
TEST_P(Rocking, ABallRollsOn) {
  WorldDef def = world_def();
  World world(def);
  BodyDef plank = dynamic(box({20, 1, 0.5f}), {0, 0, 1}, 2000);
  world.add(ground());
  world.add(plank);
  BodyDef ball = dynamic(sphere(0.25f), {-9, 0, 1.75f}, 2);
  ball.velocity = {{3, 0, 0}, 0, {0, 12, 0}, 0};
  const BodyId id = world.add(ball);
  run(world, 300);
  EXPECT_NEAR(world.velocity(id).linear.x, 3, 0.01f);
  EXPECT_NEAR(world.pose(id).position.x, 6, 0.05f);
}

// A ball has no core to hang on. By rounding it had one, and rolled along a rail faster and faster.
TEST_P(Rocking, ABallRollsAlongARailAtItsSpeed) {
  for (const float size : {0.2f, 1.0f}) {
    World world(world_def());
    BodyDef rail;
    rail.motion = MotionType::fixed, rail.shape = capsule(0.1f * size, 20 * size);
    rail.pose.rotation = axis_angle({0, 1, 0}, pi / 2);
    world.add(rail);
    BodyDef def = dynamic(sphere(0.5f * size), {-18 * size, 0, 0.6f * size});
    def.velocity.linear = {1.5f * size, 0, 0}, def.velocity.angular = {0, 3, 0};
    const BodyId ball = world.add(def);
    run(world, 180);
    EXPECT_NEAR(world.velocity(ball).linear.x, 1.5f * size, 0.01f * size);
  }
}

}  // namespace
}  // namespace fathom::test::rocking_test
