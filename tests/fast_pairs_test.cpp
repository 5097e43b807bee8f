// Bodies that move by much of their size within a step: they stop at what they hit, and do not affect what they pass.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "dynamics/time_of_impact.hpp"
#include "random.hpp"
#include "validate/bodies.hpp"
#include "validate/exact_overlap.hpp"
#include "validate/shots.hpp"
#include "world_fixture.hpp"

namespace fathom::test::fast_pairs_test {
namespace {

using validate::wide;

using Where = validate::Setup;

Where of_device() { return {.simulator = SimulatorKind::device, .device = test_device()}; }
Where of_hybrid() { return {.simulator = SimulatorKind::hybrid, .device = test_device()}; }

TEST(FastPairs, NothingIsFoundInsideOrBehindWhatItHit) {
  for (const Where& setup : {Where{}, of_device(), of_hybrid()})
    for (std::uint64_t seed = 200; seed < 400; ++seed)
      EXPECT_EQ(validate::too_deep(validate::shot_at(seed), setup), 0) << "seed " << seed;
}

TEST(FastPairs, WhatPassesAtAClearanceLeavesNoTrace) {
  for (const Where& setup : {Where{}, of_device(), of_hybrid()})
    for (std::uint64_t seed = 1; seed <= 300; ++seed)
      EXPECT_FALSE(validate::leaves_a_trace(validate::shot_past(seed), setup)) << "seed " << seed;
}

TEST(FastPairs, NothingIsFoundInsideOrBehindAFreeBodyThatItHit) {
  for (const Where& setup : {Where{}, of_device(), of_hybrid()})
    for (std::uint64_t seed = 1; seed <= 500; ++seed)
      EXPECT_EQ(validate::too_deep(validate::shot_at_free(seed), setup), 0) << "seed " << seed;
}

TEST(FastPairs, ABodyMayBecomeABulletAndIsOneAfterARestore) {
  WorldDef def;
  def.gravity = {};
  def.threads = 1;
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid}) {
    def.simulator = simulator;
    def.device = "host";
    World world(def);
    const BodyId id = world.add({.shape = sphere(0.05f)});
    EXPECT_FALSE(world.is_bullet(id));
    world.step();
    world.set_bullet(id, true);
    world.step();
    std::vector<std::byte> bytes;
    world.save(bytes);
    World copy(def);
    copy.restore(bytes);
    EXPECT_TRUE(copy.is_bullet(id));
    // A movable plate of 2 mm: a body that is not a bullet may end up behind it.
    const auto ends_in_front = [&](World& in) {
      BodyDef plate{.shape = box({0.001f, 1, 1})};
      plate.pose.position = {2.3f, 0, 0};
      plate.mass = 10;
      const BodyId target = in.add(plate);
      in.set_pose(id, {});
      in.set_velocity(id, {700, 0, 0}, {});
      for (int i = 0; i < 3; ++i) {
        in.step();
        if (in.pose(id).position.x > in.pose(target).position.x) return false;
      }
      return true;
    };
    EXPECT_TRUE(ends_in_front(copy));
    EXPECT_TRUE(ends_in_front(world));
  }
}

TEST(FastPairs, WhatPassesAFreeBodyAtAClearanceLeavesNoTrace) {
  for (const Where& setup : {Where{}, of_device(), of_hybrid()})
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      validate::Shot shot = validate::shot_past(seed);
      shot.target.motion = MotionType::dynamic;
      EXPECT_FALSE(validate::leaves_a_trace(shot, setup)) << "seed " << seed;
    }
}

/// Shots at free bodies, each far from the others and without restitution.
struct Range {
  World world;
  std::vector<BodyId> ids;

  Range(std::uint64_t first, int count, int threads, SimulatorKind simulator = SimulatorKind::native)
      : world(definition(threads, simulator)) {
    for (int i = 0; i < count; ++i) {
      const validate::Shot shot = validate::shot_at_free(first + static_cast<std::uint64_t>(i));
      for (BodyDef body : {shot.target, shot.bullet}) {
        body.material.restitution = 0;
        body.pose.position += Vec3{0, 0, 200.0f * static_cast<float>(i)};
        ids.push_back(world.add(body));
      }
    }
  }

  static WorldDef definition(int threads, SimulatorKind simulator) {
    WorldDef def;
    def.simulator = simulator;
    def.device = "host";
    def.gravity = {};
    def.threads = threads;
    def.sleep.enabled = false;
    return def;
  }
};

