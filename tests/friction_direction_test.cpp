// Friction that depends on direction: runners, treads and what stands on them.
#include <gtest/gtest.h>

#include <cmath>
#include <fathom/compound.hpp>
#include <string>
#include <vector>

#include "dynamics/contact_rows.hpp"
#include "random.hpp"
#include "test_surfaces.hpp"
#include "world_variants.hpp"

namespace fathom::test::friction_direction_test {
namespace {

constexpr float dt = 1.0f / 60, g = 9.81f, along = 0.1f, across = 0.8f;

class FrictionByDirection : public testing::TestWithParam<Variant> {
 protected:
  static WorldDef settings(int threads = 1) { return quiet_world(GetParam(), threads); }
  static bool is_exact() { return GetParam().solver == Solver::soft; }
};

INSTANTIATE_TEST_SUITE_P(Simulators, FrictionByDirection, testing::ValuesIn(all_variants),
                         [](const auto& of) { return std::string(of.param.name); });

/// Friction that a floor of coefficient 1 leaves unchanged.
Material runners(Vec3 axis = {1, 0, 0}) {
  Material m;
  m.friction = across, m.friction_along = along, m.friction_axis = axis;
  m.friction_rule = CombineRule::multiply;
  return m;
}

BodyDef floor_of(Material material = {.friction = 1}) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({50, 50, 0.5f});
  def.pose.position = {0, 0, -0.5f};
  def.material = material;
  return def;
}

/// On a floor at z = 0.
BodyDef sledge(Vec3 velocity = {}, Quat turned = {}) {
  BodyDef def = dynamic(box({0.5f, 0.5f, 0.1f}), {0, 0, 0.1f}, 4);
  def.pose.rotation = turned;
  def.velocity.linear = velocity;
  def.material = runners();
  return def;
}

/// Mean acceleration of a body over `steps`.
Vec3 acceleration(World& world, BodyId id, int steps = 6) {
  const Vec3 before = world.velocity(id).linear;
  run(world, steps);
  return (1 / (static_cast<float>(steps) * dt)) * (world.velocity(id).linear - before);
}

TEST_P(FrictionByDirection, RunnersGlideAlongTheirAxisAndHoldAcrossIt) {
  World world(settings());
  world.add(floor_of());
  const BodyId glides = world.add(sledge({4, 0, 0}));
  BodyDef def = sledge({0, 4, 0});
  def.pose.position.x = 5;
  const BodyId stops = world.add(def);
  run(world, 2);
  const Vec3 before = world.velocity(stops).linear;
  EXPECT_NEAR(acceleration(world, glides).x, -along * g, 0.01f * g);
  EXPECT_NEAR((world.velocity(stops).linear.y - before.y) / (6 * dt), -across * g, 0.01f * g);
  run(world, 60);
  EXPECT_LT(length(world.velocity(stops).linear), 1e-3f);
  EXPECT_GT(world.velocity(glides).linear.x, 2);
  run(world, 240);
  EXPECT_LT(length(world.velocity(glides).linear), 1e-3f);
  EXPECT_NEAR(world.pose(glides).position.x, 16 / (2 * along * g), 0.2f);
  EXPECT_NEAR(world.pose(glides).position.y, 0, 0.01f);
}

// Maximum dissipation: the friction is normal to the ellipse of velocities, so an oblique slide is braked across the
// axis first, and turns towards it.
TEST_P(FrictionByDirection, AnObliqueSlideTurnsTowardsTheAxis) {
  for (const float angle : {0.3f, 0.8f, 1.3f}) {
    World world(settings());
    world.add(floor_of());
    const BodyId id = world.add(sledge({6 * std::cos(angle), 6 * std::sin(angle), 0}));
    run(world, 1);
    const Vec3 v = world.velocity(id).linear;
    const Vec3 a = acceleration(world, id, 1);
    const float length = std::sqrt(along * along * v.x * v.x + across * across * v.y * v.y);
    EXPECT_NEAR(a.x, -along * along * v.x / length * g, 0.02f * g) << angle;
    EXPECT_NEAR(a.y, -across * across * v.y / length * g, 0.04f * g) << angle;
  }
}

TEST_P(FrictionByDirection, TheAxisTurnsWithTheBody) {
  const Quat turned = axis_angle({0, 0, 1}, 0.7f);
  const Vec3 axis = rotate(turned, {1, 0, 0}), aside = rotate(turned, {0, 1, 0});
  for (const bool is_along : {true, false}) {
    World world(settings());
    world.add(floor_of());
    const BodyId id = world.add(sledge(3 * (is_along ? axis : aside), turned));
    run(world, 2);
    const Vec3 a = acceleration(world, id);
    EXPECT_NEAR(dot(a, is_along ? axis : aside), -(is_along ? along : across) * g, 0.02f * g);
    EXPECT_NEAR(dot(a, is_along ? aside : axis), 0, 0.02f * g);
  }
}

TEST_P(FrictionByDirection, FloorsHaveAxesToo) {
  const std::vector<float> level(41 * 41, 0.0f);
  const std::vector<Material> materials{runners({0, 1, 0})};
  const std::vector<std::uint8_t> of_cells(40 * 40, 0);
  for (int kind = 0; kind < 4; ++kind) {
    World world(settings());
    BodyDef def = floor_of(runners({0, 1, 0}));
    if (kind == 1) def.shape = flat_mesh(40, 20), def.pose.position = {};
    if (kind == 2) {
      def.shape = height_field(
          {.columns = 41, .rows = 41, .cell_x = 1, .cell_y = 1, .heights = level, .materials = {materials, of_cells}});
      def.pose.position = {-20, -20, 0}, def.material = {};
    }
    if (kind == 3) {
      // A child whose x axis is the world's y axis.
      def.shape = compound(std::vector<ChildShape>{
          {.shape = box({20, 20, 0.5f}), .pose = {.rotation = axis_angle({0, 0, 1}, 0.5f * pi)}, .material = runners()},
          {.shape = box({1, 1, 0.5f}), .pose = {.position = {40, 0, 0}}}});
      def.pose.position += def.shape.compound->offset(), def.material = {};
    }
    world.add(def);
    BodyDef moves = sledge({0, 3, 0});
    moves.material = {.friction = 1};
    moves.pose.position.x = -5;
    const BodyId glides = world.add(moves);
    moves.pose.position.x = 5, moves.velocity.linear = {3, 0, 0};
    const BodyId stops = world.add(moves);
    run(world, 2);
    const Vec3 before = world.velocity(stops).linear;
    EXPECT_NEAR(acceleration(world, glides).y, -along * g, 0.02f * g) << kind;
    EXPECT_NEAR((world.velocity(stops).linear.x - before.x) / (6 * dt), -across * g, 0.02f * g) << kind;
  }
}

// tan 20° = 0.36 lies between the two coefficients. A stack on the runners must not be held by its supports, either.
TEST_P(FrictionByDirection, OnASlopeRunnersGlideDownAndHoldAcross) {
  const float slope = 20 * pi / 180;
  const Quat tilt = axis_angle({0, 1, 0}, slope);
  for (const bool is_along : {true, false})
    for (const bool is_loaded : {true, false}) {
      World world(sleepy_world(GetParam()));
      BodyDef def = floor_of();
      def.pose = {.position = rotate(tilt, {0, 0, -0.5f}), .rotation = tilt};
      world.add(def);
      BodyDef runner = sledge();
      runner.pose = {.position = rotate(tilt, {0, 0, 0.1f}),
                     .rotation = tilt * axis_angle({0, 0, 1}, is_along ? 0 : 0.5f * pi)};
      const BodyId id = world.add(runner);
      if (is_loaded) {
        BodyDef load = dynamic(box({0.4f, 0.4f, 0.1f}), rotate(tilt, {0, 0, 0.3f}), 3);
        load.pose.rotation = tilt;
        load.material.friction = 1;
        world.add(load);
      }
      run(world, 60);
      const float down = dot(world.velocity(id).linear, rotate(tilt, {1, 0, 0}));
      if (is_along) {
        EXPECT_NEAR(down, (std::sin(slope) - along * std::cos(slope)) * g, 0.1f) << is_loaded;
      } else {
        EXPECT_NEAR(down, 0, is_exact() ? 1e-3f : 0.05f) << is_loaded;
      }
    }
}

TEST_P(FrictionByDirection, NoFrictionAtAllAlongTheAxis) {
  World world(settings());
  world.add(floor_of());
  BodyDef def = sledge({2, 0, 0});
  def.material.friction_along = 0;
  const BodyId id = world.add(def);
  run(world, 300);
  EXPECT_NEAR(world.velocity(id).linear.x, 2, 1e-3f);
  EXPECT_NEAR(world.pose(id).position.x, 10, 0.01f);
}

TEST_P(FrictionByDirection, ChangesWhileRunning) {
  World world(settings());
  const BodyId ground = world.add(floor_of());
  const BodyId id = world.add(sledge({5, 0, 0}));
  run(world, 10);
  Material m = world.material(id);
  m.friction_axis = {0, 1, 0};
  world.set_material(id, m);
  run(world, 2);
  EXPECT_NEAR(acceleration(world, id).x, -across * g, 0.02f * g);
  m.friction_axis = {};
  m.friction = 0.3f;
  world.set_material(id, m);
  run(world, 1);
  EXPECT_NEAR(acceleration(world, id, 3).x, -0.3f * g, 0.02f * g);
  world.set_material(ground, {.friction = 0});
  run(world, 1);
  EXPECT_NEAR(acceleration(world, id).x, 0, 0.01f);
}

std::vector<BodyId> add_heap(World& world) {
  world.add(floor_of(runners({0, 1, 0})));
  Generator random(5);
  std::vector<BodyId> ids;
  for (int i = 0; i < 60; ++i) {
    BodyDef def = sledge();
    if (i % 3 == 1) def.shape = sphere(0.3f);
    if (i % 3 == 2) def.shape = capsule(0.2f, 0.3f);
    def.pose.position = {0.9f * static_cast<float>(i % 4), 0.9f * static_cast<float>(i / 4 % 3),
                         0.4f + 0.7f * static_cast<float>(i / 12)};
    def.velocity.linear = {uniform(random, -1, 1), uniform(random, -1, 1), 0};
    def.material = runners(on_sphere(random));
    def.material.restitution = i % 5 == 0 ? 0.4f : 0;
    ids.push_back(world.add(def));
  }
  return ids;
}

TEST_P(FrictionByDirection, HeapsAreDeterministicAndSurviveSnapshots) {
  World one(settings()), four(settings(4));
  add_heap(one), add_heap(four);
  run(one, 60), run(four, 60);
  EXPECT_EQ(one.state_hash(), four.state_hash());
  const std::vector<std::byte> bytes = saved(one);
  World restored(settings());
  restored.restore(bytes);
  run(one, 60), run(restored, 60);
  EXPECT_EQ(one.state_hash(), restored.state_hash());
}

TEST_P(FrictionByDirection, RefusesAxesWithoutUnitLength) {
  World world(settings());
  const BodyId id = world.add(sledge());
  for (const Vec3 bad : {Vec3{0.5f, 0, 0}, Vec3{1, 1, 0}, Vec3{NAN, 0, 0}}) {
    Material m;
    m.friction_axis = bad;
    try {
      world.set_material(id, m);
      ADD_FAILURE() << bad.x;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
      EXPECT_NE(std::string(error.what()).find("set material: the friction axis"), std::string::npos) << error.what();
    }
  }
  Material m = runners();
  m.friction_along = -1;
  EXPECT_THROW(world.set_material(id, m), Error);
  EXPECT_EQ(world.material(id).friction_along, along);
}

TEST(FrictionByDirectionCallback, ReportsTheLargestAndTakesOneForAllDirections) {
  for (const bool changes : {false, true}) {
    World world(quiet_world());
    world.add(floor_of());
    BodyDef def = sledge({4, 0, 0});
    def.pre_solve = true;
    const BodyId id = world.add(def);
    world.set_pre_solve_callback([&](PreSolveContact& contact) {
      EXPECT_FLOAT_EQ(contact.friction, across);
      if (changes) contact.friction = 0.4f;
    });
    run(world, 2);
    EXPECT_NEAR(acceleration(world, id).x, -(changes ? 0.4f : along) * g, 0.02f * g);
  }
}

/// The nearest point of the ellipse, by bisection in double precision.
void nearest_in_ellipse(double ratio, double u, double v, double& x, double& y) {
  x = u, y = v;
  if (u * u + v * v / (ratio * ratio) <= 1) return;
  double low = 0, high = std::hypot(u, ratio * v);
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high), p = u / (1 + middle), q = ratio * v / (ratio * ratio + middle);
    (p * p + q * q > 1 ? low : high) = middle;
  }
  x = u / (1 + high), y = ratio * ratio * v / (ratio * ratio + high);
}

