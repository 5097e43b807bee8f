// The examples of machines, each run for what it demonstrates; SceneExamples runs all of them for a few steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>

#include "joint_worlds.hpp"
#include "scene/scene_file.hpp"

namespace fathom::test::scene_machines_test {
namespace {

struct Example {
  Scene scene;
  World world;
  SceneInstance instance;

  explicit Example(const std::string& name) : scene(load(name)), world(scene.world), instance(scene, world) {}
  static Scene load(const std::string& name) {
    Scene scene = load_scene(FATHOM_SOURCE_DIR "/examples/scenes/" + name + ".toml");
    scene.world.threads = 1;
    return scene;
  }
  void step(int count) {
    for (int i = 0; i < count; ++i) instance.prepare_step(), world.step();
  }
  BodyId find(std::string_view name) const {
    for (const NamedBody& named : scene.names)
      if (named.name == name) return instance.ids()[named.body];
    ADD_FAILURE() << name;
    return {};
  }
  /// Of the joint whose B has this name.
  float twist(std::string_view name) const {
    for (const JointId id : world.joints())
      if (world.joint(id).b == find(name))
        return world.joint_positions(id)[static_cast<std::size_t>(JointAxisName::twist)];
    ADD_FAILURE() << name;
    return 0;
  }
  float height(std::string_view name) const { return world.pose(find(name)).position.z; }
};

struct Fall {
  float widest = 0;      ///< m, how far a joint opens at most
  float last_speed = 0;  ///< m/s, of the fastest body in the end
};

/// Lets the ragdoll fall; `push` (m/s) varies the fall.
Fall fall_of_ragdoll(float push) {
  Example example("ragdoll");
  for (const BodyId id : example.world.bodies()) {
    if (example.world.motion(id) != MotionType::dynamic) continue;
    const Velocity v = example.world.velocity(id);
    example.world.set_velocity(id, v.linear + Vec3{push, 0, 0}, v.angular);
  }
  float bent = 0, widest = 0;
  for (int i = 0; i < 600; ++i) {
    example.step(1);
    for (const char* shin : {"shin_left", "shin_right"}) {
      // An impact may press a limb past its limit for a moment.
      EXPECT_GT(example.twist(shin), -0.1f) << i;
      EXPECT_LT(example.twist(shin), 2.2f + 0.1f) << i;
      bent = max(bent, example.twist(shin));
    }
    widest = max(widest, widest_gap(example.world));
  }
  EXPECT_GT(bent, 0.5f) << "knees give way";
  EXPECT_LT(example.height("head"), 0.3f);
  EXPECT_GT(example.height("head"), -1) << "on the ground";
  EXPECT_LT(widest_gap(example.world), 1e-3f) << "at rest";
  Fall fall{widest};
  for (const BodyId id : example.world.bodies())
    fall.last_speed = max(fall.last_speed, length(example.world.velocity(id).linear));
  return fall;
}

// The impact of the body opens joints for a moment, and how far is a matter of how it lands: in 600 falls with pushes
// of up to 1.2 m/s by 2.2 cm in the median and 8.7 cm at most. A head that hangs over the edge of the step swings on,
// as nothing brakes the neck: in one of 200 falls at more than 0.5 m/s.
TEST(SceneMachines, TheRagdollLiesDownWithinItsLimits) {
  std::array<float, 40> gaps;
  int swinging = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const Fall fall = fall_of_ragdoll(0.003f * static_cast<float>(i));
    gaps[i] = fall.widest;
    swinging += fall.last_speed >= 0.5f;
  }
  EXPECT_LE(swinging, 1);
  std::sort(gaps.begin(), gaps.end());
  EXPECT_LT(gaps[gaps.size() / 2], 0.04f);
  EXPECT_LT(gaps.back(), 0.1f);
}

TEST(SceneMachines, TheRopeBridgeBearsItsCrates) {
  Example example("rope_bridge");
  example.step(900);
  for (const JointId id : example.world.joints()) EXPECT_LT(gap_of(example.world, id), 0.06f);
  const float sag = -example.height("plank.10");
  EXPECT_GT(sag, 0.4f);
  EXPECT_LT(sag, 1.2f);
  for (const char* crate : {"crate.0", "crate.1", "crate.2"}) EXPECT_GT(example.height(crate), -1.2f) << crate;
}

TEST(SceneMachines, TheArmGoesWhereItsMotorsAreTold) {
  Example example("arm");
  example.step(600);
  EXPECT_NEAR(example.twist("turntable"), 1.2f, 1e-3f);
  EXPECT_NEAR(example.twist("upper_arm"), 0.7f, 0.01f);
  EXPECT_NEAR(example.twist("forearm"), 0.9f, 0.01f);
  EXPECT_NEAR(example.twist("hand"), -0.5f, 0.01f);
  EXPECT_LT(length(example.world.velocity(example.find("load")).linear), 1e-3f);
  EXPECT_LT(widest_gap(example.world), 1e-5f);
}

TEST(SceneMachines, TheDrumWindsItsChainUp) {
  Example example("drum");
  const float start = example.height("weight");
  float widest = 0;
  for (int i = 0; i < 360; ++i) {
    example.step(1);
    widest = max(widest, widest_gap(example.world));
  }
  // The chain's centre is 0.43 m from the axle; straight links cut the corner.
  EXPECT_NEAR(example.height("weight") - start, 3 * 0.43f, 0.1f);
  EXPECT_NEAR(example.world.velocity(example.find("drum")).angular.y, -0.5f, 0.02f);
  EXPECT_LT(widest, 0.02f);
}

}  // namespace
}  // namespace fathom::test::scene_machines_test