TEST(FastPairs, HitsOnFreeBodiesKeepMomentumAndAddNoEnergy) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Range range(seed, 1, 1, seed % 2 == 0 ? SimulatorKind::device : SimulatorKind::native);
    double scale = 0, energy_at_first = 0;
    Vec3d start;
    for (int step = 0; step < 60; ++step) {
      double energy = 0;
      Vec3d momentum;
      for (const BodyId id : range.ids) {
        const Velocity v = range.world.velocity(id);
        const MassProperties mass = range.world.mass_properties(id);
        const Vec3 spin = inverse_rotate(range.world.pose(id).rotation, v.angular);
        energy += 0.5 * (wide(mass.mass) * wide(length_squared(v.linear)) + wide(dot(spin, mass.inertia * spin)));
        momentum = momentum + wide(mass.mass) * to_double(v.linear);
        if (step == 0) scale += wide(mass.mass) * wide(length(v.linear));
      }
      if (step == 0) start = momentum, energy_at_first = energy;
      EXPECT_LE(energy, (1 + 1e-5) * energy_at_first) << "seed " << seed << " step " << step;
      // In 1,000 shots the largest error is 8.7e-4, even with nothing held back.
      EXPECT_LE(length(momentum - start), 1e-3 * scale) << "seed " << seed << " step " << step;
      range.world.step();
    }
  }
}

TEST(FastPairs, ShotsAtFreeBodiesAreTheSameOnAnyNumberOfThreads) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid}) {
    Range one(1, 300, 1, simulator), two(1, 300, 2, simulator), four(1, 300, 4, simulator);
    for (int step = 0; step < 60; ++step) {
      for (Range* range : {&one, &two, &four}) range->world.step();
      ASSERT_EQ(one.world.state_hash(), two.world.state_hash()) << step;
      ASSERT_EQ(one.world.state_hash(), four.world.state_hash()) << step;
    }
  }
}

// The least separation over the steps of a cube of 6 cm, shot along (1, 0, −1) at a crate of 1 m from various
// positions.
TEST(FastPairs, CubesShotAtTheEdgeOfACrateStayOutside) {
  for (const float speed : {30.0f, 100.0f, 200.0f})
    for (int i = 0; i < 60; ++i) {
      World world(quiet_world());
      BodyDef crate;
      crate.motion = MotionType::fixed;
      crate.shape = box({0.5f, 0.5f, 0.5f});
      world.add(crate);
      BodyDef bullet = dynamic(box({0.03f, 0.03f, 0.03f}), {});
      const float back = 2 + speed / 60 * static_cast<float>(i) / 60;
      bullet.pose.position = {-0.5f - back, 0.01f * static_cast<float>(i % 7), back};
      bullet.velocity.linear = {speed * std::sqrt(0.5f), 0, -speed * std::sqrt(0.5f)};
      const BodyId id = world.add(bullet);
      const validate::Solid solid(crate.shape, {});
      Vec3 before = bullet.pose.position;
      for (int step = 0; step < 60; ++step) {
        world.step();
        const Pose now = world.pose(id);
        EXPECT_LT(validate::overlap_depth(solid, validate::Solid(bullet.shape, now)), 0.005) << speed << ' ' << i;
        // No step leads from above the crate's face to beyond it.
        EXPECT_FALSE(before.x < -0.5f && now.position.x > 0.5f) << speed << ' ' << i;
        before = now.position;
      }
    }
}

/// Discs, plates and rods of 1 to 30 mm, some as thin as 20 µm, that fall spinning on a floor of 2 cm, which they could
/// all pass within a step.
BodyDef falling_disc(Generator& random, int kind) {
  const float radius = 0.001f * std::pow(30.0f, uniform(random, 0, 1));
  const float half = radius * std::pow(50.0f, uniform(random, -1, 0));
  BodyDef body{.shape = kind == 0   ? cylinder(radius, half, 16)
                        : kind == 1 ? box({radius, half, radius * uniform(random, 0.2f, 1)})
                                    : capsule(half, radius)};
  body.pose.position.y = (radius + half) * uniform(random, 1, 1.8f);
  body.pose.rotation = any_rotation(random);
  const Vec3 along = in_cube(random);
  body.velocity.linear = {2 * along.x, -std::exp(uniform(random, -1, 3)), 2 * along.z};
  body.velocity.angular = std::exp(uniform(random, 0, 7)) * in_cube(random);
  return body;
}

