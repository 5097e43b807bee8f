// Many shapes at once, moved or placed: whichever way a simulator finds what they meet, each meets what it would meet
// alone.
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "exec/host/faults.hpp"
#include "many_queries.hpp"

namespace fathom::test::many_shapes_test {
namespace {

struct Tally {
  std::size_t hits = 0, inside = 0, triangles = 0, children = 0, overlaps = 0;
};

using Hits = std::vector<std::optional<CastHit>>;
using Lists = std::vector<std::vector<BodyId>>;

Hits cast_all(const World& world, std::span<const ShapeCast> casts, const QueryFilter& filter = {}) {
  Hits hits(casts.size(), CastHit{});
  world.cast_shapes(casts, hits, filter);
  return hits;
}
Lists overlap_all(const World& world, std::span<const ShapeCast> casts, const QueryFilter& filter = {}) {
  Lists found(casts.size(), std::vector<BodyId>(3));
  world.overlap_shapes(casts, found, filter);
  return found;
}

/// Asks about all at once and about each alone, or only about every `stride`-th.
void compare(const World& world, std::span<const ShapeCast> casts, const QueryFilter& filter, Tally& tally,
             std::size_t stride = 1) {
  const Hits hits = cast_all(world, casts, filter);
  const Lists found = overlap_all(world, casts, filter);
  for (std::size_t i = 0; i < casts.size(); i += stride) {
    const auto& [shape, pose, translation] = casts[i];
    ASSERT_TRUE(same(hits[i], world.cast_shape(*shape, pose, translation, filter))) << "shape " << i;
    ASSERT_EQ(found[i], world.overlap_shape(*shape, pose, filter)) << "shape " << i;
    tally.overlaps += found[i].size();
    if (!hits[i]) continue;
    ++tally.hits;
    tally.inside += hits[i]->starts_inside;
    tally.triangles += hits[i]->triangle != no_triangle;
    tally.children += hits[i]->child != 0;
  }
}

/// Shapes to ask with, and where they are.
struct Questions {
  std::vector<Shape> shapes;
  std::vector<ShapeCast> casts;

