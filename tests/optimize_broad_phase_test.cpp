// World::optimize_broad_phase changes when bodies are sorted, and nothing else.
#include <gtest/gtest.h>

#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::optimize_broad_phase_test {
namespace {

class OptimizeBroadPhase : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, OptimizeBroadPhase, testing::ValuesIn(joint_worlds), joint_world_name);

/// A floor of tiles, some of which are moved, removed and put back while bodies fall on them. If it `optimizes`, bodies
/// are sorted before the steps.
std::uint64_t hash_of(const WorldDef& def, bool optimizes) {
  Generator random(7);
  World world(def);
  std::vector<BodyId> tiles, others;
  const auto tile_at = [](int i) {
    BodyDef tile;
    tile.motion = MotionType::fixed;
    tile.shape = box({0.5f, 0.5f, 0.2f});
    tile.pose.position = {static_cast<float>(i % 12), static_cast<float>(i / 12), 0};
    return tile;
  };
  for (int i = 0; i < 144; ++i) tiles.push_back(world.add(tile_at(i)));
  for (int i = 0; i < 40; ++i)
    others.push_back(world.add(dynamic(i % 2 ? box({0.2f, 0.3f, 0.1f}) : sphere(0.2f),
                                       {uniform(random, 0, 11), uniform(random, 0, 11), uniform(random, 0.4f, 2)})));
  for (int step = 0; step < 120; ++step) {
    const auto i = random() % tiles.size();
    if (step % 10 == 3) {
      world.remove(tiles[i]);
      tiles[i] = world.add(tile_at(static_cast<int>(i)));
    }
    if (step % 10 == 6) world.set_pose(tiles[i], {.position = world.pose(tiles[i]).position + Vec3{0, 0, -0.1f}});
    if (step % 20 == 9) others.push_back(world.add(dynamic(sphere(0.3f), {uniform(random, 0, 11), 5, 3})));
    if (optimizes) world.optimize_broad_phase();
    if (optimizes && step % 3 == 0) world.optimize_broad_phase();
    world.step();
  }
  for (const BodyId id : others) EXPECT_GT(world.pose(id).position.z, -0.2f);
  return world.state_hash();
}

TEST_P(OptimizeBroadPhase, ChangesNoStep) {
  for (const bool sleeps : {false, true}) {
    const WorldDef def = sleeps ? GetParam().sleepy(2) : GetParam().quiet(2);
    EXPECT_EQ(hash_of(def, false), hash_of(def, true));
  }
}

TEST_P(OptimizeBroadPhase, FindsWhatComesLater) {
  World world(GetParam().quiet());
  const BodyId floor = world.add({.motion = MotionType::fixed, .shape = box({5, 5, 0.5f})});
  world.optimize_broad_phase();
  const BodyId ball = world.add(dynamic(sphere(0.5f), {0, 0, 1.1f}));
  for (int i = 0; i < 60; ++i) world.step();
  EXPECT_NEAR(world.pose(ball).position.z, 1, 0.01f);
  // A body found to touch is still checked for having separated.
  world.set_pose(floor, {.position = {0, 0, -3}});
  world.optimize_broad_phase();
  for (int i = 0; i < 20; ++i) world.step();
  EXPECT_LT(world.pose(ball).position.z, 0.7f);
}

}  // namespace
}  // namespace fathom::test::optimize_broad_phase_test
