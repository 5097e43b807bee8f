// The world obeys the laws of mechanics, each to a stated figure.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "world_fixture.hpp"

namespace fathom::test::laws_test {
namespace {

// Bodies that touch nothing move on exact parabolas, whatever the time step.
TEST(Laws, FreeFallFollowsTheParabola) {
  for (const int rate : {60, 24}) {
    WorldDef def = quiet_world();
    def.dt = 1.0f / static_cast<float>(rate);
    World world(def);
    const BodyId id = world.add(cube({0, 0, 100}));
    world.set_velocity(id, {3, -2, 5}, {});
    run(world, 2 * rate);
    const Vec3 p = world.pose(id).position;
    EXPECT_NEAR(p.x, 6.0, 1e-4);
    EXPECT_NEAR(p.y, -4.0, 1e-4);
    EXPECT_NEAR(p.z, 100 + 5 * 2.0 - 9.81 * 2.0 * 2.0 / 2, 1e-4);
  }
}

/// A fall that starts at the velocity of half a second, in steps of 1 ms, keeps the exact velocity. Rounding in every
/// step would give an error of 5e-4 m/s after one second.
void expect_exact_fall(World& world, BodyId id, Vec3 gravity) {
  double worst = 0;
  for (int i = 1; i <= 1200; ++i) {
    world.step();
    for (int axis = 0; axis < 3; ++axis) {
      const double exact = static_cast<double>(gravity[axis]) * (0.5 + static_cast<double>(0.001f) * i);
      worst = std::max(worst, std::abs(static_cast<double>(world.velocity(id).linear[axis]) - exact));
    }
  }
  EXPECT_LT(worst, 1.5e-6);
}

TEST(Laws, AFastFallGainsGravityAndNoMore) {
  for (const Vec3 gravity : {Vec3{0, 0, -9.81f}, Vec3{3.3f, -7.1f, 5.7f}}) {
    WorldDef def = quiet_world();
    def.dt = 0.001f;
    def.gravity = gravity;
    World world(def);
    const BodyId id = world.add(cube({0, 0, 0}));
    world.set_velocity(id, 0.5f * gravity, {});
    expect_exact_fall(world, id, gravity);
  }
}

// Contacts see bodies flying past a wall, and do nothing.
TEST(Laws, SoDoesAFallAlongAWall) {
  WorldDef def = quiet_world();
  def.dt = 0.001f;
  World world(def);
  BodyDef wall = ground();
  wall.pose.rotation = axis_angle({0, 1, 0}, pi / 2);
  world.add(wall);
  const BodyId id = world.add(dynamic(sphere(0.1f), {0.605f, 0, 20}));
  world.set_velocity(id, 0.5f * def.gravity, {});
  expect_exact_fall(world, id, def.gravity);
  EXPECT_EQ(world.velocity(id).linear.x, 0);
  EXPECT_EQ(world.profile().counts.manifolds, 1u);
}

TEST(Laws, ForceAcceleratesByItsMassAndOnlyForOneStep) {
  WorldDef def = quiet_world();
  def.gravity = {};
  World world(def);
  const BodyId id = world.add(dynamic(sphere(0.5f), {}, 4.0f));
  for (int i = 0; i < 60; ++i) {
    world.apply_force(id, {8, 0, 0});
    world.step();
  }
  EXPECT_NEAR(world.velocity(id).linear.x, 2.0f, 1e-4f);
  run(world, 60);
  EXPECT_NEAR(world.velocity(id).linear.x, 2.0f, 1e-4f);
}

TEST(Laws, ForceOffCentreTurnsTheBody) {
  WorldDef def = quiet_world();
  def.gravity = {};
  World world(def);
  const BodyId id = world.add(dynamic(sphere(0.5f), {}, 1.0f));  // I = 0.4 m r² = 0.1
  world.apply_force_at(id, {0, 6, 0}, {0.5f, 0, 0});
  world.step();
  EXPECT_NEAR(world.velocity(id).linear.y, 0.1f, 1e-5f);
  EXPECT_NEAR(world.velocity(id).angular.z, 6 * 0.5f / 0.1f / 60, 1e-4f);
}

TEST(Laws, ImpulseActsAtOnce) {
  World world(quiet_world());
  const BodyId id = world.add(dynamic(sphere(0.5f), {0, 0, 5}, 2.0f));
  world.apply_impulse_at(id, {4, 0, 0}, {0, 0, 5.5f});
  EXPECT_NEAR(world.velocity(id).linear.x, 2.0f, 1e-6f);
  EXPECT_NEAR(world.velocity(id).angular.y, 4 * 0.5f / 0.2f, 1e-4f);
}

TEST(Laws, CollisionsConserveMomentum) {
  WorldDef def = quiet_world();
  def.gravity = {};
  World world(def);
  std::uint32_t seed = 1;
  const auto random = [&] {
    seed = seed * 1664525u + 1013904223u;
    return static_cast<float>(seed >> 8) / 8388608.0f - 1.0f;
  };
  for (int i = 0; i < 64; ++i) {
    const Vec3 p{static_cast<float>(i % 4) * 1.5f, static_cast<float>(i / 4 % 4) * 1.5f,
                 static_cast<float>(i / 16) * 1.5f};
    BodyDef body = i % 3 == 0 ? dynamic(sphere(0.5f), p) : i % 3 == 1 ? cube(p) : dynamic(capsule(0.3f, 0.4f), p);
    const Vec3 inward = Vec3{2.25f, 2.25f, 2.25f} - p;
    body.velocity.linear = inward + Vec3{random(), random(), random()};
    body.velocity.angular = {random(), random(), random()};
    world.add(body);
  }
  const auto momenta = [&] {
    double linear[3] = {}, angular[3] = {};
    for (const BodyId id : world.bodies()) {
      const Vec3 p = world.mass(id) * world.velocity(id).linear;
      const Vec3 l = cross(world.pose(id).position, p) + angular_momentum(world, id);
      for (int k = 0; k < 3; ++k) linear[k] += static_cast<double>(p[k]), angular[k] += static_cast<double>(l[k]);
    }
    return std::array<double, 6>{linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]};
  };
  const auto before = momenta();
  int touched = 0;
  for (int i = 0; i < 1000; ++i) {
    world.step();
    touched += static_cast<int>(world.contacts_begun().size());
  }
  EXPECT_GT(touched, 100);
  const auto after = momenta();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 5e-4 * 64) << "linear, axis " << k;
  // Contacts act at the same point of both bodies, so angular momentum changes only with their positions within a step.
  for (int k = 3; k < 6; ++k)
    EXPECT_NEAR(after[k], before[k], 0.05 * (std::abs(before[k]) + 10)) << "angular, axis " << k - 3;
}