  Questions(ManyScene& scene, std::size_t count, float smallest = 0.05f, float largest = 1.5f) : casts(count) {
    for (int i = 0; i < 12; ++i) shapes.push_back(scene.any_convex(uniform(scene.random, smallest, largest)));
    for (ShapeCast& cast : casts) {
      const Ray way = scene.any_ray();
      cast = {&shapes[scene.random() % shapes.size()], {way.origin, 0, any_rotation(scene.random)}, way.translation};
    }
  }
};

/// A world of these bodies, fixed.
World world_of(SimulatorKind kind, std::span<const BodyDef> bodies) {
  World world(ManyScene::definition(kind));
  for (BodyDef def : bodies) {
    def.motion = MotionType::fixed;
    world.add(def);
  }
  return world;
}
BodyDef at(const Shape& shape, Vec3 position, Quat rotation = {1, 0, 0, 0}) {
  BodyDef def;
  def.shape = shape;
  def.pose = {position, 0, rotation};
  return def;
}

class ManyShapes : public testing::TestWithParam<SimulatorKind> {};

TEST_P(ManyShapes, MeetWhatEachMeetsAlone) {
  Tally tally;
  for (unsigned seed = 11; seed <= 16; ++seed) {
    ManyScene scene(GetParam(), seed);
    for (int round = 0; round < 12; ++round) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
      // Few are asked one by one, whatever the simulator.
      const Questions questions(scene, round % 4 == 3 ? 10 : device::min_device_queries + scene.random() % 50);
      compare(scene.world, questions.casts, scene.any_filter(), tally);
      if (HasFatalFailure()) return;
      for (auto n = scene.random() % 4; n > 0; --n) scene.change(static_cast<int>(scene.random() % 5));
    }
  }
  EXPECT_GT(tally.hits, 5000u);
  EXPECT_GT(tally.inside, 500u);
  EXPECT_GT(tally.triangles, 500u);
  EXPECT_GT(tally.children, 200u);
  EXPECT_GT(tally.overlaps, 1000u);
}

TEST_P(ManyShapes, MeetWhatTheyMeetOfTheNativeSimulator) {
  for (unsigned seed = 21; seed <= 24; ++seed) {
    ManyScene scene(GetParam(), seed), native(SimulatorKind::native, seed);
    const Questions questions(scene, 600);
    const QueryFilter filter{.mask = seed % 2 ? ~std::uint64_t{0} : 7, .ignored = {scene.any_body()}, .sensors = true};
    const Hits hits = cast_all(scene.world, questions.casts, filter);
    const Hits of_native = cast_all(native.world, questions.casts, filter);
    for (std::size_t i = 0; i < hits.size(); ++i) ASSERT_TRUE(same(hits[i], of_native[i])) << seed << ' ' << i;
    ASSERT_EQ(overlap_all(scene.world, questions.casts, filter), overlap_all(native.world, questions.casts, filter));
  }
}

// Plates and rods a thousandth as thick as long, and specks; many begin inside each other.
TEST_P(ManyShapes, ThinOrTiny) {
  Tally tally;
  Generator random(31);
  const std::vector<Shape> thin{box({1, 1, 0.001f}),
                                box({2, 0.001f, 0.001f}),
                                capsule(0.001f, 1),
                                sphere(1e-4f),
                                cylinder(1, 0.001f, 9),
                                cone(0.002f, 2, 0, 5),
                                rounded(box({1, 1e-3f, 1e-3f}), 1e-4f),
                                prism_of_250(0.001f)};
  std::vector<BodyDef> bodies;
  for (int i = 0; i < 300; ++i)
    bodies.push_back(at(thin[random() % thin.size()], 1.5f * in_cube(random), any_rotation(random)));
  bodies.push_back(at(wavy_mesh(40, 2), {0, 0, -0.5f}));
  bodies.push_back(at(random_compound(random, 0.01f), {}));
  const World world = world_of(GetParam(), bodies);
  std::vector<ShapeCast> casts(1500);
  for (ShapeCast& cast : casts) {
    const Vec3 way = uniform(random, 0, 3) * in_cube(random);
    cast = {&thin[random() % thin.size()], any_pose(random, 1.5f), random() % 2 ? way : 1e-4f * way};
  }
  compare(world, casts, {}, tally);
  EXPECT_GT(tally.hits, 500u);
  EXPECT_GT(tally.inside, 100u);
}

// Positions and sizes are whole numbers, so faces, edges and corners meet exactly, and many are equally near.
TEST_P(ManyShapes, TouchingExactly) {
  Tally tally;
  const Shape cube = box({1, 1, 1}), ball = sphere(1), pill = capsule(1, 1), solid = box_hull({1, 1, 1});
  const Shape flat = flat_mesh(8, 8), pile = cube_of_cubes();
  std::vector<BodyDef> bodies{at(flat, {0, 0, -1})};
  for (int i = 0; i < 48; ++i) {
    const auto x = static_cast<float>(i % 4), y = static_cast<float>(i / 4 % 4), z = static_cast<float>(i / 16);
    bodies.push_back(at(i % 5 == 4 ? pile : i % 3 == 0 ? solid : cube, {4 * x - 6, 4 * y - 6, 2 * z}));
  }
  const World world = world_of(GetParam(), bodies);
  const Shape* const asked[] = {&cube, &ball, &pill, &solid};
  const Vec3 ways[] = {{4, 0, 0}, {0, -4, 0}, {0, 0, -8}, {2, 2, 0}, {-2, 2, -2}, {1e-6f, 0, 0}};
  std::vector<ShapeCast> casts;
  for (int x = -8; x <= 8; x += 2)
    for (int y = -8; y <= 8; y += 4)
      for (int z = -2; z <= 8; z += 2)
        for (const Vec3& way : ways)
          casts.push_back({asked[casts.size() % 4],
                           {{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)}, 0, {}},
                           way});
  compare(world, casts, {}, tally);
  EXPECT_GT(tally.hits, casts.size() / 2);
  EXPECT_GT(tally.inside, casts.size() / 5);
  EXPECT_LT(tally.inside, tally.hits);
}

TEST_P(ManyShapes, FarAway) {
  Tally tally;
  Generator random(41);
  const Vec3 middle{10000, -10000, 10000};
  std::vector<Shape> shapes = shapes_of(0.001f);
  for (const Shape& shape : shapes_of(30)) shapes.push_back(shape);
  shapes.push_back(prism_of_250(300));
  std::vector<BodyDef> bodies;
  for (int i = 0; i < 300; ++i)
    bodies.push_back(at(shapes[random() % shapes.size()], middle + 500.0f * in_cube(random), any_rotation(random)));
  const World world = world_of(GetParam(), bodies);
  std::vector<ShapeCast> casts(1000);
  for (ShapeCast& cast : casts) {
    const Vec3 from = random() % 2 ? 500.0f * in_cube(random) : middle + 500.0f * in_cube(random);
    const Vec3 to = bodies[random() % bodies.size()].pose.position;
    cast = {&shapes[random() % shapes.size()], {from, 0, any_rotation(random)}, to - from};
  }
  compare(world, casts, {}, tally);
  EXPECT_GT(tally.hits, 500u);
  EXPECT_GT(tally.overlaps, 50u);
}

