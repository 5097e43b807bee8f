// A world saved and restored between two steps goes on bit for bit as if nothing had happened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "random.hpp"
#include "scene/environments.hpp"
#include "world/sealed_bytes.hpp"
#include "world_fixture.hpp"

namespace fathom::test::snapshot_test {
namespace {

using testing::HasSubstr;

struct Case {
  const char* name;
  Scene scene;
  int steps_before, steps_after;
};

std::vector<Case> cases() {
  std::vector<Case> all{{"drift", drift(300), 100, 100},
                        {"layers mid-fall", layers(300), 45, 120},
                        {"layers landed", layers(300), 120, 60},
                        {"pyramid", pyramid(8), 60, 60},
                        {"pyramid asleep", pyramid(5), 200, 60},
                        {"layers, sweep", layers(300), 60, 90},
                        {"layers, impulse solver", layers(200), 60, 90}};
  for (const std::size_t native : {0u, 1u, 4u}) {
    Case on_device = all[native];
    on_device.scene.world.simulator = SimulatorKind::device;
    on_device.scene.world.device = "host";
    all.push_back(on_device);
  }
  Case on_published = {"layers, published on a device", layers(300), 60, 90};
  on_published.scene.world.simulator = SimulatorKind::device;
  on_published.scene.world.device = "host";
  apply(Preset::dissertation, on_published.scene.world);
  on_published.scene.world.ahead = 0;
  Case on_hybrid = {"drift, hybrid", drift(300), 60, 60};
  on_hybrid.scene.world.simulator = SimulatorKind::hybrid;
  on_hybrid.scene.world.device = "host";
  all.back().scene.world.sleep.enabled = true;
  all.push_back(on_published);
  all.push_back(on_hybrid);
  all.push_back({"pyramid in domains", pyramid(18), 20, 20});
  all.push_back({"heap in domains", layers(3000), 150, 40});
  all[4].scene.world.sleep.enabled = true;
  all[5].scene.world.broad_phase = BroadPhase::sweep;
  all[6].scene.world.solver.method = Solver::impulse;
  return all;
}

void advance(SceneInstance& instance, World& world, int steps, std::vector<std::uint64_t>& hashes) {
  for (int i = 0; i < steps; ++i) {
    instance.prepare_step();
    world.step();
    hashes.push_back(world.state_hash());
  }
}

TEST(Snapshot, ContinuesBitForBit) {
  for (Case& c : cases()) {
    for (const int threads : {1, 4}) {
      c.scene.world.threads = threads;
      World whole(c.scene.world), halved(c.scene.world);
      SceneInstance one(c.scene, whole), other(c.scene, halved);
      std::vector<std::uint64_t> expected, got;
      advance(one, whole, c.steps_before, expected);
      advance(other, halved, c.steps_before, got);
      // Into a world with other content and settings.
      WorldDef other_def;
      other_def.gravity = {1, 2, 3};
      other_def.threads = threads;
      other_def.device = "host";
      World restored(other_def);
      restored.add(cube({0, 0, 0}));
      restored.restore(saved(halved));
      halved = std::move(restored);
      EXPECT_EQ(halved.state_hash(), expected.back());
      EXPECT_EQ(halved.step_count(), whole.step_count());
      advance(one, whole, c.steps_after, expected);
      advance(other, halved, c.steps_after, got);
      EXPECT_EQ(got, expected) << c.name << ", " << threads << " threads";
    }
  }
}

/// Bodies on a floor of tiles, of which some come, go and are moved by hand before each step.
struct TiledFloor {
  World world;
  Generator random{7};
  std::vector<BodyId> tiles;