TEST(Laws, TorqueFreeBodyKeepsItsAngularMomentum) {
  WorldDef def = quiet_world();
  def.gravity = {};
  World world(def);
  const BodyId id = world.add(dynamic(box({0.1f, 0.3f, 0.5f}), {}));
  world.set_velocity(id, {}, {4, 3, -2});
  const Vec3 before = angular_momentum(world, id);
  const float energy = kinetic_energy(world, id);
  for (int i = 0; i < 1200; ++i) {
    world.step();
    ASSERT_LT(distance(angular_momentum(world, id), before), 5e-3f * length(before)) << "step " << i;
    ASSERT_NEAR(kinetic_energy(world, id), energy, 0.02f * energy) << "step " << i;
  }
}

// Dzhanibekov: about its middle axis a T-shaped body flips over and over, and its energy is constant.
TEST(Laws, TShapedBodyFlips) {
  WorldDef def = quiet_world();
  def.gravity = {};
  World world(def);
  const Vec3 corners[] = {{-1, -0.1f, 0},     {1, -0.1f, 0},     {-1, 0.1f, 0},     {1, 0.1f, 0},
                          {-1, -0.1f, 0.2f},  {1, -0.1f, 0.2f},  {-1, 0.1f, 0.2f},  {1, 0.1f, 0.2f},
                          {-0.1f, -0.1f, -1}, {0.1f, -0.1f, -1}, {-0.1f, 0.1f, -1}, {0.1f, 0.1f, -1}};
  const BodyId id = world.add(dynamic(hull(corners), {}));
  const MassProperties mass = world.mass_properties(id);
  const Vec3 middle = rotate(mass.principal_rotation, {0, 1, 0});
  ASSERT_GT(mass.principal_moments.y, 1.05f * mass.principal_moments.x);
  ASSERT_LT(mass.principal_moments.y, 0.95f * mass.principal_moments.z);
  world.set_velocity(id, {}, 8.0f * middle + Vec3{0.01f, 0.01f, 0.01f});
  const float energy = kinetic_energy(world, id);
  int flips = 0;
  float side = 1;
  for (int i = 0; i < 3000; ++i) {
    world.step();
    const float along = dot(rotate(world.pose(id).rotation, middle), middle);
    if (along * side < -0.8f) ++flips, side = -side;
    ASSERT_NEAR(kinetic_energy(world, id), energy, 0.02f * energy) << "step " << i;
  }
  EXPECT_GE(flips, 4);
}

