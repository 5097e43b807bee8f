// Friction over a patch: it acts where the load is, and holds what is gripped.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <tuple>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::test::friction_patch_test {
namespace {

/// Every simulator and solver by name.
WorldDef world_of(const std::string& name) {
  WorldDef def = quiet_world();
  if (name == "device" || name == "hybrid") {
    def.simulator = name == "hybrid" ? SimulatorKind::hybrid : SimulatorKind::device;
    def.device = test_device();
  }
  if (name == "cells") def.partition = Partition::cells;
  if (name == "impulse") def.solver.method = Solver::impulse;
  return def;
}

class FrictionPatch : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Simulators, FrictionPatch, testing::Values("native", "cells", "impulse", "hybrid", "device"),
                         [](const auto& name) { return std::string(name.param); });

double turned(const World& world, BodyId id) {
  const Quat q = world.pose(id).rotation;
  return 2 * std::atan2(static_cast<double>(q.z), static_cast<double>(q.w));
}

// A plank with most of its load at one end does not turn when it slides sideways: gravity and friction act at the same
// point. It stops after v²/2µg with everything it carries.
TEST_P(FrictionPatch, ALoadOnOneEndDoesNotTurnAPlank) {
  Generator random{5};
  for (int trial = 0; trial < 12; ++trial) {
    const float scale = std::pow(10.0f, uniform(random, -1, 1)), mu = uniform(random, 0.2f, 0.5f);
    const float load = std::pow(10.0f, uniform(random, -0.5f, 1)), end = uniform(random, 0.3f, 0.95f);
    const float speed = 5 * std::sqrt(scale), angle = uniform(random, 0, 6.28f);
    WorldDef def = world_of(GetParam());
    def.dt = std::sqrt(scale) * uniform(random, 1 / 240.0f, 1 / 60.0f);
    World world(def);
    world.add(ground(mu));
    const Vec3 half = scale * Vec3{1.5f, 0.15f, 0.05f};
    const float block = 0.15f * scale;
    BodyDef plank = dynamic(box(half), {0, 0, 0.5f + half.z});
    plank.material = {mu, 0};
    BodyDef cargo = dynamic(box({block, block, block}), {end * (half.x - block), 0, 0.5f + 2 * half.z + block}, load);
    cargo.material = {1, 0};
    const BodyId ids[] = {world.add(plank), world.add(cargo)};
    for (int i = 0; i < 20; ++i) world.step();  // lets the load settle
    const Vec3 start = world.pose(ids[0]).position;
    const Vec3 velocity = speed * Vec3{std::cos(angle), std::sin(angle), 0};
    for (const BodyId id : ids) world.set_velocity(id, velocity, {});
    const int steps = static_cast<int>(1.2f * speed / (mu * 9.81f * def.dt)) + 20;
    for (int i = 0; i < steps; ++i) world.step();
    const auto way = static_cast<double>(speed * speed / (2 * mu * 9.81f));
    // An error of one substep at the start and at the end.
    const double slack = 0.04 * way + static_cast<double>(speed * def.dt);
    EXPECT_NEAR(length(world.pose(ids[0]).position - start), way, slack) << "trial " << trial;
    EXPECT_NEAR(turned(world, ids[0]), 0, 0.02) << "trial " << trial << ", load " << load << " at " << end;
  }
}

/// Coulomb friction on a square of half length `half` under uniform pressure, starting at `speed` and `spin`, summed
/// over 32 × 32 parts. Returns how far it slides and how far it turns.
std::array<double, 2> slid_and_spun(double half, double speed, double spin, double mu) {
  constexpr int parts = 32;
  constexpr double h = 1e-4, g = 9.81;
  const double gyration_squared = 2 * half * half / 3;
  std::array<double, 2> way{};
  while (speed > 1e-3 || std::abs(spin) * half > 1e-3) {
    double force = 0, torque = 0;
    for (int i = 0; i < parts; ++i)
      for (int j = 0; j < parts; ++j) {
        const double x = half * ((2 * i + 1.0) / parts - 1), y = half * ((2 * j + 1.0) / parts - 1);
        const double vx = speed - spin * y, vy = spin * x, v = std::hypot(vx, vy) + 1e-9;
        force -= vx / v, torque -= (x * vy - y * vx) / v;
      }
    const double share = mu * g / (parts * parts);
    speed = std::max(speed + h * share * force, 0.0);
    spin += h * share * torque / gyration_squared;
    way[0] += h * speed, way[1] += h * spin;
  }
  return way;
}

