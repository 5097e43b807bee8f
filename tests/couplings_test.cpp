// Gears, racks and pulleys on every simulator, against closed forms.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::couplings_test {
namespace {

class Couplings : public OfJointWorlds {
 protected:
  WorldDef weightless(float dt = 1.0f / 60, int substeps = 4) const {
    WorldDef def = GetParam().quiet();
    def.gravity = {}, def.dt = dt, def.solver.substeps = substeps;
    return def;
  }
};
INSTANTIATE_TEST_SUITE_P(Simulators, Couplings, testing::ValuesIn(joint_worlds), joint_world_name);

constexpr double two_pi = 2 * std::numbers::pi;

/// A wheel of radius r and 1 kg on a fixed axle along x.
struct Wheel {
  BodyId body, post;
  JointId hinge;
  double turned = 0;  ///< rad, counted
  float last = 0;

  Wheel(World& world, Vec3 at, float radius, float mass = 1, float velocity = 0, float torque = 0) {
    post = add_anchor(world, at);
    BodyDef def = dynamic(box({0.05f, radius, radius}), at, mass);
    def.filter.mask = 0;
    body = world.add(def);
    JointDef turns = revolute_joint(post, body, {}, {});
    if (torque > 0) turns.axis(JointAxisName::twist).drive_velocity(velocity, torque);
    hinge = world.add_joint(turns);
  }
  void count(const World& world) {
    const float now = world.joint_positions(hinge)[3];
    turned += std::remainder(static_cast<double>(now - last), two_pi);
    last = now;
  }
};

JointDef geared(const World& world, const Wheel& a, const Wheel& b, float ratio) {
  return gear_joint(a.body, world.pose(a.body), {1, 0, 0}, b.body, world.pose(b.body), {1, 0, 0}, ratio);
}

// The first wheel is driven, the second braked: the teeth carry 2 N·m, over a hundred turns.
TEST_P(Couplings, GearsKeepTheirRatioForAHundredTurns) {
  World world(weightless());
  Wheel fast(world, {0, 0, 5}, 0.1f, 1, 12, 20), slow(world, {0, 0.5f, 5}, 0.3f, 9, 0, 2);
  const JointId gear = world.add_joint(geared(world, fast, slow, 3));
  double widest = 0;
  for (int i = 0; std::abs(fast.turned) < 100 * two_pi; ++i) {
    ASSERT_LT(i, 5000);
    world.step();
    fast.count(world), slow.count(world);
    widest = std::max(widest, std::abs(fast.turned + 3 * slow.turned));
  }
  EXPECT_LT(widest * 180 / std::numbers::pi, 0.01) << "degrees of the fast wheel";
  EXPECT_NEAR(world.reaction(gear).torque.x, -2, 0.02f) << "what the brake takes";
  EXPECT_NEAR(world.velocity(slow.body).angular.x, -4, 1e-3f);
}

// Nothing brakes what the motor drives.
TEST_P(Couplings, DrivenGearsComeToAnEvenSpeed) {
  for (const auto& [mass, torque] : {std::pair{9.0f, 20.0f}, {9.0f, 200.0f}, {100.0f, 200.0f}}) {
    World world(weightless());
    Wheel fast(world, {0, 0, 5}, 0.1f, 1, 12, torque), slow(world, {0, 0.5f, 5}, 0.3f, mass);
    world.add_joint(geared(world, fast, slow, 3));
    run(world, 900);
    for (int i = 0; i < 60; ++i) {
      world.step();
      ASSERT_NEAR(world.velocity(slow.body).angular.x, -4, 1e-3f) << mass << " kg, " << torque << " N·m";
    }
  }
}

// A torque at one end accelerates both: I_a + I_b / ratio².
TEST_P(Couplings, GearsShareInertia) {
  for (const float mass : {0.01f, 1.0f, 1000.0f}) {
    World world(weightless());
    const Wheel fast(world, {0, 0, 5}, 0.1f), slow(world, {0, 0.5f, 5}, 0.3f, mass);
    world.add_joint(geared(world, fast, slow, -2));
    const float inertia = world.mass_properties(fast.body).inertia.xx + world.mass_properties(slow.body).inertia.xx / 4;
    for (int i = 0; i < 60; ++i) {
      world.apply_torque(fast.body, {inertia, 0, 0});
      world.step();
    }
    EXPECT_NEAR(world.velocity(fast.body).angular.x, 1, 2e-3f) << mass;
    EXPECT_NEAR(world.velocity(slow.body).angular.x, 0.5f, 1e-3f) << mass;
  }
}

TEST_P(Couplings, ARackMovesByTheCircumferenceATurn) {
  for (const bool swapped : {false, true}) {
    World world(weightless());
    Wheel pinion(world, {0, 0, 5}, 0.2f, 1, 3, 50);
    BodyDef bar = dynamic(box({0.05f, 1, 0.05f}), {0, 0, 5.25f}, 3);
    bar.filter.mask = 0, bar.pose.rotation = axis_angle({1, 2, 3}, 0.7f);
    const BodyId rack = world.add(bar);
    Pose on_post, on_rack;
    on_post.position = {0, 0, 0.25f}, on_post.rotation = axis_angle({0, 0, 1}, 1.5707963f);
    on_rack.rotation = conjugate(world.pose(rack).rotation) * on_post.rotation;
    world.add_joint(prismatic_joint(pinion.post, rack, on_post, on_rack));
    JointDef def = rack_joint(pinion.body, world.pose(pinion.body), {1, 0, 0}, rack, world.pose(rack), {0, 1, 0}, 0.2f);
    if (swapped) {
      std::swap(def.a, def.b), std::swap(def.frame_a, def.frame_b), std::swap(def.coupled_a, def.coupled_b);
      def.ratio = 1 / def.ratio;
    }
    const JointId joint = world.add_joint(def);
    while (pinion.turned < 3 * two_pi) {
      world.step();
      pinion.count(world);
      ASSERT_NEAR(world.pose(rack).position.y, 0.2 * pinion.turned, 1e-4);
    }
    EXPECT_NEAR(world.velocity(rack).linear.y, 0.6f, 1e-3f);
    EXPECT_NEAR(world.joint_positions(joint)[swapped ? 0 : 1], world.pose(rack).position.y, 1e-5f);
  }
}

// Atwood's machine: a = (m1 - m2) / (m1 + m2) g; the rope carries 2 m1 m2 / (m1 + m2) g.
TEST_P(Couplings, AtwoodsMachine) {
  for (const auto& [dt, substeps] : {std::pair{1.0f / 30, 2}, {1.0f / 60, 4}, {1.0f / 240, 8}})
    for (const auto& [m1, m2] : {std::pair{2.0f, 1.0f}, {1.05f, 1.0f}, {1000.0f, 1.0f}}) {
      WorldDef def = GetParam().quiet();
      def.dt = dt, def.solver.substeps = substeps;
      World world(def);
      BodyDef weight = dynamic(sphere(0.1f), {-1, 0, 0}, m1);
      weight.filter.mask = 0;
      const BodyId a = world.add(weight);
      weight.pose.position = {1, 0, 0}, weight.mass = m2;
      const BodyId b = world.add(weight);
      const JointId rope = world.add_joint(pulley_joint(a, {}, {-1, 0, 30}, b, {}, {1, 0, 30}, 60));
      const int steps = static_cast<int>(std::lround(1 / dt));
      run(world, steps);
      const float expected = (m1 - m2) / (m1 + m2) * 9.81f;
      EXPECT_NEAR(world.velocity(a).linear.z / -expected, 1, 1e-3f) << dt << ", " << m1;
      EXPECT_NEAR(world.velocity(b).linear.z / expected, 1, 1e-3f) << dt << ", " << m1;
      EXPECT_NEAR(world.reaction(rope).force.z / (2 * m1 * m2 / (m1 + m2) * 9.81f), 1, 1e-3f) << dt << ", " << m1;
      EXPECT_NEAR(world.pose(a).position.z + world.pose(b).position.z, 0, 1e-3f * std::max(1.0f, expected));
    }
}

// A block and tackle: 3 kg at A hold 9 kg at B with three falls of rope.
TEST_P(Couplings, ATackleDividesTheLoad) {
  World world(GetParam().quiet());
  const BodyId a = world.add(dynamic(sphere(0.1f), {-1, 0, 0}, 3)), b = world.add(dynamic(sphere(0.1f), {1, 0, 0}, 9));
  const JointId rope = world.add_joint(pulley_joint(a, {}, {-1, 0, 4}, b, {}, {1, 0, 4}, 16, 3));
  run(world, 300);
  EXPECT_NEAR(world.pose(a).position.z, 0, 1e-3f);
  EXPECT_NEAR(world.pose(b).position.z, 0, 1e-3f);
  EXPECT_NEAR(world.reaction(rope).force.z, 9 * 9.81f, 0.05f);
}

// A rope pulls but does not push.
TEST_P(Couplings, ASlackRopeLetsFall) {
  World world(GetParam().quiet());
  const BodyId a = world.add(dynamic(sphere(0.1f), {-1, 0, 0}, 1)), b = world.add(dynamic(sphere(0.1f), {1, 0, 0}, 2));
  world.add_joint(pulley_joint(a, {}, {-1, 0, 4}, b, {}, {1, 0, 4}, 8.5f));
  run(world, 10);
  EXPECT_NEAR(world.velocity(a).linear.z, -9.81f / 6, 0.02f);
  EXPECT_NEAR(world.velocity(b).linear.z, -9.81f / 6, 0.02f);
  run(world, 50);
  const float sum = (4 - world.pose(a).position.z) + (4 - world.pose(b).position.z);
  EXPECT_NEAR(sum, 8.5f, 2e-3f);
  EXPECT_GT(world.velocity(a).linear.z, 0);
}

// A pulley's wheels and a rack's path move with the origin.
TEST_P(Couplings, AShiftOfTheOriginDisturbsNone) {
  const auto at_end = [](bool shifts) {
    World world(GetParam().quiet());
    const BodyId a = world.add(dynamic(sphere(0.1f), {-1, 0, 0}, 3)),
                 b = world.add(dynamic(sphere(0.1f), {1, 0, 0}, 9));
    world.add_joint(pulley_joint(a, {}, {-1, 0, 4}, b, {}, {1, 0, 4}, 16, 3));
    BodyDef turning = dynamic(sphere(0.2f), {8, 0, 0});
    turning.motion = MotionType::kinematic;
    turning.velocity.angular = {2, 0, 0}, turning.filter.mask = 0;
    const BodyId wheel = world.add(turning);
    const BodyId rack = world.add(dynamic(box({0.1f, 1, 0.1f}), {8, 0, 4}, 1));
    world.set_gravity_scale(rack, 0);
    world.add_joint(rack_joint(wheel, world.pose(wheel), {1, 0, 0}, rack, world.pose(rack), {0, 1, 0}, 0.5f));
    const Vec3 origin{256, -1024, 64};
    run(world, 60);
    if (shifts) world.shift_origin(origin);
    run(world, 60);
    std::vector<Vec3> positions;
    for (const BodyId id : {a, b, rack}) positions.push_back(world.pose(id).position + (shifts ? origin : Vec3{}));
    return positions;
  };
  const std::vector<Vec3> with = at_end(true), without = at_end(false);
  for (std::size_t i = 0; i < with.size(); ++i) EXPECT_LT(distance(with[i], without[i]), 1e-3f) << i;
  EXPECT_GT(std::abs(without[2].y), 1.5f);
}

// A kinematic wheel drives a rack; a fixed one holds it.
TEST_P(Couplings, WhatCannotBePushedLeads) {
  World world(weightless());
  BodyDef lead = dynamic(sphere(0.2f), {0, 0, 0});
  lead.motion = MotionType::kinematic, lead.filter.mask = 0;
  const BodyId wheel = world.add(lead);
  const BodyId rack = world.add(dynamic(box({0.1f, 0.5f, 0.1f}), {0, 0, 1}, 2));
  world.add_joint(rack_joint(wheel, world.pose(wheel), {1, 0, 0}, rack, world.pose(rack), {0, 1, 0}, 0.5f));
  world.set_velocity(wheel, {}, {10, 0, 0});
  run(world, 120);
  EXPECT_NEAR(world.velocity(rack).linear.y, 5, 1e-3f);
  EXPECT_NEAR(world.pose(rack).position.y, 10, 1e-2f);
}

/// A train of gears of random sizes and masses with loads, and a rope that hangs on the rack of its last wheel.
struct Train {
  World world;
  std::vector<Wheel> wheels;
  std::vector<float> ratios;

