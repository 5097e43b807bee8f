// Sensors: which bodies are in them, on every simulator; fast bodies, sleepers, shapes of all kinds, removals,
// snapshots.
#include <gmock/gmock.h>

#include <algorithm>
#include <fathom/compound.hpp>
#include <set>

#include "joint_worlds.hpp"
#include "query_oracle.hpp"
#include "scene/scene_file.hpp"

namespace fathom {

static bool operator==(const SensorEvent& x, const SensorEvent& y) {
  return x.sensor == y.sensor && x.body == y.body && x.step == y.step;
}

namespace test::sensor_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class Sensor : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, Sensor, testing::ValuesIn(joint_worlds), joint_world_name);

BodyDef sensor(const Shape& shape, Vec3 position, MotionType motion = MotionType::fixed) {
  BodyDef def;
  def.shape = shape;
  def.motion = motion;
  def.pose.position = position;
  def.sensor = true;
  return def;
}

std::vector<BodyId> inside(const World& world, BodyId sensor) {
  std::vector<BodyId> ids;
  world.for_each_in_sensor(sensor, [&](BodyId id) { ids.push_back(id); });
  return ids;
}

TEST_P(Sensor, TellsOfWhatFallsThroughIt) {
  WorldDef def = GetParam().quiet();
  World world(def);
  const BodyId gate = world.add(sensor(box({1, 1, 0.5f}), {0, 0, 2}));
  const BodyId ball = world.add(dynamic(sphere(0.25f), {0, 0, 3}));
  std::vector<SensorEvent> begun, ended;
  bool was_in = false;
  for (int i = 0; i < 60; ++i) {
    world.step();
    const float z = world.pose(ball).position.z;
    const bool is_in = z <= 2.75f && z >= 1.25f;
    EXPECT_EQ(world.sensor_begun().size(), is_in && !was_in) << i;
    EXPECT_EQ(world.sensor_ended().size(), !is_in && was_in) << i;
    begun.insert(begun.end(), world.sensor_begun().begin(), world.sensor_begun().end());
    ended.insert(ended.end(), world.sensor_ended().begin(), world.sensor_ended().end());
    EXPECT_EQ(inside(world, gate), is_in ? std::vector{ball} : std::vector<BodyId>{}) << i;
    was_in = is_in;
  }
  ASSERT_EQ(begun.size(), 1u);
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_EQ(begun[0].sensor, gate);
  EXPECT_EQ(begun[0].body, ball);
  EXPECT_LT(begun[0].step, ended[0].step);
  // It fell as if nothing were there, and no contact began.
  EXPECT_NEAR(world.velocity(ball).linear.z, -9.81f, 1e-3f);
}

TEST_P(Sensor, PushesNobody) {
  World world(GetParam().sleepy()), without(GetParam().sleepy());
  for (World* w : {&world, &without}) {
    w->add(ground());
    for (int i = 0; i < 8; ++i) w->add(cube({1.2f * static_cast<float>(i), 0, 1.1f + 0.2f * static_cast<float>(i)}));
  }
  const BodyId drifting = world.add([] {
    BodyDef def = sensor(sphere(1), {-4, 0, 2}, MotionType::dynamic);
    def.gravity_scale = 0;
    def.velocity.linear = {1, 0, 0};
    return def;
  }());
  const BodyId lift = world.add([] {
    BodyDef def = sensor(box({1, 1, 1}), {0, 0, -3}, MotionType::kinematic);
    def.velocity.linear = {0, 0, 1};
    return def;
  }());
  std::set<std::uint32_t> met;
  for (int i = 0; i < 300; ++i) {
    world.step(), without.step();
    for (const SensorEvent& event : world.sensor_begun()) met.insert(event.sensor.index);
    for (const BodyId id : without.bodies())
      ASSERT_TRUE(without.pose(id).position == world.pose(id).position) << i << ", body " << id.index;
  }
  EXPECT_NEAR(world.pose(drifting).position.x, 1, 1e-3f);
  EXPECT_THAT(met, ElementsAre(drifting.index, lift.index));
  EXPECT_FALSE(world.is_awake(world.bodies()[1])) << "nor does it keep anybody awake";
}

