// What the application decides about contacts before they are solved, and about pairs before they become contacts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fathom/compound.hpp>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "random.hpp"
#include "test_surfaces.hpp"
#include "world_variants.hpp"

namespace fathom::test::pre_solve_test {
namespace {

using testing::HasSubstr;

constexpr float dt = 1.0f / 60, g = 9.81f;

constexpr Variant variants[] = {
    {"native"},
    {"native_impulse", SimulatorKind::native, Partition::colours, Solver::impulse},
    {"native_cells", SimulatorKind::native, Partition::cells},
    {"native_sweep", SimulatorKind::native, Partition::colours, Solver::soft, BroadPhase::sweep},
    {"hybrid", SimulatorKind::hybrid},
    {"device", SimulatorKind::device},
    {"device_impulse", SimulatorKind::device, Partition::colours, Solver::impulse},
    {"device_cells", SimulatorKind::device, Partition::cells},
    {"device_sweep", SimulatorKind::device, Partition::colours, Solver::soft, BroadPhase::sweep},
};

class PreSolve : public testing::TestWithParam<Variant> {
 protected:
  static WorldDef sleepy(int threads = 1) { return sleepy_world(GetParam(), threads); }
  static WorldDef quiet(int threads = 1) { return quiet_world(GetParam(), threads); }
};

INSTANTIATE_TEST_SUITE_P(Simulators, PreSolve, testing::ValuesIn(variants),
                         [](const auto& of) { return std::string(of.param.name); });

BodyDef asking(BodyDef def) {
  def.pre_solve = true;
  return def;
}

BodyDef plate(float half_height = 0.05f, Vec3 at = {0, 0, 1}) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({5, 5, half_height});
  def.pose.position = at;
  return def;
}

void steps(World& world, int count) {
  for (int i = 0; i < count; ++i) world.step();
}

std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

/// Only bodies from above collide with the platform.
void let_through_from_below(const World& world, PreSolveContact& contact, BodyId platform) {
  const bool is_a = contact.a == platform;
  const BodyId other = is_a ? contact.b : contact.a;
  const float up = is_a ? contact.normal.z : -contact.normal.z;
  contact.enabled = up > 0.7f && world.velocity(other).linear.z < 0.5f;
}

TEST_P(PreSolve, APlatformHoldsWhatComesFromAboveAlone) {
  for (const Shape& shape : {box({0.3f, 0.3f, 0.3f}), sphere(0.3f), capsule(0.2f, 0.2f)}) {
    World world(sleepy());
    world.add(ground());
    const BodyId platform = world.add(asking(plate(0.05f, {0, 0, 3})));
    const BodyId jumper = world.add(dynamic(shape, {0, 0, 1.2f}));
    world.set_pre_solve_callback([&](PreSolveContact& c) { let_through_from_below(world, c, platform); });
    world.set_velocity(jumper, {0, 0, 9}, {});
    float highest = 0;
    for (int i = 0; i < 200; ++i) {
      world.step();
      highest = std::max(highest, world.pose(jumper).position.z);
    }
    // 9 m/s carry it up by 4.1 m.
    EXPECT_NEAR(highest, 1.2f + 81 / (2 * g), 0.1f) << "it was held up on its way through";
    EXPECT_GT(world.pose(jumper).position.z, 3.2f);
    EXPECT_LT(world.pose(jumper).position.z, 3.5f);
    EXPECT_FALSE(world.is_awake(jumper)) << "it rests on the platform, and may sleep there";
  }
}

TEST_P(PreSolve, IsAskedAboutEveryContactInEveryStepWhileItsBodiesAreAwake) {
  World world(sleepy());
  const BodyId floor = world.add(ground());
  const BodyId crate = world.add(asking(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1.0f})));
  world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 5, 1.0f}));  // does not ask
  std::vector<PreSolveContact> seen;
  world.set_pre_solve_callback([&](PreSolveContact& c) { seen.push_back(c); });
  int asked = 0;
  while (world.is_awake(crate)) {
    seen.clear();
    world.step();
    ASSERT_EQ(seen.size(), 1u);
    const PreSolveContact& c = seen[0];
    EXPECT_TRUE(c.a == floor && c.b == crate);
    EXPECT_NEAR(c.normal.z, 1, 1e-5f);
    EXPECT_EQ(c.point_count, 4);
    float impulse = 0;
    for (int i = 0; i < c.point_count; ++i) {
      EXPECT_NEAR(c.points[i].position.z, 0.5f, 0.01f);
      EXPECT_NEAR(std::abs(c.points[i].position.x), 0.5f, 1e-3f);
      EXPECT_NEAR(c.points[i].separation, 0, 0.01f);
      impulse += c.points[i].impulse;
    }
    if (++asked > 10) {
      EXPECT_NEAR(impulse, g * dt, 0.01f);
    }
    EXPECT_FLOAT_EQ(c.friction, 0.5f);
    EXPECT_EQ(c.restitution, 0);
    EXPECT_TRUE(c.surface_velocity == Vec3{});
    ASSERT_LT(asked, 200);
  }
  seen.clear();
  steps(world, 5);
  EXPECT_TRUE(seen.empty()) << "it sleeps";
}

