// Which bodies collide: categories and masks of 64 bits, groups, excluded pairs, on every simulator; contacts of a
// body.
#include <gmock/gmock.h>

#include <algorithm>

#include "joint_worlds.hpp"
#include "scene/scene.hpp"
#include "scene/scene_file.hpp"

namespace fathom::test::filter_test {
namespace {

using testing::ElementsAre;

class Filters : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, Filters, testing::ValuesIn(joint_worlds), joint_world_name);

/// Whether a cube with one filter rests on a plate with the other.
bool collide(const WorldDef& def, const Filter& on_top, const Filter& below) {
  World world(def);
  BodyDef plate = ground();
  plate.filter = below;
  world.add(plate);
  BodyDef falling = cube({0, 0, 1.01f});
  falling.filter = on_top;
  const BodyId body = world.add(falling);
  run(world, 30);
  return world.pose(body).position.z > 0.9f;
}

TEST_P(Filters, HaveSixtyFourBits) {
  const WorldDef def = GetParam().quiet();
  constexpr std::uint64_t high = std::uint64_t{1} << 63, other = std::uint64_t{1} << 40;
  EXPECT_TRUE(collide(def, {high}, {other}));
  EXPECT_TRUE(collide(def, {high, other}, {other, high}));
  EXPECT_FALSE(collide(def, {high, other}, {other, ~high}));
  EXPECT_FALSE(collide(def, {high, ~other}, {other}));
  EXPECT_FALSE(collide(def, {0}, {}));
  EXPECT_FALSE(collide(def, {high, high >> 32}, {high}));
}

TEST_P(Filters, GroupsDecideBeforeMasks) {
  const WorldDef def = GetParam().quiet();
  EXPECT_FALSE(collide(def, {1, ~std::uint64_t{0}, -7}, {1, ~std::uint64_t{0}, -7}));
  EXPECT_TRUE(collide(def, {1, ~std::uint64_t{0}, -7}, {1, ~std::uint64_t{0}, -8}));
  EXPECT_TRUE(collide(def, {1, 0, 7}, {1, 0, 7}));
  EXPECT_FALSE(collide(def, {1, 0, 7}, {1, 0, 8}));
  EXPECT_FALSE(collide(def, {1, 0, 0}, {1, 0, 0}));
  EXPECT_TRUE(collide(def, {1, ~std::uint64_t{0}, 7}, {1, ~std::uint64_t{0}, -7}));
}

TEST_P(Filters, OfQueriesAreTheSame) {
  World world(GetParam().quiet());
  std::vector<BodyId> ids;
  constexpr std::uint64_t high = std::uint64_t{1} << 50;
  for (const Filter& filter : {Filter{high, 4}, Filter{2, 8, 3}, Filter{2, 8, -3}}) {
    BodyDef def = cube({2.0f * static_cast<float>(ids.size()), 0, 0});
    def.filter = filter;
    ids.push_back(world.add(def));
    EXPECT_EQ(world.filter(ids.back()).category, filter.category);
    EXPECT_EQ(world.filter(ids.back()).group, filter.group);
  }
  const auto met = [&](const QueryFilter& filter) { return world.overlap_shape(box({9, 1, 1}), {}, filter); };
  EXPECT_THAT(met({}), ElementsAre(ids[0], ids[1], ids[2]));
  EXPECT_THAT(met({.mask = high}), ElementsAre(ids[0]));
  EXPECT_THAT(met({.category = 8}), ElementsAre(ids[1], ids[2]));
  EXPECT_THAT(met({.mask = high, .group = 3}), ElementsAre(ids[0], ids[1]));
  EXPECT_THAT(met({.group = -3}), ElementsAre(ids[0], ids[1]));
}

TEST_P(Filters, ExcludedPairsPassAndComeBack) {
  World world(GetParam().sleepy());
  const BodyId plate = world.add(ground());
  const BodyId below = world.add(cube({0, 0, 1})), above = world.add(cube({0, 0, 2}));
  world.exclude(below, above);
  EXPECT_TRUE(world.is_excluded(above, below));
  run(world, 120);
  EXPECT_NEAR(world.pose(above).position.z, 1, 0.02f) << "it fell into the other one";
  EXPECT_FALSE(world.is_awake(above));
  world.include(above, below);
  EXPECT_FALSE(world.is_excluded(above, below));
  world.step();
  const auto begun = world.contacts_begun();
  EXPECT_TRUE(std::ranges::any_of(begun, [&](const ContactEvent& e) { return e.a == below && e.b == above; }));
  run(world, 60);
  world.exclude(plate, above);
  EXPECT_TRUE(world.is_awake(above));
  world.step();
  const auto ended = world.contacts_ended();
  EXPECT_TRUE(std::ranges::any_of(ended, [&](const ContactEvent& e) { return e.a == plate && e.b == above; }));
  run(world, 60);
  EXPECT_LT(world.pose(above).position.z, 0);
  EXPECT_GT(world.pose(below).position.z, 0.9f);
  EXPECT_THROW(world.exclude(below, below), Error);
  world.remove(above);
  EXPECT_THROW(world.exclude(below, above), Error);
  // Another body in a removed body's slot is not excluded.
  const BodyId next = world.add(cube({4, 0, 1.01f}));
  EXPECT_EQ(next.index, above.index);
  EXPECT_FALSE(world.is_excluded(plate, next));
  run(world, 60);
  EXPECT_GT(world.pose(next).position.z, 0.9f);
}

TEST_P(Filters, ExclusionsOutlastChangesAndJoints) {
  World world(GetParam().quiet());
  const BodyId plate = world.add(ground());
  const BodyId ghost = world.add(cube({0, 0, 1})), held = world.add(cube({4, 0, 1.5f}));
  world.exclude(plate, ghost);
  run(world, 5);
  world.set_mass(ghost, 3);
  world.set_shape(ghost, sphere(0.5f));
  const JointId joint = world.add_joint(ball_joint(plate, held, {4, 0, 1.5f}, {}));
  world.exclude(plate, held);
  world.remove_joint(joint);
  run(world, 60);
  EXPECT_LT(world.pose(ghost).position.z, 0);
  EXPECT_LT(world.pose(held).position.z, 0.4f);
}

TEST_P(Filters, SensorsDoNotSeeExcludedBodies) {
  World world(GetParam().quiet());
  BodyDef def = cube({0, 0, 0});
  def.motion = MotionType::fixed, def.sensor = true;
  const BodyId zone = world.add(def), seen = world.add(cube({0.2f, 0, 0})), unseen = world.add(cube({-3, 0, 0}));
  world.exclude(zone, unseen);
  world.set_pose(unseen, {{-0.9f, 0, 0}});
  world.step();
  std::vector<BodyId> ids;
  world.for_each_in_sensor(zone, [&](BodyId id) { ids.push_back(id); });
  EXPECT_THAT(ids, ElementsAre(seen));
}

// Pairs that come and go in every step, before the first one, and before and after a snapshot.
TEST_P(Filters, ExclusionsAreInSnapshots) {
  for (const int before : {0, 1, 20}) {
    World world(GetParam().sleepy());
    const BodyId plate = world.add(ground());
    std::vector<BodyId> ids;
    for (int i = 0; i < 24; ++i)
      ids.push_back(world.add(cube({1.1f * static_cast<float>(i % 6), 0, 1.1f + 1.05f * static_cast<float>(i / 6)})));
    const auto change = [&](World& w, int step) {
      const auto k = static_cast<std::size_t>(step);
      w.exclude(ids[k % 24], ids[(k + 6) % 24]);
      w.include(ids[(k + 13) % 24], ids[(k + 19) % 24]);
      if (step == 3) w.exclude(plate, ids[4]);
    };
    for (int i = 0; i < before; ++i) change(world, i), world.step();
    change(world, before);
    std::vector<std::byte> bytes;
    world.save(bytes);
    World copy(GetParam().quiet());
    copy.restore(bytes);
    for (int i = before + 1; i < before + 60; ++i) {
      world.step(), copy.step();
      ASSERT_EQ(world.state_hash(), copy.state_hash()) << before << ", step " << i;
      change(world, i), change(copy, i);
      ASSERT_TRUE(copy.is_excluded(ids[static_cast<std::size_t>(i) % 24], ids[static_cast<std::size_t>(i + 6) % 24]));
    }
    EXPECT_LT(world.pose(ids[4]).position.z, 0);
  }
}

TEST_P(Filters, ContactsOfOneBodyAreThoseOfAll) {
  World world(GetParam().sleepy());
  world.add(ground());
  for (int i = 0; i < 40; ++i)
    world.add(cube(
        {0.7f * static_cast<float>(i % 5), 0.6f * static_cast<float>(i % 3), 1.0f + 1.1f * static_cast<float>(i / 5)}));
  run(world, 90);
  const auto key = [](const ContactInfo& c) { return std::pair(c.a.index, c.b.index); };
  for (const BodyId id : world.bodies()) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> expected, got;
    float of_all = 0, of_one = 0;
    const auto impulse = [](const ContactInfo& c) {
      float sum = 0;
      for (int i = 0; i < c.point_count; ++i) sum += c.points[i].impulse;
      return sum;
    };
    world.for_each_contact([&](const ContactInfo& c) {
      if (c.a == id || c.b == id) expected.push_back(key(c)), of_all += impulse(c);
    });
    world.for_each_contact_of(id, [&](const ContactInfo& c) { got.push_back(key(c)), of_one += impulse(c); });
    std::ranges::sort(expected);
    EXPECT_TRUE(std::ranges::is_sorted(got));
    EXPECT_EQ(got, expected);
    EXPECT_NEAR(of_one, of_all, 1e-4f * (1 + of_all));
  }
  const BodyId gone = world.bodies().back();
  world.remove(gone);
  EXPECT_THROW(world.for_each_contact_of(gone, [](const ContactInfo&) {}), Error);
}