  explicit TiledFloor(const WorldDef& def) : world(def) {
    for (int i = 0; i < 600; ++i) tiles.push_back(world.add(tile(i)));
    for (int i = 0; i < 60; ++i)
      world.add(cube({uniform(random, 2, 28), uniform(random, 2, 18), uniform(random, 0.6f, 3)}));
  }
  static BodyDef tile(int i) {
    BodyDef def;
    def.motion = MotionType::fixed;
    def.shape = box({0.5f, 0.5f, 0.25f});
    def.pose.position = {static_cast<float>(i % 30) + 0.5f, static_cast<float>(i / 30) + 0.5f, -0.25f};
    return def;
  }
  void step() {
    for (int i = 0; i < 3; ++i) {
      BodyId& id = tiles[random() % tiles.size()];
      Pose pose = world.pose(id);
      pose.position.z = uniform(random, -0.4f, -0.1f);
      if (random() % 2 == 0) {
        world.set_pose(id, pose);
        continue;
      }
      BodyDef again = tile(0);
      again.pose = pose;
      world.remove(id);
      id = world.add(again);
    }
    (void)world.cast_ray({15, 10, 5}, {0, 0, -10});
    world.step();
  }
};

TEST(Snapshot, FixedBodiesThatComeAndGoContinueBitForBit) {
  for (const int steps : {1, 7, 40, 90}) {
    SCOPED_TRACE(steps);
    WorldDef def = quiet_world();
    TiledFloor whole(def);
    for (int i = 0; i < steps; ++i) whole.step();
    TiledFloor other(def);
    other.world.restore(saved(whole.world));
    other.random = whole.random, other.tiles = whole.tiles;
    for (int i = 0; i < 60; ++i) {
      whole.step();
      other.step();
      ASSERT_EQ(whole.world.state_hash(), other.world.state_hash()) << "step " << i << " after it";
    }
    for (const BodyId id : whole.world.bodies()) EXPECT_GT(whole.world.pose(id).position.z, -0.5f);
  }
}

// Nothing that is found anew on restoring changes what the step leaves, such as when it next looks for structures that
// are overloaded.
TEST(Snapshot, ACopyStaysEqualToTheLastByte) {
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    Generator random(seed);
    World world(quiet_world());
    world.add(ground());
    for (int i = 0; i < 12; ++i)
      world.add(dynamic(box({0.2f, 0.2f, 0.2f}),
                        {uniform(random, -1, 1), uniform(random, -1, 1), 1 + 0.5f * static_cast<float>(i)},
                        i % 4 == 3 ? 50.0f : 1.0f));
    for (int i = 0; i < 120; ++i) {
      World copy(quiet_world());
      copy.restore(saved(world));
      world.step();
      copy.step();
      ASSERT_TRUE(saved(world) == saved(copy)) << "seed " << seed << ", step " << i;
    }
  }
}

// The first step after restoring finds no room, when the device does not hold the previous step's events.
TEST(Snapshot, NeedsMoreRoomAtOnce) {
  Scene scene = pyramid(10);
  scene.world.simulator = SimulatorKind::device;
  scene.world.device = "host";
  World whole(scene.world), restored(scene.world);
  SceneInstance one(scene, whole);
  run(whole, 1);  // all contacts begin
  restored.restore(saved(whole));
  for (World* world : {&whole, &restored}) {
    for (int i = 0; i < 100; ++i) world->add(cube({0.01f * static_cast<float>(i), 0, 5}));
    world->step();
  }
  EXPECT_EQ(restored.state_hash(), whole.state_hash());
  EXPECT_EQ(restored.contacts_begun().size(), whole.contacts_begun().size());
}

// All shapes, damping, gravity and filters of their own, bodies that came and went, kinematic and quarantined bodies,
// pending forces and events.
World busy_world(int threads, SimulatorKind simulator = SimulatorKind::native) {
  WorldDef def;
  def.simulator = simulator;
  def.device = "host";
  def.threads = threads;
  World world(def);
  world.add(ground(0.6f));
  const Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const Shape shapes[] = {box({0.4f, 0.5f, 0.3f}), sphere(0.4f), capsule(0.25f, 0.4f), hull(corners)};
  std::vector<BodyId> ids;
  for (int i = 0; i < 120; ++i) {
    BodyDef body = dynamic(shapes[i % 4], {static_cast<float>(i % 4) * 0.9f, static_cast<float>(i / 4 % 4) * 0.9f,
                                           1.5f + static_cast<float>(i / 16)});
    body.material.restitution = i % 7 == 0 ? 0.6f : 0.0f;
    body.user_data = static_cast<std::uint64_t>(i);
    body.linear_damping = i % 5 == 0 ? 0.4f : 0.0f;
    body.angular_damping = i % 6 == 0 ? 0.7f : 0.0f;
    body.gravity_scale = i % 11 == 0 ? 0.6f : 1.0f;
    if (i % 13 == 0) body.filter = {2, ~2u};
    ids.push_back(world.add(body));
  }
  BodyDef lift = cube({6, 0, 1});
  lift.motion = MotionType::kinematic;
  lift.velocity.linear = {-0.5f, 0, 0};
  world.add(lift);
  run(world, 50);
  world.remove(ids[7]);
  world.remove(ids[30]);
  world.add(cube({1, 1, 12}));
  const BodyId broken = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 50, 20}, 1e-30f));
  world.apply_force(broken, {1e30f, 0, 0});  // finite, but its acceleration is not
  run(world, 3);
  world.apply_force(ids[11], {200, 0, 50});
  world.remove(ids[31]);
  world.set_pose(ids[40], {{1, 2, 9}, 0, {}});
  return world;
}