  Train(const WorldDef& def, unsigned seed) : world(def) {
    Generator random(seed);
    const auto part = [&] { return static_cast<float>(random() % 1000) / 1000; };
    for (int i = 0; i < 6; ++i) {
      const float radius = 0.1f + 0.3f * part(), mass = std::pow(10.0f, 3 * part() - 1);
      wheels.emplace_back(world, Vec3{0, static_cast<float>(i), 5}, radius, mass, i ? 0.0f : 6.0f,
                          i ? 0.2f * part() : 30.0f);
      if (i == 0) continue;
      ratios.push_back((random() % 2 ? 1.0f : -1.0f) * (0.4f + 2 * part()));
      world.add_joint(geared(world, wheels[wheels.size() - 2], wheels.back(), ratios.back()));
    }
    const BodyId weight = world.add(dynamic(sphere(0.2f), {2, 0, 3}, 1 + 5 * part()));
    const BodyId other = world.add(dynamic(box({0.2f, 0.1f, 0.1f}), {3, 0, 3}, 1 + 5 * part()));
    world.add_joint(pulley_joint(weight, {0, 0, 0.2f}, {2, 0.3f, 6}, other, {0.1f, 0, 0.1f}, {3, -0.5f, 6}, 6));
  }
};

TEST_P(Couplings, TrainsOfGearsHoldAndGoOnAlikeFromSnapshots) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    WorldDef def = GetParam().quiet();
    def.dt = seed % 3 == 0 ? 1.0f / 30 : seed % 3 == 1 ? 1.0f / 60 : 1.0f / 240;
    def.solver.substeps = 2 << seed % 3;
    Train train(def, seed);
    const int steps = static_cast<int>(2 / def.dt);
    for (int i = 0; i < steps; ++i) {
      train.world.step();
      for (Wheel& wheel : train.wheels) wheel.count(train.world);
    }
    for (std::size_t i = 0; i < train.ratios.size(); ++i)
      EXPECT_NEAR(train.wheels[i].turned + static_cast<double>(train.ratios[i]) * train.wheels[i + 1].turned, 0,
                  def.dt > 0.02f ? 0.8 : 0.05)
          << "seed " << seed << ", gear " << i;
    std::vector<std::byte> bytes;
    train.world.save(bytes);
    World copy(def);
    copy.restore(bytes);
    for (int i = 0; i < 60; ++i) {
      train.world.step(), copy.step();
      ASSERT_EQ(train.world.state_hash(), copy.state_hash()) << seed;
    }
  }
}

