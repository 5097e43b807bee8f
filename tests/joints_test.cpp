// What an application may do with joints: sleeping, waking, contacts of joined bodies, snapshots, bodies that fail, and
// streams of all these, on every simulator that has joints.
#include <gmock/gmock.h>

#include <cmath>
#include <deque>

#include "dynamics/body_fault.hpp"
#include "joint_worlds.hpp"
#include "late_device.hpp"
#include "random.hpp"

namespace fathom::test::joints_test {
namespace {

class Joints : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, Joints, testing::ValuesIn(joint_worlds), joint_world_name);

bool all_asleep(const World& world, const std::vector<BodyId>& bodies) {
  return std::ranges::none_of(bodies, [&](BodyId id) { return world.is_awake(id); });
}
int contact_count(const World& world) {
  int count = 0;
  world.for_each_contact([&](const ContactInfo&) { ++count; });
  return count;
}

TEST_P(Joints, WhatHangsStillFallsAsleepAndWakesAsOne) {
  World world(GetParam().sleepy());
  const BodyId top = add_anchor(world, {});
  const Chain chain(world, top, {}, {0, 0, -1}, 6);
  run(world, 400);
  ASSERT_TRUE(all_asleep(world, chain.links));
  EXPECT_NEAR(world.reaction(chain.joints[0]).force.z, 6 * 9.81f, 0.6f) << "a sleeper's reaction is its last";
  // Nothing else would end their swinging.
  for (const BodyId id : chain.links) world.set_damping(id, 1, 1);
  run(world, 200);
  const auto wakes = [&](const char* what, const auto& act) {
    ASSERT_TRUE(all_asleep(world, chain.links)) << what;
    act();
    world.step();
    for (const BodyId id : chain.links) EXPECT_TRUE(world.is_awake(id)) << what;
    run(world, 600);
  };
  wakes("a push", [&] { world.add_velocity(chain.links[5], {0.1f, 0, 0}, {}); });
  wakes("a spring", [&] { world.set_joint_spring(chain.joints[2], 20, 1); });
  wakes("a joint more", [&] {
    const BodyId weight = world.add(dynamic(sphere(0.1f), {0, 0, -3.2f}, 0.5f));
    world.add_joint(ball_joint(chain.links[5], weight, {0, 0, 0.25f}, {0, 0, 0.2f}));
  });
  wakes("its anchor moves", [&] { world.set_pose(top, {.position = {0, 0, 0.02f}}); });
  world.remove_joint(chain.joints[3]);
  world.step();
  EXPECT_TRUE(world.is_awake(chain.links[2]));
  EXPECT_TRUE(world.is_awake(chain.links[3]));
  run(world, 60);
  EXPECT_LT(world.pose(chain.links[5]).position.z, -5);
  EXPECT_GT(world.pose(chain.links[2]).position.z, -2);
}

TEST_P(Joints, AKinematicPartnerThatMovesKeepsAwake) {
  World world(GetParam().sleepy());
  const BodyId crane = add_anchor(world, {}, MotionType::kinematic);
  const Chain chain(world, crane, {}, {0, 0, -1}, 3);
  world.set_velocity(crane, {0.01f, 0, 0}, {});
  run(world, 300);
  EXPECT_FALSE(all_asleep(world, chain.links));
  world.set_velocity(crane, {}, {});
  run(world, 1500);
  EXPECT_TRUE(all_asleep(world, chain.links));
  world.set_velocity(crane, {0, 0, 0.5f}, {});
  run(world, 60);
  EXPECT_FALSE(all_asleep(world, chain.links));
  EXPECT_NEAR(world.pose(chain.links[2]).position.z, -0.75f, 0.05f);
}

// A chain in flight is momentarily at rest at its highest point, and does not fall asleep there.
TEST_P(Joints, WhatFliesDoesNotSleep) {
  WorldDef def = GetParam().sleepy();
  def.gravity = {0, 0, -0.01f};
  World world(def);
  const Chain chain(world, {}, {}, {1, 0, 0}, 4);
  run(world, 600);
  EXPECT_FALSE(all_asleep(world, chain.links));
}

TEST_P(Joints, JoinedBodiesKeepApartUnlessTheyCollide) {
  for (const bool collide : {false, true}) {
    World world(GetParam().quiet());
    const BodyId a = world.add(cube({0, 0, 0.1f})), b = world.add(cube({0.7f, 0, 0.1f}));
    world.add(ground());
    world.set_pose(a, {.position = {0, 0, 5}}), world.set_pose(b, {.position = {0.7f, 0, 5}});
    JointDef def = ball_joint(a, b, {0.35f, 0, 0}, {-0.35f, 0, 0});
    def.collide_connected = collide;
    world.add_joint(def);
    run(world, 20);
    EXPECT_EQ(contact_count(world), collide ? 1 : 0);
  }
}

TEST_P(Joints, ContactsEndWithAJointAndBeginWithoutIt) {
  World world(GetParam().quiet());
  world.add(ground());
  const BodyId lower = world.add(cube({0, 0, 1})), upper = world.add(cube({0, 0, 2}));
  const auto pair_events = [&](std::span<const ContactEvent> events) {
    return std::ranges::count_if(events, [&](const ContactEvent& e) { return e.a == lower && e.b == upper; });
  };
  run(world, 60);
  ASSERT_EQ(contact_count(world), 2);
  const JointId first = world.add_joint(ball_joint(lower, upper, {0, 0, 0.5f}, {0, 0, -0.5f}));
  const JointId second = world.add_joint(ball_joint(lower, upper, {0.3f, 0, 0.5f}, {0.3f, 0, -0.5f}));
  world.step();
  EXPECT_EQ(pair_events(world.contacts_ended()), 1);
  EXPECT_EQ(world.contacts_ended().size(), 1);
  EXPECT_EQ(contact_count(world), 1);
  world.remove_joint(first);
  world.step();
  EXPECT_EQ(pair_events(world.contacts_begun()), 0) << "the other joint keeps them apart";
  world.remove_joint(second);
  world.step();
  EXPECT_EQ(pair_events(world.contacts_begun()), 1);
  EXPECT_EQ(world.contacts_begun().size(), 1);
  run(world, 60);
  EXPECT_NEAR(world.pose(upper).position.z, 2, 0.01f);
}

TEST_P(Joints, GoWithTheirBodies) {
  World world(GetParam().quiet());
  const Chain chain(world, add_anchor(world, {}), {}, {0, 0, -1}, 4);
  run(world, 10);
  world.remove(chain.links[1]);
  EXPECT_EQ(world.joint_count(), 2);
  EXPECT_FALSE(world.contains(chain.joints[1]));
  run(world, 60);
  EXPECT_LT(world.pose(chain.links[3]).position.z, -5);
  EXPECT_NEAR(world.pose(chain.links[0]).position.z, -0.25f, 0.01f);
}

// More joints than colours on one body: all hold.
TEST_P(Joints, AHubHoldsMoreThanItHasColoursFor) {
  World world(GetParam().quiet());
  BodyDef hub = dynamic(sphere(1), {}, 500);
  const BodyId middle = world.add(hub);
  world.add_joint(ball_joint(add_anchor(world, {0, 0, 2}), middle, {}, {0, 0, 2}));
  Generator random(11);
  std::vector<JointId> joints;
  for (int i = 0; i < 90; ++i) {
    const Vec3 out = on_sphere(random);
    const BodyId weight = world.add(dynamic(sphere(0.05f), 1.5f * out, 1));
    joints.push_back(world.add_joint(ball_joint(middle, weight, 1.4f * out, -0.1f * out)));
  }
  run(world, 120);
  EXPECT_LT(widest_gap(world), 0.01f);
  for (const JointId id : joints) world.remove_joint(id);
  run(world, 2);
  EXPECT_EQ(world.profile().counts.overflow, 0);
}

// A link that fails becomes an obstacle; the others keep hanging as if it were fixed there.
TEST_P(Joints, AFailingLinkLeavesTheOthersFinite) {
  constexpr std::uint32_t failing = 1u << 30;
  for (int stage = 0; stage <= static_cast<int>(last_solver_stage); ++stage) {
    World world(GetParam().quiet());
    const Chain chain(world, add_anchor(world, {}), {}, {1, 0, 0}, 6);
    world.set_filter(chain.links[2], {.category = failing});
    run(world, 5);
    body_fault.category = failing, body_fault.stage = static_cast<SolverStage>(stage), body_fault.substep = 1;
    body_fault.turns = stage % 2 == 0;
    body_fault.is_armed = true;
    world.step();
    body_fault.is_armed = false;
    const Pose at = world.pose(chain.links[2]);
    run(world, 120);
    for (const BodyId id : chain.links) {
      EXPECT_TRUE(is_finite(world.pose(id)) && is_finite(world.velocity(id).linear)) << stage;
      EXPECT_LT(length(world.velocity(id).linear), 20) << stage;
    }
    for (const JointId id : chain.joints) EXPECT_LT(gap_of(world, id), 0.01f) << stage;
    // Not every simulator has every stage.
    if (world.pose(chain.links[2]).position == at.position) {
      world.set_velocity(chain.links[2], {}, {});
      run(world, 30);
      EXPECT_LT(world.pose(chain.links[2]).position.z, at.position.z) << "freed by its own setter";
    }
  }
}

/// Bodies and chains that come and go over a floor, with other actions of an application.
struct JointStream {
  JointStream(unsigned seed, const WorldDef& def) : random(seed), world(def) {
    world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({20, 20, 0.5f})});
    for (int i = 0; i < 3; ++i)
      pillars.push_back(add_anchor(world, {2 * static_cast<float>(i), 0, 3}, MotionType::kinematic));
    for (int i = 0; i < 20; ++i) add();
  }

  BodyId any() { return random() % 6 ? living[random() % living.size()] : pillars[random() % pillars.size()]; }
  void add() {
    const float size = uniform(random, 0.1f, 0.4f);
    const auto kind = random() % 3;
    BodyDef def;
    def.shape = kind == 0   ? sphere(size)
                : kind == 1 ? box({size, 0.7f * size, 0.5f * size})
                            : capsule(0.5f * size, 0.4f * size);
    def.density = 1000;
    def.pose = {.position = {uniform(random, -2, 6), uniform(random, -2, 2), uniform(random, 0.5f, 4)}};
    living.push_back(world.add(def));
  }
  void join() {
    const BodyId a = any(), b = any();
    if (world.motion(a) != MotionType::dynamic && world.motion(b) != MotionType::dynamic) return;
    const Pose pa = world.pose(a), pb = world.pose(b);
    if (a == b || length(pa.position - pb.position) > 1.5f) return;
    const Vec3 at = 0.5f * (pa.position + pb.position);
    JointDef def =
        ball_joint(a, b, inverse_rotate(pa.rotation, at - pa.position), inverse_rotate(pb.rotation, at - pb.position));
    def.collide_connected = random() % 3 == 0;
    if (random() % 4 == 0) def.hertz = uniform(random, 1, 30);
    world.add_joint(def);
  }
  /// Reads poses, as `join` does, in every step that joins: this waits for steps ahead.
  void step() {
    world.wait();
    for (int i = 0; i < 2; ++i) add();
    while (living.size() > 60) world.remove(living.front()), living.pop_front();
    for (int i = 0; i < 6; ++i) join();
    while (world.joint_count() > 60) world.remove_joint(world.joints()[random() % world.joint_count()]);
    if (random() % 5 == 0 && world.joint_count() > 0) {
      const JointId id = world.joints()[random() % world.joint_count()];
      world.set_joint_spring(id, random() % 2 ? 0 : uniform(random, 1, 30), 1);
    }
    if (random() % 8 == 0 && world.joint_count() > 0) {
      // Added and removed between two steps.
      world.remove_joint(world.add_joint(world.joint(world.joints()[0])));
    }
    if (random() % 10 == 0) world.set_velocity(pillars[0], in_cube(random), {});
    if (random() % 10 == 0) world.set_velocity(pillars[0], {}, {});
    world.step();
  }

  Generator random;
  World world;
  std::vector<BodyId> pillars;
  std::deque<BodyId> living;
};

