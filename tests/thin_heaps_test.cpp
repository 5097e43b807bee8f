// Heaps of thin bodies, whose contacts carry many times their own weight and sag by a large part of their thickness:
// they come to rest, and do not sink into each other (docs/log/2026-11-29-boiling-plates.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "random.hpp"
#include "scene/overlaps.hpp"
#include "world_fixture.hpp"

namespace fathom::test::thin_heaps_test {
namespace {

class ThinHeaps : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Simulators, ThinHeaps, testing::Bool(), [](const testing::TestParamInfo<bool>& on_device) {
  return on_device.param ? "device" : "native";
});

/// Bodies about each other's centres, so that they fall little, each turned about the vertical.
template <class MakeShape>
Scene heap(Generator& random, std::size_t count, float size, float spacing, const MakeShape& make_shape) {
  Scene scene;
  BodyDef floor = ground(0.6f);
  floor.pose.position.z = -0.5f;
  scene.bodies.push_back(floor);
  for (std::size_t i = 0; i < count; ++i) {
    BodyDef def;
    def.shape = make_shape();
    def.material.friction = 0.6f;
    def.pose.position = {size * uniform(random, -0.5f, 0.5f), size * uniform(random, -0.5f, 0.5f),
                         size * (0.6f + spacing * static_cast<float>(i))};
    def.pose.rotation = axis_angle({0, 0, 1}, uniform(random, 0, 3.14159f));
    scene.bodies.push_back(def);
  }
  return scene;
}

struct Rest {
  double energy = 0;   ///< J/kg, of linear motion
  double overlap = 0;  ///< m
};

Rest after_10_s(const Scene& scene, bool on_device) {
  WorldDef def = quiet_world();
  if (on_device) def.simulator = SimulatorKind::device, def.device = test_device();
  World world(def);
  const std::vector<BodyId> ids = world.add_bodies(scene.bodies);
  run(world, 600);
  Rest rest;
  std::vector<Pose> poses;
  for (const BodyId id : ids) {
    poses.push_back(world.pose(id));
    rest.energy += 0.5 * static_cast<double>(length_squared(world.velocity(id).linear));
  }
  rest.energy /= static_cast<double>(ids.size() - 1);
  rest.overlap = deepest_overlap(scene, poses);
  return rest;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Their energy was 0.07 J/kg and went on: added inertia came and went as they swayed, and gave them energy each time.
TEST_P(ThinHeaps, OfPlatesComeToRest) {
  Generator random(1);
  std::vector<double> energies;
  for (int i = 0; i < 9; ++i) {
    const float size = std::exp(uniform(random, std::log(0.05f), 0));
    const Scene scene = heap(random, 40, size, 0.05f, [&] {
      return box({size, size * uniform(random, 0.5f, 1), 0.015f * size});
    });
    const Rest rest = after_10_s(scene, GetParam());
    energies.push_back(rest.energy);
    EXPECT_LT(rest.overlap, 0.03 * static_cast<double>(size)) << i << ": plates of " << size << " m";
  }
  EXPECT_LT(median(energies), 2e-3);
}

TEST_P(ThinHeaps, OfRodsComeToRest) {
  Generator random(2);
  std::vector<double> energies;
  for (int i = 0; i < 9; ++i) {
    const float size = std::exp(uniform(random, std::log(0.05f), 0));
    const Scene scene = heap(random, 60, size, 0.25f, [&] { return box({size, size / 25, size / 25}); });
    const Rest rest = after_10_s(scene, GetParam());
    energies.push_back(rest.energy);
    EXPECT_LT(rest.overlap, 0.03 * static_cast<double>(size)) << i << ": rods of " << size << " m";
  }
  EXPECT_LT(median(energies), 1e-4);
}

// Under gravity tilted by 35° a heap of plates slides, µ 0.3. It moved by a seventh of what a block does, because its
// bodies kept the inertia that their load had added.
TEST_P(ThinHeaps, SlideWhenGravityTilts) {
  Generator random(3);
  Scene scene = heap(random, 40, 0.5f, 0.06f, [&] { return box({0.5f, 0.5f * uniform(random, 0.5f, 1), 0.0075f}); });
  for (BodyDef& def : scene.bodies) def.material.friction = 0.3f;
  WorldDef def = quiet_world();
  if (GetParam()) def.simulator = SimulatorKind::device, def.device = test_device();
  World world(def);
  const std::vector<BodyId> ids = world.add_bodies(scene.bodies);
  const auto centre = [&] {
    float sum = 0;
    for (std::size_t i = 1; i < ids.size(); ++i) sum += world.pose(ids[i]).position.x;
    return sum / static_cast<float>(ids.size() - 1);
  };
  run(world, 300);
  const float start = centre();
  world.set_gravity({9.81f * std::sin(0.61f), 0, -9.81f * std::cos(0.61f)});
  run(world, 60);
  const float expected = 0.5f * 9.81f * (std::sin(0.61f) - 0.3f * std::cos(0.61f));
  EXPECT_GT(centre() - start, 0.25f * expected);
  EXPECT_LT(centre() - start, 1.6f * expected);
}

}  // namespace
}  // namespace fathom::test::thin_heaps_test
