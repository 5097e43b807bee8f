// Springs by frequency: what mass they move, and that their stiffness does no work.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <numbers>

#include "dynamics/joint_masses.hpp"
#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::joint_springs_test {
namespace {

using Axis = JointAxisName;

SymMat3 diagonal_inverse(float x, float y, float z) {
  SymMat3 m;
  m.xx = 1 / x, m.yy = 1 / y, m.zz = 1 / z;
  return m;
}

/// A body of 2 kg whose joint is `arm` away from its centre.
JointedMass thing(Vec3 arm) {
  JointedMass body;
  body.frame.position = arm;
  body.inverse_mass = 0.5f, body.inverse_inertia = diagonal_inverse(3, 4, 5);
  return body;
}

TEST(JointMasses, AreReducedMassesForBallAndDistanceJoints) {
  JointDef def;
  for (const JointType type : {JointType::ball, JointType::distance}) {
    def.type = type;
    EXPECT_FLOAT_EQ(joint_masses_of(def, thing({1, 2, 3}), thing({4, 0, 0}))[0], 1);
    EXPECT_FLOAT_EQ(joint_masses_of(def, {}, thing({4, 0, 0}))[0], 2);
  }
}

TEST(JointMasses, OfADoorIsItsInertiaAboutTheHinge) {
  const JointDef def = revolute_joint({}, {}, {}, {});
  const JointMasses masses = joint_masses_of(def, {}, thing({0, 0, -2}));
  EXPECT_FLOAT_EQ(masses[static_cast<std::size_t>(Axis::twist)], 3 + 2 * 4);
}

TEST(JointMasses, OfAWheelOnItsSuspensionIsReduced) {
  JointDef def = wheel_joint({}, {}, {}, {}, 2, 1);
  const JointMasses masses = joint_masses_of(def, {}, thing({}));
  EXPECT_FLOAT_EQ(masses[static_cast<std::size_t>(Axis::z)], 2);
  EXPECT_FLOAT_EQ(masses[static_cast<std::size_t>(Axis::twist)], 3);
  // Both bodies: 1 / (1 / 2 + 1 / 2).
  EXPECT_FLOAT_EQ(joint_masses_of(def, thing({}), thing({}))[static_cast<std::size_t>(Axis::z)], 1);
}

// Locked axes hold: the mass matrix of a rigid body at its joint, whose diagonal is known.
TEST(JointMasses, OfAWeldAreTheMassMatrixAtTheJoint) {
  const JointDef def = fixed_joint({}, {}, {}, {});
  Generator random(1);
  for (int i = 0; i < 100; ++i) {
    const float reach = std::pow(10.0f, uniform(random, -3, 2));
    JointedMass body = thing(reach * in_cube(random));
    body.frame.rotation = any_rotation(random);
    const JointMasses masses = joint_masses_of(def, {}, body);
    const Vec3 arm = rotate(conjugate(body.frame.rotation), body.frame.position);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 axis{k == 0 ? 1.0f : 0.0f, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f};
      EXPECT_NEAR(masses[k], 2, 1e-3f) << i;
      const Vec3 own = rotate(body.frame.rotation, axis);
      const float inertia = 3 * own.x * own.x + 4 * own.y * own.y + 5 * own.z * own.z;
      const float about = inertia + 2 * length_squared(cross(axis, arm));
      EXPECT_NEAR(masses[3 + k], about, 1e-3f * about) << i;
    }
  }
}

TEST(JointMasses, AreZeroWhereNothingMoves) {
  JointedMass stiff = thing({});
  stiff.inverse_inertia = {};
  const JointMasses masses = joint_masses_of(fixed_joint({}, {}, {}, {}), {}, stiff);
  EXPECT_THAT(masses, testing::ElementsAre(2, 2, 2, 0, 0, 0));
}

TEST(JointMasses, OfACouplingAreThoseOfItsSum) {
  const Pose at{};
  JointDef gear = gear_joint({}, at, {1, 0, 0}, {}, at, {0, 0, 1}, 3);
  JointedMass a = thing({}), b = thing({});
  a.frame = gear.frame_a, b.frame = gear.frame_b;
  EXPECT_NEAR(joint_masses_of(gear, a, b)[0], 1 / (1.0f / 3 + 9.0f / 5), 1e-5f);
  const JointDef pulley = pulley_joint({}, {}, {0, 0, 5}, {}, {1, 0, 0}, {1, 0, 5}, 6, 2);
  EXPECT_NEAR(joint_masses_of(pulley, thing({}), thing({}))[0], 1 / (0.5f + 4 * 0.5f), 1e-6f);
}

class JointSprings : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, JointSprings, testing::ValuesIn(joint_worlds), joint_world_name);

enum class Spring { ball, rod, hinge, weld, slider };

/// A spring between these bodies; `at` on each is the joint's frame.
JointDef spring_of(Spring kind, BodyId a, BodyId b, const Pose& on_a, const Pose& on_b, float hertz, float ratio) {
  JointDef def = ball_joint(a, b, on_a.position, on_b.position);
  if (kind == Spring::rod) def = distance_joint(a, b, on_a.position + Vec3{0, 0, 0.3f}, on_b.position, 0.3f, 0.3f);
  if (kind == Spring::hinge) def = revolute_joint(a, b, on_a, on_b);
  if (kind == Spring::weld) def = fixed_joint(a, b, on_a, on_b);
  if (kind == Spring::slider) {
    def = generic_joint(a, b, on_a, on_b);
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) def.axis(axis).spring(hertz, ratio);
    return def;
  }
  def.hertz = hertz, def.damping_ratio = ratio;
  return def;
}

