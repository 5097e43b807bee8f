// The same inputs give the same bits, whatever the threads, the vector width and the broad phase.
#include <gtest/gtest.h>

#include <limits>

#include "native/solver_kernels.hpp"
#include "scene/environments.hpp"
#include "world_fixture.hpp"

namespace fathom::test::determinism_test {
namespace {

// A heap of all shapes with bouncing, spinning and sliding, and a few changes along the way.
std::uint64_t heap_hash(WorldDef def) {
  World world(def);
  world.add(ground(0.6f));
  const Vec3 tetrahedron[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Shape shapes[] = {box({0.4f, 0.5f, 0.3f}), sphere(0.4f), capsule(0.25f, 0.4f), hull(tetrahedron)};
  std::vector<BodyId> ids;
  for (int i = 0; i < 300; ++i) {
    BodyDef body = dynamic(shapes[i % 4], {static_cast<float>(i % 5) * 0.9f, static_cast<float>(i / 5 % 5) * 0.9f,
                                           1.5f + static_cast<float>(i / 25)});
    body.pose.rotation = axis_angle({1, static_cast<float>(i % 3), 2}, 0.1f * static_cast<float>(i));
    body.material.restitution = i % 7 == 0 ? 0.6f : 0.0f;
    ids.push_back(world.add(body));
  }
  for (int step = 0; step < 240; ++step) {
    if (step == 60) world.remove(ids[37]);
    if (step == 90) world.add(cube({1, 1, 9}));
    if (step == 120) world.apply_impulse(ids[100], {3, 1, 5});
    world.step();
  }
  return world.state_hash();
}

TEST(Determinism, ThreadsDoNotMatter) {
  const std::uint64_t expected = heap_hash(quiet_world(1));
  EXPECT_EQ(heap_hash(quiet_world(1)), expected) << "twice in a row";
  for (const int threads : {2, 3, 5}) EXPECT_EQ(heap_hash(quiet_world(threads)), expected) << threads << " threads";
}

// Large enough for several threads: many islands, which are solved in groups, and a single one.
TEST(Determinism, ThreadsDoNotMatterInTheEnvironments) {
  const auto hash = [](Scene scene, int threads) {
    scene.world.threads = threads;
    World world(scene.world);
    SceneInstance instance(scene, world);
    for (int step = 0; step < 90; ++step) {
      instance.prepare_step();
      world.step();
    }
    return world.state_hash();
  };
  const auto check = [&](const char* name, const auto& make) {
    const std::uint64_t expected = hash(make(), 1);
    for (const int threads : {2, 5}) EXPECT_EQ(hash(make(), threads), expected) << name << ", " << threads;
  };
  check("drift", [] { return drift(3000); });
  check("layers", [] { return layers(1000); });
  check("spread", [] { return spread(900); });
  check("pyramid", [] { return pyramid(8); });
  check("pyramid in domains", [] { return pyramid(18); });
}

// Heaps large enough for domains: one that collapses, so that they are redrawn along the way, and a kinematic body that
// comes and goes.
TEST(Determinism, ThreadsDoNotMatterInLargeHeaps) {
  const auto hash = [](int threads) {
    Scene scene = layers(3000);
    scene.world.threads = threads;
    World world(scene.world);
    SceneInstance instance(scene, world);
    BodyId plough{};
    for (int step = 0; step < 200; ++step) {
      if (step == 170) {
        BodyDef def;
        def.motion = MotionType::kinematic;
        def.shape = box({1, 1, 1});
        def.pose.position = {-8, 0, 1.5f};
        def.velocity.linear = {10, 0, 0};
        plough = world.add(def);
      }
      if (step == 185) world.remove(plough);
      world.step();
    }
    return world.state_hash();
  };
  const std::uint64_t expected = hash(1);
  for (const int threads : {2, 5}) EXPECT_EQ(hash(threads), expected) << threads;
}

// Small bodies within each other's margins have more contacts than colours. The overflow rules out domains, so the
// order by colours must not depend on their neighbourhoods.
TEST(Determinism, ThreadsDoNotMatterInACrowdOfSmallBodies) {
  const auto hash = [](int threads) {
    World world(quiet_world(threads));
    world.add(ground(0.6f));
    for (int i = 0; i < 216; ++i)
      world.add(dynamic(sphere(0.004f), {0.0081f * static_cast<float>(i % 6), 0.0081f * static_cast<float>(i / 6 % 6),
                                         0.01f + 0.0081f * static_cast<float>(i / 36)}));
    for (int step = 0; step < 20; ++step) world.step();
    return world.state_hash();
  };
  const std::uint64_t expected = hash(1);
  for (const int threads : {2, 5}) EXPECT_EQ(hash(threads), expected) << threads;
}

// A kinematic body under many islands moves while they are solved; a body that is not finite stays in their contacts.
TEST(Determinism, ThreadsDoNotMatterToSpecialBodies) {
  const auto hash = [](bool kinematic, int threads) {
    World world(quiet_world(threads));
    BodyDef floor = ground(0.5f);
    if (kinematic) floor.motion = MotionType::kinematic, floor.velocity.linear = {0.5f, 0, 0.1f};
    world.add(floor);
    std::vector<BodyId> ids;
    for (int i = 0; i < 600; ++i)
      ids.push_back(world.add(cube({static_cast<float>(i % 20) * 1.2f, static_cast<float>(i / 20 % 15) * 1.2f,
                                    1.0f + 1.01f * static_cast<float>(i / 300)})));
    for (int step = 0; step < 60; ++step) {
      if (step == 30) world.apply_force(ids[10], {std::numeric_limits<float>::max(), 0, 0});
      world.step();
    }
    return world.state_hash();
  };
  for (const bool kinematic : {false, true}) {
    const std::uint64_t expected = hash(kinematic, 1);
    for (const int threads : {2, 5}) EXPECT_EQ(hash(kinematic, threads), expected) << kinematic << ", " << threads;
  }
}

TEST(Determinism, SleepingDoesNotDependOnThreadsEither) {
  WorldDef def;
  def.threads = 1;
  const std::uint64_t expected = heap_hash(def);
  def.threads = 3;
  EXPECT_EQ(heap_hash(def), expected);
}

// Columns of many heights, cubes and flat boxes, which break up where balls hit them.
std::uint64_t columns_hash(const WorldDef& def) {
  World world(def);
  world.add(ground());
  for (int column = 0; column < 40; ++column) {
    const float x = 4.0f * static_cast<float>(column), half_height = column % 3 == 0 ? 0.3f : 0.5f;
    for (int i = 0; i < 12 + column % 19; ++i)
      world.add(dynamic(box({0.5f, 0.5f, half_height}),
                        {x, 0.004f * static_cast<float>(i % 3), 0.5f + half_height * static_cast<float>(2 * i + 1)}));
    if (column % 2 == 0) continue;
    BodyDef ball = dynamic(sphere(0.4f), {x, -3, 3 + static_cast<float>(column % 7)}, 2);
    ball.velocity.linear = {0, 4, 2};
    world.add(ball);
  }
  for (int i = 0; i < 90; ++i) world.step();
  return world.state_hash();
}

TEST(Determinism, VectorWidthDoesNotMatter) {
  const std::uint64_t expected = heap_hash(quiet_world(2)), of_columns = columns_hash(quiet_world(2));
  int tried = 0;
  for (const char* name : {"AVX3", "AVX2", "NEON", "single"}) {
    if (!native::select_kernels(name)) continue;
    ++tried;
    EXPECT_EQ(heap_hash(quiet_world(2)), expected) << name;
    EXPECT_EQ(columns_hash(quiet_world(1)), of_columns) << name;
  }
  native::select_kernels(nullptr);
  EXPECT_GE(tried, 2);
}

TEST(Determinism, ImpulseSolverIsDeterministicToo) {
  WorldDef def = quiet_world(1);
  def.solver.method = Solver::impulse;
  const std::uint64_t expected = heap_hash(def);
  def.threads = 3;
  EXPECT_EQ(heap_hash(def), expected);
}

}  // namespace
}  // namespace fathom::test::determinism_test