TEST_P(PreSolve, MaterialsAreTheCallbacksInThatStepAndMixedAgainWithoutIt) {
  World world(quiet());
  world.add(ground(0.8f));
  const BodyId slider = world.add(asking(dynamic(box({0.5f, 0.5f, 0.2f}), {0, 0, 0.7f})));
  steps(world, 10);
  world.set_pre_solve_callback([](PreSolveContact& c) { c.friction = 0; });
  world.set_velocity(slider, {3, 0, 0}, {});
  steps(world, 60);
  EXPECT_NEAR(world.velocity(slider).linear.x, 3, 1e-4f);
  world.set_pre_solve_callback([](PreSolveContact& c) { c.friction = 0.2f; });
  steps(world, 30);
  EXPECT_NEAR(world.velocity(slider).linear.x, 3 - 0.2f * g * 0.5f, 0.02f);
  world.set_pre_solve_callback({});
  const float before = world.velocity(slider).linear.x;
  steps(world, 6);
  EXPECT_NEAR(world.velocity(slider).linear.x, before - std::sqrt(0.8f * 0.5f) * g * 0.1f, 0.02f);
}

TEST_P(PreSolve, RestitutionIsTheCallbacks) {
  World world(quiet());
  world.add(ground());
  const BodyId ball = world.add(asking(dynamic(sphere(0.2f), {0, 0, 2.7f})));
  world.set_pre_solve_callback([](PreSolveContact& c) { c.restitution = 0.8f; });
  float highest = 0;
  bool has_hit = false;
  for (int i = 0; i < 120; ++i) {
    world.step();
    has_hit |= world.velocity(ball).linear.z > 0;
    if (has_hit) highest = std::max(highest, world.pose(ball).position.z);
  }
  EXPECT_NEAR(highest, 0.7f + 0.64f * 2, 0.06f);
}

TEST_P(PreSolve, ASurfaceMovesAsTheCallbackSays) {
  for (const bool is_floor_first : {true, false}) {
    World world(sleepy());
    BodyId crate;
    const auto add_floor = [&] { world.add(ground()); };
    const auto add_crate = [&] { crate = world.add(asking(dynamic(box({0.5f, 0.5f, 0.2f}), {0, 0, 0.7f}))); };
    is_floor_first ? add_floor() : add_crate();
    is_floor_first ? add_crate() : add_floor();
    // The floor's surface moves at 1 m/s along x. The velocity is that of b's surface relative to a's.
    world.set_pre_solve_callback([&](PreSolveContact& c) { c.surface_velocity = {c.a == crate ? 1.0f : -1.0f, 0, 0}; });
    steps(world, 120);
    EXPECT_NEAR(world.velocity(crate).linear.x, 1, 1e-3f);
    EXPECT_TRUE(world.is_awake(crate)) << "the belt takes it along";
    world.set_pre_solve_callback({});
    steps(world, 120);
    EXPECT_NEAR(world.velocity(crate).linear.x, 0, 1e-3f);
    EXPECT_FALSE(world.is_awake(crate));
  }
}