// More than travel to a device at once, and more than its two batches.
TEST_P(ManyShapes, ComeBackInOrder) {
  ManyScene scene(GetParam(), 7, 0, 30);
  const Shape ball = sphere(0.2f);
  std::vector<ShapeCast> casts(2 * device::max_queries_of_batch + 1000);
  for (ShapeCast& cast : casts) cast = {&ball, {12.0f * in_cube(scene.random), 0, {}}, {1, 2, -3}};
  Tally tally;
  compare(scene.world, casts, {.sensors = true}, tally, 97);
  EXPECT_GT(tally.hits, 100u);
  EXPECT_GT(tally.overlaps, 20u);
}

// Far more overlaps than there is room for at first, and more than ever fit at once.
TEST_P(ManyShapes, OverlapAll) {
  ManyScene scene(GetParam(), 8, 0, 0);
  const std::size_t count = 250;
  for (std::size_t i = 0; i < count; ++i) scene.world.add(at(sphere(0.1f), in_cube(scene.random)));
  scene.world.remove(scene.any_body());
  const Shape ball = sphere(4), pea = sphere(0.1f);
  std::vector<ShapeCast> casts(device::max_overlaps_of_batch / count + 2000);
  for (std::size_t i = 0; i < casts.size(); ++i)
    casts[i] = {i % 10 ? &ball : &pea, {0.5f * in_cube(scene.random), 0, {}}, {}};
  const Lists found = overlap_all(scene.world, casts);
  std::size_t total = 0;
  for (std::size_t i = 0; i < casts.size(); ++i) {
    total += found[i].size();
    if (casts[i].shape == &ball) {
      ASSERT_EQ(found[i].size(), count - 1) << i;
    } else if (i % 500 == 0) {
      ASSERT_EQ(found[i], scene.world.overlap_shape(pea, casts[i].pose)) << i;
    }
  }
  EXPECT_EQ(found[1], scene.world.overlap_shape(ball, casts[1].pose));
  EXPECT_EQ(found.back(), scene.world.overlap_shape(*casts.back().shape, casts.back().pose));
  EXPECT_GT(total, device::max_overlaps_of_batch / 10 * 8);
  // Fewer of them, afterwards.
  const std::span few = std::span(casts).first(300);
  EXPECT_EQ(overlap_all(scene.world, few), Lists(found.begin(), found.begin() + 300));
}

TEST_P(ManyShapes, OfAnEmptyWorldMeetNothing) {
  World world(ManyScene::definition(GetParam()));
  const Shape ball = sphere(1);
  const std::vector<ShapeCast> casts(2 * device::min_device_queries, ShapeCast{&ball, {}, {0, 0, -1}});
  for (const auto& hit : cast_all(world, casts)) EXPECT_FALSE(hit);
  for (const auto& list : overlap_all(world, casts)) EXPECT_TRUE(list.empty());
  world.cast_shapes({}, {});
  world.overlap_shapes({}, {});
  // Nor if all bodies are beyond them, or unseen.
  const BodyId body = world.add(at(ball, {0, 0, 50}));
  for (const auto& hit : cast_all(world, casts)) EXPECT_FALSE(hit);
  const std::vector<ShapeCast> up(casts.size(), ShapeCast{&ball, {{0, 0, 49}, 0, {}}, {0, 0, 99}});
  for (const auto& hit : cast_all(world, up, {.ignored = {body}})) EXPECT_FALSE(hit);
  for (const auto& list : overlap_all(world, up, {.ignored = {body}})) EXPECT_TRUE(list.empty());
  for (const auto& list : overlap_all(world, up)) EXPECT_EQ(list, std::vector{body});
}

// And leave the answers as they were.
TEST_P(ManyShapes, RefuseWhatOneRefuses) {
  World world(ManyScene::definition(GetParam()));
  const BodyId body = world.add(at(sphere(1), {})), gone = world.add(at(sphere(1), {}));
  world.remove(gone);
  const Shape ball = sphere(1), ground = flat_mesh(2, 1), pile = cube_of_cubes();
  const std::vector<ShapeCast> good(300, ShapeCast{&ball, {}, {0, 0, -1}});
  CastHit before;
  before.fraction = 7;
  Hits hits(good.size(), before);
  Lists found(good.size(), {gone});
  const auto refused = [&](const ShapeCast& bad, const char* text, const QueryFilter& filter = {}) {
    std::vector<ShapeCast> casts = good;
    casts[257] = bad;
    for (const bool is_cast : {true, false}) {
      if (!is_cast && bad.translation == Vec3{}) continue;
      try {
        is_cast ? world.cast_shapes(casts, hits, filter) : world.overlap_shapes(casts, found, filter);
        ADD_FAILURE() << text;
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
      }
    }
  };
  refused({nullptr, {}, {1, 0, 0}}, "shape 257");
  refused({&ground, {}, {1, 0, 0}}, "shape 257");
  refused({&pile, {}, {1, 0, 0}}, "shape 257");
  refused({&ball, {}, {}}, "shape 257");
  refused({&ball, {{0, NAN, 0}, 0, {}}, {1, 0, 0}}, "shape 257");
  refused(good[0], "shapes", {.ignored = {body, gone}});
  for (const auto& hit : hits) ASSERT_EQ(hit->fraction, 7);
  for (const auto& list : found) ASSERT_EQ(list, std::vector{gone});
}