TEST_P(Joints, StreamsAreTheSameHoweverTheyRun) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    WorldDef def = seed % 2 ? GetParam().sleepy() : GetParam().quiet();
    const auto hashes = [&](const WorldDef& of) {
      JointStream stream(seed, of);
      std::vector<std::uint64_t> list;
      for (int i = 0; i < 120; ++i) {
        stream.step();
        if (i % 10 == 9) list.push_back(stream.world.state_hash());
      }
      for (const BodyId id : stream.world.bodies()) EXPECT_TRUE(is_finite(stream.world.pose(id)));
      return list;
    };
    const std::vector<std::uint64_t> once = hashes(def);
    for (const int threads : {2, 4}) {
      def.threads = threads;
      EXPECT_EQ(hashes(def), once) << "seed " << seed << ", " << threads << " threads";
    }
    for (const int ahead : {1, 2, 3}) {
      def.threads = 1, def.ahead = ahead;
      EXPECT_EQ(hashes(def), once) << "seed " << seed << ", " << ahead << " ahead";
    }
  }
}

/// Joints placed only by the bodies' first poses, so that steps may run ahead.
TEST_P(Joints, StepsAheadChangeNothing) {
  const auto hash = [&](int ahead) {
    WorldDef def = GetParam().sleepy();
    def.ahead = ahead;
    World world(def);
    world.add(ground());
    const BodyId top = add_anchor(world, {0, 0, 20});
    std::vector<JointId> joints;
    // In waves, so that memory grows while steps are in flight.
    for (int wave = 0; wave < 12; ++wave) {
      for (int i = 0; i < 60; ++i) {
        const Vec3 from{static_cast<float>(i % 10), static_cast<float>(i / 10), 3 + static_cast<float>(wave)};
        const Chain chain(world, wave % 3 ? BodyId{} : top, from, {1, 0, 0}, 3);
        joints.insert(joints.end(), chain.joints.begin(), chain.joints.end());
      }
      for (int step = 0; step < 5; ++step) {
        world.remove_joint(joints[static_cast<std::size_t>(wave * 100 + step)]);
        world.step();
      }
    }
    return world.state_hash();
  };
  const std::uint64_t once = hash(0);
  const LateDevice late;
  for (const int ahead : {1, 2, 3}) EXPECT_EQ(hash(ahead), once) << ahead;
}