// A body that slides and spins is braked less along its path than one that only slides. Its twist has the whole limit,
// so it turns less far than it should (docs/solver.md).
TEST_P(FrictionPatch, SlidingAndSpinningShareTheCone) {
  constexpr double mu = 0.5;
  for (const auto& [speed, spin] : {std::tuple(3.0, 0.0), {3.0, 3.0}, {3.0, 8.0}, {1.0, 8.0}, {0.2, 8.0}}) {
    WorldDef def = world_of(GetParam());
    def.dt = 1 / 120.0f;
    World world(def);
    world.add(ground(mu));
    BodyDef slab = dynamic(box({0.5f, 0.5f, 0.02f}), {0, 0, 0.52f});
    const BodyId id = world.add(slab);
    for (int i = 0; i < 10; ++i) world.step();
    const Vec3 start = world.pose(id).position;
    world.set_velocity(id, {static_cast<float>(speed), 0, 0}, {0, 0, static_cast<float>(spin)});
    double angle = 0, last = turned(world, id);
    for (int i = 0; i < 240; ++i) {
      world.step();
      const double now = turned(world, id);
      angle += std::remainder(now - last, 2 * 3.14159265358979);
      last = now;
    }
    const auto [way, turn] = slid_and_spun(0.5, speed, spin, mu);
    const auto got = static_cast<double>(length(world.pose(id).position - start));
    EXPECT_NEAR(got, way, (spin == 0 ? 0.01 : 0.18) * way + 0.01) << speed << " m/s, " << spin << " rad/s";
    EXPECT_LT(angle, 1.02 * turn + 0.01) << speed << " m/s, " << spin << " rad/s";
  }
}

/// A box that is held at `speed` (m/s, upward).
BodyDef finger(float x, float speed, MotionType motion, float friction) {
  BodyDef def = dynamic(box({0.02f, 0.1f, 0.1f}), {x, 0, 2}, 0.2f);
  def.motion = motion;
  def.velocity.linear = {0, 0, speed};
  def.material.friction = friction;
  def.gravity_scale = 0;
  return def;
}

// A plank is pressed with 15 N against a wall that begins to rise: after slipping a little it has to stick again.
TEST_P(FrictionPatch, AWallTakesAlongWhatIsPressedAgainstIt) {
  for (const float off : {0.0f, 0.02f, 0.05f}) {
    World world(world_of(GetParam()));
    const BodyId wall = world.add(finger(-0.07f, 0.1f, MotionType::kinematic, 1));
    BodyDef def = dynamic(box({0.05f, 0.5f, 0.05f}), {0, off, 2});
    def.material.friction = 1;
    const BodyId plank = world.add(def);
    const auto lead = [&] { return world.pose(wall).position.z - world.pose(plank).position.z; };
    const auto press = [&](int steps) {
      for (int i = 0; i < steps; ++i) {
        world.apply_force(plank, {-15, 0, 0});
        world.step();
      }
    };
    press(60);
    const float early = lead();
    press(120);
    EXPECT_LT(early, 0.01f) << off;
    EXPECT_NEAR(lead(), early, 0.001f) << off;
  }
}

// Two fingers rise with a plank between them, whose centre is beside them. One presses with 15 N: the weight takes half
// of what both can exert, the twist a quarter.
TEST_P(FrictionPatch, AGripHolds) {
  if (GetParam() == std::string("cells")) GTEST_SKIP() << "has no joints";
  for (const float off : {0.0f, 0.03f, 0.06f}) {
    World world(world_of(GetParam()));
    const BodyId fixed = world.add(finger(-0.07f, 0.1f, MotionType::kinematic, 0.7f));
    const BodyId moving = world.add(finger(0.07f, 0, MotionType::dynamic, 0.7f));
    JointDef guide = generic_joint(fixed, moving, {.position = {0.07f, 0, 0}}, {.position = {-0.07f, 0, 0}});
    guide.axis(JointAxisName::x).mode = AxisMode::free;
    world.add_joint(guide);
    BodyDef def = dynamic(box({0.05f, 0.5f, 0.05f}), {0, off, 2});
    def.material.friction = 0.7f;
    const BodyId plank = world.add(def);
    for (int i = 0; i < 240; ++i) {
      world.apply_force(moving, {-15, 0, 0});
      world.step();
    }
    EXPECT_NEAR(world.pose(plank).position.z, 2.4f, 0.02f) << off;
    EXPECT_NEAR(world.velocity(plank).linear.z, 0.1f, 0.005f) << off;
  }
}

// Friction opposes sliding, whatever the body's shape and direction. An impulse that would stop both directions at once
// and is then cut to its limit does not: such boxes ended a quarter of their way beside the line.
TEST_P(FrictionPatch, AnObliqueSlideIsStraight) {
  for (const Vec3 half : {Vec3{1, 0.125f, 0.25f}, Vec3{0.5f, 0.25f, 0.25f}, Vec3{0.5f, 0.1f, 0.1f}})
    for (const float degrees : {20.0f, 45.0f, 70.0f}) {
      World world(world_of(GetParam()));
      world.add(ground(0.3f));
      const float angle = degrees * 3.14159265f / 180;
      const Vec3 way{std::cos(angle), std::sin(angle), 0}, aside{-way.y, way.x, 0};
      BodyDef slider = dynamic(box(half), {0, 0, 0.5f + half.z});
      slider.material.friction = 0.3f;
      slider.velocity.linear = 3.0f * way;
      const BodyId id = world.add(slider);
      for (int i = 0; i < 120; ++i) world.step();
      const Vec3 moved = world.pose(id).position;
      EXPECT_NEAR(dot(moved, way), 9 / (2 * 0.3f * 9.81f), 0.02f) << half.x << ' ' << degrees;
      EXPECT_NEAR(dot(moved, aside), 0, 0.02f) << half.x << ' ' << degrees;
    }
}

}  // namespace
}  // namespace fathom::test::friction_patch_test