TEST_P(Sensor, SeesWhatCrossesItWithinAStep) {
  World world(GetParam().quiet());
  const BodyId film = world.add(sensor(box({0.01f, 2, 2}), {0, 0, 5}));
  const BodyId aside = world.add(sensor(box({0.01f, 2, 2}), {0, 5, 5}));
  BodyDef shot = dynamic(sphere(0.05f), {-28, 0, 5});
  shot.gravity_scale = 0;
  shot.velocity.linear = {300, 0, 0};
  const BodyId bullet = world.add(shot);
  std::vector<SensorEvent> begun, ended;
  for (int i = 0; i < 12; ++i) {
    world.step();
    begun.insert(begun.end(), world.sensor_begun().begin(), world.sensor_begun().end());
    ended.insert(ended.end(), world.sensor_ended().begin(), world.sensor_ended().end());
    EXPECT_THAT(inside(world, aside), IsEmpty());
  }
  ASSERT_EQ(begun.size(), 1u);
  EXPECT_EQ(begun[0].sensor, film);
  EXPECT_EQ(begun[0].body, bullet);
  EXPECT_EQ(begun, ended);
}

// The sensor flies and what it crosses stands still; a body moved by the application has crossed nothing.
TEST_P(Sensor, MovesThroughOthersWithinAStep) {
  World world(GetParam().quiet());
  BodyDef flying = sensor(sphere(0.1f), {-4, 0, 5}, MotionType::kinematic);
  flying.velocity.linear = {480, 0, 0};
  const BodyId probe = world.add(flying);
  BodyDef post;
  post.motion = MotionType::fixed;
  post.shape = capsule(0.05f, 1);
  post.pose.position = {0, 0, 5};
  const BodyId still = world.add(post);
  world.step();
  ASSERT_EQ(world.sensor_begun().size(), 1u);
  EXPECT_EQ(world.sensor_begun()[0].sensor, probe);
  EXPECT_EQ(world.sensor_begun()[0].body, still);
  EXPECT_EQ(world.sensor_ended().size(), 1u);
  world.set_velocity(probe, {}, {});
  world.set_pose(probe, {{-4, 0, 5}});
  world.step();
  EXPECT_THAT(world.sensor_begun(), IsEmpty());
  EXPECT_THAT(world.sensor_ended(), IsEmpty());
}

TEST_P(Sensor, SeesSleepersAndWhatIsPutIntoIt) {
  World world(GetParam().sleepy());
  world.add(ground());
  const BodyId crate = world.add(cube({0, 0, 1.0f}));
  run(world, 120);
  ASSERT_FALSE(world.is_awake(crate));
  const BodyId zone = world.add(sensor(box({1, 1, 1}), {0, 0, 1.5f}));
  world.step();
  EXPECT_THAT(inside(world, zone), ElementsAre(crate)) << "a fixed sensor sees no ground";
  EXPECT_FALSE(world.is_awake(crate));
  world.step();
  EXPECT_THAT(world.sensor_begun(), IsEmpty());
  world.set_pose(crate, {{5, 0, 1}});
  world.step();
  ASSERT_EQ(world.sensor_ended().size(), 1u);
  EXPECT_EQ(world.sensor_ended()[0].step, world.step_count());
  world.set_pose(crate, {{0, 0, 1}});
  world.step();
  EXPECT_EQ(world.sensor_begun().size(), 1u);
}

TEST_P(Sensor, RemovalEndsAndChangesBeginAnew) {
  World world(GetParam().quiet());
  const BodyId zone = world.add(sensor(sphere(2), {0, 0, 0}));
  BodyDef still = cube({0, 0, 0});
  still.gravity_scale = 0;
  const BodyId a = world.add(still);
  still.pose.position = {1, 0, 1};
  const BodyId b = world.add(still);
  world.step();
  EXPECT_THAT(inside(world, zone), ElementsAre(a, b));
  world.remove(a);
  EXPECT_THAT(inside(world, zone), ElementsAre(b));
  still.pose.position = {0, 0, 0};
  const BodyId c = world.add(still);
  ASSERT_EQ(c.index, a.index);
  world.step();
  EXPECT_THAT(world.sensor_ended(), ElementsAre(SensorEvent{zone, a, 2}));
  EXPECT_THAT(world.sensor_begun(), ElementsAre(SensorEvent{zone, c, 2}));
  world.set_filter(b, {2, ~2u});
  world.step();
  EXPECT_THAT(world.sensor_ended(), IsEmpty());
  world.set_filter(b, {2, ~1u});
  world.step();
  EXPECT_THAT(world.sensor_ended(), ElementsAre(SensorEvent{zone, b, 4}));
  EXPECT_TRUE(world.is_sensor(zone));
  world.set_sensor(zone, false);
  EXPECT_FALSE(world.is_sensor(zone));
  EXPECT_THROW(world.for_each_in_sensor(zone, [](BodyId) {}), Error);
  world.step();
  EXPECT_THAT(world.sensor_ended(), ElementsAre(SensorEvent{zone, c, 5}));
  EXPECT_EQ(world.contacts_begun().size(), 1u);
  world.set_sensor(c, true);
  world.step();
  EXPECT_EQ(world.contacts_ended().size(), 1u);
  EXPECT_THAT(world.sensor_begun(), ElementsAre(SensorEvent{c, zone, 6})) << "one that moves sees fixed bodies";
  world.remove(zone);
  EXPECT_THROW(world.for_each_in_sensor(zone, [](BodyId) {}), Error);
}