// A hit throws a body aside within the step, into a plate that is no pair of it.
TEST(FastPairs, WhatAHitThrowsAsideStopsAtWhatLiesBeside) {
  struct Case {
    SimulatorKind simulator;
    BroadPhase broad_phase;
  };
  using enum BroadPhase;
  for (const Case& c :
       {Case{SimulatorKind::native, tree}, {SimulatorKind::device, tree}, {SimulatorKind::device, sweep}})
    for (std::uint32_t seed = 1; seed <= 60; ++seed) {
      std::mt19937 random(seed);
      WorldDef def;
      def.gravity = {};
      def.threads = 1;
      def.simulator = c.simulator, def.device = test_device(), def.broad_phase = c.broad_phase;
      World world(def);
      const float size = uniform(random, 0.03f, 0.1f), away = size * uniform(random, 5, 9);
      BodyDef thrown{.shape = seed % 3 == 0 ? box({size, size, size}) : sphere(size)};
      thrown.material.restitution = 0.5f;
      const BodyId id = world.add(thrown);
      BodyDef plate{.shape = box({60, 0.01f, 60})};
      plate.motion = seed % 2 == 0 ? MotionType::kinematic : MotionType::fixed;
      plate.pose.position = {0, away, 0};
      const BodyId wall = world.add(plate);
      if (seed % 2 == 0) world.set_velocity(wall, {0, uniform(random, -0.5f, 0.5f), 0}, {});
      BodyDef hitter = thrown;
      hitter.shape = sphere(2 * size), hitter.density = 5000;
      hitter.pose.position = {-3 * size - uniform(random, 0.5f, 2), -size * uniform(random, 1, 2), 0};
      hitter.velocity.linear = {uniform(random, 60, 150), 0, 0};
      world.add(hitter);
      for (int i = 0; i < 12; ++i) {
        world.step();
        ASSERT_LT(world.pose(id).position.y, world.pose(wall).position.y)
            << "seed " << seed << (c.simulator == SimulatorKind::native ? "" : " on the device")
            << (c.broad_phase == sweep ? ", sweep" : "");
      }
    }
}

TEST(FastPairs, SmallSpinningDiscsDoNotFallThroughAFloor) {
  constexpr int side = 20;
  constexpr float spacing = 0.19f;
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid})
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      Generator random(seed);
      WorldDef def = Range::definition(1, simulator);
      def.gravity = {0, -9.81f, 0};
      World world(def);
      BodyDef floor{.shape = box({10, 0.01f, 10})};
      floor.motion = MotionType::fixed;
      floor.pose.position.y = -0.01f;
      world.add(floor);
      std::vector<BodyId> ids;
      for (int i = 0; i < side * side; ++i) {
        BodyDef body = falling_disc(random, i % 3);
        body.pose.position.x = spacing * static_cast<float>(i % side - side / 2);
        body.pose.position.z = spacing * static_cast<float>(i / side - side / 2);
        ids.push_back(world.add(body));
      }
      for (int step = 0; step < 30; ++step) world.step();
      for (const BodyId id : ids)
        EXPECT_GT(world.pose(id).position.y, -0.01f) << "seed " << seed << ", body " << id.index;
    }
}

TEST(FastPairs, AnElasticBallKeepsItsSpeedOffAWallWhereverInAStepItMeetsIt) {
  for (int i = 0; i < 20; ++i) {
    WorldDef def = quiet_world();
    def.gravity = {};
    World world(def);
    BodyDef wall;
    wall.motion = MotionType::fixed;
    wall.shape = box({0.1f, 5, 5});
    wall.material.restitution = 1;
    world.add(wall);
    BodyDef ball = dynamic(sphere(0.02f), {-5 - 0.07f * static_cast<float>(i), 0, 0});
    ball.velocity.linear = {100, 0, 0};
    ball.material.restitution = 1;
    const BodyId id = world.add(ball);
    for (int step = 0; step < 12; ++step) world.step();
    EXPECT_NEAR(world.velocity(id).linear.x, -100, 1e-3f) << i;
  }
}

// A slab of tiles laid edge to edge: bodies sliding over their seams are not stopped by them.
TEST(FastPairs, SeamsOfTilesDoNotStopWhatSlidesFastOverThem) {
  World world(quiet_world());
  for (int i = 0; i < 60; ++i) {
    BodyDef tile;
    tile.motion = MotionType::fixed;
    tile.shape = box({0.5f, 0.5f, 0.1f});
    tile.pose.position = {static_cast<float>(i), 0, -0.1f};
    tile.material.friction = 0;
    world.add(tile);
  }
  BodyDef sledge = dynamic(box({0.1f, 0.1f, 0.05f}), {0, 0, 0.05f});
  sledge.material.friction = 0;
  const BodyId id = world.add(sledge);
  for (int step = 0; step < 30; ++step) world.step();
  world.set_velocity(id, {30, 0, 0}, {});
  for (int step = 0; step < 100; ++step) {
    world.step();
    ASSERT_NEAR(world.velocity(id).linear.x, 30, 0.01f) << step;
    ASSERT_NEAR(world.pose(id).position.z, 0.05f, 0.003f) << step;
  }
}