TEST_P(Joints, ARestoredWorldGoesOnBitForBit) {
  for (const unsigned seed : {5u, 6u, 7u}) {
    JointStream stream(seed, seed % 2 ? GetParam().sleepy() : GetParam().quiet());
    for (int i = 0; i < 40; ++i) stream.step();
    // Changes that wait for the next step are included.
    for (int i = 0; i < 10; ++i) stream.join();
    stream.world.remove_joint(stream.world.joints()[1]);
    std::vector<std::byte> bytes;
    stream.world.save(bytes);
    World restored(GetParam().quiet(2));
    restored.restore(bytes);
    ASSERT_EQ(restored.joint_count(), stream.world.joint_count());
    for (int i = 0; i < 60; ++i) {
      stream.world.step(), restored.step();
      ASSERT_EQ(restored.state_hash(), stream.world.state_hash()) << "seed " << seed << ", step " << i;
    }
    for (const JointId id : restored.joints()) EXPECT_EQ(restored.reaction(id).force, stream.world.reaction(id).force);
    // Both continue identically under the application's next actions.
    for (World* world : {&stream.world, &restored}) {
      while (world->joint_count() > 5) world->remove_joint(world->joints().back());
      run(*world, 30);
    }
    EXPECT_EQ(restored.state_hash(), stream.world.state_hash());
  }
}

TEST_P(Joints, AreKnownBeforeTheFirstStep) {
  World world(GetParam().quiet());
  const Chain chain(world, add_anchor(world, {}), {}, {0, 0, -1}, 3);
  std::vector<std::byte> bytes;
  world.save(bytes);
  World restored(GetParam().quiet());
  restored.restore(bytes);
  run(world, 30), run(restored, 30);
  EXPECT_EQ(restored.state_hash(), world.state_hash());
  EXPECT_LT(widest_gap(restored), 1e-3f);
}

}  // namespace
}  // namespace fathom::test::joints_test
