// What the device simulator promises beyond the World's interface, on its host back end or on FATHOM_TEST_DEVICE.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fathom/error.hpp"
#include "late_device.hpp"
#include "scene/environments.hpp"
#include "scene/scene.hpp"
#include "world_fixture.hpp"

namespace fathom::device_simulator_test {
namespace {

WorldDef on_device(WorldDef def) {
  def.simulator = SimulatorKind::device;
  def.device = test::test_device();
  return def;
}

TEST(DevicePoses, HostBackEndHasNone) {
  WorldDef def;
  def.simulator = SimulatorKind::device;
  def.device = "host";
  World world(def);
  world.add({.shape = box({0.5f, 0.5f, 0.5f}), .mass = 1});
  EXPECT_FALSE(world.device_poses());
  world.step();
  EXPECT_FALSE(world.device_poses());
  EXPECT_LT(world.poses()[0].position.z, 0);
  EXPECT_FALSE(World().device_poses());
}

/// State hash of a scene after `steps` steps, with settings that must not matter.
std::uint64_t hash_after(Scene scene, int steps, const std::function<void(WorldDef&)>& set) {
  scene.world = on_device(scene.world);
  set(scene.world);
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < steps; ++i) {
    instance.prepare_step();
    world.step();
  }
  return world.state_hash();
}

TEST(DeviceSimulator, SameStatesForAnyNumberOfThreadsAndStepsAhead) {
  for (const Scene& scene : {drift(200), layers(300), pyramid(6)}) {
    const std::uint64_t one = hash_after(scene, 120, [](WorldDef& def) { def.threads = 1; });
    EXPECT_EQ(one, hash_after(scene, 120, [](WorldDef& def) { def.threads = 4; })) << scene.name;
    const test::LateDevice late;
    EXPECT_EQ(one, hash_after(scene, 120, [](WorldDef& def) { def.ahead = 2; })) << scene.name;
    EXPECT_EQ(one, hash_after(scene, 120, [](WorldDef& def) { def.ahead = 5, def.copy_results = false; }))
        << scene.name;
  }
}

// Contacts of a pyramid begin all at once and choose their colours in an unsuitable order; they try again until no
// further colour can be saved.
TEST(DeviceSimulator, ContactsThatBeganTryOtherColours) {
  World world(on_device(test::quiet_world()));
  world.add(test::ground());
  test::add_pyramid(world, 15);
  world.step();
  const std::uint32_t at_first = world.profile().counts.colours;
  test::run(world, 59);
  EXPECT_LE(world.profile().counts.colours, 11u) << "of " << at_first;
}

/// 400 bodies come from far apart to the same place, each with a velocity of this size (m/s). What becomes of them in
/// six steps, and the number of events in the first five.
std::pair<std::uint64_t, std::vector<std::size_t>> crowd(const Shape& shape, float speed, std::uint32_t room,
                                                         int ahead) {
  WorldDef def = on_device(test::quiet_world());
  def.gravity = {};
  def.ahead = ahead;
  World world(def);
  world.reserve(room);
  std::vector<BodyId> ids;
  for (int i = 0; i < 400; ++i) ids.push_back(world.add(test::dynamic(shape, {10.0f * static_cast<float>(i), 0, 0})));
  test::run(world, 3);
  for (int i = 0; i < 400; ++i) {
    const BodyId id = ids[static_cast<std::size_t>(i)];
    const float x = 0.3f * static_cast<float>(i % 8), y = 0.3f * static_cast<float>(i / 8 % 8),
                z = 0.3f * static_cast<float>(i / 64);
    world.set_pose(id, {.position = {x, y, z}});
    const Vec3 middle{1.05f, 1.05f, 0.9f};
    if (speed > 0) world.set_velocity(id, speed * normalize(middle - Vec3{x, y, z}), {});
  }
  std::vector<std::size_t> events;
  for (int i = 0; i < 5; ++i) {
    world.step();
    world.apply_impulse(ids[static_cast<std::size_t>(i)], {0, 0, 5});
    if (ahead == 0) events.insert(events.end(), {world.contacts_begun().size(), world.contacts_ended().size()});
  }
  if (ahead == 0) {
    EXPECT_GT(events.front(), 1024u) << "manifolds that there is room for at first";
  }
  world.step();
  world.wait();
  EXPECT_GT(world.profile().counts.pairs, 3000u);
  return {world.state_hash(), events};
}

// A step that finds its buffers too small is stopped, they grow, and it runs again with all that followed it. The
// result is that of a world that had room from the start.
TEST(DeviceSimulator, StepsThatOverflowAreDoneAgain) {
  const auto roomy = crowd(sphere(0.5f), 0, 100'000, 0);
  EXPECT_EQ(crowd(sphere(0.5f), 0, 1, 0), roomy);
  EXPECT_EQ(crowd(sphere(0.5f), 0, 1, 3).first, roomy.first);
}

// So many pairs are fast and lack a manifold that their list would overflow if those were listed again.
TEST(DeviceSimulator, StepsThatOverflowWithFastPairsAreDoneAgain) {
  const Vec3 corners[] = {{0.5f, 0, 0}, {-0.5f, 0, 0}, {0, 0.5f, 0}, {0, -0.5f, 0}, {0, 0, 0.5f}, {0, 0, -0.5f}};
  for (const Shape& shape : {sphere(0.5f), hull(corners)}) {
    const auto roomy = crowd(shape, 60, 100'000, 0);
    EXPECT_EQ(crowd(shape, 60, 1, 0), roomy);
    EXPECT_EQ(crowd(shape, 60, 1, 3).first, roomy.first);
  }
}

// The bound is that of docs/device.md.
TEST(DeviceSimulator, MemoryIsBoundedByBodiesAndManifolds) {
  for (Scene scene : {pyramid(15), layers(2000)}) {
    scene.world = on_device(scene.world);
    World world(scene.world);
    SceneInstance instance(scene, world);
    for (int i = 0; i < 240; ++i) world.step();
    const StepCounts& counts = world.profile().counts;
    EXPECT_GE(counts.manifolds + 1, counts.bodies) << scene.name;
    EXPECT_LE(counts.memory_bytes, 2048 * counts.bodies + 1024 * counts.manifolds) << scene.name;
  }
}

TEST(DeviceSimulator, RunsAheadOfWhatIsRead) {
  WorldDef def = on_device(test::quiet_world());
  def.ahead = 2;
  World world(def);
  const BodyId ball = world.add(test::dynamic(sphere(0.5f), {0, 0, 100}));
  for (int i = 0; i < 20; ++i) {
    world.step();
    const std::uint64_t read = world.profile().step;
    EXPECT_LE(read, world.step_count());
    EXPECT_GE(read + 2, world.step_count());
  }
  world.wait();
  EXPECT_EQ(world.profile().step, 20u);
  const float t = 20 * def.dt;
  EXPECT_NEAR(world.pose(ball).position.z, 100 - 0.5f * 9.81f * t * t, 1e-2f);
}

TEST(DeviceSimulator, ManyBodiesOnOneAreAllHeld) {
  // More contacts on one dynamic body than a word has colours, and than there are colours.
  for (const int side : {9, 13}) {
    World world(on_device(test::quiet_world()));
    world.add(test::ground());
    const float half = 0.6f * static_cast<float>(side);
    const BodyId raft = world.add(test::dynamic(box({half, half, 0.25f}), {0, 0, 0.75f}, 4 * half * half));
    std::vector<BodyId> load;
    for (int i = 0; i < side * side; ++i)
      load.push_back(
          world.add(test::dynamic(box({0.3f, 0.3f, 0.3f}), {1.2f * static_cast<float>(i % side - side / 2),
                                                            1.2f * static_cast<float>(i / side - side / 2), 1.3f})));
    world.step();
    EXPECT_EQ(world.profile().counts.overflow > 0, side == 13);
    test::run(world, 239);
    const StepCounts counts = world.profile().counts;
    EXPECT_EQ(counts.overflow > 0, side == 13);
    EXPECT_GT(counts.colours, 64u);
    EXPECT_NEAR(world.pose(raft).position.z, 0.75f, 0.01f);
    for (const BodyId id : load) EXPECT_NEAR(world.pose(id).position.z, 1.3f, 0.01f);
    for (const BodyId id : load) world.remove(id);
    world.step();
    world.step();
    EXPECT_LE(world.profile().counts.colours, 1u) << side;
  }
}

TEST(DeviceSimulator, SaysWhatItRunsOn) {
  World world(on_device({}));
  EXPECT_THAT(world.hardware(), testing::HasSubstr(":0 "));
  EXPECT_EQ(World().hardware(), "");
}

TEST(DeviceSimulator, DevicesThatAreNotThereAreErrors) {
  WorldDef def;
  def.simulator = SimulatorKind::device;
  for (const char* device : {"host:1", "gpu", "cuda:99", ""}) {
    def.device = device;
    EXPECT_THROW(World{def}, Error) << device;
  }
}

// Edits of many bodies are sent to the device while more are made, and are followed by edits in the bodies' own order:
// neither that order nor a body's later edit may be lost.
TEST(DeviceSimulator, EditsOfManyBodiesAreAppliedInTheirOrder) {
  const Scene scene = drift(5000);
  const auto hash = [&](int ahead, const std::function<void(World&, const std::vector<BodyId>&)>& edit) {
    WorldDef def = on_device(scene.world);
    def.ahead = ahead;
    World world(def);
    SceneInstance instance(scene, world);
    for (int i = 0; i < 6; ++i) {
      world.step();
      edit(world, instance.ids());
    }
    world.step();
    return world.state_hash();
  };
  const Vec3 v{1, 2, 3}, w{0.5f, 0, -1}, more{-0.25f, 1, 0};
  const auto once = [&](World& world, const std::vector<BodyId>& ids) {
    for (const BodyId id : ids) world.set_velocity(id, v + more, w + more);
  };
  const std::uint64_t expected = hash(0, once);
  EXPECT_EQ(expected, hash(2, once));
  EXPECT_EQ(expected, hash(2, [&](World& world, const std::vector<BodyId>& ids) {
              for (auto id = ids.rbegin(); id != ids.rend(); ++id) world.set_velocity(*id, v, w);
              for (const BodyId id : ids) world.add_velocity(id, more, more);
            }));
}

TEST(DeviceSimulator, MemoryStaysInBounds) {
  Scene scene = pyramid(12);
  scene.world = on_device(scene.world);
  World world(scene.world);
  SceneInstance instance(scene, world);
  test::run(world, 30);
  const StepCounts& counts = world.profile().counts;
  EXPECT_LE(counts.memory_bytes, 2048u * counts.bodies + 1024u * counts.manifolds);
  EXPECT_GT(counts.launches, 0u);
}

}  // namespace
}  // namespace fathom::device_simulator_test