TEST(FrictionEllipse, LimitsToTheNearestImpulse) {
  Generator random(3);
  for (int i = 0; i < 100000; ++i) {
    const float ratio = std::pow(10.0f, uniform(random, -1.3f, 0)), angle = uniform(random, 0, 2 * pi),
                towards = uniform(random, 0, 2 * pi), size = std::pow(10.0f, uniform(random, -3, 6)),
                most = std::pow(10.0f, uniform(random, -6, 6));
    const float cosine = std::cos(angle), sine = std::sin(angle);
    const float u = size * std::cos(towards), v = size * std::sin(towards);
    const FrictionImpulse<float> now =
        limited_to_ellipse((1 - ratio) * cosine, (1 - ratio) * sine, most,
                           FrictionImpulse<float>{most * (cosine * u - sine * v), most * (sine * u + cosine * v), 7});
    double x = 0, y = 0;
    const double r = static_cast<double>(ratio);
    nearest_in_ellipse(r, static_cast<double>(u), static_cast<double>(v), x, y);
    const auto got_x = static_cast<double>((cosine * now.slide_1 + sine * now.slide_2) / most),
               got_y = static_cast<double>((cosine * now.slide_2 - sine * now.slide_1) / most);
    ASSERT_NEAR(got_x, x, 2e-3) << i << " ratio " << ratio << " at " << u << ", " << v;
    ASSERT_NEAR(got_y / r, y / r, 5e-3) << i << " ratio " << ratio << " at " << u << ", " << v;
    ASSERT_LE(got_x * got_x + got_y * got_y / (r * r), 1.001);
    ASSERT_EQ(now.twist, 7);
  }
}

