// Motions that textbooks of mechanics solve exactly, for all suitable shapes, on every simulator.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "random.hpp"
#include "shape_fixture.hpp"
#include "world_fixture.hpp"

namespace fathom::closed_forms_test {
namespace {

using namespace test;

constexpr double g = 9.81;
constexpr float half_pi = std::numbers::pi_v<float> / 2;

WorldDef steps_of(float dt) {
  WorldDef def = quiet_world();
  def.dt = dt;
  return def;
}

/// A box whose upper face is z = 0.
BodyDef floor_with(Material material) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({200, 200, 1});
  def.pose.position = {0, 0, -1};
  def.material = material;
  return def;
}

BodyDef with_friction(BodyDef def, float friction, float restitution = 0) {
  def.material = {friction, restitution};
  return def;
}

/// A thin rod along its x axis or, for a capsule, along z.
struct Rod {
  Shape shape;
  Quat along_x;
};
std::vector<Rod> rods(float half_length, float radius) {
  const Vec3 half{half_length, radius, radius};
  return {
      {box(half), {}}, {box_hull(half), {}}, {capsule(radius, half_length - radius), axis_angle({0, 1, 0}, half_pi)}};
}

double expect_share(double value, double expected, double share) {
  EXPECT_NEAR(value, expected, share * std::abs(expected));
  return value;
}

}  // namespace

// It circles at 2/7 of the table's rate, wherever it is and however fast (Weckesser, "A ball rolling on a freely
// spinning turntable", American Journal of Physics 65, 1997).
TEST(ClosedForms, ABallOnATurntableCircles) {
  for (const float rate : {1.0f, 3.0f, 8.0f}) {
    World world(quiet_world());
    BodyDef table = with_friction(floor_with({}), 2);
    table.motion = MotionType::kinematic;
    table.velocity.angular = {0, 0, rate};
    world.add(table);
    constexpr float r = 0.5f, v = 0.7f;
    BodyDef ball = with_friction(dynamic(sphere(r), {2, 0, r}), 2);
    ball.velocity.linear = {0, v, 0};
    ball.velocity.angular = {(2 * rate - v) / r, 0, 0};
    const BodyId id = world.add(ball);
    const int steps = static_cast<int>(360 / std::max(rate, 1.0f));
    float turned = 0;
    for (int i = 0; i < steps; ++i) {
      const Vec3 before = world.velocity(id).linear;
      world.step();
      const Vec3 after = world.velocity(id).linear;
      turned += std::atan2(cross(before, after).z, dot(before, after));
    }
    expect_share(static_cast<double>(60 * turned) / steps, 2.0 / 7 * static_cast<double>(rate), 0.01);
    expect_share(static_cast<double>(length(world.velocity(id).linear)), 0.7, 0.01);
  }
}

TEST(ClosedForms, ASpinningBallEndsRolling) {
  for (const float spin : {5.0f, -20.0f, 60.0f}) {
    World world(quiet_world());
    world.add(floor_with({0.3f, 0}));
    BodyDef ball = with_friction(dynamic(sphere(0.3f), {0, 0, 0.3f}, 2), 0.3f);
    ball.velocity = {{3, 0, 0}, 0, {0, spin, 0}, 0};
    const BodyId id = world.add(ball);
    run(world, 600);
    EXPECT_NEAR(world.velocity(id).linear.x, (5 * 3 + 2 * 0.3f * spin) / 7, 1e-3f) << spin;
  }
}