// A box on a slope slides if the tangent of the angle exceeds µ.
class Slope : public testing::TestWithParam<float> {};

TEST_P(Slope, SlipsBeyondTheFrictionAngle) {
  const float friction = GetParam();
  for (const float offset : {-1.0f, 1.0f}) {
    const float angle = std::atan(friction) + offset * pi / 180;
    WorldDef def = quiet_world();
    def.gravity = {9.81f * std::sin(angle), 0, -9.81f * std::cos(angle)};
    World world(def);
    world.add(ground(friction));
    BodyDef body = cube({0, 0, 1});
    body.shape = box({0.5f, 0.5f, 0.1f});
    body.pose.position.z = 0.6f;
    body.material.friction = friction;
    const BodyId id = world.add(body);
    run(world, 120);
    const float speed = world.velocity(id).linear.x;
    if (offset < 0)
      EXPECT_LT(std::abs(speed), 1e-3f) << "holds below atan(" << friction << ")";
    else
      EXPECT_NEAR(speed, 2 * 9.81f * (std::sin(angle) - friction * std::cos(angle)), 0.02f)
          << "slides above atan(" << friction << ")";
  }
}
INSTANTIATE_TEST_SUITE_P(Friction, Slope, testing::Values(0.1f, 0.3f, 0.5f, 0.7f, 1.0f));

TEST(Laws, SlidingBoxStopsAfterItsBrakingDistance) {
  for (const float friction : {0.2f, 0.4f, 0.7f}) {
    for (int direction = 0; direction < 12; ++direction) {
      const float angle = static_cast<float>(direction) * pi / 6;
      World world(quiet_world());
      world.add(ground(friction));
      BodyDef body = dynamic(box({0.5f, 0.5f, 0.1f}), {0, 0, 0.6f});
      body.material.friction = friction;
      const BodyId id = world.add(body);
      run(world, 30);  // settle
      const Vec3 start = world.pose(id).position;
      world.set_velocity(id, {2 * std::cos(angle), 2 * std::sin(angle), 0}, {});
      run(world, 180);
      const float way = distance(world.pose(id).position, start);
      const float expected = 4 / (2 * friction * 9.81f);
      // The integrator brakes at substep ends, which adds half a substep at the initial speed.
      EXPECT_NEAR(way, expected, 0.01f * expected + 2.0f / 480)
          << "friction " << friction << ", direction " << direction;
    }
  }
}

TEST(Laws, BallsReboundToTheSquareOfTheirRestitution) {
  for (const float e : {0.3f, 0.5f, 0.8f, 1.0f}) {
    WorldDef def = quiet_world();
    def.dt = 1.0f / 240;
    World world(def);
    world.add(ground(0.5f, 0));
    BodyDef body = dynamic(sphere(0.5f), {0, 0, 3});
    body.material.restitution = e;
    const BodyId id = world.add(body);
    const float drop = 3 - 1;
    float top = 0;
    bool bounced = false;
    for (int i = 0; i < 600; ++i) {
      const float before = world.velocity(id).linear.z;
      world.step();
      const float after = world.velocity(id).linear.z;
      if (before < 0 && after > 0) bounced = true;
      if (bounced) top = max(top, world.pose(id).position.z - 1);
      if (bounced && before > 0 && after <= 0) break;
    }
    EXPECT_NEAR(top, e * e * drop, 0.02f * drop) << "restitution " << e;
    EXPECT_LE(top, drop * 1.001f) << "restitution " << e;
  }
}

TEST(Laws, SlidingSphereEndsRollingAtFiveSeventhsOfItsSpeed) {
  World world(quiet_world());
  world.add(ground(0.5f));
  const BodyId id = world.add(dynamic(sphere(0.5f), {0, 0, 1}));
  run(world, 10);
  world.set_velocity(id, {3, 0, 0}, {});
  run(world, 180);
  EXPECT_NEAR(world.velocity(id).linear.x, 3.0f * 5 / 7, 0.01f * 3 * 5 / 7);
  EXPECT_NEAR(world.velocity(id).angular.y, 2 * 3.0f * 5 / 7, 0.02f * 2 * 3 * 5 / 7);
}