TEST(Snapshot, KeepsAllKindsOfBodiesAndWhatIsPending) {
  for (const auto& [simulator, threads] : {std::pair{SimulatorKind::native, 1}, std::pair{SimulatorKind::native, 4},
                                           std::pair{SimulatorKind::device, 2}}) {
    World whole = busy_world(threads, simulator);
    WorldDef def;
    def.threads = threads;
    def.device = "host";
    World copy(def);
    copy.restore(saved(whole));
    ASSERT_EQ(copy.definition().simulator, simulator);
    ASSERT_EQ(copy.body_count(), whole.body_count());
    EXPECT_THAT(copy.bodies(), testing::ElementsAreArray(whole.bodies()));
    for (const BodyId id : whole.bodies()) {
      EXPECT_EQ(copy.user_data(id), whole.user_data(id));
      EXPECT_EQ(copy.mass(id), whole.mass(id));
      EXPECT_EQ(copy.is_awake(id), whole.is_awake(id));
    }
    for (int step = 0; step < 150; ++step) {
      if (step == 20) {
        EXPECT_EQ(copy.add(cube({0, 1, 9})), whole.add(cube({0, 1, 9})));
      }
      whole.step();
      copy.step();
      ASSERT_EQ(copy.state_hash(), whole.state_hash()) << "step " << step;
      ASSERT_EQ(copy.contacts_begun().size(), whole.contacts_begun().size());
      ASSERT_EQ(copy.contacts_ended().size(), whole.contacts_ended().size());
      ASSERT_EQ(copy.hits().size(), whole.hits().size());
    }
    EXPECT_EQ(copy.cast_ray({1, 1, 50}, {0, 0, -60})->body, whole.cast_ray({1, 1, 50}, {0, 0, -60})->body);
  }
}

TEST(Snapshot, ThreadCountMayChangeOnTheWay) {
  World whole = busy_world(1);
  WorldDef def;
  def.threads = 3;
  World copy(def);
  copy.restore(saved(whole));
  EXPECT_EQ(copy.definition().threads, 3);
  run(whole, 60);
  run(copy, 60);
  EXPECT_EQ(copy.state_hash(), whole.state_hash());
}

void add_cubes(World& world) {
  for (int i = 0; i < 20; ++i) world.add(cube({static_cast<float>(i % 3), 0, 1.0f + 1.1f * static_cast<float>(i / 3)}));
}