TEST_P(PreSolve, WhatIsDisabledTellsOfNothingAndHoldsNothing) {
  World world(sleepy());
  world.add(ground());
  const BodyId upper = world.add(asking(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 2.0f})));
  const BodyId lower = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1.0f}));
  bool enabled = true;
  world.set_pre_solve_callback([&](PreSolveContact& c) {
    if (c.a == upper && c.b == lower) c.enabled = enabled;
  });
  std::size_t begun = 0;
  for (int i = 0; i < 20; ++i) {
    world.step();
    begun += world.contacts_begun().size();
  }
  EXPECT_EQ(begun, 2u);
  enabled = false;
  world.step();
  ASSERT_EQ(world.contacts_ended().size(), 1u);
  EXPECT_TRUE(world.contacts_ended()[0].a == upper && world.contacts_ended()[0].b == lower);
  bool touch = false;
  for (int i = 0; i < 120; ++i) {
    world.step();
    world.for_each_contact([&](const ContactInfo& c) { touch |= c.a == upper && c.b == lower; });
  }
  EXPECT_FALSE(touch);
  EXPECT_NEAR(world.pose(upper).position.z, 1, 0.01f) << "it fell through to the ground";
  EXPECT_FALSE(world.is_awake(upper));
  EXPECT_FALSE(world.is_awake(lower));
  // When enabled again, they separate without being thrown.
  enabled = true;
  world.wake(upper);
  float fastest = 0;
  for (int i = 0; i < 300; ++i) {
    world.step();
    fastest = std::max(fastest, length(world.velocity(upper).linear));
  }
  EXPECT_LT(fastest, 4);
  EXPECT_GT(length(world.pose(upper).position - world.pose(lower).position), 0.98f);
}

TEST_P(PreSolve, FastBodiesPassWhatIsDisabledAndStopAtWhatIsNot) {
  for (const bool is_mesh : {false, true}) {
    for (const float speed : {20.0f, 200.0f, 900.0f})
      for (const bool enabled : {false, true}) {
        WorldDef def = quiet();
        def.gravity = {};
        World world(def);
        BodyDef wall = plate(0.005f, {});
        if (is_mesh) wall.shape = flat_mesh(8, 5);
        world.add(wall);
        std::vector<BodyId> shots;
        for (int k = 0; k < 12; ++k) {
          BodyDef shot =
              asking(dynamic(k % 2 == 0 ? sphere(0.01f) : box({0.01f, 0.02f, 0.01f}),
                             {0.3f * static_cast<float>(k) - 1.7f, 0.1f, 1 + 0.37f * static_cast<float>(k)}));
          shot.velocity.linear = {0, 0, -speed};
          shots.push_back(world.add(shot));
        }
        int asked = 0;
        world.set_pre_solve_callback([&](PreSolveContact& c) { c.enabled = enabled, ++asked; });
        while (world.pose(shots[11]).position.z > -3 && world.step_count() < 60) world.step();
        for (const BodyId id : shots) {
          const Vec3 end = world.pose(id).position;
          if (enabled) {
            const bool is_beside = std::abs(end.x) > 5 || std::abs(end.y) > 5;  // a box that was thrown aside
            EXPECT_TRUE(is_beside || end.z > -0.01f) << is_mesh << speed;
          } else {
            EXPECT_LT(end.z, -1) << is_mesh << speed;
            EXPECT_NEAR(world.velocity(id).linear.z, -speed, 1e-3f * speed);
          }
        }
        EXPECT_GE(asked, enabled ? 12 : 1);
      }
  }
}

