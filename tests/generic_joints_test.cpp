// Generic and distance joints on every simulator: locked axes, limits, drives and springs, and their definitions.
// Bounds hold for sweeps as well as for a direct solution.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "joint_worlds.hpp"

namespace fathom::test::generic_joints_test {
namespace {

class GenericJoints : public OfJointWorlds {
 protected:
  World make(Vec3 gravity = {0, 0, -9.81f}) const {
    WorldDef def = GetParam().quiet();
    def.gravity = gravity;
    return World(def);
  }
};
INSTANTIATE_TEST_SUITE_P(Simulators, GenericJoints, testing::ValuesIn(joint_worlds), joint_world_name);

constexpr Vec3 weightless{}, height{0, 0, 5};
constexpr float pi_f = std::numbers::pi_v<float>;

float position(const World& world, JointId id, JointAxisName axis) {
  return world.joint_positions(id)[static_cast<std::size_t>(axis)];
}

/// A rod of 1 m and 1 kg along y on a hinge about x, at its end; the hinge's frame is the fixed body's.
struct Hinged {
  static constexpr float inertia = 1.01f / 12 + 0.25f;  ///< kg·m², about the hinge
  BodyId top, rod;
  JointId joint;

  /// `swapped`: the fixed body is the joint's B.
  template <class Set>
  Hinged(World& world, const Set& set, bool swapped = false) {
    top = add_anchor(world, height);
    rod = world.add(dynamic(box({0.05f, 0.5f, 0.05f}), height + Vec3{0, 0.5f, 0}));
    const Pose on_rod{.position = {0, -0.5f, 0}};
    JointDef def = swapped ? revolute_joint(rod, top, on_rod, {}) : revolute_joint(top, rod, {}, on_rod);
    set(def.axis(JointAxisName::twist));
    joint = world.add_joint(def);
  }
  void spin(World& world, float rate) const { world.set_velocity(rod, {0, 0, 0.5f * rate}, {rate, 0, 0}); }
  float angle(const World& world) const { return position(world, joint, JointAxisName::twist); }
};

TEST_P(GenericJoints, AWeldCarriesABeam) {
  World world = make();
  const BodyId wall = add_anchor(world, height);
  const BodyId beam = world.add(dynamic(box({0.5f, 0.1f, 0.1f}), height + Vec3{0.6f, 0, 0}, 10));
  const JointId weld =
      world.add_joint(fixed_joint(wall, beam, {.position = {0.1f, 0, 0}}, {.position = {-0.5f, 0, 0}}));
  run(world, 100);
  for (int i = 0; i < 200; ++i) {
    world.step();
    for (const float off : world.joint_positions(weld)) ASSERT_LT(std::abs(off), 1e-4f);
  }
  const JointReaction reaction = world.reaction(weld);
  EXPECT_NEAR(reaction.force.z, 98.1f, 0.981f);
  EXPECT_NEAR(reaction.torque.y, -49.05f, 0.4905f);
  EXPECT_LT(std::abs(reaction.force.x) + std::abs(reaction.force.y), 0.1f);
  EXPECT_LT(std::abs(reaction.torque.x) + std::abs(reaction.torque.z), 0.1f);
}

TEST_P(GenericJoints, AHingeSwingsWithItsEnergy) {
  World world = make();
  const Hinged hinge(world, [](JointAxis&) {});
  float least = 0, most = 0;
  for (int i = 0; i < 600; ++i) {
    world.step();
    const JointPositions at = world.joint_positions(hinge.joint);
    for (std::size_t axis = 0; axis < at.size(); ++axis)
      ASSERT_LT(axis == static_cast<std::size_t>(JointAxisName::twist) ? 0 : std::abs(at[axis]), 1e-3f) << axis;
    const float energy = kinetic_energy(world, hinge.rod) + 9.81f * (world.pose(hinge.rod).position.z - height.z);
    least = std::min(least, energy), most = std::max(most, energy);
  }
  EXPECT_GT(least, -1e-3f * 4.9f);
  EXPECT_LT(most, 1e-3f * 4.9f);
}

TEST_P(GenericJoints, OneSwingTurnsRoundAndRound) {
  for (const bool limited : {false, true})
    for (const JointAxisName swing : {JointAxisName::swing_y, JointAxisName::swing_z}) {
      World world = make(weightless);
      BodyDef def = dynamic(box({0.1f, 0.3f, 0.5f}), {});
      const Vec3 axis = swing == JointAxisName::swing_y ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
      def.pose.rotation = normalize(Quat{1, 0.3f, -0.4f, 0.2f});
      def.velocity.angular = 4.0f * axis + (limited ? Vec3{2, 0, 0} : Vec3{});
      const BodyId body = world.add(def);
      JointDef joint = fixed_joint(add_anchor(world, {}), body, {}, {.rotation = conjugate(def.pose.rotation)});
      joint.axis(swing).mode = AxisMode::free;
      if (limited) joint.axis(JointAxisName::twist).limit(-0.5f, 0.5f);
      const JointId id = world.add_joint(joint);
      world.step();
      float least = kinetic_energy(world, body);
      for (int i = 0; i < 600; ++i) {
        world.step();
        const float now = kinetic_energy(world, body);
        ASSERT_LT(now, 1.002f * least) << "after " << i << " steps";
        least = std::min(least, now);
        ASSERT_LT(std::abs(position(world, id, JointAxisName::twist)), limited ? 0.51f : 1e-3f);
        if (!limited) {
          ASSERT_NEAR(dot(world.velocity(body).angular, axis), 4, 4e-3f);
        }
      }
    }
}

TEST_P(GenericJoints, LimitsHoldWhateverTheSpeed) {
  for (const bool swapped : {false, true}) {
    for (const float rate : {10.0f, -10.0f}) {
      World world = make(weightless);
      const Hinged hinge(
          world, [](JointAxis& twist) { twist.limit(-0.7f, 1); }, swapped);
      hinge.spin(world, rate);
      float least = 0, most = 0;
      for (int i = 0; i < 60; ++i) {
        world.step();
        least = std::min(least, hinge.angle(world)), most = std::max(most, hinge.angle(world));
      }
      constexpr float beyond = 0.05f * pi_f / 180;
      EXPECT_LT(most, 1 + beyond);
      EXPECT_GT(least, -0.7f - beyond);
      // The angle is that of B relative to A.
      const bool goes_up = swapped ? rate < 0 : rate > 0;
      EXPECT_NEAR(goes_up ? most : least, goes_up ? 1 : -0.7f, beyond);
      EXPECT_LT(std::abs(world.velocity(hinge.rod).angular.x), 1e-3f);
    }
    for (const float speed : {2.0f, -2.0f}) {
      World world = make(weightless);
      const BodyId rail = add_anchor(world, height);
      const BodyId car = world.add(dynamic(box({0.1f, 0.2f, 0.3f}), height, 3));
      JointDef def = swapped ? prismatic_joint(car, rail, {}, {}) : prismatic_joint(rail, car, {}, {});
      def.axis(JointAxisName::x).limit(-0.3f, 0.51f);
      const JointId joint = world.add_joint(def);
      world.set_velocity(car, {speed, 0, 0}, {});
      float least = 0, most = 0;
      for (int i = 0; i < 60; ++i) {
        world.step();
        const float x = position(world, joint, JointAxisName::x);
        least = std::min(least, x), most = std::max(most, x);
      }
      const bool goes_up = swapped ? speed < 0 : speed > 0;
      EXPECT_NEAR(goes_up ? most : least, goes_up ? 0.51f : -0.3f, 1e-4f);
      EXPECT_LT(length(world.velocity(car).linear), 1e-3f);
    }
  }
}

TEST_P(GenericJoints, AMotorTurnsWithItsTorqueUpToItsSpeed) {
  for (const bool swapped : {false, true}) {
    World world = make(weightless);
    const Hinged hinge(
        world, [](JointAxis& twist) { twist.drive_velocity(5, 0.5f); }, swapped);
    const float sign = swapped ? -1.0f : 1.0f;
    run(world, 30);
    const float expected = 0.5f * 0.5f / Hinged::inertia;
    EXPECT_NEAR(sign * world.velocity(hinge.rod).angular.x, expected, 0.01f * expected);
    EXPECT_NEAR(world.reaction(hinge.joint).torque.x, 0.5f, 0.005f);
    run(world, 600);
    EXPECT_NEAR(sign * world.velocity(hinge.rod).angular.x, 5, 1e-3f);
  }
}

TEST_P(GenericJoints, APositionMotorHoldsWithAnyGain) {
  for (const float stiffness : {1e2f, 1e4f, 1e6f, 1e8f}) {
    World world = make();
    const Hinged hinge(world, [&](JointAxis& twist) { twist.drive_position(0.5f, stiffness, 0.1f * stiffness); });
    run(world, 600);
    const float angle = hinge.angle(world), torque = 9.81f * 0.5f * std::cos(angle);
    EXPECT_NEAR(angle, 0.5f - torque / stiffness, 1e-3f) << stiffness;
    EXPECT_NEAR(world.reaction(hinge.joint).torque.x, torque, 0.02f * torque) << stiffness;
    // In a direct solution a body held by a drive reports half a substep of gravity, but does not move.
    const float fall = 0.5f * 9.81f / Hinged::inertia / 240;
    EXPECT_LT(length(world.velocity(hinge.rod).angular), 0.5f * fall) << stiffness;
    run(world, 60);
    EXPECT_NEAR(hinge.angle(world), angle, 1e-5f) << stiffness;
  }
}

TEST_P(GenericJoints, ASpringIsAnImplicitOne) {
  World world = make(weightless);
  const BodyId rail = add_anchor(world, height);
  const BodyId car = world.add(dynamic(box({0.1f, 0.2f, 0.3f}), height + Vec3{0.3f, 0, 0}, 2));
  JointDef def = prismatic_joint(rail, car, {}, {});
  def.axis(JointAxisName::x).spring(1, 0);
  const JointId joint = world.add_joint(def);
  const double h = 1.0 / 240, rate = 4 * std::numbers::pi * std::numbers::pi;  // 1/s²
  double x = 0.3, v = 0;
  for (int i = 0; i < 120; ++i) {
    world.step();
    for (int substep = 0; substep < 4; ++substep) {
      v = (v - h * rate * x) / (1 + h * h * rate);
      x += h * v;
    }
    ASSERT_NEAR(position(world, joint, JointAxisName::x), x, 1e-5);
  }
}

TEST_P(GenericJoints, RodsAndRopesKeepTheirLength) {
  World world = make();
  const BodyId top = add_anchor(world, height);
  const auto hang = [&](float out, float lower) {
    const BodyId bob = world.add(dynamic(box({0.1f, 0.1f, 0.1f}), height + Vec3{out, 0, 0}));
    return world.add_joint(distance_joint(top, bob, {}, {}, lower, 1));
  };
  const JointId rod = hang(1, 1), rope = hang(0.3f, 0);
  float longest = 0;
  for (int i = 0; i < 600; ++i) {
    world.step();
    ASSERT_NEAR(position(world, rod, JointAxisName::x), 1, 1e-3f);
    longest = std::max(longest, position(world, rope, JointAxisName::x));
  }
  EXPECT_LT(longest, 1.001f);
  EXPECT_GT(longest, 0.999f);
}

TEST_P(GenericJoints, AConeBoundsTheSwingAndALimitTheTwist) {
  World world = make();
  const BodyId top = add_anchor(world, height);
  const BodyId arm = world.add(dynamic(box({0.5f, 0.1f, 0.1f}), height + Vec3{0.5f, 0, 0}));
  JointDef def = generic_joint(top, arm, {}, {.position = {-0.5f, 0, 0}});
  for (std::size_t axis = 0; axis < 3; ++axis) def.axes[axis].mode = AxisMode::locked;
  def.cone_angle = 0.5f;
  def.axis(JointAxisName::twist).limit(-0.2f, 0.2f);
  const JointId joint = world.add_joint(def);
  world.set_velocity(arm, {}, {8, 0, 0});
  float swing = 0, twist = 0;
  for (int i = 0; i < 600; ++i) {
    world.step();
    swing = std::max(swing, std::acos(rotate(world.pose(arm).rotation, {1, 0, 0}).x));
    twist = std::max(twist, std::abs(position(world, joint, JointAxisName::twist)));
  }
  EXPECT_NEAR(swing, 0.5f, 3e-3f);
  EXPECT_NEAR(twist, 0.2f, 3e-3f);
  EXPECT_LT(length(world.velocity(arm).angular), 0.01f);
}

TEST_P(GenericJoints, LimitsLetGoOfWhatIsPushedAway) {
  for (int i = 0; i < 50; ++i) {
    World world = make(weightless);
    const float limit = 0.01f + 0.02f * static_cast<float>(i);
    const Hinged hinge(world, [&](JointAxis& twist) { twist.limit(-1, limit); });
    hinge.spin(world, 2);
    run(world, 40);
    ASSERT_NEAR(hinge.angle(world), limit, 1e-4f);
    const Vec3 arm = rotate(world.pose(hinge.rod).rotation, {0, 0.5f, 0}), spin{-1, 0, 0};
    world.set_velocity(hinge.rod, cross(spin, arm), spin);
    world.step();
    EXPECT_NEAR(world.velocity(hinge.rod).angular.x, -1, 1e-4f) << "limit " << limit;
  }
}

TEST_P(GenericJoints, ABrakeHoldsOffALimitUpToItsTorque) {
  constexpr float torque = 2;  // N·m
  for (const float share : {-0.9f, 0.9f, -1.5f, 1.5f}) {
    World world = make(weightless);
    const Hinged hinge(world, [](JointAxis& twist) {
      twist.drive_velocity(0, torque);
      twist.limit(-1, 0.3f);
    });
    hinge.spin(world, 12);
    run(world, 60);
    ASSERT_NEAR(hinge.angle(world), 0.3f, 1e-4f) << share;
    constexpr int steps = 12;
    const float pushed = share * torque, free = std::max(-pushed - torque, 0.0f), time = steps / 60.0f;
    for (int i = 0; i < steps; ++i) {
      world.apply_torque(hinge.rod, {pushed, 0, 0});
      world.step();
    }
    EXPECT_NEAR(world.velocity(hinge.rod).angular.x, -free / Hinged::inertia * time, 2e-3f) << share;
  }
}

TEST_P(GenericJoints, ASliderOfFreeBodiesKeepsItsMomentum) {
  World world = make(weightless);
  const BodyId a = world.add(dynamic(box({0.1f, 0.2f, 0.3f}), {}, 2));
  const BodyId b = world.add(dynamic(box({0.3f, 0.1f, 0.1f}), {1, 0, 0}, 1));
  world.add_joint(prismatic_joint(a, b, {}, {}));
  world.set_velocity(a, {0.1f, -0.2f, 0.3f}, {0, 0, 2});
  world.set_velocity(b, {0.5f, 1.8f, 0.3f}, {0, 0, 2});
  const auto momentum = [&] {
    Vec3 linear, angular;
    for (const BodyId id : {a, b}) {
      const Vec3 p = world.mass(id) * world.velocity(id).linear;
      linear += p, angular += cross(world.pose(id).position, p) + angular_momentum(world, id);
    }
    return std::pair(linear, angular);
  };
  world.step();
  const auto [linear, angular] = momentum();
  for (int i = 0; i < 120; ++i) {
    world.step();
    const auto [now, turning] = momentum();
    ASSERT_LT(length(now - linear), 1e-5f * length(linear)) << i;
    ASSERT_LT(length(turning - angular), 1e-5f * length(angular)) << i;
  }
  EXPECT_GT(length(world.pose(b).position - world.pose(a).position), 2) << "it slides out";
}

// The impulse of an axis before it was freed, or its drive switched off, is not applied again.
TEST_P(GenericJoints, ChangesActAtOnce) {
  World world = make(weightless);
  const Hinged hinge(world, [](JointAxis& twist) { twist.drive_velocity(5, 0.5f); });
  run(world, 30);
  world.set_joint_axis(hinge.joint, JointAxisName::twist, {});
  const float rate = world.velocity(hinge.rod).angular.x;
  run(world, 60);
  EXPECT_NEAR(world.velocity(hinge.rod).angular.x, rate, 1e-2f);
  EXPECT_NEAR(world.reaction(hinge.joint).torque.x, 0, 1e-3f);

  World falling = make();
  const BodyId top = add_anchor(falling, height);
  const BodyId box_below = falling.add(dynamic(box({0.1f, 0.1f, 0.1f}), height, 2));
  const JointId joint = falling.add_joint(fixed_joint(top, box_below, {}, {}));
  run(falling, 60);
  EXPECT_NEAR(falling.reaction(joint).force.z, 2 * 9.81f, 0.2f);
  falling.set_joint_axis(joint, JointAxisName::z, {});
  run(falling, 30);
  EXPECT_NEAR(falling.velocity(box_below).linear.z, -0.5f * 9.81f, 0.05f);
  JointAxis held;
  held.mode = AxisMode::locked;
  falling.set_joint_axis(joint, JointAxisName::z, held);
  falling.set_joint_frames(joint, {.position = {0, 0, -1}}, {});
  run(falling, 300);
  EXPECT_NEAR(falling.pose(box_below).position.z, height.z - 1, 1e-3f);
}

TEST_P(GenericJoints, TheirBodiesKeepApartUnlessTheyCollide) {
  for (const bool collide : {false, true}) {
    World world = make(weightless);
    const BodyId a = world.add(cube({})), b = world.add(cube({0.9f, 0, 0}));
    JointDef def = prismatic_joint(a, b, {}, {});
    def.collide_connected = collide;
    world.add_joint(def);
    int contacts = 0;
    for (int i = 0; i < 60; ++i) {
      world.step();
      world.for_each_contact([&](const ContactInfo&) { contacts = 1; });
    }
    EXPECT_EQ(contacts, collide);
    EXPECT_EQ(world.pose(b).position.x - world.pose(a).position.x > 0.95f, collide);
  }
}

TEST_P(GenericJoints, FallAsleepWithWhatTheyHold) {
  World world(GetParam().sleepy());
  const BodyId top = add_anchor(world, height);
  const BodyId beam = world.add(dynamic(box({0.5f, 0.1f, 0.1f}), height + Vec3{0.5f, 0, 0}));
  const JointId weld = world.add_joint(fixed_joint(top, beam, {}, {.position = {-0.5f, 0, 0}}));
  run(world, 200);
  ASSERT_FALSE(world.is_awake(beam));
  EXPECT_NEAR(world.reaction(weld).force.z, 9.81f, 0.1f);
  world.set_joint_axis(weld, JointAxisName::swing_y, {});
  world.step();
  EXPECT_TRUE(world.is_awake(beam));
}

TEST_P(GenericJoints, BadDefinitionsAreRefused) {
  World world = make();
  const BodyId a = world.add(cube({})), b = world.add(cube({2, 0, 0}));
  const JointId ball = world.add_joint(ball_joint(a, b, {}, {}));
  const JointId weld = world.add_joint(fixed_joint(a, b, {}, {}));
  const float nan = std::nanf("");
  const auto refuses = [&](JointDef def, const auto& spoil) {
    spoil(def);
    try {
      world.add_joint(def);
      ADD_FAILURE() << "accepted";
      return std::string();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
      return std::string(error.what());
    }
  };
  using testing::HasSubstr;
  const JointDef good = generic_joint(a, b, {}, {}), distance = distance_joint(a, b, {}, {}, 0, 1);
  using enum JointAxisName;
  EXPECT_THAT(refuses(good, [&](JointDef& d) { d.axis(y).limit(nan, 1); }), HasSubstr("axis y's lower bound"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.axis(twist).limit(1, 0); }), HasSubstr("above its upper bound"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.axis(swing_z).limit(-2, 2); }), HasSubstr("swing_z"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.axis(x).drive.stiffness = -1; }), HasSubstr("stiffness"));
  EXPECT_THAT(refuses(good, [&](JointDef& d) { d.axis(x).drive.velocity = nan; }), HasSubstr("target velocity"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.axis(x).spring(0, 1); }), HasSubstr("no frequency"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.axis(x).mode = static_cast<AxisMode>(7); }), HasSubstr("AxisMode"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.cone_angle = 4; }), HasSubstr("cone"));
  EXPECT_THAT(refuses(good, [](JointDef& d) { d.cone_angle = 1, d.axis(swing_y).limit(0, 1); }), HasSubstr("swing_y"));
  EXPECT_THAT(refuses(distance, [](JointDef& d) { d.cone_angle = 1; }), HasSubstr("no cone"));
  EXPECT_THAT(refuses(distance, [](JointDef& d) { d.axis(z).limit(0, 1); }), HasSubstr("one axis"));
  EXPECT_THAT(refuses(distance, [](JointDef& d) { d.axis(x).lower = -1; }), HasSubstr("below 0"));
  EXPECT_THROW(world.set_joint_axis(ball, x, {}), Error);
  EXPECT_THROW(world.set_joint_axis(weld, x, JointAxis().limit(nan, 1)), Error);
  EXPECT_THROW(world.set_joint_axis(weld, static_cast<JointAxisName>(6), {}), Error);
  EXPECT_EQ(world.joint_count(), 2u);
  EXPECT_EQ(world.joint(weld).axis(x).mode, AxisMode::locked);
}

}  // namespace
}  // namespace fathom::test::generic_joints_test
