// Queries of worlds: the tree must offer every body that is hit, whatever happened to the world. Every answer is
// compared with that of testing all bodies one by one.
#include <gmock/gmock.h>

#include <string>
#include <thread>

#include "geometry/separation.hpp"
#include "geometry/support.hpp"
#include "query_scene.hpp"

namespace fathom::queries_test {

namespace {

using namespace test;

struct Tally {
  std::size_t rays = 0, shapes = 0, overlaps = 0, boxes = 0;
};

/// Makes every kind of query at random positions and along random paths.
void compare(QueryScene& scene, Tally& tally) {
  const World& world = scene.world;
  const QueryFilter filter = scene.any_filter();
  const Shape shape = scene.any_shape();
  const Pose pose = scene.any_placement();
  const Vec3 from = pose.position, way = scene.any_way(from);

  const auto rays = scene.each(filter, [&](const Geometry& g, const Pose& at) { return ray_cast(g, at, {from, way}); });
  ASSERT_EQ(world.cast_ray_all(from, way, filter), rays);
  const auto ray = world.cast_ray(from, way, filter);
  ASSERT_EQ(ray.has_value(), !rays.empty());
  ASSERT_TRUE(!ray || *ray == rays.front());

  const PlacedShape placed(geometry(shape), pose);
  const auto casts = scene.each(filter, [&](const Geometry& g, const Pose& at) {
    return shape_cast(placed, way, {g, at});
  });
  ASSERT_EQ(world.cast_shape_all(shape, pose, way, filter), casts);
  const auto cast = world.cast_shape(shape, pose, way, filter);
  ASSERT_EQ(cast.has_value(), !casts.empty());
  ASSERT_TRUE(!cast || *cast == casts.front());

  const auto overlaps = scene.those(filter, [&](const Geometry& g, const Pose& at) {
    return separation(placed, {g, at}).touch();
  });
  ASSERT_EQ(world.overlap_shape(shape, pose, filter), overlaps);
  const Vec3 half = scene.any_size() * Vec3{1, 2, 0.5f};
  const Aabb box{from - half, from + half};
  const auto in_box =
      scene.those(filter, [&](const Geometry& g, const Pose& at) { return fathom::overlaps(bounds(g, at), box); });
  ASSERT_EQ(world.overlap_aabb(box, filter), in_box);
  tally.rays += rays.size();
  tally.shapes += casts.size();
  tally.overlaps += overlaps.size();
  tally.boxes += in_box.size();
}

void compare(QueryScene& scene, int questions, Tally& tally) {
  for (int i = 0; i < questions; ++i) {
    SCOPED_TRACE("question " + std::to_string(i) + " after " + std::to_string(scene.world.step_count()) + " steps");
    compare(scene, tally);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(Queries, FindWhoeverIsThereWhateverHappens) {
  Tally tally;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    QueryScene scene(quiet_world(), seed, {}, 8, 0.1f, 3, 120);
    compare(scene, 60, tally);  // before the first step
    for (int round = 0; round < 12 && !HasFatalFailure(); ++round) {
      run(scene.world, round % 3 * 20);  // farther than fat boxes have room for
      compare(scene, 8, tally);
      scene.add();
      compare(scene, 8, tally);
      scene.remove();
      compare(scene, 8, tally);
      const BodyId moved = scene.any_body();
      scene.world.set_pose(moved, scene.any_placement());
      compare(scene, 8, tally);
      scene.world.step();
      compare(scene, 8, tally);
    }
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(tally.rays, 2000u);
  EXPECT_GT(tally.shapes, 4000u);
  EXPECT_GT(tally.overlaps, 800u);
  EXPECT_GT(tally.boxes, 1000u);
}

TEST(Queries, FindPebblesAndMountainsFarAway) {
  Tally tally;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    QueryScene scene(quiet_world(), seed, {10000, -10000, 10000}, 500, 0.001f, seed % 2 ? 1.0f : 1000.0f, 200);
    compare(scene, 100, tally);
    scene.world.step();
    compare(scene, 100, tally);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(tally.rays, 1000u);
  EXPECT_GT(tally.shapes, 1000u);
}

// A pebble of a millimetre at ten kilometres, where positions are a millimetre apart.
TEST(Queries, HitAPebbleFarAway) {
  World world(quiet_world());
  Generator random(1);
  std::vector<BodyId> pebbles;
  for (int i = 0; i < 500; ++i) {
    BodyDef pebble = dynamic(sphere(0.001f), 10000.f * in_cube(random));
    pebble.motion = MotionType::fixed;
    pebbles.push_back(world.add(pebble));
  }
  for (const BodyId id : pebbles) {
    const Vec3 at = world.pose(id).position, from = at + 1000.f * in_cube(random);
    const auto hit = world.cast_ray(from, at - from, {.accepts = [id](BodyId met) { return met == id; }});
    ASSERT_TRUE(hit) << "from " << from.x << ", the ray ends inside up to its own rounding";
    ASSERT_EQ(world.overlap_shape(sphere(0.001f), {at, 0, {}}), std::vector{id});
  }
}

// At ten kilometres a box smaller than a millimetre is rounded to a plane, which this ray misses.
TEST(Queries, HitWhatIsSmallerThanTheRoundingOfItsBox) {
  World world(quiet_world());
  BodyDef pebble = dynamic(sphere(0.0004f), {10000, 0, 0});
  pebble.motion = MotionType::fixed;
  const BodyId id = world.add(pebble);
  for (const float way : {2.0f, -2.0f}) {
    const auto hit = world.cast_ray({10000 - 0.5f * way, 0.0005f - 0.5f * way, 0}, {way, way, 0});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->body, id);
  }
}

TEST(Queries, AreTheSameOnAllSimulators) {
  std::vector<std::unique_ptr<QueryScene>> scenes;
  for (const auto kind : {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid})
    for (const auto broad_phase : {BroadPhase::tree, BroadPhase::sweep}) {
      WorldDef def;
      def.threads = 1;
      def.simulator = kind;
      def.device = "host";
      def.broad_phase = broad_phase;
      if (kind == SimulatorKind::hybrid && broad_phase == BroadPhase::sweep) continue;
      scenes.push_back(std::make_unique<QueryScene>(def, 5, Vec3{}, 6, 0.1f, 2, 150));
    }
  for (int i = 0; i < 300; ++i) {
    QueryScene& first = *scenes.front();
    const Vec3 from = first.any_placement().position, way = first.any_way(from);
    const Shape shape = first.any_shape();
    const Pose pose{from, 0, any_rotation(first.random)};
    const BodyId a = first.any_body(), b = first.any_body();
    for (const auto& other : scenes) {
      ASSERT_EQ(other->world.cast_ray_all(from, way), first.world.cast_ray_all(from, way));
      ASSERT_EQ(other->world.cast_ray(from, way), first.world.cast_ray(from, way));
      ASSERT_EQ(other->world.cast_shape_all(shape, pose, way), first.world.cast_shape_all(shape, pose, way));
      ASSERT_EQ(other->world.cast_shape(shape, pose, way), first.world.cast_shape(shape, pose, way));
      ASSERT_EQ(other->world.overlap_shape(shape, pose), first.world.overlap_shape(shape, pose));
      ASSERT_EQ(other->world.closest_points(a, b).on_a, first.world.closest_points(a, b).on_a);
      ASSERT_EQ(other->world.closest_points(shape, pose, b).on_b, first.world.closest_points(shape, pose, b).on_b);
    }
  }
}

TEST(Queries, SeeSleepers) {
  World world(sleepy_world());
  const BodyId floor = world.add(ground());
  const BodyId crate = world.add(cube({0, 0, 1}));
  run(world, 120);
  ASSERT_FALSE(world.is_awake(crate));
  EXPECT_EQ(world.cast_ray({0, 0, 5}, {0, 0, -9})->body, crate);
  EXPECT_EQ(world.cast_shape(sphere(0.5f), {{5, 0, 1.1f}, 0, {}}, {-9, 0, 0})->body, crate);
  EXPECT_THAT(world.overlap_shape(sphere(0.8f), {{0, 0, 1}, 0, {}}), testing::ElementsAre(floor, crate));
  EXPECT_NEAR(world.closest_points(floor, crate).distance, 0, 1e-3f);
  EXPECT_FALSE(world.is_awake(crate)) << "being asked wakes nobody";
}

TEST(Queries, ChangeNothingOfLaterSteps) {
  QueryScene asked(sleepy_world(), 3, {}, 4, 0.2f, 1, 150), alone(sleepy_world(), 3, {}, 4, 0.2f, 1, 150);
  Tally tally;
  for (int i = 0; i < 60; ++i) {
    Generator random(static_cast<unsigned>(i));
    for (World* world : {&asked.world, &alone.world}) {
      const BodyId id = world->bodies()[static_cast<std::size_t>(i)];
      if (i % 2) world->set_pose(id, {{0, static_cast<float>(i), 1}, 0, {}});
      if (world == &asked.world) compare(asked, 3, tally);
      if (i % 3 == 0) world->remove(world->bodies()[static_cast<std::size_t>(i)]);
      if (world == &asked.world) compare(asked, 3, tally);
      world->step();
    }
    ASSERT_EQ(asked.world.state_hash(), alone.world.state_hash()) << "step " << i;
  }
}

TEST(Queries, OfManyRaysAreThoseOfEach) {
  QueryScene scene(quiet_world(), 7, {}, 8, 0.1f, 2, 300);
  run(scene.world, 3);
  std::vector<Ray> rays;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 from = scene.any_placement().position;
    rays.push_back({from, scene.any_way(from)});
  }
  std::vector<std::optional<CastHit>> hits(rays.size());
  scene.world.cast_rays(rays, hits, {.mask = 5});
  std::size_t met = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(hits[i], scene.world.cast_ray(rays[i].origin, rays[i].translation, {.mask = 5}));
    met += hits[i].has_value();
  }
  EXPECT_GT(met, 1000u);

