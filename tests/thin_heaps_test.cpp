// Heaps of thin bodies, whose contacts carry many times their own weight and sag by a large part of their thickness:
// they come to rest without sinking into each other, and move as anything else does (docs/log/
// 2026-11-30-plates-at-rest.md).
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

// Every heap bounced like one long spring, at up to 2 m/s and without end: added inertia came and went as it did so.
// A few still sway.
TEST_P(ThinHeaps, OfPlatesComeToRest) {
  Generator random(1);
  std::vector<double> energies;
  int restless = 0;
  for (int i = 0; i < 15; ++i) {
    const float size = std::exp(uniform(random, std::log(0.05f), 0));
    const Scene scene = heap(random, 40, size, 0.05f, [&] {
      return box({size, size * uniform(random, 0.5f, 1), 0.015f * size});
    });
    const Rest rest = after_10_s(scene, GetParam());
    energies.push_back(rest.energy);
    restless += rest.energy > 1e-3;
    EXPECT_LT(rest.overlap, 0.06 * static_cast<double>(size)) << i << ": plates of " << size << " m";
  }
  EXPECT_LT(median(energies), 1e-4);
  EXPECT_LE(restless, 7);
}

TEST_P(ThinHeaps, OfRodsComeToRest) {
  Generator random(2);
  std::vector<double> energies;
  for (int i = 0; i < 15; ++i) {
    const float size = std::exp(uniform(random, std::log(0.05f), 0));
    const Scene scene = heap(random, 60, size, 0.25f, [&] { return box({size, size / 25, size / 25}); });
    const Rest rest = after_10_s(scene, GetParam());
    energies.push_back(rest.energy);
    EXPECT_LT(rest.energy, 0.01) << i << ": rods of " << size << " m";
    EXPECT_LT(rest.overlap, 0.03 * static_cast<double>(size)) << i << ": rods of " << size << " m";
  }
  EXPECT_LT(median(energies), 1e-5);
}

/// A heap of plates that has come to rest.
struct Resting {
  World world;
  std::vector<BodyId> ids;

  Resting(bool on_device, float friction, MotionType of_floor) : world(definition(on_device)) {
    Generator random(3);
    Scene scene = heap(random, 40, 0.5f, 0.06f, [&] { return box({0.5f, 0.5f * uniform(random, 0.5f, 1), 0.0075f}); });
    for (BodyDef& def : scene.bodies) def.material.friction = friction;
    scene.bodies[0].motion = of_floor;
    ids = world.add_bodies(scene.bodies);
    run(world, 300);
  }
  static WorldDef definition(bool on_device) {
    WorldDef def = quiet_world();
    if (on_device) def.simulator = SimulatorKind::device, def.device = test_device();
    return def;
  }
  Vec3 centre() const {
    Vec3 sum;
    for (std::size_t i = 1; i < ids.size(); ++i) sum += world.pose(ids[i]).position;
    return 1 / static_cast<float>(ids.size() - 1) * sum;
  }
};

// What moves has its own mass alone. A heap that kept its added inertia slid by a seventh of what a block does.
TEST_P(ThinHeaps, SlideWhenGravityTilts) {
  Resting heap(GetParam(), 0.3f, MotionType::fixed);
  const float start = heap.centre().x;
  heap.world.set_gravity({9.81f * std::sin(0.61f), 0, -9.81f * std::cos(0.61f)});
  run(heap.world, 60);
  const float expected = 0.5f * 9.81f * (std::sin(0.61f) - 0.3f * std::cos(0.61f));
  EXPECT_GT(heap.centre().x - start, 0.25f * expected);
  EXPECT_LT(heap.centre().x - start, 1.6f * expected);
}

TEST_P(ThinHeaps, FallWhenTheirFloorIsGone) {
  Resting heap(GetParam(), 0.6f, MotionType::fixed);
  const float start = heap.centre().z;
  heap.world.remove(heap.ids[0]);
  run(heap.world, 60);
  EXPECT_NEAR(start - heap.centre().z, 4.2f, 0.7f);
}

TEST_P(ThinHeaps, RideOnAFloorThatSpeedsUp) {
  Resting heap(GetParam(), 0.6f, MotionType::kinematic);
  const Vec3 start = heap.centre();
  Pose floor = heap.world.pose(heap.ids[0]);
  const float floor_start = floor.position.x;
  float speed = 0;
  for (int i = 0; i < 120; ++i) {
    speed += (i < 60 ? 2.0f : -2.0f) / 60;
    floor.position.x += speed / 60;
    heap.world.move_to(heap.ids[0], floor);
    heap.world.step();
  }
  EXPECT_NEAR(heap.centre().x - start.x, floor.position.x - floor_start, 0.25f);
}

}  // namespace
}  // namespace fathom::test::thin_heaps_test