TEST(Snapshot, EmptyWorldsAndWorldsBeforeTheirFirstStep) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
    WorldDef def;
    def.simulator = simulator;
    def.device = "host";
    World world(def), copy(def);
    copy.restore(saved(world));
    copy.step();
    EXPECT_EQ(copy.body_count(), 0u);
    world.add(ground());
    add_cubes(world);
    copy.restore(saved(world));
    run(world, 30);
    run(copy, 30);
    EXPECT_EQ(copy.state_hash(), world.state_hash());
  }
}

std::string refusal(World& world, std::span<const std::byte> bytes) {
  try {
    world.restore(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file);
    return error.what();
  }
  return "accepted";
}

TEST(Snapshot, TruncatedAndAlteredBytesAreRefusedAndChangeNothing) {
  const std::vector<std::byte> good = saved(busy_world(1));
  World world(quiet_world());
  world.add(cube({0, 0, 0}));
  const std::uint64_t before = world.state_hash();
  EXPECT_THAT(refusal(world, {}), HasSubstr("ends too early"));
  for (const std::size_t size : {std::size_t{7}, std::size_t{31}, std::size_t{32}, good.size() / 2, good.size() - 1})
    EXPECT_THAT(refusal(world, std::span(good).first(size)), HasSubstr("snapshot: ")) << size;
  for (std::size_t at = 0; at < good.size(); at += 997) {
    std::vector<std::byte> bad = good;
    bad[at] ^= std::byte{0x10};
    EXPECT_NE(refusal(world, bad), "accepted") << at;
  }
  std::vector<std::byte> later = good;
  const int next = std::to_integer<int>(good[8]) + 1;
  later[8] = static_cast<std::byte>(next);
  EXPECT_THAT(refusal(world, later), HasSubstr("format version " + std::to_string(next)));
  EXPECT_EQ(world.state_hash(), before);
  EXPECT_EQ(world.body_count(), 1u);
  run(world, 3);
}

/// The snapshot with the right checksum, but with the `number`-th word that is `from` replaced by `to`; empty if there
/// are not so many.
std::vector<std::byte> altered(std::vector<std::byte> bytes, float from, float to, int number) {
  for (std::size_t at = 32; at + sizeof from <= bytes.size(); ++at) {
    if (std::memcmp(bytes.data() + at, &from, sizeof from) != 0 || number-- > 0) continue;
    std::memcpy(bytes.data() + at, &to, sizeof to);
    seal(bytes);
    return bytes;
  }
  return {};
}

// Sizes so large that what follows from them is not finite are not refused. The body is quarantined, and the step ends.
TEST(Snapshot, NumbersOutOfRangeAreRefusedOrQuarantined) {
  constexpr float x = 0.1234567f, extent = 0.2345678f;
  World small(quiet_world());
  small.add(ground());
  for (int i = 0; i < 4; ++i)
    small.add(dynamic(cylinder(0.3f, extent, 5), {x, 0, 0.4f + 0.9f * static_cast<float>(i)}));
  run(small, 40);
  small.set_pose(small.bodies()[1], {.position = {x, 0, 0.3f}});
  const std::vector<std::byte> good = saved(small);
  World world(quiet_world());
  for (const float number : {std::nanf(""), std::numeric_limits<float>::infinity()})
    EXPECT_THAT(refusal(world, altered(good, x, number, 0)), HasSubstr("contradicts itself"));
  int accepted = 0;
  for (const float size : {extent, -extent}) {
    for (int number = 0;; ++number) {
      const std::vector<std::byte> bytes = altered(good, size, std::numeric_limits<float>::max(), number);
      if (bytes.empty()) break;
      if (refusal(world, bytes) != "accepted") continue;
      ++accepted;
      run(world, 3);
      for (const BodyId id : world.bodies()) EXPECT_TRUE(is_finite(world.pose(id))) << number;
    }
  }
  EXPECT_GT(accepted, 4);
}

}  // namespace
}  // namespace fathom::test::snapshot_test