TEST(ClosedForms, BallsAndCapsulesRollDownSlopes) {
  constexpr float slope = 0.35f, r = 0.4f;
  const Quat turn = axis_angle({0, 1, 0}, slope);
  for (const bool is_ball : {true, false}) {
    World world(quiet_world());
    BodyDef plane = floor_with({0.9f, 0});
    plane.pose = {rotate(turn, {0, 0, -1}), 0, turn};
    world.add(plane);
    BodyDef roller = with_friction(dynamic(is_ball ? sphere(r) : capsule(r, 0.6f), rotate(turn, {0, 0, r})), 0.9f);
    if (!is_ball) roller.pose.rotation = axis_angle({1, 0, 0}, half_pi);
    const BodyId id = world.add(roller);
    const double inertia = static_cast<double>(world.mass_properties(id).inertia.zz);
    run(world, 120);
    expect_share(static_cast<double>(length(world.velocity(id).linear)),
                 2 * g * std::sin(static_cast<double>(slope)) / (1 + inertia / static_cast<double>(r * r)), 0.005);
  }
}

// It leaves the wall once its top has descended by a third, and continues at constant horizontal speed.
TEST(ClosedForms, ALadderSlidesOffItsWall) {
  constexpr double half_length = 2, angle = 1.2217;
  for (const float rate : {60.0f, 240.0f})
    for (const Rod& rod : rods(static_cast<float>(half_length), 0.02f)) {
      World world(steps_of(1 / rate));
      world.add(floor_with({0, 0}));
      BodyDef wall = with_friction(dynamic(box({1, 50, 50}), {-1, 0, 49}), 0);
      wall.motion = MotionType::fixed;
      world.add(wall);
      BodyDef ladder = with_friction(dynamic(rod.shape, {}, 5), 0);
      ladder.pose.rotation = axis_angle({0, 1, 0}, static_cast<float>(angle)) * rod.along_x;
      ladder.pose.position = {static_cast<float>(half_length * std::cos(angle)) + 0.019f, 0,
                              static_cast<float>(half_length * std::sin(angle)) + 0.01f};
      const BodyId id = world.add(ladder);
      while (world.pose(id).position.z > 0.2f && world.step_count() < 2000) world.step();
      const double expected = 2.0 / 3 * std::sin(angle) * std::sqrt(g * half_length * std::sin(angle) / 2);
      expect_share(static_cast<double>(world.velocity(id).linear.x), expected, 0.04);
    }
}

TEST(ClosedForms, AFastGyroscopePrecesses) {
  if (quiet_world().partition == Partition::cells) GTEST_SKIP() << "cells have no joints";
  for (const float spin : {40.0f, 150.0f}) {
    World world(quiet_world());
    BodyDef base = dynamic(box({0.1f, 0.1f, 0.1f}), {0, 0, -3});
    base.motion = MotionType::fixed;
    const BodyId stand = world.add(base);
    constexpr float m = 3, radius = 0.5f, half = 0.05f, arm = 1;
    BodyDef wheel = dynamic(cylinder_hull(radius, half, 32), {arm, 0, 0}, m);
    const float about = 0.5f * m * radius * radius, across = m * (3 * radius * radius + 4 * half * half) / 12;
    wheel.inertia = SymMat3{across, across, about, 0, 0, 0};
    wheel.pose.rotation = axis_angle({0, 1, 0}, half_pi);
    const float expected = m * static_cast<float>(g) * arm / (about * spin);
    wheel.velocity = {{0, expected * arm, 0}, 0, {spin, 0, expected}, 0};
    const BodyId id = world.add(wheel);
    world.add_joint(ball_joint(stand, id, {0, 0, 3}, {0, 0, -arm}));
    float turned = 0;
    float nod = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3 before = world.pose(id).position;
      world.step();
      const Vec3 after = world.pose(id).position;
      turned += std::atan2(before.x * after.y - before.y * after.x, before.x * after.x + before.y * after.y);
      nod = std::max(nod, std::abs(after.z));
    }
    expect_share(static_cast<double>(turned / 5), static_cast<double>(expected), 0.005);
    EXPECT_LT(nod, 0.02f);
    expect_share(static_cast<double>(dot(world.velocity(id).angular, rotate(world.pose(id).rotation, {0, 0, 1}))),
                 static_cast<double>(spin), 0.005);
  }
}

