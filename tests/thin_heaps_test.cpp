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
INSTANTIATE_TEST_SUITE_P(Simulators, ThinHeaps, testing::Bool(),
                         [](const auto& info) { return info.param ? "device" : "native"; });

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

// The energy of plates was 0.1 to 0.5 J/kg and went on: their added inertia came and went as they swayed, and lifted
// them in every cycle.
TEST_P(ThinHeaps, OfPlatesComeToRest) {
  Generator random(1);
  for (int i = 0; i < 8; ++i) {
    const float size = std::exp(uniform(random, std::log(0.05f), 0));
    const Scene scene = heap(random, 40, size, 0.05f, [&] {
      return box({size, size * uniform(random, 0.5f, 1), 0.015f * size});
    });
    const Rest rest = after_10_s(scene, GetParam());
    EXPECT_LT(rest.energy, 5e-3) << i << ": plates of " << size << " m";
    EXPECT_LT(rest.overlap, 0.03 * static_cast<double>(size)) << i << ": plates of " << size << " m";
  }
}

TEST_P(ThinHeaps, OfRodsComeToRest) {
  Generator random(2);
  for (int i = 0; i < 8; ++i) {
    const float size = std::exp(uniform(random, std::log(0.05f), 0));
    const Scene scene = heap(random, 60, size, 0.25f, [&] { return box({size, size / 25, size / 25}); });
    const Rest rest = after_10_s(scene, GetParam());
    EXPECT_LT(rest.energy, 2e-4) << i << ": rods of " << size << " m";
    EXPECT_LT(rest.overlap, 0.02 * static_cast<double>(size)) << i << ": rods of " << size << " m";
  }
}

}  // namespace
}  // namespace fathom::test::thin_heaps_test