  // Threads query together; the first of them updates the tree.
  scene.world.step();
  std::vector<std::optional<CastHit>> by_threads(rays.size());
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      const std::size_t part = rays.size() / 4;
      scene.world.cast_rays(std::span(rays).subspan(t * part, part), std::span(by_threads).subspan(t * part, part));
    });
  for (std::thread& thread : threads) thread.join();
  scene.world.cast_rays(rays, hits);
  EXPECT_EQ(by_threads, hits);
}

TEST(Queries, OfADeviceAheadAreOfOneFinishedStep) {
  WorldDef def = quiet_world();
  if (def.simulator == SimulatorKind::hybrid) GTEST_SKIP() << "it is never ahead";
  def.simulator = SimulatorKind::device;
  def.device = test_device();
  def.ahead = 2;
  QueryScene scene(def, 9, {}, 5, 0.2f, 2, 100);
  Tally tally;
  for (int i = 0; i < 20 && !HasFatalFailure(); ++i) {
    scene.world.step();
    if (i % 2) scene.add();
    scene.world.wait();
    compare(scene, 20, tally);
  }
  EXPECT_GT(tally.rays, 200u);
}

TEST(Queries, DistancesOfBodies) {
  World world(quiet_world());
  const BodyId a = world.add(dynamic(sphere(1), {0, 0, 0})), b = world.add(cube({4, 0, 0}));
  const ClosestPoints points = world.closest_points(a, b);
  EXPECT_FLOAT_EQ(points.distance, 2.5f);
  EXPECT_EQ(points.on_a, (Vec3{1, 0, 0}));
  EXPECT_EQ(points.on_b, (Vec3{3.5f, 0, 0}));
  EXPECT_EQ(points.normal, (Vec3{1, 0, 0}));
  EXPECT_FLOAT_EQ(world.closest_points(box({1, 1, 1}), {{4, 0, 5}, 0, {}}, b).distance, 3.5f);
  const ClosestPoints overlap = world.closest_points(sphere(1), {{3.2f, 0, 0}, 0, {}}, b);
  EXPECT_EQ(overlap.distance, 0);
  EXPECT_EQ(overlap.normal, (Vec3{}));
  EXPECT_EQ(overlap.on_a, overlap.on_b);
}

}  // namespace
}  // namespace fathom::queries_test