TEST_P(PreSolve, IsAskedAboutEachPartOfACompound) {
  for (const bool is_asking_first : {false, true}) {
    World world(quiet());
    const auto add_table = [&] {
      BodyDef def;
      def.motion = MotionType::fixed;
      const ChildShape halves[] = {{.shape = box({1, 1, 0.1f}), .pose = {.position = {-1, 0, 0}}},
                                   {.shape = box({1, 1, 0.1f}), .pose = {.position = {1, 0, 0}}}};
      def.shape = compound(halves);
      return world.add(def);
    };
    BodyId table, left, right;
    if (!is_asking_first) table = add_table();
    left = world.add(asking(dynamic(box({0.2f, 0.2f, 0.2f}), {-1, 0, 0.31f})));
    right = world.add(asking(dynamic(box({0.2f, 0.2f, 0.2f}), {1, 0, 0.31f})));
    const BodyId across = world.add(asking(dynamic(box({0.6f, 0.2f, 0.2f}), {0.1f, 0.7f, 0.31f})));
    if (is_asking_first) table = add_table();
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> asked;
    world.set_pre_solve_callback([&](PreSolveContact& c) {
      const std::uint32_t child = c.a == table ? c.child_a : c.child_b;
      const BodyId other = c.a == table ? c.b : c.a;
      ++asked[{other.index, child}];
      c.enabled = child == 0;
    });
    steps(world, 30);
    EXPECT_NEAR(world.pose(left).position.z, 0.3f, 0.01f);
    EXPECT_LT(world.pose(right).position.z, -0.3f);
    const Vec3 axis = rotate(world.pose(across).rotation, {1, 0, 0});
    EXPECT_LT(axis.z, -0.05f) << "it tips over the edge of the child that holds it";
    const std::pair on_first{across.index, 0u}, on_second{across.index, 1u};
    EXPECT_GT(asked[on_first], 20);
    EXPECT_GT(asked[on_second], 10);
  }
}

TEST_P(PreSolve, PartsOfManyPairsEnd) {
  const std::vector<float> level(21 * 21, 0.0f);
  World world(sleepy());
  BodyDef field;
  field.motion = MotionType::fixed;
  field.shape = height_field({.columns = 21, .rows = 21, .cell_x = 1, .cell_y = 1, .heights = level});
  field.pose.position = {-10, -10, 0};
  world.add(field);
  const std::vector<ChildShape> dumbbell{{.shape = box({0.3f, 0.05f, 0.05f})},
                                         {.shape = sphere(0.12f), .pose = {.position = {0.3f, 0, 0}}},
                                         {.shape = sphere(0.12f), .pose = {.position = {-0.3f, 0, 0}}}};
  Generator random(3);
  for (int i = 0; i < 120; ++i) {
    BodyDef def = asking(dynamic(compound(dumbbell), 3 * in_cube(random) + Vec3{0, 0, 4}));
    def.velocity.angular = 6 * on_sphere(random);
    world.add(def);
  }
  world.set_pre_solve_callback([&](PreSolveContact& c) {
    c.restitution = 0.5f;
    c.enabled = c.a.index == 0 || (c.a.index + c.b.index + world.step_count() / 5) % 4 != 0;
  });
  for (int i = 0; i < 200; ++i) {
    world.step();
    ASSERT_TRUE(world.quarantined().empty()) << i;
  }
  for (const BodyId id : world.bodies()) EXPECT_GT(world.pose(id).position.z, -0.1f);
}

/// A callback that depends only on what it sees: some contacts off for a time, others with other materials.
void mix_up(const World& world, PreSolveContact& c) {
  const std::uint32_t pair = c.a.index * 31 + c.b.index;
  const bool is_floor = world.motion(c.a) != MotionType::dynamic;
  c.enabled = is_floor || (pair + world.step_count() / 16) % 5 != 0;
  c.friction = static_cast<float>(pair % 4) * 0.25f;
  c.restitution = pair % 7 == 0 ? 0.5f : 0.0f;
  if (pair % 6 == 0) c.surface_velocity = {0.5f, 0, 0};
}