// A free wedge recoils from a body sliding down it (Landau and Lifshitz' wedge, without friction).
TEST(ClosedForms, AWedgeGivesWay) {
  for (const double slope : {0.4, 0.7})
    for (const double m_wedge : {2.0, 20.0}) {
      World world(steps_of(1 / 120.0f));
      world.add(floor_with({0, 0}));
      const float length = 6, height = length * static_cast<float>(std::tan(slope));
      std::vector<Vec3> corners;
      const Vec3 centre{length / 3, 0, height / 3};
      for (const float y : {-1.0f, 1.0f})
        for (const Vec3 corner : {Vec3{0, y, 0}, Vec3{length, y, 0}, Vec3{0, y, height}})
          corners.push_back(corner - centre);
      const BodyId wedge = world.add(with_friction(dynamic(hull(corners), centre, static_cast<float>(m_wedge)), 0));
      const float s = static_cast<float>(slope);
      const Vec3 at = Vec3{1, 0, height - std::tan(s)} + 0.3f * Vec3{std::sin(s), 0, std::cos(s)};
      BodyDef slider = with_friction(dynamic(box({0.4f, 0.3f, 0.3f}), at), 0);
      slider.pose.rotation = axis_angle({0, 1, 0}, s);
      const BodyId block = world.add(slider);
      run(world, 48);
      const double time = 0.4, c = std::cos(slope), sine = std::sin(slope), inertia = m_wedge + sine * sine;
      expect_share(static_cast<double>(-world.velocity(wedge).linear.x), g * sine * c / inertia * time, 0.002);
      expect_share(static_cast<double>(length_squared(world.velocity(block).linear - world.velocity(wedge).linear)),
                   std::pow((m_wedge + 1) * g * sine / inertia * time, 2), 0.004);
    }
}

TEST(ClosedForms, ALoadSlipsOffWhatIsPulledTooHard) {
  constexpr double mu = 0.3, m_below = 4, m_load = 2;
  for (const double pull : {20.0, 40.0}) {
    World world(quiet_world());
    Material slippery{0, 0};
    slippery.friction_rule = CombineRule::minimum;
    world.add(floor_with(slippery));
    const BodyId below = world.add(with_friction(dynamic(box({1, 1, 0.3f}), {0, 0, 0.3f}, m_below), 0.3f));
    const BodyId load = world.add(with_friction(dynamic(box({0.3f, 0.3f, 0.3f}), {0, 0, 0.9f}, m_load), 0.3f));
    for (int i = 0; i < 24; ++i) {
      world.apply_force(below, {static_cast<float>(pull), 0, 0});
      world.step();
    }
    const double together = pull / (m_below + m_load), carried = std::min(together, mu * g);
    const double rate = together <= mu * g ? together : (pull - mu * m_load * g) / m_below;
    expect_share(static_cast<double>(world.velocity(load).linear.x), carried * 0.4, 0.005);
    expect_share(static_cast<double>(world.velocity(below).linear.x), rate * 0.4, 0.005);
  }
}

TEST(ClosedForms, AConveyorTakesBoxesAlong) {
  const Vec3 half{0.5f, 0.4f, 0.3f};
  for (const Shape& shape : {box(half), box_hull(half), cylinder_hull(0.5f, 0.3f, 24)}) {
    World world(quiet_world());
    BodyDef belt = floor_with({0.4f, 0});
    belt.motion = MotionType::kinematic;
    belt.velocity.linear = {4, 0, 0};
    world.add(belt);
    const BodyId id = world.add(with_friction(dynamic(shape, {0, 0, 0.3f}, 2), 0.4f));
    run(world, 36);
    expect_share(static_cast<double>(world.velocity(id).linear.x), 0.4 * g * 0.6, 0.002);
    run(world, 120);
    EXPECT_NEAR(world.velocity(id).linear.x, 4, 1e-3);
    expect_share(static_cast<double>(world.pose(id).position.x), 4 * 2.6 - 16 / (2 * 0.4 * g), 0.005);
  }
}

