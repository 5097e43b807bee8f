// Contacts that mechanisms solve: what stands on light wheels and feet rests, and rolls on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/joint.hpp>
#include <limits>
#include <string>
#include <vector>

#include "dynamics/link_contact.hpp"
#include "scene/heap.hpp"
#include "simulator_fixture.hpp"

namespace fathom::test::link_contacts_test {
namespace {

class LinkContacts : public OnSimulator {
 protected:
  static WorldDef quiet() { return on_simulator(quiet_world()); }
};
INSTANTIATE_TEST_SUITE_P(Simulators, LinkContacts,
                         testing::Values(SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid),
                         simulator_name);

const Quat across = axis_angle({1, 0, 0}, pi / 2);  // turns a capsule's axis to y

JointId join(World& world, BodyId a, BodyId b, Vec3 at, JointDef (*make)(BodyId, BodyId, const Pose&, const Pose&),
             Vec3 axis) {
  const Pose frame = joint_frame(at, axis);
  return world.add_joint(
      make(a, b, joint_parts::frame_on(world.pose(a), frame), joint_parts::frame_on(world.pose(b), frame)));
}
JointId hinge(World& world, BodyId a, BodyId b, Vec3 at) { return join(world, a, b, at, revolute_joint, {0, 1, 0}); }
JointId weld(World& world, BodyId a, BodyId b, Vec3 at) { return join(world, a, b, at, fixed_joint, {0, 0, 1}); }

/// A body of `mass` with four wheels of 1 kg, from front to back `size` (m) long, on ground at z = 0.5.
struct Cart {
  BodyId body;
  float radius;
  std::vector<BodyId> wheels;