// The arm's centre rests, but its side pushes the rod on: a rod that slid down along its edge was held back to where it
// began in every step, so it hung in the air while it gained speed.
TEST(FastPairs, ARodFallsPastATurningArm) {
  for (const Where& where : {Where{}, of_device(), of_hybrid()}) {
    World world(world_def(where));
    BodyDef arm;
    arm.motion = MotionType::kinematic;
    arm.shape = box({0.139704958f, 1.05412555f, 0.153849974f});
    arm.pose.position = {0, 0, 1.97514439f};
    arm.velocity.angular = {0, 0, 0.923155487f};
    world.add(arm);
    BodyDef rod = dynamic(capsule(0.0382521152f, 0.125890002f), {-0.22961247f, 0.635304928f, 2.29806089f}, 1.4f);
    rod.pose.rotation = {-0.0274312645f, -0.0254740734f, 0.986452818f, -0.159716874f};
    const BodyId id = world.add(rod);
    for (int i = 0; i < 60; ++i) world.step();
    EXPECT_LT(world.pose(id).position.z, 0);
    EXPECT_GT(world.velocity(id).linear.z, -9.9f);
  }
}

// A slowly growing bound proves nothing within a step: tumbling hulls that stay a centimetre apart pass, and are found
// to.
TEST(FastPairs, WhatTurnsBesideAnotherIsFoundToPass) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(-1, 1);
  constexpr float dt = 1.0f / 60, skin = 0.001f;
  int crept = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto vector = [&](float size) { return size * Vec3{unit(random), unit(random), unit(random)}; };
    const Geometry shape{ShapeType::box, 0, {0.5f + 0.2f * unit(random), 0.5f, 0.5f}, {}};
    const float radius = bounding_radius(shape);
    const Vec3 away = normalize(vector(1) + Vec3{0, 0, 1.5f});
    const Mover a{shape, radius, {{}, 0, {}}, {vector(5), 0, vector(20), 0}};
    const Mover b{shape, radius, {1.2f * away, 0, {}}, {vector(5), 0, vector(20), 0}};
    const NearCores cores = near_cores(a, b, dt, skin);
    const Impact impact = first_impact(a, b, cores, dt, skin, away);
    // Against the gap at many moments.
    float meets = 2 * dt;
    for (int k = 0; k <= 200 && meets > dt; ++k) {
      const float time = dt * static_cast<float>(k) / 200;
      const Pose at_a = advanced(a.pose, a.velocity, time), at_b = advanced(b.pose, b.velocity, time);
      const Vec3 n = direction_apart(cores, at_a, at_b, away, 1e-5f);
      if (separation_along(cores, at_a, at_b, n) <= 0) meets = time;
    }
    if (meets <= dt) {
      EXPECT_TRUE(impact.meets) << i;
      EXPECT_LE(impact.time, meets) << i;
    }
    crept += impact.meets && impact.gap > skin;
  }
  EXPECT_LE(crept, 10);  // the search ended without a result
}

// The distance of a point from a box is known: the bound must not exceed it, and must be as good.
TEST(FastPairs, TheGapOfAPointAndABoxIsItsDistance) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const double size = std::pow(10.0, 2 * unit(random));
    const auto side = [&] { return static_cast<float>(size * (0.05 + std::abs(unit(random)))); };
    const Vec3 half{side(), side(), side()};
    const auto place = [&] { return static_cast<float>(4 * size * unit(random)); };
    const Vec3 p{place(), place(), place()};
    const auto beyond = [](float x, float h) { return std::max(std::abs(wide(x)) - wide(h), 0.0); };
    const double distance = std::hypot(beyond(p.x, half.x), beyond(p.y, half.y), beyond(p.z, half.z));
    if (distance < 0.01 * size) continue;
    const Core a = core_of(Geometry{ShapeType::box, 0, half, {}}),
               b = core_of(Geometry{ShapeType::sphere, 0.1f, {}, {}});
    const Gap gap = gap_between(a, b, make_frame({p, 0, {}}), p, 1e-5f * static_cast<float>(size));
    EXPECT_LE(wide(gap.distance), distance + 1e-5 * size);
    EXPECT_GE(wide(gap.distance), 0.998 * distance - 3e-5 * size);
  }
}

}  // namespace
}  // namespace fathom::test::fast_pairs_test