TEST(Laws, StackAtRestStaysAndCarriesItsWeight) {
  World world(quiet_world());
  world.add(ground());
  std::vector<BodyId> stack;
  for (int i = 0; i < 5; ++i) stack.push_back(world.add(cube({0, 0, 1.0f + static_cast<float>(i)})));
  run(world, 600);
  for (int i = 0; i < 5; ++i) {
    const Vec3 p = world.pose(stack[i]).position;
    EXPECT_LT(length(Vec3{p.x, p.y, 0}), 1e-3f) << "body " << i;
    // Contacts are springs of 30 Hz over the pair's effective mass, so a column yields by load / (½ m ω²) per storey: 2
    // mm under four cubes.
    EXPECT_NEAR(p.z, 1.0f + static_cast<float>(i), 1e-3f + 3e-3f * static_cast<float>(i)) << "body " << i;
    EXPECT_LT(length(world.velocity(stack[i]).linear), 1e-3f);
  }
  float force = 0;
  world.for_each_contact([&](const ContactInfo& c) {
    if (world.motion(c.a) != MotionType::fixed) return;
    for (int p = 0; p < c.point_count; ++p) force += c.points[p].impulse * 60;
  });
  EXPECT_NEAR(force, 5 * 9.81f, 1e-2f * 5 * 9.81f);
}

TEST(Laws, HeavyOnLightStands) {
  World world(quiet_world());
  world.add(ground());
  const BodyId light = world.add(cube({0, 0, 1}));
  const BodyId heavy = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 2}, 100.0f));
  run(world, 600);
  EXPECT_NEAR(world.pose(light).position.z, 1, 0.05f);
  EXPECT_NEAR(world.pose(heavy).position.z, 2, 0.1f);
}

TEST(Laws, FastBodiesDoNotPassThroughTheGround) {
  for (const float speed : {10.0f, 50.0f, 150.0f, 300.0f}) {
    World world(quiet_world());
    world.add(ground());
    const BodyId id = world.add(cube({0, 0, 20.3f}));
    const BodyId ball = world.add(dynamic(sphere(0.05f), {5, 0, 20.3f}));
    world.set_velocity(id, {0, 0, -speed}, {1, 2, 3});
    world.set_velocity(ball, {0, 0, -speed}, {});
    for (int i = 0; i < 240; ++i) {
      world.step();
      ASSERT_GT(world.bounds(id).lower.z, 0.3f) << speed << " m/s, step " << i;
      ASSERT_GT(world.bounds(ball).lower.z, 0.4f) << speed << " m/s, step " << i;
    }
  }
}

TEST(Laws, OverlappingBodiesPartGently) {
  World world(quiet_world());
  world.add(ground());
  const BodyId a = world.add(cube({0, 0, 1}));
  const BodyId b = world.add(cube({0.02f, 0, 1.7f}));  // 0.3 m deep
  float top = 0;
  for (int i = 0; i < 240; ++i) {
    world.step();
    top = max(top, world.pose(b).position.z);
  }
  EXPECT_LT(top, 2.1f);
  EXPECT_NEAR(world.pose(a).position.z, 1, 0.01f);
  EXPECT_NEAR(world.pose(b).position.z, 2, 0.02f);
}

TEST(Laws, KinematicBodyPushesAndIsNotPushed) {
  World world(quiet_world());
  world.add(ground());
  BodyDef wall = cube({-3, 0, 1});
  wall.motion = MotionType::kinematic;
  wall.velocity.linear = {1, 0, 0};
  const BodyId pusher = world.add(wall);
  const BodyId pushed = world.add(cube({-1.5f, 0, 1}));
  run(world, 120);
  EXPECT_NEAR(world.pose(pusher).position.x, -1, 1e-3f);
  EXPECT_NEAR(world.pose(pushed).position.x, 0, 0.05f);
}

TEST(Laws, ConveyorTakesItsLoadAlong) {
  World world(quiet_world());
  BodyDef belt = dynamic(box({50, 1, 0.5f}), {});
  belt.motion = MotionType::kinematic;
  const BodyId conveyor = world.add(belt);
  const BodyId load = world.add(cube({0, 0, 1}));
  run(world, 30);
  world.set_velocity(conveyor, {2, 0, 0}, {});
  run(world, 20);
  EXPECT_NEAR(world.velocity(load).linear.x, 0.5f * 9.81f * 20 / 60, 0.05f) << "friction accelerates it at µg";
  run(world, 60);
  EXPECT_NEAR(world.velocity(load).linear.x, 2, 1e-3f);
}

}  // namespace
}  // namespace fathom::test::laws_test
