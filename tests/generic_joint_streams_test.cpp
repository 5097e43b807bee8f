// Generic and distance joints that come, change and go: the same bits however their stream runs.
#include <gtest/gtest.h>

#include <string>

#include "joint_worlds.hpp"
#include "late_device.hpp"
#include "native/solver_kernels.hpp"
#include "random.hpp"

namespace fathom::test::generic_joint_streams_test {
namespace {

class GenericJointStreams : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, GenericJointStreams, testing::ValuesIn(joint_worlds), joint_world_name);

/// Pairs of bodies over the ground with joints of all types, some of which change in every step.
struct GenericStream {
  Generator random;
  World world;
  std::vector<BodyId> bodies;

  GenericStream(unsigned seed, const WorldDef& def, int count = 60) : random(seed), world(def) {
    world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({30, 30, 0.5f})});
    for (int i = 0; i < count; ++i) {
      const Vec3 at{static_cast<float>(i % 6), static_cast<float>(i / 6 % 5), 1 + static_cast<float>(i / 30)};
      BodyDef body = dynamic(i % 3 ? box({0.2f, 0.15f, 0.3f}) : sphere(0.25f), at, i % 4 ? 1.0f : 2.5f);
      if (i % 19 == 7) body.motion = MotionType::fixed;
      if (i % 19 == 11) body.motion = MotionType::kinematic, body.velocity.linear = {0, 0.1f, 0};
      bodies.push_back(world.add(body));
    }
    for (int i = 0; i < count / 2; ++i) join();
  }
  JointAxis axis(float reach) {
    JointAxis axis;
    axis.mode = static_cast<AxisMode>(random() % 3);
    if (axis.mode == AxisMode::limited) axis.limit(uniform(random, -reach, 0), uniform(random, 0, reach));
    if (random() % 4 == 0) axis.drive_velocity(uniform(random, -1, 1), uniform(random, 0, 20));
    if (random() % 4 == 0) axis.drive_position(uniform(random, -reach, reach), 1e3f, 10, 100);
    if (random() % 4 == 0) axis.spring(3, 0.3f);
    return axis;
  }
  void join() {
    const BodyId a = bodies[random() % bodies.size()], b = bodies[random() % bodies.size()];
    if (a == b || (!(world.mass(a) > 0) && !(world.mass(b) > 0))) return;
    const auto point = [&] { return Vec3{uniform(random, -0.3f, 0.3f), 0.2f, uniform(random, -0.3f, 0.3f)}; };
    // B's frame coincides with A's current one.
    world.wait();
    const Pose on_a{.position = point(), .rotation = axis_angle(point(), 1)}, &at_a = world.pose(a),
                                                                              &at_b = world.pose(b);
    const Vec3 between = transform(at_a, on_a.position) - at_b.position;
    const Pose on_b{.position = inverse_rotate(at_b.rotation, between),
                    .rotation = conjugate(at_b.rotation) * (at_a.rotation * on_a.rotation)};
    JointDef def = generic_joint(a, b, on_a, on_b);
    const auto type = random() % 6;
    if (type == 0) def = distance_joint(a, b, point(), point(), 0.2f, 1.5f);
    if (type == 1) def = ball_joint(a, b, on_a.position, on_b.position);
    if (type > 1)
      for (std::size_t i = 0; i < joint_axis_count; ++i) def.axes[i] = axis(i < 3 ? 0.5f : 1);
    if (type == 2) def.cone_angle = 0.7f, def.axes[4] = def.axes[5] = {};
    if (type == 3) def.hertz = 4;
    def.collide_connected = random() % 2;
    world.add_joint(def);
  }
  void change() {
    const std::span<const JointId> joints = world.joints();
    if (joints.empty()) return;
    const JointId id = joints[random() % joints.size()];
    switch (random() % 4) {
      case 0:
        world.remove_joint(id);
        break;
      case 1:
        world.set_joint_spring(id, uniform(random, 0, 8), 0.5f);
        break;
      case 2:
        if (world.joint(id).type == JointType::generic)
          world.set_joint_axis(id, static_cast<JointAxisName>(random() % 3), axis(0.4f));
        break;
      default:
        world.set_joint_frames(id, {.position = {0, 0.1f, 0}}, {.position = {0.1f, 0, 0}});
    }
  }
  void step() {
    for (auto n = random() % 3; n > 0; --n) join();
    for (auto n = random() % 3; n > 0; --n) change();
    world.step();
  }
};