// A coupling whose row sees little of the mass it moves: a pile of crates on a lift, against a counterweight.
TEST_P(Couplings, ALiftCarriesAPile) {
  for (const auto& [dt, substeps] : {std::pair{1.0f / 60, 4}, {1.0f / 240, 8}})
    for (const float top : {1.0f, 20.0f}) {
      if (top > 1 && dt > 0.01f) continue;  // see docs/joints.md, Known faults
      WorldDef def = GetParam().quiet();
      def.dt = dt, def.solver.substeps = substeps;
      World world(def);
      const BodyId post = add_anchor(world, {0, 0, 0});
      const BodyId lift = world.add(dynamic(box({0.5f, 0.5f, 0.05f}), {0, 0, 0}));
      const Quat up = axis_angle({0, 1, 0}, -1.5707963f);
      world.add_joint(prismatic_joint(post, lift, {{}, 0, up}, {{}, 0, up}));
      for (int i = 0; i < 10; ++i)
        world.add(dynamic(box({0.2f, 0.2f, 0.2f}), {0, 0, 0.25f + 0.4f * static_cast<float>(i)}, i == 9 ? top : 1.0f));
      const BodyId weight = world.add(dynamic(sphere(0.2f), {3, 0, 0}, 10 + top));
      world.add_joint(pulley_joint(lift, {}, {0, 0, 9}, weight, {}, {3, 0, 9}, 18));
      run(world, static_cast<int>(4 / dt));
      EXPECT_NEAR(world.pose(lift).position.z, 0, 0.05f) << dt << ", " << top;
      EXPECT_NEAR(world.pose(lift).position.z + world.pose(weight).position.z, 0, 0.01f) << dt << ", " << top;
      EXPECT_LT(length(world.velocity(lift).linear), 0.05f) << dt << ", " << top;
    }
}