/// A body on a spring off its centre, and another one welded to it: the largest gain of energy within 10 s (J), in
/// units of the fall by a body's size.
float gain_of(const WorldDef& def, Spring kind, std::uint32_t seed) {
  World world(def);
  Generator random(seed);
  constexpr float size = 0.3f;
  BodyDef base{.motion = MotionType::fixed, .shape = sphere(0.1f), .filter = {.mask = 0}};
  std::array<BodyId, 3> chain{world.add(base)};
  std::array<Pose, 3> poses{};
  float mass = 0;
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const Vec3 half{size * uniform(random, 0.3f, 1), size * uniform(random, 0.3f, 1), size * uniform(random, 0.3f, 1)};
    const Vec3 before = poses[i - 1].position;
    const Vec3 position = before + size * uniform(random, 0.5f, 2) * on_sphere(random);
    BodyDef body = dynamic(box(half), position, uniform(random, 0.5f, 2));
    body.pose.rotation = any_rotation(random), body.filter.mask = 0;
    chain[i] = world.add(body), poses[i] = body.pose, mass += world.mass(chain[i]);
    const Pose joint{before + 0.3f * (position - before), 0, any_rotation(random)};
    const Pose on_a = joint_parts::frame_on(poses[i - 1], joint), on_b = joint_parts::frame_on(poses[i], joint);
    world.add_joint(i == 1
                        ? spring_of(kind, chain[0], chain[1], on_a, on_b, uniform(random, 1, 8), uniform(random, 0, 1))
                        : fixed_joint(chain[i - 1], chain[i], on_a, on_b));
  }
  const float begin = energy(world);
  float gain = 0;
  for (int i = 0; i < 600; ++i) {
    world.step();
    gain = std::max(gain, energy(world) - begin);
  }
  return gain / (mass * 9.81f * size);
}

// A spring whose stiffness turned with its body would drive it: energy grew without bound in a third of such worlds.
TEST_P(JointSprings, DoNoWorkOnWhatTurns) {
  for (const Spring kind : {Spring::ball, Spring::rod, Spring::hinge, Spring::weld, Spring::slider})
    for (std::uint32_t seed = 0; seed < 12; ++seed)
      EXPECT_LT(gain_of(GetParam().quiet(), kind, seed), 0.05f)
          << "kind " << static_cast<int>(kind) << ", seed " << seed;
}

// A weld's axes are springs with the stiffness m ω² whatever the direction of the load.
TEST_P(JointSprings, OfAWeldYieldAlikeInAllDirections) {
  constexpr float hertz = 3, omega = 2 * pi * hertz, load = 9.81f / (omega * omega);
  Generator random(2);
  for (int i = 0; i < 5; ++i) {
    World world(GetParam().quiet());
    const Quat turn = any_rotation(random);
    BodyDef wall{.motion = MotionType::fixed, .shape = sphere(0.1f), .filter = {.mask = 0}};
    wall.pose.rotation = turn;
    const BodyId a = world.add(wall);
    BodyDef body = dynamic(box({0.1f, 0.2f, 0.3f}), {}, 2);
    body.pose.rotation = turn;
    const BodyId b = world.add(body);
    JointDef weld = fixed_joint(a, b, {}, {});
    weld.hertz = hertz, weld.damping_ratio = 1;
    world.add_joint(weld);
    run(world, 180);
    EXPECT_LT(length(world.pose(b).position - Vec3{0, 0, -load}), 0.01f * load) << i;
  }
}

// A door of 1 m on a fixed frame closes with the frequency that it was given, at any angle.
TEST_P(JointSprings, CloseADoorAtTheirFrequency) {
  WorldDef def = GetParam().quiet();
  def.gravity = {};
  World world(def);
  const BodyId frame = add_anchor(world, {});
  const Quat open = axis_angle({0, 0, 1}, 0.5f);
  BodyDef leaf = dynamic(box({0.5f, 0.02f, 1}), rotate(open, {0.5f, 0, 0}), 20);
  leaf.pose.rotation = open, leaf.filter.mask = 0;
  const BodyId door = world.add(leaf);
  const Pose hinge = joint_frame({}, {0, 0, 1});
  Pose on_door = hinge;
  on_door.position = {-0.5f, 0, 0};
  JointDef joint = revolute_joint(frame, door, hinge, on_door);
  joint.axis(Axis::twist).spring(1, 0);
  world.add_joint(joint);
  const auto angle = [&] {
    const Quat q = world.pose(door).rotation;
    return 2 * std::atan2(q.z, q.w);
  };
  run(world, 15);  // a quarter of a period
  EXPECT_NEAR(angle(), 0, 0.02f);
  run(world, 45);
  constexpr float h = 1.0f / 240, omega = 2 * pi;
  EXPECT_NEAR(angle(), 0.5f * std::exp(-pi * omega * h), 2e-3f);  // implicit Euler damps by this in a period
}

}  // namespace
}  // namespace fathom::test::joint_springs_test