  Cart(World& world, float size, float height, float mass) : radius(0.08f * size) {
    BodyDef def =
        dynamic(box({0.5f * size, 0.25f * size, 0.5f * height}), {0, 0, 0.5f + 1.2f * radius + 0.5f * height}, mass);
    body = world.add(def);
    for (int i = 0; i < 4; ++i) {
      const Vec3 at{(i & 1 ? 0.4f : -0.4f) * size, (i & 2 ? 1.0f : -1.0f) * (0.25f * size + 1.4f * radius),
                    0.5f + radius};
      BodyDef wheel = dynamic(capsule(radius, 0.2f * radius), at);
      wheel.pose.rotation = across, wheel.material.friction = 0.9f;
      wheels.push_back(world.add(wheel));
      hinge(world, body, wheels.back(), at);
    }
  }
};

float fastest_within(World& world, int steps) {
  float fastest = 0;
  for (int i = 0; i < steps; ++i) {
    world.step();
    for (const BodyId id : world.bodies()) fastest = std::max(fastest, length(world.velocity(id).linear));
  }
  return fastest;
}

// A contact that knows only its wheel hops: at a ratio of 200 by 3 cm for a size of 1 m, and by half of it at 10 cm.
TEST_P(LinkContacts, ABodyOnOneWheelRests) {
  for (const float size : {0.1f, 1.0f})
    for (const float mass : {50.0f, 1000.0f}) {
      World world(quiet());
      world.add(ground());
      BodyDef anchor_def = fixed_body(sphere(0.01f * size), {0, 0, 3 * size});
      anchor_def.filter.mask = 0;
      const BodyId anchor = world.add(anchor_def);
      const float radius = 0.3f * size;
      BodyDef def = dynamic(capsule(radius, 0.2f * radius), {0, 0, 0.5f + radius});
      def.pose.rotation = across;
      const BodyId wheel = world.add(def);
      BodyDef load = dynamic(box({radius, radius, radius}), {0, 0, 0.5f + radius + 0.5f * size}, mass);
      load.filter.mask = 0;
      const BodyId body = world.add(load);
      hinge(world, body, wheel, {0, 0, 0.5f + radius});
      join(world, anchor, body, load.pose.position, prismatic_joint, {0, 0, 1});
      run(world, 400);
      EXPECT_LT(fastest_within(world, 200), 1e-3f) << size << ' ' << mass;
      EXPECT_NEAR(world.pose(wheel).position.z, 0.5f + radius, 0.005f * size) << mass;
    }
}

TEST_P(LinkContacts, ABodyOnFourWheelsRests) {
  for (const float size : {0.3f, 1.0f})
    for (const float height : {0.3f, 2.0f}) {
      World world(quiet());
      world.add(ground(0.9f));
      const Cart cart(world, size, height * size, 400);
      run(world, 600);
      EXPECT_LT(fastest_within(world, 120), 1e-3f) << size << ' ' << height;
    }
}

TEST_P(LinkContacts, ACartRollsOnAtItsSpeed) {
  World world(quiet());
  world.add(ground(0.9f));
  const Cart cart(world, 1, 0.5f, 400);
  for (const BodyId wheel : cart.wheels) world.set_velocity(wheel, {2, 0, 0}, {0, 2 / cart.radius, 0});
  world.set_velocity(cart.body, {2, 0, 0}, {});
  run(world, 300);
  EXPECT_NEAR(world.velocity(cart.body).linear.x, 2, 0.02f);
  EXPECT_NEAR(world.velocity(cart.body).linear.y, 0, 0.01f);
  EXPECT_NEAR(world.pose(cart.body).position.x, 10, 0.1f);
}

// What leans over on a foot plate is no load on it, but turns it.
TEST_P(LinkContacts, ALampPostRests) {
  for (const float size : {0.1f, 1.0f}) {
    World world(quiet());
    world.add(ground());
    const BodyId plate =
        world.add(dynamic(box({0.25f * size, 0.25f * size, 0.025f * size}), {0, 0, 0.5f + 0.025f * size}));
    const BodyId pole =
        world.add(dynamic(box({0.03f * size, 0.03f * size, 0.6f * size}), {0, 0, 0.5f + 0.65f * size}, 0.7f));
    weld(world, plate, pole, {0, 0, 0.5f + 0.05f * size});
    run(world, 400);
    EXPECT_LT(fastest_within(world, 200), 1e-3f) << size;
  }
}

// Inertia that the load added to the sled gave it momentum out of nothing.
TEST_P(LinkContacts, ALoadedSledGainsNoMomentum) {
  World world(quiet());
  world.add(ground(0));
  constexpr float size = 0.3f;
  BodyDef def = dynamic(box({0.6f * size, 0.4f * size, 0.1f * size}), {0, 0, 0.5f + 0.1f * size});
  def.material.friction = 0;
  const BodyId sled = world.add(def);
  const BodyId load = world.add(
      dynamic(box({0.3f * size, 0.3f * size, 0.3f * size}), {0.1f * size, 0.05f * size, 0.5f + 0.5f * size}, 50));
  weld(world, sled, load, {0, 0, 0.5f + 0.2f * size});
  run(world, 600);
  EXPECT_LT(length(world.velocity(load).linear), 2e-3f);
}

// In this heap contacts press a hinge between bodies of 6 and 139 g against its limit. The joints alone would let the
// limit go, because the contacts' own sweep turns the light body back.
TEST_P(LinkContacts, LimitsHoldUnderALoad) {
  const Heap heap = make_joint_heap(17);
  World world(on_simulator(heap.scene.world));
  SceneInstance instance(heap.scene, world);
  const int steps_per_second = static_cast<int>(std::lround(1 / heap.scene.world.dt));
  float beyond = 0;
  for (int i = 1; i <= 10 * steps_per_second; ++i) {
    instance.prepare_step();
    world.step();
    if (i < 5 * steps_per_second || i % 10 != 0) continue;
    for (const JointId id : world.joints()) {
      const JointDef& joint = world.joint(id);
      const JointAxis& twist = joint.axis(JointAxisName::twist);
      if (joint.type != JointType::generic || twist.mode != AxisMode::limited) continue;
      const float angle = world.joint_positions(id)[static_cast<std::size_t>(JointAxisName::twist)];
      beyond = std::max({beyond, twist.lower - angle, angle - twist.upper});
    }
  }
  EXPECT_LT(beyond, 0.02f);
}

TEST(LinkContact, ASweepStopsWhatTheMechanismWouldMove) {
  LinkContact contact;
  contact.rows.count = 1;
  contact.rows.set_frame(ContactAxes({0, 0, 1}, {1, 0, 0}, {}, {0, 0, -0.5f}));
  contact.rows.frame.friction.coefficient = 0.5f;
  contact.rows.points[0] = {0, 0, 0, 0};
  contact.soft.inverse_substep = 240;
  LinkPushes pushes{};  // of 100 kg that turn about y alone, with 4 kg·m²
  pushes.by_impulse[0].linear = {0.01f, 0, 0}, pushes.by_impulse[1].linear = {0, 0.01f, 0};
  pushes.by_impulse[2].linear = {0, 0, 0.01f};
  pushes.by_moment[1].angular = {0, 0.25f, 0};
  ContactBody<LinkResponse> link{{0, 0, -2}, {}, 1, link_response(pushes)};
  weigh_link_contact<false>(contact, link);
  const Wrench push = sweep_link_contact<ContactPass::relax, false>(contact, link, 0);
  EXPECT_FLOAT_EQ(push.force.z, 200);
  EXPECT_NEAR(link.linear.z, 0, 1e-6f);
  EXPECT_FLOAT_EQ(contact.rows.impulses.normal[0], 200);
  // Sliding is braked by what moves with the link, as far as friction goes.
  link.linear = {1, 0, 0};
  weigh_link_contact<false>(contact, link);
  const Wrench friction = sweep_link_contact<ContactPass::relax, false>(contact, link, 0);
  const float effective = 1 / (0.01f + 0.25f * 0.25f);
  EXPECT_NEAR(friction.force.x, -effective, 1e-3f);
  EXPECT_NEAR(friction.torque.y, 0.5f * effective, 1e-3f);
}

TEST(LinkContact, WhatIsNotFiniteGivesNothing) {
  LinkContact contact;
  contact.rows.count = 1;
  contact.rows.set_frame(ContactAxes({0, 0, 1}, {1, 0, 0}, {}, {0, 0, -0.5f}));
  LinkPushes pushes{};
  pushes.by_impulse[2].linear = {0, 0, 0.01f};
  ContactBody<LinkResponse> link{{0, 0, -std::numeric_limits<float>::infinity()}, {}, 1, link_response(pushes)};
  weigh_link_contact<false>(contact, link);
  const Wrench push = sweep_link_contact<ContactPass::relax, false>(contact, link, 0);
  EXPECT_EQ(push.force, Vec3{});
  EXPECT_EQ(contact.rows.impulses.normal[0], 0);
}

}  // namespace
}  // namespace fathom::test::link_contacts_test