constexpr const char* scene_text = R"(
[[body]]
name = "ground"
shape = {type = "box", half_extents = [5, 5, 0.5]}
motion = "static"
filter = {category = 0x4000000000000000, mask = -1, group = -2}
[[body]]
name = "ball"
shape = {type = "sphere", radius = 0.5}
position = [0, 0, 1]
filter = {mask = -2}
[[exclude]]
a = "ground"
b = "ball"
)";

TEST(FilterScene, IsRead) {
  const Scene scene = parse_scene(scene_text, "scene.toml");
  EXPECT_EQ(scene.bodies[0].filter.category, std::uint64_t{1} << 62);
  EXPECT_EQ(scene.bodies[0].filter.mask, ~std::uint64_t{0});
  EXPECT_EQ(scene.bodies[0].filter.group, -2);
  EXPECT_EQ(scene.bodies[1].filter.mask, ~std::uint64_t{1});
  EXPECT_THAT(scene.excluded, ElementsAre(std::pair<std::size_t, std::size_t>(0, 1)));
  World world(scene.world);
  const SceneInstance instance(scene, world);
  EXPECT_TRUE(world.is_excluded(instance.ids()[0], instance.ids()[1]));
}

TEST(FilterScene, TellsMistakes) {
  const auto error_of = [](std::string text) {
    try {
      parse_scene(text, "scene.toml");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string text = std::string(scene_text).substr(1);
  EXPECT_EQ(error_of(text + "[[exclude]]\na = \"ball\"\nb = \"ball\"\n"),
            "scene.toml:16:5: 'ball' is both bodies; exclude two different ones from each other");
  EXPECT_EQ(error_of(text + "[[exclude]]\na = \"ball\"\nb = \"bal\"\n"),
            "scene.toml:16:5: no [[body]] is named 'bal'; did you mean 'ball'?");
}

}  // namespace
}  // namespace fathom::test::filter_test