void fill(World& world, int bodies, bool all_ask) {
  Generator random(7);
  world.add(ground());
  for (const Vec3 side : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -1, 0}}) {
    BodyDef wall;
    wall.motion = MotionType::fixed;
    wall.shape = box({4, 4, 20});
    wall.pose.position = 7 * side + Vec3{0, 0, 20};
    world.add(wall);
  }
  for (int i = 0; i < bodies; ++i) {
    const auto cell = [i](int k) { return 1.2f * static_cast<float>(i / k % 4) - 1.8f; };
    const Vec3 at = Vec3{cell(1), cell(4), 1.2f + 0.8f * static_cast<float>(i / 16)} + 0.1f * in_cube(random);
    const Shape shapes[] = {box({0.3f, 0.2f, 0.25f}), sphere(0.25f), capsule(0.2f, 0.15f)};
    BodyDef def = dynamic(shapes[i % 3], at);
    def.pre_solve = all_ask || i % 3 != 1;
    world.add(def);
  }
}

TEST_P(PreSolve, AHeapIsTheSameOnAnyNumberOfThreadsAndStaysInItsBin) {
  std::uint64_t hashes[3];
  for (int k = 0; k < 3; ++k) {
    World world(sleepy(1 << k));
    fill(world, 400, true);
    world.set_pre_solve_callback([&](PreSolveContact& c) { mix_up(world, c); });
    steps(world, 240);
    hashes[k] = world.state_hash();
    for (const BodyId id : world.bodies()) {
      const Vec3 p = world.pose(id).position;
      if (world.motion(id) != MotionType::dynamic) continue;
      EXPECT_TRUE(std::abs(p.x) < 3 && std::abs(p.y) < 3 && p.z > 0.5f) << id.index;
    }
    EXPECT_TRUE(world.quarantined().empty());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST_P(PreSolve, ARestoredWorldGoesOnAlike) {
  for (const int at : {30, 90, 400}) {
    World world(sleepy());
    fill(world, 120, false);
    world.set_pre_solve_callback([&](PreSolveContact& c) { mix_up(world, c); });
    steps(world, at);
    std::vector<std::byte> bytes;
    world.save(bytes);
    World copy(sleepy());
    copy.set_pre_solve_callback([&](PreSolveContact& c) { mix_up(copy, c); });
    copy.restore(bytes);
    for (int i = 0; i < 60; ++i) {
      if (i == 20)
        for (World* w : {&world, &copy}) w->wake(w->bodies()[20]);
      world.step();
      copy.step();
      ASSERT_EQ(world.state_hash(), copy.state_hash()) << at << ", " << i;
    }
  }
}

TEST_P(PreSolve, WithoutACallbackNothingChanges) {
  std::uint64_t hashes[3];
  for (int k = 0; k < 3; ++k) {
    World world(sleepy());
    fill(world, 100, k != 0);
    if (k == 2) world.set_pre_solve_callback([](PreSolveContact&) {});
    steps(world, 150);
    hashes[k] = world.state_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]) << "a callback that changes nothing";
}

TEST_P(PreSolve, WhatSleepsKeepsWhatItWasGiven) {
  World world(sleepy());
  BodyDef slope = ground(0.0f);
  slope.pose.rotation = {std::cos(0.2f), 0, std::sin(0.2f), 0};  // 23°
  slope.pose.position = {0, 0, -0.5f};
  world.add(slope);
  const BodyId crate =
      world.add(asking(dynamic(box({0.5f, 0.5f, 0.2f}), 0.21f * rotate(slope.pose.rotation, {0, 0, 1}))));
  world.set_pose(crate, {world.pose(crate).position, 0, slope.pose.rotation});
  const BodyId neighbour = world.add(dynamic(sphere(0.2f), {0, 30, 3}));
  world.set_pre_solve_callback([](PreSolveContact& c) { c.friction = 1; });
  steps(world, 200);
  ASSERT_FALSE(world.is_awake(crate));
  const Vec3 rest = world.pose(crate).position;
  world.wake(crate);
  world.set_pose(neighbour, {rest + rotate(slope.pose.rotation, {0, 0, 0.6f}), 0, {}});
  steps(world, 5);
  EXPECT_LT(length(world.pose(crate).position - rest), 0.01f);
}

TEST_P(PreSolve, FaultsOfCallbacksAreThrownWhenTheStepIsOver) {
  World world(sleepy());
  world.add(ground());
  const BodyId crate = world.add(asking(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1})));
  World twin(sleepy());
  twin.add(ground());
  twin.add(asking(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1})));
  const auto step_says = [&](const std::function<void(PreSolveContact&)>& callback) {
    world.set_pre_solve_callback(callback);
    const std::string text = error_of([&] { world.step(); });
    twin.step();
    EXPECT_EQ(world.state_hash(), twin.state_hash()) << "as without the callback";
    return text;
  };
  EXPECT_EQ(step_says([](PreSolveContact&) {}), "no error");
  EXPECT_EQ(step_says([](PreSolveContact& c) {
              c.enabled = false;
              throw std::runtime_error("mine");
            }),
            "mine");
  EXPECT_THAT(step_says([](PreSolveContact& c) { c.friction = -1; }), HasSubstr("pre-solve callback: the friction"));
  EXPECT_THAT(step_says([](PreSolveContact& c) { c.restitution = 1.5f; }), HasSubstr("restitution"));
  EXPECT_THAT(step_says([](PreSolveContact& c) { c.surface_velocity.x = std::numeric_limits<float>::quiet_NaN(); }),
              HasSubstr("surface velocity"));
  const std::vector<std::pair<std::string, std::function<void()>>> forbidden = {
      {"set pose", [&] { world.set_pose(crate, {}); }},
      {"set velocity", [&] { world.set_velocity(crate, {}, {}); }},
      {"apply force",
       [&] {
         world.apply_force(crate, {1, 0, 0});
       }},
      {"add body", [&] { world.add(dynamic(sphere(1), {})); }},
      {"body 0: add body", [&] { world.add_bodies(std::vector{dynamic(sphere(1), {})}); }},
      {"remove body", [&] { world.remove(crate); }},
      {"add joint", [&] { world.add_joint({}); }},
      {"set gravity", [&] { world.set_gravity({}); }},
      {"shift the origin",
       [&] {
         world.shift_origin({1, 0, 0});
       }},
      {"set filter", [&] { world.set_filter(crate, {}); }},
      {"wake", [&] { world.wake(crate); }},
      {"reserve", [&] { world.reserve(10); }},
      {"step", [&] { world.step(); }},
      {"save",
       [&] {
         std::vector<std::byte> bytes;
         world.save(bytes);
       }},
      {"restore", [&] { world.restore({}); }},
      {"query",
       [&] {
         (void)world.cast_ray({0, 0, 9}, {0, 0, -9});
       }},
      {"set pre-solve callback", [&] { world.set_pre_solve_callback({}); }},
      {"set filter callback", [&] { world.set_filter_callback({}); }},
  };
  for (const auto& [action, act] : forbidden)
    EXPECT_EQ(step_says([&act = act](PreSolveContact&) { act(); }),
              action +
                  ": the world is in the middle of a step, and its callbacks must not change, save or query it; "
                  "note it and do it after the step");
}

