// The same inputs give the same bits, whatever the threads, the vector width and the broad phase.
#include <gtest/gtest.h>

#include "native/solver_kernels.hpp"
#include "world_fixture.hpp"

namespace fathom::test {
namespace {

// A heap of all shapes with bouncing, spinning and sliding, and a few changes on the way.
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

TEST(Determinism, SleepingDoesNotDependOnThreadsEither) {
  WorldDef def;
  def.threads = 1;
  const std::uint64_t expected = heap_hash(def);
  def.threads = 3;
  EXPECT_EQ(heap_hash(def), expected);
}

TEST(Determinism, VectorWidthDoesNotMatter) {
  const std::uint64_t expected = heap_hash(quiet_world(2));
  int tried = 0;
  for (const char* name : {"AVX3", "AVX2", "NEON", "single"}) {
    if (!native::select_kernels(name)) continue;
    ++tried;
    EXPECT_EQ(heap_hash(quiet_world(2)), expected) << name;
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
}  // namespace fathom::test