TEST_P(ManyShapes, ChangeNothingOfLaterSteps) {
  ManyScene asked(GetParam(), 3), alone(GetParam(), 3);
  Tally tally;
  for (int i = 0; i < 20; ++i) {
    Generator random(static_cast<unsigned>(i));
    for (ManyScene* scene : {&asked, &alone}) {
      scene->random = random;
      scene->change(i % 4);
      if (scene == &asked)
        compare(asked.world, Questions(asked, device::min_device_queries).casts, asked.any_filter(), tally, 16);
      scene->world.step();
    }
    ASSERT_EQ(asked.world.state_hash(), alone.world.state_hash()) << "step " << i;
  }
}

TEST_P(ManyShapes, FromManyThreads) {
  ManyScene scene(GetParam(), 51);
  const Questions questions(scene, 4 * 300);
  std::vector<Ray> rays(questions.casts.size());
  for (Ray& ray : rays) ray = scene.any_ray();
  Hits hits(rays.size()), of_rays(rays.size());
  Lists found(rays.size());
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      const auto part = [&](auto& all) { return std::span(all).subspan(300 * t, 300); };
      const std::span<const ShapeCast> casts(questions.casts.data() + 300 * t, 300);
      scene.world.cast_shapes(casts, part(hits));
      scene.world.overlap_shapes(casts, part(found));
      scene.world.cast_rays(part(rays), part(of_rays));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(found, overlap_all(scene.world, questions.casts));
  const Hits again = cast_all(scene.world, questions.casts);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    ASSERT_TRUE(same(hits[i], again[i])) << i;
    ASSERT_TRUE(same(of_rays[i], scene.world.cast_ray(rays[i].origin, rays[i].translation))) << i;
  }
}

// Which only the caller's thread may call.
TEST_P(ManyShapes, AskTheCallback) {
  ManyScene scene(GetParam(), 61);
  const Questions questions(scene, 400);
  std::set<std::thread::id> callers;
  QueryFilter odd;
  odd.accepts = [&](BodyId id) {
    callers.insert(std::this_thread::get_id());
    return id.index % 2 == 1;
  };
  Tally tally;
  compare(scene.world, questions.casts, odd, tally);
  EXPECT_EQ(callers, std::set{std::this_thread::get_id()});
  for (const auto& list : overlap_all(scene.world, questions.casts, odd))
    for (const BodyId id : list) EXPECT_EQ(id.index % 2, 1u);
}

INSTANTIATE_TEST_SUITE_P(Simulators, ManyShapes, testing::ValuesIn(all_simulators), name_of);

TEST(ManyShapesAhead, AreOfOneFinishedStep) {
  ManyScene scene(SimulatorKind::device, 9, 2);
  Tally tally;
  for (int i = 0; i < 10 && !testing::Test::HasFatalFailure(); ++i) {
    scene.world.step();
    if (i % 2) scene.add();
    scene.world.wait();
    compare(scene.world, Questions(scene, device::min_device_queries).casts, {}, tally);
  }
  EXPECT_GT(tally.hits, 500u);
}

// Wherever memory runs out, the next call is answered.
TEST(ManyShapesFaults, MemoryMayRunOut) {
  int failures = 0;
  for (bool failed = true; failed; ++failures) {
    WorldDef def = ManyScene::definition(SimulatorKind::device);
    def.device = "host";
    ManyScene scene(def, 71);
    const Questions questions(scene, device::min_device_queries, 0.5f, 2);
    scene.world.step();
    scene.world.wait();
    Hits hits(questions.casts.size());
    Lists found(questions.casts.size());
    exec::host_faults.allocations = failures;
    try {
      scene.world.cast_shapes(questions.casts, hits);
      scene.world.overlap_shapes(questions.casts, found);
      failed = exec::host_faults.allocations < 0;
    } catch (const Error&) {
    }
    exec::host_faults.allocations = -1;
    Tally tally;
    compare(scene.world, questions.casts, {}, tally, 16);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(failures, 10);
}

}  // namespace
}  // namespace fathom::test::many_shapes_test
