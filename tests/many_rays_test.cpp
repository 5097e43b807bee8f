// Many rays or shapes at once: whichever way a simulator casts them, each hits what it would hit alone.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "device/tuning.hpp"
#include "query_scene.hpp"
#include "test_compounds.hpp"

namespace fathom::test::many_rays_test {
namespace {

bool same(const CastHit& a, const CastHit& b) { return a == b && a.triangle == b.triangle && a.child == b.child; }

/// Bodies of all shapes and motions, as sensors too, in all groups.
class RayScene {
 public:
  RayScene(SimulatorKind kind, unsigned seed, int ahead = 0) : world(definition(kind, ahead)), random(seed) {
    for (int i = 0; i < 120; ++i) add();
  }

  static WorldDef definition(SimulatorKind kind, int ahead) {
    WorldDef def;
    def.simulator = kind;
    def.device = test_device();
    def.threads = 2;
    def.ahead = ahead;
    return def;
  }

  void add() {
    BodyDef def;
    const auto kind = random() % 12;
    if (kind == 0)
      def.shape = wavy_mesh(12, uniform(random, 1, 5));
    else if (kind == 1)
      def.shape = wavy_field(11, uniform(random, 1, 5), {3, 17, 18, 44});
    else if (kind < 4)
      def.shape = random_compound(random, uniform(random, 0.2f, 1));
    else
      def.shape = shapes_of(uniform(random, 0.05f, 1.5f))[random() % 4];
    const bool is_surface = def.shape.is_surface();
    def.motion = is_surface ? static_cast<MotionType>(random() % 2) : static_cast<MotionType>(random() % 3);
    def.pose = any_pose();
    def.mass = 1;
    def.sensor = !is_surface && random() % 8 == 0;
    def.filter.category = 1u << random() % 4;
    def.filter.mask = random() % 4 ? ~std::uint64_t{0} : random() % 16;
    def.filter.group = static_cast<std::int32_t>(random() % 5) - 2;
    if (def.motion != MotionType::fixed) def.velocity.linear = in_cube(random);
    world.add(def);
  }
  void change(int what) {
    const BodyId id = any_body();
    if (what == 0) world.remove(id);
    if (what == 1) world.set_pose(id, any_pose());
    if (what == 2) world.set_filter(id, {1u << random() % 4, ~std::uint64_t{0}, 0});
    if (what == 3) add();
    if (what == 4) world.step();
  }

  BodyId any_body() { return world.bodies()[random() % world.body_count()]; }
  Pose any_pose() { return {9.0f * in_cube(random), 0, any_rotation(random)}; }
  Ray any_ray() {
    const Vec3 from = 12.0f * in_cube(random);
    Vec3 way = random() % 2 ? world.pose(any_body()).position - from : 9.0f * in_cube(random);
    if (random() % 8 == 0) way.x = 0;
    if (random() % 8 == 0 || way == Vec3{}) way = {0, 0, -20};
    return {from, way};
  }
  QueryFilter any_filter() {
    QueryFilter filter;
    if (random() % 3 == 0) filter.mask = random() % 16;
    if (random() % 3 == 0) filter.category = 1 + random() % 15;
    if (random() % 3 == 0) filter.group = static_cast<std::int32_t>(random() % 5) - 2;
    if (random() % 2 == 0)
      for (auto n = random() % 9; n > 0; --n) filter.ignored.push_back(any_body());
    filter.sensors = random() % 2;
    if (random() % 6 == 0) filter.accepts = [](BodyId id) { return id.index % 3 != 0; };
    return filter;
  }

  World world;
  Generator random;
};

struct Tally {
  int hits = 0, triangles = 0, children = 0, inside = 0;
};

void compare(RayScene& scene, std::size_t count, Tally& tally) {
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) ray = scene.any_ray();
  const QueryFilter filter = scene.any_filter();
  std::vector<std::optional<CastHit>> hits(count);
  scene.world.cast_rays(rays, hits, filter);
  for (std::size_t i = 0; i < count; ++i) {
    const auto alone = scene.world.cast_ray(rays[i].origin, rays[i].translation, filter);
    ASSERT_EQ(hits[i].has_value(), alone.has_value()) << "ray " << i;
    if (!alone) continue;
    ASSERT_TRUE(same(*hits[i], *alone)) << "ray " << i;
    ++tally.hits;
    tally.triangles += alone->triangle != no_triangle;
    tally.children += alone->child != 0;
    tally.inside += alone->starts_inside;
  }
}

class ManyRays : public testing::TestWithParam<SimulatorKind> {};

TEST_P(ManyRays, HitWhatEachHitsAlone) {
  Tally tally;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    RayScene scene(GetParam(), seed);
    for (int round = 0; round < 20; ++round) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
      // Few are cast one by one, whatever the simulator.
      compare(scene, round % 5 == 4 ? 10 : device::min_device_rays + scene.random() % 100, tally);
      if (HasFatalFailure()) return;
      for (auto n = scene.random() % 4; n > 0; --n) scene.change(static_cast<int>(scene.random() % 5));
    }
  }
  EXPECT_GT(tally.hits, 10000);
  EXPECT_GT(tally.triangles, 1000);
  EXPECT_GT(tally.children, 300);
  EXPECT_GT(tally.inside, 300);
}