TEST_P(Sensor, DoesNotSeeSensorsAndIsNotThereForQueries) {
  World world(GetParam().quiet());
  const BodyId one = world.add(sensor(sphere(1), {0, 0, 0})),
               other = world.add(sensor(sphere(1), {0.5f, 0, 0}, MotionType::kinematic));
  world.step();
  EXPECT_THAT(inside(world, one), IsEmpty());
  EXPECT_THAT(inside(world, other), IsEmpty());
  EXPECT_FALSE(world.cast_ray({-5, 0, 0}, {10, 0, 0}).has_value());
  EXPECT_THAT(world.overlap_shape(sphere(1), {}), IsEmpty());
  EXPECT_THAT(world.overlap_shape(sphere(1), {}, {.sensors = true}), ElementsAre(one, other));
}

// Random worlds: events and contents match testing all pairs one by one; events add up to what is inside.
TEST_P(Sensor, TellsWhatDistancesSay) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    WorldDef def = GetParam().sleepy(1 + static_cast<int>(seed) % 2);
    World world(def);
    Generator random(seed);
    world.add(ground());
    std::vector<BodyId> sensors, others;
    for (int i = 0; i < 12; ++i) {
      BodyDef body =
          sensor(shapes_of_each_kind(random, uniform(random, 0.3f, 1.5f))[random() % 4],
                 2.5f * in_cube(random) + Vec3{0, 0, 3}, i % 3 == 2 ? MotionType::kinematic : MotionType::fixed);
      if (body.motion == MotionType::kinematic) body.velocity.linear = 3 * in_cube(random);
      sensors.push_back(world.add(body));
    }
    for (int i = 0; i < 80; ++i) {
      BodyDef body = dynamic(shapes_of_each_kind(random, uniform(random, 0.1f, 0.6f))[random() % 4],
                             2.5f * in_cube(random) + Vec3{0, 0, 5});
      body.velocity.linear = (i % 9 == 0 ? 60.0f : 3.0f) * in_cube(random);
      others.push_back(world.add(body));
    }
    std::set<std::pair<std::uint32_t, std::uint32_t>> present;
    std::size_t events = 0;
    for (int step = 0; step < 90; ++step) {
      world.step();
      for (const SensorEvent& e : world.sensor_begun())
        EXPECT_TRUE(present.emplace(e.sensor.index, e.body.index).second) << "it begins once";
      for (const SensorEvent& e : world.sensor_ended()) EXPECT_EQ(present.erase({e.sensor.index, e.body.index}), 1u);
      events += world.sensor_begun().size() + world.sensor_ended().size();
      for (const BodyId s : sensors) {
        std::vector<BodyId> expected;
        for (const BodyId body : world.bodies()) {
          if (world.is_sensor(body)) continue;
          if (world.motion(s) == MotionType::fixed && world.motion(body) == MotionType::fixed) continue;
          if (world.closest_points(body, s).distance == 0) expected.push_back(body);
        }
        ASSERT_EQ(inside(world, s), expected) << seed << ", step " << step;
        for (const BodyId body : expected) EXPECT_TRUE(present.contains({s.index, body.index}));
      }
    }
    EXPECT_GT(events, 40u);
  }
}

