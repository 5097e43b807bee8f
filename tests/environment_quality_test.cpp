// The four environments meet their quality limits over 30 s (1,800 steps), sleeping off.
#include <gtest/gtest.h>

#include "scene/environments.hpp"
#include "scene/quality.hpp"
#include "world_fixture.hpp"

namespace fathom::environment_quality_test {
namespace {

Quality simulate(Scene scene, int steps) {
  const WorldDef def = test::sleepy_world(2);
  scene.world.threads = def.threads;
  scene.world.simulator = def.simulator;
  scene.world.device = def.device;
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < steps; ++i) {
    instance.prepare_step();
    world.step();
    if (i % 50 != 49) continue;
    const Quality on_the_way = measure_quality(scene, instance, world);
    EXPECT_EQ(on_the_way.bodies_below_ground, 0u) << "after step " << i + 1;
    EXPECT_EQ(on_the_way.non_finite, 0u) << "after step " << i + 1;
  }
  return measure_quality(scene, instance, world);
}

TEST(EnvironmentQuality, PyramidsStand) {
  for (const int layers : {5, 10, 15}) {
    const Quality q = simulate(pyramid(layers), 1800);
    EXPECT_LE(q.displacement_max, 0.02) << layers << " layers";
    EXPECT_LE(q.ground_penetration_max, 0.002) << layers << " layers";
    EXPECT_LE(q.kinetic_energy_per_body, 1e-8) << layers << " layers";
  }
}

TEST(EnvironmentQuality, SpreadBodiesStayWhereTheyAre) {
  for (const int bodies : {100, 1000, 10000}) {
    const Quality q = simulate(spread(bodies), bodies == 10000 ? 300 : 1800);
    EXPECT_LE(q.displacement_max, 0.001) << bodies << " bodies";
    EXPECT_LE(q.ground_penetration_max, 0.0005) << bodies << " bodies";
  }
}

TEST(EnvironmentQuality, LayersComeToRest) {
  for (const int bodies : {100, 1000}) {
    const Quality q = simulate(layers(bodies), 1800);
    EXPECT_LE(q.kinetic_energy_per_body, 1e-4) << bodies << " bodies";
    EXPECT_LE(q.ground_penetration_max, 0.002) << bodies << " bodies";
  }
}

// A tower of 150 m collapses; nothing is pushed through the ground on the way.
TEST(EnvironmentQuality, CollapsingTowerStaysAboveTheGround) {
  const Quality q = simulate(layers(10000), 500);
  EXPECT_EQ(q.bodies_below_ground, 0u);
  EXPECT_EQ(q.non_finite, 0u);
}

TEST(EnvironmentQuality, DriftersKeepTheirMomentumBetweenKicks) {
  Scene scene = drift(1000);
  scene.kicks.reset();
  scene.world.threads = 2;
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const auto f = static_cast<float>(i % 7) - 3;
    world.set_velocity(instance.ids()[i], {f, 2 - f, 0.5f * f}, {0.3f * f, 0, 0.2f});
  }
  const auto momentum = [&] {
    double sum[3] = {};
    for (const BodyId id : world.bodies())
      for (int k = 0; k < 3; ++k) sum[k] += static_cast<double>(world.velocity(id).linear[k]);
    return std::array<double, 3>{sum[0], sum[1], sum[2]};
  };
  const auto before = momentum();
  std::size_t collisions = 0;
  for (int i = 0; i < 300; ++i) {
    world.step();
    collisions += world.contacts_begun().size();
  }
  EXPECT_GT(collisions, 100u);
  const auto after = momentum();
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 5e-4 * 1000);
}

}  // namespace
}  // namespace fathom::environment_quality_test