TEST(FrictionEllipse, IsFiniteForAllFloats) {
  Generator random(4);
  for (int i = 0; i < 200000; ++i) {
    const auto any = [&] { return (random() % 2 ? 1.0f : -1.0f) * std::pow(10.0f, uniform(random, -38, 18)); };
    const float part = random() % 4 ? uniform(random, 0, 1) : 1.0f, angle = uniform(random, 0, 2 * pi);
    const float most = random() % 5 ? std::abs(any()) : 0;
    const FrictionImpulse<float> now = limited_to_ellipse(part * std::cos(angle), part * std::sin(angle), most,
                                                          FrictionImpulse<float>{any(), random() % 5 ? any() : 0, 0});
    ASSERT_TRUE(std::isfinite(now.slide_1) && std::isfinite(now.slide_2)) << i;
    ASSERT_LE(std::hypot(now.slide_1, now.slide_2), 1.0001f * most) << i;
  }
}

TEST(FrictionEllipse, CombinesBothSidesAlongTheStrongerAxis) {
  const SideFriction plain{0.5f, 0, {}, CombineRule::geometric_mean};
  const SideFriction ski{0.8f, 0.05f, {1, 0, 0}, CombineRule::geometric_mean};
  const auto e = friction_ellipse(plain, ski, {0, 0, 1});
  EXPECT_NEAR(e.coefficient, std::sqrt(0.4f), 1e-6f);
  EXPECT_NEAR(std::abs(e.grain.y), 1 - std::sqrt(0.05f / 0.8f), 1e-6f);
  EXPECT_NEAR(e.grain.x, 0, 1e-6f);
  // Along the normal an axis has no effect.
  const auto upright = friction_ellipse(plain, {0.8f, 0.05f, {0, 0, 1}, CombineRule::geometric_mean}, {0, 0, 1});
  EXPECT_NEAR(upright.coefficient, std::sqrt(0.4f), 1e-6f);
  EXPECT_NEAR(length(upright.grain), 0, 1e-6f);
  // Two skis on each other.
  const auto crossed = friction_ellipse(ski, {0.8f, 0.05f, {0, 1, 0}, CombineRule::geometric_mean}, {0, 0, 1});
  EXPECT_NEAR(crossed.coefficient, 0.2f, 1e-6f);
  EXPECT_NEAR(length(crossed.grain), 0, 1e-6f);
  const auto none = friction_ellipse({0, 0, {1, 0, 0}, CombineRule::minimum}, ski, {0, 0, 1});
  EXPECT_EQ(none.coefficient, 0);
  EXPECT_EQ(none.grain, Vec3{});
}

}  // namespace
}  // namespace fathom::test::friction_direction_test
