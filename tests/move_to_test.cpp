// Kinematic bodies that follow poses: World::move_to.
#include "dynamics/move_to.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fathom/error.hpp>

#include "dynamics/rotation.hpp"
#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::move_to_test {
namespace {

using namespace test;

constexpr float dt = 1.0f / 60;

BodyDef platform(Vec3 position) {
  BodyDef def;
  def.motion = MotionType::kinematic;
  def.shape = box({2, 2, 0.1f});
  def.pose.position = position;
  return def;
}

bool same(const Quat& a, const Quat& b) { return a.w == b.w && a.x == b.x && a.y == b.y && a.z == b.z; }

void expect_refused(const char* part, const std::function<void()>& act) {
  try {
    act();
    ADD_FAILURE() << "nothing was refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

}  // namespace

TEST(RotationVector, TurnsBackIntoItsQuaternion) {
  Generator random(3);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 axis = normalize(in_cube(random));
    const float angle = static_cast<float>(i) * 3.14159f / 2000;
    const Quat q = axis_angle(axis, angle);
    const Vec3 phi = rotation_vector(i % 2 ? q : Quat{-q.w, -q.x, -q.y, -q.z});
    EXPECT_NEAR(length(phi), angle, 1e-6f * (1 + angle));
    EXPECT_LT(length(phi - angle * axis), 3e-6f);
  }
  EXPECT_EQ(rotation_vector({}), Vec3{});
  EXPECT_EQ(rotation_vector({-1, 0, 0, 0}), Vec3{});
}

TEST(MoveTo, EndsTheStepAtThePoseAndStops) {
  for (const bool sleeps : {false, true}) {
    WorldDef def = sleepy_world();
    def.sleep.enabled = sleeps;
    World world(def);
    const BodyId id = world.add(platform({0, 0, 3}));
    const Pose target{{0.3f, -0.1f, 3.2f}, 0, axis_angle({1, 2, 3}, 0.4f)};
    world.move_to(id, target);
    const Velocity v = world.velocity(id);
    EXPECT_NEAR(v.linear.x, 0.3f / dt, 1e-3f);
    EXPECT_NEAR(length(v.angular), 0.4f / dt, 1e-3f);
    for (int i = 0; i < 3; ++i) {
      world.step();
      EXPECT_EQ(world.pose(id).position, target.position);
      EXPECT_TRUE(same(world.pose(id).rotation, normalize(target.rotation)));
      EXPECT_EQ(world.velocity(id).linear, Vec3{});
      EXPECT_EQ(world.velocity(id).angular, Vec3{});
    }
  }
}

TEST(MoveTo, TheLastCallBeforeAStepCounts) {
  World world(quiet_world());
  const BodyId id = world.add(platform({0, 0, 3}));
  world.move_to(id, {{5, 0, 3}, 0, {}});
  world.move_to(id, {{0.1f, 0, 3}, 0, {}});
  world.step();
  EXPECT_EQ(world.pose(id).position, (Vec3{0.1f, 0, 3}));
  world.move_to(id, {{5, 0, 3}, 0, {}});
  world.set_velocity(id, {0, 0, 0.6f}, {});
  run(world, 2);
  EXPECT_NEAR(world.pose(id).position.x, 0.1f, 1e-6f);
  EXPECT_NEAR(world.pose(id).position.z, 3.02f, 1e-5f);
  EXPECT_EQ(world.velocity(id).linear.z, 0.6f);
  world.move_to(id, {{5, 0, 3}, 0, {}});
  world.set_pose(id, {{-5, 0, 3}, 0, {}});
  world.set_velocity(id, {}, {});
  world.move_to(id, {{-5, 0.1f, 3}, 0, {}});
  run(world, 2);
  EXPECT_EQ(world.pose(id).position, (Vec3{-5, 0.1f, 3}));
  world.move_to(id, {{5, 0, 3}, 0, {}});
  world.remove(id);
  const BodyId other = world.add(platform({7, 7, 7}));
  run(world, 2);
  EXPECT_EQ(world.pose(other).position, (Vec3{7, 7, 7}));
}

TEST(MoveTo, CarriesLoadsByFriction) {
  World world(sleepy_world());
  const BodyId lift = world.add(platform({0, 0, 3}));
  const BodyId load = world.add(cube({0.5f, 0, 3.6f})), ball = world.add(dynamic(sphere(0.3f), {-1, 0, 3.4f}));
  run(world, 90);
  EXPECT_FALSE(world.is_awake(load));
  std::size_t ended = 0;
  const auto way = [](float t) {  // m, smooth
    return Vec3{0.5f * (1 - std::cos(2 * t)), 0.4f * std::sin(t), 0.5f * t};
  };
  for (int i = 1; i <= 180; ++i) {
    world.move_to(lift, {Vec3{0, 0, 3} + way(dt * static_cast<float>(i)), 0, {}});
    world.step();
    ended += world.contacts_ended().size();
  }
  EXPECT_EQ(ended, 0u);
  const Vec3 moved = world.pose(lift).position - Vec3{0, 0, 3};
  EXPECT_LT(length(world.pose(load).position - moved - Vec3{0.5f, 0, 3.6f}), 0.02f);
  EXPECT_NEAR(world.pose(ball).position.z - moved.z, 3.4f, 0.01f);
}

TEST(MoveTo, ATurntableCarriesItsLoadRound) {
  World world(sleepy_world());
  const BodyId table = world.add(platform({0, 0, 3}));
  const BodyId load = world.add(cube({1, 0, 3.6f}));
  run(world, 60);
  for (int i = 1; i <= 240; ++i) {
    world.move_to(table, {{0, 0, 3}, 0, axis_angle({0, 0, 1}, 0.01f * static_cast<float>(i))});
    world.step();
  }
  const Vec3 p = world.pose(load).position;
  EXPECT_NEAR(std::atan2(p.y, p.x), 2.4f, 0.06f);
  EXPECT_NEAR(std::hypot(p.x, p.y), 1, 0.03f);
}

TEST(MoveTo, ThePoseThatABodyHasWakesNobody) {
  World world(sleepy_world());
  Pose pose{{0, 0, 3}, 0, normalize(Quat{0.9f, 0, 0, 0.3f})};
  BodyDef def = platform(pose.position);
  def.pose = pose;
  const BodyId lift = world.add(def);
  const BodyId load = world.add(cube({0, 0, 3.6f}));
  for (int i = 0; i < 120; ++i) {
    world.move_to(lift, world.pose(lift));
    world.step();
  }
  EXPECT_FALSE(world.is_awake(load));
  pose = world.pose(lift);
  pose.position.z += 0.001f;
  world.move_to(lift, pose);
  world.step();
  EXPECT_TRUE(world.is_awake(load));
}

/// Slower than the sleeping threshold: what it carries must not be left behind.
TEST(MoveTo, ASlowPlatformLeavesNobodyBehind) {
  World world(sleepy_world());
  const BodyId lift = world.add(platform({0, 0, 3}));
  const BodyId load = world.add(cube({0, 0, 3.6f}));
  for (int i = 1; i <= 600; ++i) {
    world.move_to(lift, {{0, 0, 3 + 0.0003f * static_cast<float>(i)}, 0, {}});
    world.step();
  }
  EXPECT_NEAR(world.pose(load).position.z, 3.78f, 2e-3f);
}

TEST(MoveTo, PushesWhatIsInItsWay) {
  World world(quiet_world());
  world.add(ground());
  BodyDef wall = platform({-2, 0, 1.6f});
  wall.shape = box({0.5f, 1, 1});
  const BodyId piston = world.add(wall);
  const BodyId crate = world.add(cube({-0.9f, 0, 1}));
  for (int i = 1; i <= 120; ++i) {
    world.move_to(piston, {{-2 + 0.02f * static_cast<float>(i), 0, 1.6f}, 0, {}});
    world.step();
  }
  EXPECT_NEAR(world.pose(crate).position.x, 1.4f, 0.03f);
}

// A plate faster than its thickness a step hits a body in the air, which must end before it. The plate follows poses or
// has a velocity.
TEST(MoveTo, AFastPlateTakesAlongWhatItHits) {
  for (unsigned seed = 1; seed <= 48; ++seed) {
    Generator random(seed);
    WorldDef def = seed % 2 == 0 ? quiet_world() : sleepy_world();
    def.gravity = {};
    World world(def);
    const float size = uniform(random, 0.03f, 0.4f), speed = uniform(random, 5, 250),
                half = uniform(random, 5e-3f, 0.05f);
    const Shape shapes[] = {sphere(size), box({size, size, 0.3f * size}), capsule(0.4f * size, size), cone(size, size)};
    const Quat turned = axis_angle({uniform(random, -1, 1), uniform(random, -1, 1), 1}, uniform(random, 0, 3));
    BodyDef hit = dynamic(shapes[seed / 4 % 4], {});
    hit.pose.rotation = turned;
    const BodyId body = world.add(hit);
    BodyDef bat = platform({-1 - uniform(random, 0, 1), 0, 0});
    bat.shape = box({half, 2, 2});
    const bool follows = seed % 4 < 2;
    if (!follows) bat.velocity.linear.x = speed;
    const BodyId plate = world.add(bat);
    for (int i = 0; i < 10 + static_cast<int>(60 * 6 / speed); ++i) {
      Pose pose = world.pose(plate);
      pose.position.x += speed * dt;
      if (follows) world.move_to(plate, pose);
      world.step();
    }
    EXPECT_GT(world.pose(body).position.x, world.pose(plate).position.x) << "seed " << seed;
  }
}

TEST(MoveTo, IsInSnapshots) {
  World world(sleepy_world());
  const BodyId lift = world.add(platform({0, 0, 3}));
  world.add(cube({0, 0, 3.6f}));
  run(world, 30);
  const Pose target{{0.1f, 0, 3.05f}, 0, axis_angle({0, 0, 1}, 0.1f)};
  world.move_to(lift, target);
  std::vector<std::byte> bytes;
  world.save(bytes);
  World other(sleepy_world());
  other.restore(bytes);
  for (int i = 0; i < 10; ++i) {
    world.step();
    other.step();
    EXPECT_EQ(world.state_hash(), other.state_hash());
  }
  EXPECT_EQ(other.pose(lift).position, target.position);
}

TEST(MoveTo, RefusesOtherBodiesAndBadPoses) {
  World world(quiet_world());
  const BodyId fixed = world.add(ground()), body = world.add(cube({0, 0, 2})), lift = world.add(platform({0, 0, 9}));
  expect_refused("the body is fixed", [&] { world.move_to(fixed, {}); });
  expect_refused("the body is dynamic", [&] { world.move_to(body, {}); });
  expect_refused("position", [&] { world.move_to(lift, {{NAN, 0, 0}, 0, {}}); });
  expect_refused("rotation", [&] { world.move_to(lift, {{}, 0, {0, 0, 0, 0}}); });
}

namespace {

/// A turntable's speed (rad/s), where a crate lies on it (m), steps per second, substeps.
struct Ride {
  float spin, radius, rate;
  int substeps;
  Solver method = Solver::soft;
};

struct Turntable : testing::TestWithParam<Ride> {
  /// A world with the table, whose top is at z = 0.1 m.
  static World make(bool on_device) {
    const Ride& ride = GetParam();
    WorldDef def = quiet_world();
    if (on_device) def.simulator = SimulatorKind::device, def.device = test_device();
    def.dt = 1 / ride.rate;
    def.solver.substeps = ride.substeps;
    def.solver.method = ride.method;
    World world(def);
    BodyDef table = platform({});
    table.velocity.angular = {0, 0, ride.spin};
    world.add(table);
    return world;
  }
};

// Friction's arms must turn with the table; otherwise the crate drifts outwards by ω² Δt / 2 of its radius per second.
TEST_P(Turntable, ACrateGoesRoundWhereItLies) {
  const Ride& ride = GetParam();
  for (const bool on_device : {false, true}) {
    World world = make(on_device);
    BodyDef crate = dynamic(box({0.05f, 0.05f, 0.05f}), {ride.radius, 0, 0.15f});
    crate.velocity = {{0, ride.spin * ride.radius, 0}, 0, {0, 0, ride.spin}, 0};
    crate.material.friction = 0.9f;
    const BodyId id = world.add(crate);
    for (int i = 0; i < static_cast<int>(10 * ride.rate); ++i) world.step();
    const Vec3 p = world.pose(id).position;
    EXPECT_NEAR(std::hypot(p.x, p.y), ride.radius, 0.02f * ride.radius) << (on_device ? "device" : "native");
  }
}

// A solid ball that rolls on a turntable moves in a circle, once in 7/2 of the table's turns (J. M. Earnshaw, 1844).
// Its arm does not turn with its spin; otherwise small balls would gain spin without bound.
TEST_P(Turntable, ABallRollsInACircle) {
  const Ride& ride = GetParam();
  for (const float ball_radius : {0.008f, 0.03f, 0.1f})
    for (const bool on_device : {false, true}) {
      World world = make(on_device);
      BodyDef ball = dynamic(sphere(ball_radius), {ride.radius, 0, 0.1f + ball_radius});
      ball.velocity = {{0, 2 * ride.spin * ride.radius / 7, 0},
                       0,
                       {5 * ride.spin * ride.radius / (7 * ball_radius), 0, ride.spin},
                       0};
      ball.material.friction = 0.9f;
      const BodyId id = world.add(ball);
      constexpr float time = 5;
      for (int i = 0; i < static_cast<int>(time * ride.rate); ++i) world.step();
      const Vec3 p = world.pose(id).position;
      const float angle = 2 * ride.spin * time / 7;
      EXPECT_NEAR(p.x, ride.radius * std::cos(angle), 0.04f * ride.radius) << ball_radius << ' ' << on_device;
      EXPECT_NEAR(p.y, ride.radius * std::sin(angle), 0.04f * ride.radius) << ball_radius << ' ' << on_device;
    }
}

INSTANTIATE_TEST_SUITE_P(Rides, Turntable,
                         testing::Values(Ride{3, 0.3f, 60, 4}, Ride{3, 0.3f, 60, 16}, Ride{-3, 0.3f, 60, 4},
                                         Ride{1.5f, 1.2f, 30, 4}, Ride{4, 0.2f, 240, 2},
                                         Ride{3, 0.3f, 60, 4, Solver::impulse}));

}  // namespace
}  // namespace fathom::move_to_test