TEST_P(Sensor, IsInSnapshots) {
  World world(GetParam().sleepy());
  world.add(ground());
  const BodyId zone = world.add(sensor(box({2, 2, 1}), {0, 0, 2}));
  world.add(sensor(box({2, 2, 0.01f}), {0, 0, 4}));
  for (int i = 0; i < 10; ++i) world.add(cube({0.4f * static_cast<float>(i), 0, 2 + 1.2f * static_cast<float>(i)}));
  for (int i = 0; i < 60; ++i) {
    std::vector<std::byte> bytes;
    world.save(bytes);
    World copy(GetParam().quiet());
    copy.restore(bytes);
    EXPECT_TRUE(copy.is_sensor(zone));
    ASSERT_EQ(inside(world, zone), inside(copy, zone)) << i;
    ASSERT_TRUE(std::ranges::equal(world.sensor_begun(), copy.sensor_begun())) << i;
    world.step(), copy.step();
    ASSERT_EQ(world.state_hash(), copy.state_hash());
    ASSERT_TRUE(std::ranges::equal(world.sensor_begun(), copy.sensor_begun())) << i;
    ASSERT_TRUE(std::ranges::equal(world.sensor_ended(), copy.sensor_ended())) << i;
  }
}

TEST(SensorShapes, AreOfAnyKind) {
  for (const SimulatorKind kind : {SimulatorKind::native, SimulatorKind::hybrid, SimulatorKind::device}) {
    WorldDef def;
    def.simulator = kind;
    def.device = test_device();
    def.threads = 1;
    def.gravity = {};
    World world(def);
    const ChildShape children[] = {{.shape = sphere(0.5f), .pose = {.position = {-2, 0, 0}}},
                                   {.shape = box({0.5f, 0.5f, 0.5f}), .pose = {.position = {2, 0, 0}}}};
    const BodyId rings = world.add(sensor(compound(children), {0, 0, 0}));
    const float offset = world.shape(rings).compound->children()[0].pose.position.x + 2;
    const BodyId between = world.add(dynamic(sphere(0.5f), {offset, 0, 0}));
    const BodyId in_second = world.add(dynamic(compound(children), {offset + 4.0f, 0, 0}));
    BodyDef shot = dynamic(sphere(0.1f), {offset + 2, -3, 0});
    shot.velocity.linear = {0, 360, 0};
    const BodyId bullet = world.add(shot);
    world.step();
    EXPECT_THAT(inside(world, rings), ElementsAre(in_second));
    EXPECT_EQ(world.sensor_ended().size(), 1u);
    EXPECT_EQ(world.sensor_ended()[0].body, bullet);
    world.set_pose(between, {{offset - 2, 0, 0}});
    world.step();
    EXPECT_THAT(inside(world, rings), ElementsAre(between, in_second));
  }
}

// Events of unread steps add up; states do not depend on reading.
TEST(SensorAhead, CollectsEvents) {
  std::vector<std::uint64_t> hashes;
  std::vector<std::size_t> begun;
  for (const int every : {1, 7, 60}) {
    WorldDef def;
    def.simulator = SimulatorKind::device;
    def.device = test_device();
    def.ahead = 2;
    World world(def);
    world.add(ground());
    world.add(sensor(box({2, 2, 0.2f}), {0, 0, 2}));
    for (int i = 0; i < 10; ++i) world.add(cube({0, 0, 3 + 1.2f * static_cast<float>(i)}));
    std::size_t count = 0;
    for (int i = 1; i <= 60; ++i) {
      world.step();
      if (i % every == 0) count += world.sensor_begun().size();
    }
    begun.push_back(count + world.sensor_begun().size() * (60 % every != 0));
    hashes.push_back(world.state_hash());
  }
  EXPECT_GT(begun[0], 0u);
  EXPECT_THAT(begun, testing::Each(begun[0]));
  EXPECT_THAT(hashes, testing::Each(hashes[0]));
}

TEST(SensorScene, IsRead) {
  const Scene scene = parse_scene(R"(
[[body]]
shape = {type = "sphere", radius = 1}
motion = "static"
sensor = true
[[body]]
shape = {type = "sphere", radius = 0.5}
)",
                                  "scene.toml");
  EXPECT_TRUE(scene.bodies.at(0).sensor);
  EXPECT_FALSE(scene.bodies.at(1).sensor);
}

}  // namespace
}  // namespace test::sensor_test
}  // namespace fathom