// More than travel to a device at once, and more than its two batches.
TEST_P(ManyRays, ComeBackInOrder) {
  RayScene scene(GetParam(), 7);
  std::vector<Ray> rays(2 * device::max_rays_of_batch + 1000);
  for (Ray& ray : rays) ray = {12.0f * in_cube(scene.random), {1, 2, -30}};
  std::vector<std::optional<CastHit>> hits(rays.size());
  scene.world.cast_rays(rays, hits);
  std::size_t met = 0;
  for (std::size_t i = 0; i < rays.size(); i += 97) {
    const auto alone = scene.world.cast_ray(rays[i].origin, rays[i].translation);
    ASSERT_EQ(hits[i].has_value(), alone.has_value()) << "ray " << i;
    ASSERT_TRUE(!alone || same(*hits[i], *alone)) << "ray " << i;
    met += alone.has_value();
  }
  EXPECT_GT(met, 500u);
}

TEST_P(ManyRays, ChangeNothingOfLaterSteps) {
  RayScene asked(GetParam(), 3), alone(GetParam(), 3);
  Tally tally;
  for (int i = 0; i < 30; ++i) {
    Generator random(static_cast<unsigned>(i));
    for (RayScene* scene : {&asked, &alone}) {
      scene->random = random;
      scene->change(i % 4);
      if (scene == &asked) compare(asked, device::min_device_rays, tally);
      scene->world.step();
    }
    ASSERT_EQ(asked.world.state_hash(), alone.world.state_hash()) << "step " << i;
  }
}

TEST_P(ManyRays, ShapesMeetWhatEachMeetsAlone) {
  std::size_t hits_of_all = 0, overlaps_of_all = 0;
  for (unsigned seed = 11; seed <= 14; ++seed) {
    RayScene scene(GetParam(), seed);
    for (int round = 0; round < 10; ++round) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
      const std::vector<Shape> shapes = shapes_of(uniform(scene.random, 0.05f, 1.5f));
      std::vector<ShapeCast> casts(round % 3 == 0 ? 5 : 200);
      for (ShapeCast& cast : casts) {
        const Ray way = scene.any_ray();
        cast = {&shapes[scene.random() % shapes.size()], {way.origin, 0, any_rotation(scene.random)}, way.translation};
      }
      const QueryFilter filter = scene.any_filter();
      std::vector<std::optional<CastHit>> hits(casts.size());
      std::vector<std::vector<BodyId>> found(casts.size(), std::vector<BodyId>(3));
      scene.world.cast_shapes(casts, hits, filter);
      scene.world.overlap_shapes(casts, found, filter);
      for (std::size_t i = 0; i < casts.size(); ++i) {
        const auto& [shape, pose, translation] = casts[i];
        const auto alone = scene.world.cast_shape(*shape, pose, translation, filter);
        ASSERT_EQ(hits[i].has_value(), alone.has_value()) << "shape " << i;
        ASSERT_TRUE(!alone || same(*hits[i], *alone)) << "shape " << i;
        ASSERT_EQ(found[i], scene.world.overlap_shape(*shape, pose, filter)) << "shape " << i;
        hits_of_all += alone.has_value(), overlaps_of_all += found[i].size();
      }
      scene.change(static_cast<int>(scene.random() % 5));
    }
  }
  EXPECT_GT(hits_of_all, 1500u);
  EXPECT_GT(overlaps_of_all, 300u);
}

INSTANTIATE_TEST_SUITE_P(Simulators, ManyRays,
                         testing::Values(SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid),
                         [](const auto& kind) {
                           return kind.param == SimulatorKind::native   ? "native"
                                  : kind.param == SimulatorKind::device ? "device"
                                                                        : "hybrid";
                         });

TEST(ManyRaysAhead, AreOfOneFinishedStep) {
  RayScene scene(SimulatorKind::device, 9, 2);
  Tally tally;
  for (int i = 0; i < 10 && !HasFatalFailure(); ++i) {
    scene.world.step();
    if (i % 2) scene.add();
    scene.world.wait();
    compare(scene, device::min_device_rays, tally);
  }
  EXPECT_GT(tally.hits, 500);
}

TEST(ManyRaysOfNone, HitNothing) {
  for (const auto kind : {SimulatorKind::native, SimulatorKind::device}) {
    World world(RayScene::definition(kind, 0));
    const std::vector<Ray> rays(2 * device::min_device_rays, Ray{{}, {0, 0, -1}});
    std::vector<std::optional<CastHit>> hits(rays.size(), CastHit{});
    world.cast_rays(rays, hits);
    for (const auto& hit : hits) EXPECT_FALSE(hit);
    world.cast_rays({}, {});
  }
}

}  // namespace
}  // namespace fathom::test::many_rays_test
