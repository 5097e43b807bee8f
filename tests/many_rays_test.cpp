// Many rays at once: whichever way a simulator casts them, each hits what it would hit alone.
#include <gtest/gtest.h>

#include "many_queries.hpp"

namespace fathom::test::many_rays_test {
namespace {

struct Tally {
  int hits = 0, triangles = 0, children = 0, inside = 0;
};

void compare(ManyScene& scene, std::size_t count, Tally& tally) {
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) ray = scene.any_ray();
  const QueryFilter filter = scene.any_filter();
  std::vector<std::optional<CastHit>> hits(count);
  scene.world.cast_rays(rays, hits, filter);
  for (std::size_t i = 0; i < count; ++i) {
    const auto alone = scene.world.cast_ray(rays[i].origin, rays[i].translation, filter);
    ASSERT_TRUE(same(hits[i], alone)) << "ray " << i;
    if (!alone) continue;
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
    ManyScene scene(GetParam(), seed);
    for (int round = 0; round < 20; ++round) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
      // Few are cast one by one, whatever the simulator.
      compare(scene, round % 5 == 4 ? 10 : device::min_device_queries + scene.random() % 100, tally);
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
  ManyScene scene(GetParam(), 7);
  std::vector<Ray> rays(2 * device::max_queries_of_batch + 1000);
  for (Ray& ray : rays) ray = {12.0f * in_cube(scene.random), {1, 2, -30}};
  std::vector<std::optional<CastHit>> hits(rays.size());
  scene.world.cast_rays(rays, hits);
  std::size_t met = 0;
  for (std::size_t i = 0; i < rays.size(); i += 97) {
    const auto alone = scene.world.cast_ray(rays[i].origin, rays[i].translation);
    ASSERT_TRUE(same(hits[i], alone)) << "ray " << i;
    met += alone.has_value();
  }
  EXPECT_GT(met, 500u);
}

TEST_P(ManyRays, ChangeNothingOfLaterSteps) {
  ManyScene asked(GetParam(), 3), alone(GetParam(), 3);
  Tally tally;
  for (int i = 0; i < 30; ++i) {
    Generator random(static_cast<unsigned>(i));
    for (ManyScene* scene : {&asked, &alone}) {
      scene->random = random;
      scene->change(i % 4);
      if (scene == &asked) compare(asked, device::min_device_queries, tally);
      scene->world.step();
    }
    ASSERT_EQ(asked.world.state_hash(), alone.world.state_hash()) << "step " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Simulators, ManyRays, testing::ValuesIn(all_simulators), name_of);

TEST(ManyRaysAhead, AreOfOneFinishedStep) {
  ManyScene scene(SimulatorKind::device, 9, 2);
  Tally tally;
  for (int i = 0; i < 10 && !HasFatalFailure(); ++i) {
    scene.world.step();
    if (i % 2) scene.add();
    scene.world.wait();
    compare(scene, device::min_device_queries, tally);
  }
  EXPECT_GT(tally.hits, 500);
}

TEST(ManyRaysOfNone, HitNothing) {
  for (const auto kind : {SimulatorKind::native, SimulatorKind::device}) {
    World world(ManyScene::definition(kind));
    const std::vector<Ray> rays(2 * device::min_device_queries, Ray{{}, {0, 0, -1}});
    std::vector<std::optional<CastHit>> hits(rays.size(), CastHit{});
    world.cast_rays(rays, hits);
    for (const auto& hit : hits) EXPECT_FALSE(hit);
    world.cast_rays({}, {});
  }
}

}  // namespace
}  // namespace fathom::test::many_rays_test