std::uint64_t hash_of(const WorldDef& def, int steps = 90) {
  GenericStream stream(3, def);
  for (int i = 0; i < steps; ++i) stream.step();
  for (const BodyId id : stream.bodies) EXPECT_TRUE(std::isfinite(length(stream.world.velocity(id).linear)));
  return stream.world.state_hash();
}

TEST_P(GenericJointStreams, ThreadsDoNotMatter) {
  const std::uint64_t expected = hash_of(GetParam().sleepy());
  for (const int threads : {1, 4}) EXPECT_EQ(hash_of(GetParam().sleepy(threads)), expected) << threads;
}

TEST(GenericJoints, VectorWidthDoesNotMatter) {
  constexpr JointWorlds native{"native", SimulatorKind::native};
  const std::uint64_t expected = hash_of(native.quiet(2));
  for (const char* name : {"AVX3", "AVX2", "NEON", "single"}) {
    if (!native::select_kernels(name)) continue;
    EXPECT_EQ(hash_of(native.quiet(2)), expected) << name;
  }
  native::select_kernels(nullptr);
}

TEST_P(GenericJointStreams, StepsAheadChangeNothing) {
  if (GetParam().simulator != SimulatorKind::device) GTEST_SKIP() << "has no steps ahead";
  const auto hash = [&](int ahead) {
    WorldDef def = GetParam().sleepy();
    def.ahead = ahead;
    return hash_of(def);
  };
  const std::uint64_t expected = hash(0);
  const LateDevice late;
  for (const int ahead : {1, 2, 3}) EXPECT_EQ(hash(ahead), expected) << ahead;
}

TEST_P(GenericJointStreams, ARestoredWorldGoesOnBitForBit) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    GenericStream stream(seed, seed % 2 ? GetParam().sleepy() : GetParam().quiet());
    for (int i = 0; i < 40; ++i) stream.step();
    // Changes that wait for the next step are included.
    for (int i = 0; i < 5; ++i) stream.join(), stream.change();
    std::vector<std::byte> bytes;
    stream.world.save(bytes);
    World restored(GetParam().quiet(2));
    restored.restore(bytes);
    for (int i = 0; i < 60; ++i) {
      stream.world.step(), restored.step();
      ASSERT_EQ(restored.state_hash(), stream.world.state_hash()) << "seed " << seed << ", step " << i;
    }
    for (const JointId id : restored.joints()) {
      EXPECT_EQ(restored.reaction(id).force, stream.world.reaction(id).force);
      EXPECT_EQ(restored.reaction(id).torque, stream.world.reaction(id).torque);
      EXPECT_EQ(restored.joint_positions(id), stream.world.joint_positions(id));
    }
    for (World* world : {&stream.world, &restored}) {
      while (world->joint_count() > 5) world->remove_joint(world->joints().back());
      run(*world, 30);
    }
    EXPECT_EQ(restored.state_hash(), stream.world.state_hash());
  }
}

// A slot used before by another kind of joint, and a world whose first joints are all of one kind.
TEST_P(GenericJointStreams, SlotsAreUsedAgain) {
  World world(GetParam().quiet());
  const BodyId top = add_anchor(world, {0, 0, 5});
  const BodyId bob = world.add(dynamic(box({0.1f, 0.1f, 0.1f}), {0, 0, 4}, 2));
  const Pose above{.position = {0, 0, 1}};
  for (int round = 0; round < 3; ++round) {
    const JointId ball = world.add_joint(ball_joint(top, bob, {}, above.position));
    run(world, 60);
    EXPECT_NEAR(world.reaction(ball).force.z, 2 * 9.81f, 0.3f);
    EXPECT_EQ(world.reaction(ball).torque, Vec3{});
    world.remove_joint(ball);
    const JointId weld = world.add_joint(fixed_joint(top, bob, {}, above));
    EXPECT_EQ(weld.index, ball.index);
    EXPECT_EQ(world.reaction(weld).force, Vec3{}) << "nothing of the one before";
    run(world, 60);
    EXPECT_NEAR(world.reaction(weld).force.z, 2 * 9.81f, 0.3f);
    EXPECT_NEAR(world.pose(bob).position.z, 4, 1e-3f);
    world.remove_joint(weld);
    const JointId rope = world.add_joint(distance_joint(top, bob, {}, {}, 0, 1));
    run(world, 60);
    EXPECT_NEAR(world.reaction(rope).force.z, 2 * 9.81f, 0.3f);
    world.remove_joint(rope);
  }
  run(world, 30);
  EXPECT_NEAR(world.velocity(bob).linear.z, -0.5f * 9.81f, 0.05f);
}

}  // namespace
}  // namespace fathom::test::generic_joint_streams_test
