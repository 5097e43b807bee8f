// Bodies on meshes and height fields: rolling, edges that stop bodies, shots, moving surfaces, equal results.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/support.hpp"
#include "random.hpp"
#include "test_surfaces.hpp"
#include "world_fixture.hpp"

namespace fathom::test::surface_motion_test {
namespace {

World world_on(const BodyDef& ground, int threads = 1) {
  WorldDef def = sleepy_world();
  def.threads = threads;
  World world(def);
  world.add(ground);
  return world;
}

BodyDef body_at(const Shape& shape, Vec3 position, Vec3 velocity = {}) {
  BodyDef def;
  def.shape = shape;
  def.pose.position = position;
  def.velocity.linear = velocity;
  return def;
}

/// A closed box as a mesh of twelve triangles.
Shape box_mesh(Vec3 half) {
  std::vector<Vec3> v;
  for (int i = 0; i < 8; ++i)
    v.push_back({i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z});
  const std::uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  std::vector<std::uint32_t> indices;
  for (const auto& f : faces)
    for (const std::uint32_t k : {f[0], f[1], f[2], f[0], f[2], f[3]}) indices.push_back(k);
  return mesh(v, indices);
}

const char* name_of(const Shape& shape) {
  constexpr const char* names[] = {"sphere", "capsule", "box", "hull"};
  return names[static_cast<int>(shape.type)];
}

TEST(SurfaceMotion, ABallRollsStraightOverADenseMesh) {
  for (const float cell : {0.07f, 0.4f})
    for (const float speed : {1.0f, 6.0f}) {
      World world = world_on(fixed(flat_mesh(static_cast<int>(80 / cell), 40)));
      const Vec3 velocity{speed * std::cos(0.3f), speed * std::sin(0.3f), 0};
      BodyDef ball = body_at(sphere(0.3f), {-35, -10, 0.3f}, velocity);
      ball.velocity.angular = (1 / 0.3f) * cross({0, 0, 1}, velocity);
      const BodyId id = world.add(ball);
      const int steps = static_cast<int>(60 * 60 / speed);
      for (int i = 0; i < steps; ++i) world.step();
      const Vec3 way = world.pose(id).position - ball.pose.position;
      const float along = dot(way, (1 / speed) * velocity);
      EXPECT_NEAR(along, speed * static_cast<float>(steps) / 60, 0.02f) << "cell " << cell << ", " << speed << " m/s";
      EXPECT_LT(length(way - (along / speed) * velocity), 0.002f) << "cell " << cell << ", " << speed << " m/s";
    }
}

/// Mechanical energy per kilogram (J/kg) of a body with this radius of gyration (m).
float energy(const World& world, BodyId id, float gyration) {
  const Velocity v = world.velocity(id);
  return 0.5f * length_squared(v.linear) + 0.5f * gyration * gyration * length_squared(v.angular) +
         9.81f * world.pose(id).position.z;
}

// The device lists triangles and touches; a pair that finds no room there is collided in another way.
TEST(SurfaceMotion, APlateRestsOnMoreTrianglesThanListsHold) {
  std::uint64_t hashes[2];
  for (const int threads : {1, 3}) {
    WorldDef def;
    def.simulator = SimulatorKind::device;
    def.device = "host";
    def.threads = threads;
    World world(def);
    world.add(fixed(flat_mesh(80, 2.5f)));
    const BodyId plate = world.add(body_at(box({2.2f, 2.2f, 0.1f}), {0, 0, 0.1f}));
    const BodyId ball = world.add(body_at(sphere(0.1f), {2.35f, 2.35f, 0.1f}));
    for (int i = 0; i < 20; ++i) world.step();
    EXPECT_NEAR(world.pose(plate).position.z, 0.1f, 2e-3f);
    EXPECT_NEAR(world.pose(ball).position.z, 0.1f, 2e-3f);
    EXPECT_LT(length(world.velocity(plate).linear), 0.01f);
    hashes[threads / 3] = world.state_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(SurfaceMotion, ABallInABowlGainsNoEnergy) {
  for (const int cells : {20, 60, 200}) {
    // Within a step a body moves straight on, into ground that bends up; in a long step that lifts it.
    WorldDef def = sleepy_world();
    def.dt = 1.0f / 240;
    World world(def);
    world.add(fixed(grid_mesh(cells, 5, [](float x, float y) { return 0.1f * (x * x + y * y); })));
    const BodyId id = world.add(body_at(sphere(0.2f), {2.5f, 0, 0.9f}, {0, 1, 0}));
    const float gyration = std::sqrt(0.4f) * 0.2f;
    for (int i = 0; i < 240; ++i) world.step();
    const float start = energy(world, id, gyration);
    float most = start;
    for (int i = 0; i < 7200; ++i) {
      world.step();
      most = std::max(most, energy(world, id, gyration));
    }
    EXPECT_LT(most, start + 0.05f) << cells;
  }
}

TEST(SurfaceMotion, RealEdgesHold) {
  // A step of 0.4 m: bodies that slide against it stop, at any of its triangles.
  std::vector<Vec3> v;
  std::vector<std::uint32_t> indices;
  constexpr int strips = 40;
  for (int j = 0; j <= strips; ++j) {
    const float y = -4 + 0.2f * static_cast<float>(j);
    for (const Vec3 p : {Vec3{-20, y, 0}, Vec3{2, y, 0}, Vec3{2, y, 0.4f}, Vec3{20, y, 0.4f}}) v.push_back(p);
  }
  for (std::uint32_t j = 0; j < strips; ++j)
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t a = 4 * j + i;
      for (const std::uint32_t k : {a, a + 1, a + 5, a, a + 5, a + 4}) indices.push_back(k);
    }
  const Shape stairs = mesh(v, indices);
  for (const float speed : {1.0f, 4.0f, 20.0f})
    for (const Shape& shape : shapes_of(0.3f)) {
      BodyDef ground = fixed(stairs);
      ground.material.friction = 0;
      World world = world_on(ground);
      BodyDef body = body_at(shape, {-1, 0.07f, -bounds(geometry(shape), Pose{}).lower.z}, {speed, 0, 0});
      body.material.friction = 0;
      const BodyId id = world.add(body);
      for (int i = 0; i < 240; ++i) world.step();
      const Vec3 end = world.pose(id).position;
      const float reach = bounds(geometry(shape), world.pose(id)).upper.x;
      // Fast bodies may tip over the edge, but not penetrate it.
      if (speed < 10) {
        EXPECT_LT(reach, 2.02f) << name_of(shape) << " at " << speed << " m/s";
      }
      EXPECT_GT(end.z, end.x < 2 ? 0.1f : 0.5f) << name_of(shape) << " at " << speed << " m/s";
    }
  // A body placed on the upper floor's rim stays if its centre is on it, and falls off otherwise.
  for (const float x : {2.05f, 1.95f}) {
    World world = world_on(fixed(stairs));
    const BodyId id = world.add(body_at(box({0.3f, 0.24f, 0.15f}), {x, 0.1f, 0.55f}));
    for (int i = 0; i < 240; ++i) world.step();
    const float z = world.pose(id).position.z;
    EXPECT_TRUE(x > 2 ? std::abs(z - 0.55f) < 0.005f : z < 0.5f) << "from " << x << " to a height of " << z;
  }
}

TEST(SurfaceMotion, ABallRestsInACrackAndOnARidge) {
  // A crack of 90° along y, and a ridge.
  const auto v_shape = [](float sign) { return grid_mesh(20, 5, [=](float x, float) { return sign * std::abs(x); }); };
  {
    World world = world_on(fixed(v_shape(1)));
    const BodyId id = world.add(body_at(sphere(0.3f), {0.4f, 0.1f, 1.5f}));
    for (int i = 0; i < 600; ++i) world.step();
    const Pose pose = world.pose(id);
    EXPECT_NEAR(pose.position.x, 0, 0.002f);
    EXPECT_NEAR(pose.position.z, 0.3f * std::numbers::sqrt2_v<float>, 0.004f);
  }
  World world = world_on(fixed(v_shape(-1)));
  BodyDef plank = body_at(box({0.8f, 0.2f, 0.05f}), {0, 0.1f, 0.06f});
  const BodyId id = world.add(plank);
  for (int i = 0; i < 120; ++i) world.step();
  EXPECT_NEAR(world.pose(id).position.z, 0.05f, 0.003f) << "balanced over the ridge";
}

/// Random shots at a closed box as a mesh: none ends inside or behind it.
TEST(SurfaceMotion, NothingPassesTriangles) {
  const Shape crate = box_mesh({0.5f, 0.5f, 0.5f});
  Generator random(5);
  for (int i = 0; i < 600; ++i) {
    WorldDef def = sleepy_world();
    def.gravity = {};
    World world(def);
    world.add(fixed(crate));
    const float size = std::exp(uniform(random, std::log(0.01f), std::log(0.3f)));
    const float speed = std::exp(uniform(random, std::log(5.0f), std::log(1000.0f)));
    const std::vector<Shape> shapes = shapes_of(size);
    const Shape rod = box({size, 0.05f * size, 0.05f * size});
    const int kind = static_cast<int>(uniform(random, 0, 4.999f));
    const Shape& shape = kind == 4 ? rod : shapes[static_cast<std::size_t>(kind)];
    const Vec3 target{uniform(random, -0.45f, 0.45f), uniform(random, -0.45f, 0.45f), uniform(random, -0.45f, 0.45f)};
    Vec3 from{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    from = (2.0f / std::max(length(from), 0.1f)) * from;
    BodyDef body = body_at(shape, from, speed * normalize(target - from));
    body.pose.rotation = normalize(
        Quat{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1f, 1)});
    body.velocity.angular = {uniform(random, -80, 80), uniform(random, -80, 80), uniform(random, -80, 80)};
    const BodyId id = world.add(body);
    bool was_inside = false;
    for (int step = 0; step < 60; ++step) {
      world.step();
      was_inside |= max_component(abs(world.pose(id).position)) < 0.499f;
    }
    // Beyond the crate along its path: it passed through.
    const Vec3 end = world.pose(id).position;
    was_inside |= dot(end, target - from) > 0 && length(cross(end, normalize(target - from))) < 0.05f &&
                  length(end) > 1 && length(cross(from, normalize(target - from))) < 0.3f;
    EXPECT_FALSE(was_inside) << "shot " << i << " of size " << size << " at " << speed << " m/s";
  }
}

TEST(SurfaceMotion, ALiftAndATurntableCarry) {
  for (const Shape& shape : shapes_of(0.3f)) {
    BodyDef lift = fixed(flat_mesh(40, 2));
    lift.motion = MotionType::kinematic;
    lift.velocity.linear = {0.4f, 0, 0.5f};
    World world = world_on(lift);
    const BodyId id = world.add(body_at(shape, {0.1f, 0.2f, 0.31f}));
    for (int i = 0; i < 180; ++i) world.step();
    EXPECT_NEAR(world.pose(id).position.z, 1.5f + 0.3f, 0.32f) << name_of(shape);
    EXPECT_GT(world.pose(id).position.z, 1.5f) << name_of(shape);
    if (shape.type == ShapeType::box) {
      EXPECT_NEAR(world.velocity(id).linear.x, 0.4f, 0.01f);
      EXPECT_NEAR(world.velocity(id).linear.z, 0.5f, 0.01f);
    }
  }
  BodyDef table = fixed(flat_mesh(40, 2));
  table.motion = MotionType::kinematic;
  table.velocity.angular = {0, 0, 1};
  World world = world_on(table);
  const BodyId id = world.add(body_at(box({0.2f, 0.2f, 0.1f}), {1, 0, 0.1f}));
  for (int i = 0; i < 600; ++i) world.step();
  EXPECT_NEAR(std::hypot(world.pose(id).position.x, world.pose(id).position.y), 1, 0.02f);
  EXPECT_NEAR(world.velocity(id).angular.z, 1, 0.01f);
}

TEST(SurfaceMotion, AnyNumberOfThreadsGivesTheSameBits) {
  const BodyDef grounds[] = {fixed(wavy_mesh(60)), fixed(wavy_field(41), {-5, -5, 0})};
  for (const BodyDef& ground : grounds) {
    std::uint64_t expected = 0;
    for (const int threads : {1, 2, 4}) {
      World world = world_on(ground, threads);
      for (const BodyDef& body : mixed_bodies(400)) world.add(body);
      for (int i = 0; i < 240; ++i) world.step();
      if (threads == 1) expected = world.state_hash();
      EXPECT_EQ(world.state_hash(), expected) << threads << " threads";
    }
  }
}

TEST(SurfaceMotion, NobodyFallsThroughRandomHills) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Generator random(seed);
    const float cell = uniform(random, 0.05f, 0.6f);
    const auto height = [](float x, float y) {
      return 0.6f * std::sin(0.9f * x) * std::cos(0.7f * y) + 0.15f * std::sin(3.1f * x + 1) * std::sin(2.7f * y) +
             0.04f * (x * x + y * y);
    };
    const int cells = static_cast<int>(12 / cell);
    World world = world_on(fixed(grid_mesh(cells, 6, height)));
    for (const float side : {-6.5f, 6.5f}) {
      world.add(fixed(box({0.5f, 7, 40}), {side, 0, 35}));
      world.add(fixed(box({7, 0.5f, 40}), {0, side, 35}));
    }
    std::vector<BodyId> ids;
    for (int i = 0; i < 60; ++i) {
      const std::vector<Shape> shapes = shapes_of(std::exp(uniform(random, std::log(0.08f), std::log(0.5f))));
      BodyDef body = body_at(shapes[static_cast<std::size_t>(i % 4)], {});
      body.pose.position = {uniform(random, -3, 3), uniform(random, -3, 3), 3 + 0.1f * static_cast<float>(i)};
      body.pose.rotation = normalize(
          Quat{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1f, 1)});
      ids.push_back(world.add(body));
    }
    for (int i = 0; i < 900; ++i) {
      world.step();
      ASSERT_TRUE(world.quarantined().empty()) << "seed " << seed;
    }
    for (const BodyId id : ids) {
      const Vec3 p = world.pose(id).position;
      // A triangle lies below a wave of this curvature by less than a fortieth of its squared cell size.
      EXPECT_GT(p.z, height(p.x, p.y) - 0.3f * cell * cell) << "seed " << seed << ", body " << id.index;
    }
  }
}

}  // namespace
}  // namespace fathom::test::surface_motion_test