TEST_P(Couplings, AreAlikeForAnyNumberOfThreads) {
  std::uint64_t hashes[4];
  for (int threads = 1; threads <= 4; ++threads) {
    WorldDef def = GetParam().quiet(threads);
    Train train(def, 7);
    run(train.world, 100);
    hashes[threads - 1] = train.world.state_hash();
  }
  for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

TEST_P(Couplings, BreakAndSleep) {
  World world(GetParam().sleepy());
  const BodyId a = world.add(dynamic(sphere(0.1f), {-1, 0, 0}, 3)), b = world.add(dynamic(sphere(0.1f), {1, 0, 0}, 3));
  const JointId rope = world.add_joint(pulley_joint(a, {}, {-1, 0, 4}, b, {}, {1, 0, 4}, 8));
  run(world, 200);
  EXPECT_FALSE(world.is_awake(a)) << "it hangs from a rope";
  world.set_joint_break(rope, 20, unbreakable);
  world.step();
  ASSERT_EQ(world.joints_broken().size(), 1);
  EXPECT_NEAR(world.joints_broken()[0].force.z, 3 * 9.81f, 0.1f);
  run(world, 30);
  EXPECT_LT(world.pose(a).position.z, -1);
}

// A rope whose body had another joint may be stiffer once that is gone: saved and restored worlds have to agree.
TEST_P(Couplings, GoOnAlikeAfterAJointBesideThemHasGone) {
  for (const bool breaks : {false, true}) {
    World world(GetParam().quiet());
    const BodyId a = world.add(dynamic(sphere(0.1f), {-1, 0, 0}, 3));
    const BodyId b = world.add(dynamic(sphere(0.1f), {1, 0, 0}, 3));
    const BodyId c = world.add(dynamic(sphere(0.1f), {-1, 0, -1}, 1));
    world.add_joint(pulley_joint(a, {}, {-1, 0, 4}, b, {}, {1, 0, 4}, 8));
    const JointId beside = world.add_joint(ball_joint(a, c, {0, 0, -0.5f}, {0, 0, 0.5f}));
    run(world, 30);
    if (breaks)
      world.set_joint_break(beside, 1, 1);
    else
      world.remove_joint(beside);
    world.step();
    ASSERT_EQ(world.joint_count(), 1);
    std::vector<std::byte> bytes;
    world.save(bytes);
    World copy(GetParam().quiet());
    copy.restore(bytes);
    for (int i = 0; i < 60; ++i) {
      world.step(), copy.step();
      ASSERT_EQ(world.state_hash(), copy.state_hash()) << breaks << ", step " << i;
    }
  }
}

TEST_P(Couplings, RefuseWhatCannotBe) {
  World world(weightless());
  const BodyId a = world.add(cube({})), b = world.add(cube({0, 0, 3}));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const JointDef good = gear_joint(a, world.pose(a), {1, 0, 0}, b, world.pose(b), {1, 0, 0}, 3);
  const auto refuses = [&](const auto& spoil) {
    JointDef def = good;
    spoil(def);
    EXPECT_THROW(world.add_joint(def), Error);
  };
  refuses([&](JointDef& d) { d.ratio = nan; });
  refuses([](JointDef& d) { d.ratio = 0; });
  refuses([&](JointDef& d) { d.coupled_a.from.position.x = nan; });
  refuses([](JointDef& d) { d.coupled_b.from.rotation = {0, 0, 0, 0}; });
  refuses([](JointDef& d) { d.coupled_b.motion = static_cast<CoupledMotion>(3); });
  refuses([](JointDef& d) { d.axis(JointAxisName::x).mode = AxisMode::free; });
  refuses([](JointDef& d) { d.axis(JointAxisName::x).friction(1); });
  refuses([](JointDef& d) { d.axis(JointAxisName::y).limit(0, 1); });
  refuses([](JointDef& d) { d.cone_angle = 1; });
  EXPECT_EQ(world.joint_count(), 0);
  world.add_joint(good);
}

}  // namespace
}  // namespace fathom::test::couplings_test