TEST(ClosedForms, ABallHitsTheEndOfAFreeRod) {
  for (const Rod& rod : rods(1, 0.1f))
    for (const float restitution : {0.0f, 1.0f})
      for (const double m_ball : {0.1, 1.0, 50.0}) {
        WorldDef def = steps_of(1 / 240.0f);
        def.gravity = {};
        World world(def);
        BodyDef hit = with_friction(dynamic(rod.shape, {}, 2), 0, restitution);
        hit.pose.rotation = rod.along_x;
        const BodyId rod_id = world.add(hit);
        BodyDef shot =
            with_friction(dynamic(sphere(0.1f), {0.8f, -0.5f, 0}, static_cast<float>(m_ball)), 0, restitution);
        shot.velocity.linear = {0, 5, 0};
        const BodyId ball = world.add(shot);
        run(world, 30);
        const double inertia = static_cast<double>(world.mass_properties(rod_id).inertia.yy);
        const double impulse = (1 + static_cast<double>(restitution)) * 5 / (1 / m_ball + 0.5 + 0.64 / inertia);
        EXPECT_NEAR(world.velocity(ball).linear.y, 5 - impulse / m_ball, 0.06);
        EXPECT_NEAR(world.velocity(rod_id).linear.y, impulse / 2, 0.06);
        EXPECT_NEAR(world.velocity(rod_id).angular.z, impulse * 0.8 / inertia, 0.06);
      }
}

TEST(ClosedForms, ABeamRestsOnItsSupportsByTheLawOfLevers) {
  World world(quiet_world());
  const auto support = [&](float x) {
    BodyDef def = dynamic(box({0.01f, 1, 1}), {x, 0, -1});
    def.motion = MotionType::fixed;
    return world.add(def);
  };
  const BodyId left = support(-2), right = support(3);
  world.add(dynamic(box({4, 0.2f, 0.1f}), {0, 0, 0.1f}, 10));
  world.add(dynamic(box({0.2f, 0.2f, 0.2f}), {1.5f, 0, 0.4f}, 30));
  run(world, 600);
  const auto force_on = [&](BodyId id) {
    double sum = 0;
    world.for_each_contact_of(id, [&](const ContactInfo& c) {
      for (int k = 0; k < c.point_count; ++k) sum += 60 * static_cast<double>(c.points[k].impulse);
    });
    return sum;
  };
  expect_share(force_on(right), g * (10 * 2 + 30 * 3.5) / 5, 0.01);
  expect_share(force_on(left) + force_on(right), 40 * g, 0.002);
}

// Thin bodies that spin fast touch with a corner, and are fast: they are held back within the step and must keep the
// spin that they have then. Otherwise rods reach up to four times their energy within a step.
TEST(ClosedForms, WhatTumblesGainsNoEnergy) {
  const Shape shapes[] = {cylinder_hull(0.5f, 0.02f, 32), box({1, 0.03f, 0.02f}), capsule(0.02f, 0.8f),
                          box({0.5f, 0.5f, 0.01f}), cylinder_hull(0.3f, 0.6f, 8)};
  for (const Shape& shape : shapes)
    for (unsigned seed = 1; seed <= 40; ++seed) {
      World world(quiet_world());
      world.add(floor_with({0.4f, 0}));
      Generator random(seed);
      BodyDef thrown = with_friction(dynamic(shape, {0, 0, 1.3f}), 0.4f);
      thrown.pose.rotation = any_rotation(random);
      thrown.velocity = {2 * in_cube(random), 0, 30 * in_cube(random), 0};
      const BodyId id = world.add(thrown);
      const auto energy = [&] {
        return kinetic_energy(world, id) + static_cast<float>(g) * (1 + world.pose(id).position.z);
      };
      const float first = energy();
      float least = first, rises = 0;
      for (int i = 0; i < 300; ++i) {
        world.step();
        rises = std::max(rises, energy() - least);
        least = std::min(least, energy());
      }
      EXPECT_LT(rises, 0.015f * first) << "seed " << seed << ", radius " << length(shape.half_extents);
    }
}

}  // namespace fathom::closed_forms_test