TEST_P(PreSolve, BodiesMayBeginAndCeaseToAsk) {
  World world(sleepy());
  world.add(ground());
  const BodyId crate = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1}));
  int asked = 0;
  world.set_pre_solve_callback([&](PreSolveContact& c) { ++asked, c.friction = 0; });
  steps(world, 10);
  EXPECT_EQ(asked, 0);
  EXPECT_FALSE(world.has_pre_solve(crate));
  world.set_pre_solve(crate, true);
  EXPECT_TRUE(world.has_pre_solve(crate));
  steps(world, 10);
  EXPECT_EQ(asked, 10);
  world.set_pre_solve(crate, false);
  world.set_velocity(crate, {1, 0, 0}, {});
  steps(world, 60);
  EXPECT_EQ(asked, 10);
  EXPECT_NEAR(world.velocity(crate).linear.x, 0, 1e-3f) << "its friction is the materials' again";
  world.remove(crate);
  steps(world, 2);
}

TEST(PreSolveOnDevices, StepsThatRunAheadAskTheSame) {
  std::uint64_t hashes[2];
  for (const int ahead : {0, 2}) {
    WorldDef def;
    def.simulator = SimulatorKind::device;
    def.device = "host";
    def.ahead = ahead;
    World world(def);
    fill(world, 100, false);
    steps(world, 20);
    world.set_pre_solve_callback([&](PreSolveContact& c) { mix_up(world, c); });
    steps(world, 100);
    world.set_pre_solve_callback({});
    steps(world, 20);
    hashes[ahead / 2] = world.state_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

// --- pairs -----------------------------------------------------------------------------------------------------

TEST_P(PreSolve, PairsThatTheFilterCallbackRefusesDoNotCollide) {
  World world(sleepy());
  world.add(ground());
  BodyDef ghost = dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 4});
  ghost.custom_filter = true;
  const BodyId lower = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1}));
  const BodyId upper = world.add(ghost);
  int asked = 0;
  world.set_filter_callback([&](BodyId a, BodyId b) {
    EXPECT_LT(a.index, b.index);
    EXPECT_EQ(b, upper);
    ++asked;
    return !(a == lower);
  });
  steps(world, 200);
  EXPECT_NEAR(world.pose(upper).position.z, 1, 0.01f) << "on the ground, inside the other";
  EXPECT_GE(asked, 2);
  EXPECT_FALSE(world.is_awake(upper));
  const int asked_before = asked;
  steps(world, 50);
  EXPECT_EQ(asked, asked_before) << "nothing moves";
  world.set_filter_callback([](BodyId, BodyId) -> bool { throw std::runtime_error("mine"); });
  world.set_custom_filter(upper, true);
  EXPECT_EQ(error_of([&] { world.step(); }), "mine");
  steps(world, 300);
  EXPECT_GT(length(world.pose(upper).position - world.pose(lower).position), 0.98f) << "they collide by then";
  EXPECT_TRUE(world.has_custom_filter(upper));
}

