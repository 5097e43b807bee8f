// Structures that stand although their contacts carry far more than sweeps can (dynamics/support.hpp), on the device
// simulator's host back end.
#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::test::supports_test {
namespace {

using Bodies = std::vector<BodyDef>;

Bodies wall(int courses) {
  Bodies bricks;
  for (int r = 0; r < courses; ++r)
    for (int i = 0; i < 10; ++i)
      bricks.push_back(dynamic(box({0.5f, 0.25f, 0.25f}), {static_cast<float>(i) + 0.5f * static_cast<float>(r % 2), 0,
                                                           0.75f + 0.5f * static_cast<float>(r)}));
  return bricks;
}

Bodies slab() {
  Bodies bodies;
  for (int i = 0; i < 4; ++i)
    bodies.push_back(dynamic(box({0.25f, 0.25f, 0.25f}), {i % 2 ? 1.5f : -1.5f, i / 2 ? 1.5f : -1.5f, 0.75f}, 10));
  bodies.push_back(dynamic(box({2, 2, 0.5f}), {0, 0, 1.5f}, 32000));
  return bodies;
}

Bodies flat_pyramid(int rows) {
  Bodies cubes;
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < rows - r; ++i)
      cubes.push_back(
          cube({1.05f * (static_cast<float>(i) + 0.5f * static_cast<float>(r)), 0, 1 + static_cast<float>(r)}));
  return cubes;
}

Bodies plates() {
  Bodies bodies;
  for (int i = 0; i < 20; ++i)
    bodies.push_back(dynamic(box({0.5f, 0.5f, 0.01f}), {0, 0, 0.51f + 0.02f * static_cast<float>(i)}));
  return bodies;
}

Bodies tower() {
  Bodies cubes;
  for (int i = 0; i < 100; ++i) cubes.push_back(cube({0, 0, 1 + static_cast<float>(i)}));
  return cubes;
}

struct Structure {
  const char* name;
  std::function<Bodies()> bodies;
};

void PrintTo(const Structure& s, std::ostream* out) { *out << s.name; }

class Supports : public testing::TestWithParam<Structure> {
 protected:
  static WorldDef definition(int threads = 1) {
    WorldDef def = quiet_world(threads);
    if (def.simulator == SimulatorKind::native) def.simulator = SimulatorKind::device, def.device = test_device();
    return def;
  }
  static std::vector<BodyId> build(World& world) {
    world.add(ground());
    std::vector<BodyId> ids;
    for (const BodyDef& def : GetParam().bodies()) ids.push_back(world.add(def));
    return ids;
  }
};

TEST_P(Supports, Stand) {
  World world(definition());
  const std::vector<BodyId> ids = build(world);
  std::vector<Vec3> start;
  for (const BodyId id : ids) start.push_back(world.pose(id).position);
  run(world, 300);
  for (std::size_t i = 0; i < ids.size(); ++i)
    ASSERT_LT(length(world.pose(ids[i]).position - start[i]), 0.005f) << "body " << i;
}

// Each is hit by a ball, so that not everything is at rest.
TEST_P(Supports, DoNotDependOnThreads) {
  std::uint64_t expected = 0;
  for (const int threads : {1, 3}) {
    World world(definition(threads));
    build(world);
    BodyDef ball = dynamic(sphere(0.3f), {1, -2, 1}, 3);
    ball.velocity.linear = {0, 4, 1};
    world.add(ball);
    run(world, 60);
    if (threads == 1) expected = world.state_hash();
    EXPECT_EQ(world.state_hash(), expected);
  }
}

TEST_P(Supports, ContinueBitForBitFromASnapshot) {
  World straight(definition());
  build(straight);
  BodyDef ball = dynamic(sphere(0.3f), {1, -2, 1}, 3);
  ball.velocity.linear = {0, 4, 1};
  straight.add(ball);
  run(straight, 21);
  std::vector<std::byte> bytes;
  straight.save(bytes);
  World restored(definition());
  restored.restore(bytes);
  for (int i = 0; i < 45; ++i) {
    straight.step();
    restored.step();
    ASSERT_EQ(straight.state_hash(), restored.state_hash()) << "step " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Structures, Supports,
                         testing::Values(Structure{"wall", [] { return wall(20); }}, Structure{"slab", slab},
                                         Structure{"pyramid", [] { return flat_pyramid(30); }},
                                         Structure{"plates", plates}, Structure{"tower", tower}),
                         [](const auto& structure) { return structure.param.name; });

// A structure moves as one with the platform that it stands on.
TEST(SupportsOnAPlatform, MoveAlong) {
  WorldDef def = quiet_world();
  if (def.simulator == SimulatorKind::native) def.simulator = SimulatorKind::device, def.device = test_device();
  World world(def);
  BodyDef platform = ground();
  platform.motion = MotionType::kinematic;
  platform.velocity.linear = {0.2f, 0, 0.3f};
  world.add(platform);
  std::vector<BodyId> ids;
  for (int i = 0; i < 40; ++i) {
    BodyDef c = cube({0, 0, 1 + static_cast<float>(i)});
    c.velocity.linear = platform.velocity.linear;
    ids.push_back(world.add(c));
  }
  run(world, 300);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Vec3 expected = Vec3{0, 0, 1 + static_cast<float>(i)} + 5.0f * platform.velocity.linear;
    ASSERT_LT(length(world.pose(ids[i]).position - expected), 0.005f) << "cube " << i;
  }
}

// Without weight nothing is held: what remains of the structures drifts as it is pushed.
TEST(SupportsWithoutWeight, LetGo) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
    WorldDef def = quiet_world();
    def.simulator = simulator, def.device = test_device();
    World world(def);
    world.add(ground());
    std::vector<BodyId> kept, removed;
    for (int i = 0; i < 40; ++i) (i % 2 ? kept : removed).push_back(world.add(cube({0, 0, 1 + static_cast<float>(i)})));
    for (int i = 0; i < 8; ++i)
      (i % 2 ? removed : kept)
          .push_back(
              world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {3, 0, 1 + static_cast<float>(i)}, i < 7 ? 1.0f : 1000.0f)));
    run(world, 20);
    world.set_gravity({});
    run(world, 2);
    for (const BodyId id : removed) world.remove(id);
    run(world, 10);
    for (const BodyId id : kept) world.set_velocity(id, {0.5f, 0, 1}, {});
    run(world, 60);
    for (const BodyId id : kept) EXPECT_NEAR(world.velocity(id).linear.x, 0.5f, 1e-4f);
    world.set_gravity({0, 0, -9.81f});
    run(world, 60);
  }
}

}  // namespace
}  // namespace fathom::test::supports_test
