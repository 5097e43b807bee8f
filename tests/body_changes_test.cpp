// Bodies that change while the world runs: another motion, shape or mass, with joints and with bodies lying on them.
#include <gtest/gtest.h>

#include <fathom/compound.hpp>
#include <string>

#include "test_compounds.hpp"
#include "world_fixture.hpp"

namespace fathom::test::body_changes_test {
namespace {

class BodyChanges : public testing::TestWithParam<SimulatorKind> {
 protected:
  static WorldDef world_def() {
    WorldDef def;
    def.simulator = GetParam();
    def.device = test_device();
    def.threads = 2;
    return def;
  }
  World world{world_def()};
};

INSTANTIATE_TEST_SUITE_P(Simulators, BodyChanges,
                         testing::Values(SimulatorKind::native, SimulatorKind::hybrid, SimulatorKind::device),
                         [](const auto& of) {
                           return of.param == SimulatorKind::native   ? "native"
                                  : of.param == SimulatorKind::hybrid ? "hybrid"
                                                                      : "device";
                         });

TEST_P(BodyChanges, AShelfThatLetsGoFallsWithItsLoad) {
  world.add(ground());
  BodyDef def = fixed(box({1, 1, 0.1f}), {0, 0, 3});
  const BodyId shelf = world.add(def), load = world.add(cube({0, 0, 3.65f}));
  run(world, 120);
  EXPECT_NEAR(world.pose(load).position.z, 3.6f, 5e-3f);
  world.set_motion(shelf, MotionType::dynamic);
  EXPECT_EQ(world.motion(shelf), MotionType::dynamic);
  EXPECT_NEAR(world.mass(shelf), 1000 * 8 * 0.1f, 1e-2f);
  run(world, 300);
  EXPECT_NEAR(world.pose(shelf).position.z, 0.6f, 5e-3f);
  EXPECT_NEAR(world.pose(load).position.z, 1.2f, 1e-2f);
  // It is also held in the air.
  world.set_pose(shelf, {{0, 0, 5}, 0, {1, 0, 0, 0}});
  world.set_velocity(shelf, {0, 0, -1}, {});
  world.set_motion(shelf, MotionType::fixed);
  run(world, 60);
  EXPECT_EQ(world.pose(shelf).position, (Vec3{0, 0, 5}));
  EXPECT_EQ(world.velocity(shelf).linear, Vec3{});
  EXPECT_EQ(world.mass(shelf), 0);
  world.set_motion(shelf, MotionType::kinematic);
  world.set_velocity(shelf, {0, 1, 0}, {});
  run(world, 60);
  EXPECT_NEAR(world.pose(shelf).position.y, 1, 1e-4f);
}

TEST_P(BodyChanges, ABalloonGrowsUnderWhatLiesOnIt) {
  world.add(ground());
  const BodyId lower = world.add(cube({0, 0, 1})), upper = world.add(cube({0, 0, 2}));
  run(world, 90);
  world.set_shape(lower, box({0.5f, 0.5f, 0.51f}));
  EXPECT_EQ(world.mass(lower), 1);
  EXPECT_NEAR(world.mass_properties(lower).inertia.xx, (0.25f + 0.51f * 0.51f) / 3, 1e-5f);
  run(world, 240);
  EXPECT_NEAR(world.pose(lower).position.z, 1.01f, 3e-3f);
  EXPECT_NEAR(world.pose(upper).position.z, 2.02f, 5e-3f);
  world.set_shape(lower, sphere(0.3f));
  EXPECT_EQ(world.shape(lower).type, ShapeType::sphere);
  run(world, 400);
  EXPECT_NEAR(world.pose(lower).position.z, 0.8f, 3e-3f);
  EXPECT_NEAR(world.pose(upper).position.z, 1.6f, 3e-3f);  // balanced
  world.set_shape(lower, table());
  EXPECT_EQ(world.shape(lower).type, ShapeType::compound);
  run(world, 60);
}

TEST_P(BodyChanges, MassCountsFromTheNextStep) {
  world.set_gravity({});
  const BodyId a = world.add(dynamic(sphere(0.5f), {-1, 0, 0}, 1)), b = world.add(dynamic(sphere(0.5f), {1, 0, 0}, 1));
  for (const BodyId id : {a, b}) world.set_material(id, {0, 1});
  world.set_mass(b, 1000);
  world.set_velocity(a, {3, 0, 0}, {});
  run(world, 60);
  EXPECT_NEAR(world.velocity(a).linear.x, -3 * 999.0f / 1001, 0.05f);
  EXPECT_NEAR(world.velocity(b).linear.x, 6.0f / 1001, 1e-3f);
  world.set_mass(b, 2, SymMat3{1, 2, 2.5f, 0, 0, 0});
  EXPECT_EQ(world.mass_properties(b).inertia.yy, 2);
}

TEST_P(BodyChanges, JointsGoOn) {
  world.add(ground());
  BodyDef hook = fixed(box({0.1f, 0.1f, 0.1f}), {0, 0, 6});
  const BodyId top = world.add(hook);
  std::vector<BodyId> chain{top};
  std::vector<JointId> joints;
  for (int i = 1; i <= 4; ++i) {
    chain.push_back(world.add(dynamic(box({0.1f, 0.1f, 0.25f}), {0, 0, 6.25f - 0.5f * static_cast<float>(i)})));
    JointDef def;
    def.a = chain[chain.size() - 2], def.b = chain.back();
    def.frame_a.position = {0, 0, i == 1 ? 0 : -0.25f};
    def.frame_b.position = {0, 0, 0.25f};
    joints.push_back(world.add_joint(def));
  }
  run(world, 60);
  const float low = world.pose(chain[4]).position.z;
  EXPECT_NEAR(low, 4.25f, 5e-3f);
  // The middle one becomes fixed: what hangs on it keeps hanging.
  world.set_motion(chain[2], MotionType::fixed);
  EXPECT_THROW(world.set_motion(chain[1], MotionType::kinematic), Error);
  EXPECT_EQ(world.motion(chain[1]), MotionType::dynamic);
  run(world, 60);
  EXPECT_NEAR(world.pose(chain[4]).position.z, low, 5e-3f);
  for (const JointId joint : joints) EXPECT_TRUE(world.contains(joint));
  // The top is released and falls with the upper link; the lower ones stay.
  world.set_motion(top, MotionType::dynamic);
  world.set_velocity(top, {0.5f, 0, 0}, {});
  world.set_shape(chain[3], sphere(0.2f));
  world.set_mass(chain[4], 10);
  run(world, 240);
  EXPECT_NEAR(world.pose(chain[4]).position.z, low, 5e-3f);
  EXPECT_LT(world.pose(top).position.z, 5.3f);
  world.remove_joint(joints[2]);
  run(world, 120);
  EXPECT_LT(world.pose(chain[4]).position.z, 1.5f);
}

TEST_P(BodyChanges, AreInSnapshots) {
  world.add(ground());
  std::vector<BodyId> ids;
  for (int i = 0; i < 8; ++i)
    ids.push_back(world.add(cube({0.1f * static_cast<float>(i), 0, 1 + static_cast<float>(i)})));
  run(world, 30);
  world.set_shape(ids[2], sphere(0.5f));
  world.set_motion(ids[4], MotionType::kinematic);
  world.set_mass(ids[1], 4);
  run(world, 5);
  const std::vector<std::byte> bytes = saved(world);
  World copy(world_def());
  copy.restore(bytes);
  for (int i = 0; i < 120; ++i) {
    world.step();
    copy.step();
    ASSERT_EQ(world.state_hash(), copy.state_hash()) << i;
  }
}

// Contacts that end and begin again have no impulses to begin with, and what lies on them sinks in.
TEST_P(BodyChanges, TheSameFilterMotionSensorOrMassChangesNothing) {
  world.add(ground());
  std::vector<BodyId> ids;
  for (int i = 0; i < 4; ++i) ids.push_back(world.add(cube({0, 0, 1 + static_cast<float>(i)})));
  run(world, 60);
  World other(world_def());
  other.restore(saved(world));
  for (int i = 0; i < 30; ++i) {
    for (const BodyId id : ids) {
      world.set_filter(id, world.filter(id));
      world.set_motion(id, MotionType::dynamic);
      world.set_sensor(id, false);
      world.set_mass(id, world.mass(id), world.mass_properties(id).inertia);
    }
    world.step();
    other.step();
    ASSERT_EQ(world.state_hash(), other.state_hash()) << i;
  }
}

// A tank that fills: contacts that begin again in every step have no impulses, and the upper cube sank into the lower.
TEST_P(BodyChanges, AMassThatChangesInEveryStepKeepsContacts) {
  for (const float half : {0.025f, 0.5f}) {
    World w(world_def());
    w.add(ground());
    const BodyId lower = w.add(dynamic(box({half, half, half}), {0, 0, 0.5f + half}, 1)),
                 upper = w.add(dynamic(box({half, half, half}), {0, 0, 0.5f + 3 * half}, 1));
    run(w, 60);
    for (int i = 0; i < 600; ++i) {
      w.set_mass(lower, 1 + 0.001f * static_cast<float>(i % 100));
      w.set_mass(upper, 1 + 0.01f * static_cast<float>(i));
      w.step();
      ASSERT_TRUE(w.contacts_begun().empty() && w.contacts_ended().empty()) << half << " m, step " << i;
    }
    EXPECT_NEAR(w.pose(lower).position.z, 0.5f + half, 0.02f * half);
    EXPECT_NEAR(w.pose(upper).position.z, 0.5f + 3 * half, 0.04f * half);
  }
}

// Springs given by frequency, and mechanisms, count with the new mass as if the body had always had it.
TEST_P(BodyChanges, JointsCountWithTheNewMass) {
  const auto swing = [](bool later) {
    World w(world_def());
    const BodyId top = w.add(fixed(sphere(0.1f), {0, 0, 5}));
    const float masses[] = {1, 40, 0.5f};
    std::vector<BodyId> chain{top};
    for (int i = 0; i < 3; ++i) {
      const float x = static_cast<float>(i + 1);
      chain.push_back(w.add(dynamic(box({0.1f, 0.2f, 0.3f}), {x, 0, 5}, later ? 3 : masses[i])));
      const BodyId last = chain[chain.size() - 2];
      const Pose frame = joint_frame({0.5f, 0, 0}, {0, 1, 0}), own_frame = joint_frame({-0.5f, 0, 0}, {0, 1, 0});
      JointDef hinge = revolute_joint(last, chain.back(), frame, own_frame);
      if (i != 1) hinge.axis(JointAxisName::twist).spring(2, 0.1f);
      w.add_joint(hinge);
    }
    for (std::size_t i = 0; i < 3 && later; ++i) w.set_mass(chain[i + 1], masses[i]);
    run(w, 60);
    return w.pose(chain.back()).position;
  };
  EXPECT_LT(length(swing(true) - swing(false)), 1e-4f);
}

TEST_P(BodyChanges, WhatIsRefusedChangesNothing) {
  world.add(ground());
  const BodyId id = world.add(cube({0, 0, 1}));
  run(world, 10);
  const std::uint64_t hash = world.state_hash();
  const auto complaint = [&](const auto& change) -> std::string {
    try {
      change();
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(complaint([&] { world.set_mass(id, -1); }).find("set mass: the mass is -1"), 0u);
  EXPECT_EQ(complaint([&] { world.set_mass(id, 1, SymMat3{1, 1, 10, 0, 0, 0}); }).find("set mass: the inertia"), 0u);
  EXPECT_EQ(complaint([&] { world.set_shape(id, Shape{}); }).find("set shape: "), 0u);
  EXPECT_EQ(complaint([&] { world.set_shape(id, flat_mesh(2, 1)); }).find("set shape: a mesh"), 0u);
  EXPECT_EQ(complaint([&] { world.set_motion(id, static_cast<MotionType>(9)); }).find("set motion: "), 0u);
  EXPECT_EQ(complaint([&] { world.set_mass({77, 1}, 1); }).find("set mass: body {index 77"), 0u);
  EXPECT_EQ(world.state_hash(), hash);
  EXPECT_EQ(world.mass(id), 1);
}

}  // namespace
}  // namespace fathom::test::body_changes_test