TEST_P(PreSolve, RefusedPairsEndWithTheirBodies) {
  World world(sleepy());
  world.add(ground());
  BodyDef ghost = dynamic(box({0.5f, 0.5f, 0.5f}), {0, 0, 1});
  ghost.custom_filter = true;
  const BodyId kept = world.add(ghost);
  world.set_filter_callback([](BodyId a, BodyId) { return a.index == 0; });
  for (int round = 0; round < 4; ++round) {
    const BodyId other = world.add(dynamic(sphere(0.4f), {0.1f, 0, 1}));
    steps(world, 3);
    world.remove(other);
    if (round % 2 == 1) world.add(dynamic(sphere(0.3f), {5, 5 + static_cast<float>(round), 1}));
    steps(world, 3);
  }
  steps(world, 100);
  EXPECT_NEAR(world.pose(kept).position.z, 1, 0.01f);
}

TEST_P(PreSolve, FastBodiesPassWhatTheFilterCallbackRefuses) {
  for (const bool refuses : {true, false}) {
    WorldDef def = quiet();
    def.gravity = {};
    World world(def);
    world.add(plate(0.005f, {}));
    std::vector<BodyId> shots;
    for (int k = 0; k < 10; ++k) {
      BodyDef shot = dynamic(sphere(0.01f), {0.3f * static_cast<float>(k) - 1.3f, 0, 3 + 0.7f * static_cast<float>(k)});
      shot.velocity.linear = {0, 0, -700};
      shot.custom_filter = true;
      shots.push_back(world.add(shot));
    }
    world.set_filter_callback([&](BodyId, BodyId) { return !refuses; });
    steps(world, 30);
    for (const BodyId id : shots) EXPECT_EQ(world.pose(id).position.z < -1, refuses);
  }
}

}  // namespace
}  // namespace fathom::test::pre_solve_test
