// Joints and the laws of mechanics, on every simulator that has joints.
#include <gmock/gmock.h>

#include <algorithm>
#include <numbers>

#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::joint_laws_test {
namespace {

class JointLaws : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, JointLaws, testing::ValuesIn(joint_worlds), joint_world_name);

/// A plane pendulum: θ'' = −k sin θ, by Runge–Kutta in double precision.
struct ExactPendulum {
  double k, angle, rate = 0;

  void advance(double time) {
    constexpr int parts = 50;
    const double h = time / parts;
    for (int i = 0; i < parts; ++i) {
      const auto pull = [&](double at) { return -k * std::sin(at); };
      const double a1 = rate, b1 = pull(angle), a2 = rate + h / 2 * b1, b2 = pull(angle + h / 2 * a1);
      const double a3 = rate + h / 2 * b2, b3 = pull(angle + h / 2 * a2), a4 = rate + h * b3, b4 = pull(angle + h * a3);
      angle += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      rate += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4);
    }
  }
};

/// The largest error of a pendulum's angle over ten periods, relative to its amplitude.
double pendulum_error(const WorldDef& def, const Shape& shape, float arm, double amplitude) {
  World world(def);
  const BodyId top = add_anchor(world, {0, 0, 10});
  BodyDef bob = dynamic(shape, {}, 2);
  const double s = std::sin(amplitude), c = std::cos(amplitude);
  bob.pose.position = {arm * static_cast<float>(s), 0, 10 - arm * static_cast<float>(c)};
  bob.pose.rotation = axis_angle({0, -1, 0}, static_cast<float>(amplitude));
  const BodyId id = world.add(bob);
  world.add_joint(ball_joint(top, id, {}, {0, 0, arm}));
  const double m = 2, inertia = static_cast<double>(world.mass_properties(id).inertia.yy), l = static_cast<double>(arm);
  ExactPendulum exact{m * 9.81 * l / (inertia + m * l * l), amplitude};
  const int steps = static_cast<int>(10 * 2 * std::numbers::pi / std::sqrt(exact.k) / static_cast<double>(def.dt));
  double worst = 0;
  for (int i = 0; i < steps; ++i) {
    world.step();
    exact.advance(static_cast<double>(def.dt));
    const Vec3 p = world.pose(id).position;
    const double angle = std::atan2(static_cast<double>(p.x), 10 - static_cast<double>(p.z));
    worst = std::max(worst, std::abs(angle - exact.angle) / amplitude);
  }
  return worst;
}

TEST_P(JointLaws, PendulumsSwingAsTheyShould) {
  const WorldDef def = GetParam().quiet();
  EXPECT_LT(pendulum_error(def, sphere(0.1f), 1, 0.5), 1e-3);
  EXPECT_LT(pendulum_error(def, box({0.05f, 0.1f, 0.5f}), 0.5f, 0.5), 1e-3);
  EXPECT_LT(pendulum_error(def, box({0.05f, 0.1f, 0.5f}), 1, 1), 1e-3);
  WorldDef fine = def;
  fine.solver.substeps = 8;
  EXPECT_LT(pendulum_error(fine, sphere(0.1f), 1, 1), 5e-4);
}

struct Swing {
  float least, most;  ///< J, energy minus the initial energy
  float gap;          ///< m, at the end
};

/// Ten seconds of a double pendulum.
Swing double_pendulum(const WorldDef& def, Vec3 direction) {
  World world(def);
  const BodyId anchor = add_anchor(world, {});
  const Chain chain(world, anchor, {}, direction, 2);
  world.exclude(anchor, chain.links[1]);  // it passes by
  const float begin = energy(world);
  float least = begin, most = begin;
  for (int i = 0; i < 600; ++i) {
    world.step();
    least = std::min(least, energy(world));
    most = std::max(most, energy(world));
  }
  return {least - begin, most - begin, widest_gap(world)};
}

// A double pendulum's motion is chaotic, but its energy is constant.
TEST_P(JointLaws, ADoublePendulumKeepsItsEnergy) {
  constexpr int starts = 15;
  const float height = 9.81f * 2 * Chain::length;  // J, of the fall to the lowest point
  for (int i = 0; i < starts; ++i) {
    const Vec3 direction = normalize(Vec3{1, 0, 0.005f * static_cast<float>(i)});
    const Swing swing = double_pendulum(GetParam().quiet(), direction);
    EXPECT_LT(swing.most, 0.05f * height) << "start " << i;
    EXPECT_GT(swing.least, -0.1f * height) << "start " << i;
    EXPECT_LT(swing.gap, i == 0 ? 2e-3f : 2.5e-3f) << "start " << i;
  }
}

/// How far (m) a body hangs below a fixed one on a spring joint of 2 Hz, with its twist free or limited.
float sag_of_spring(const WorldDef& def, AxisMode twist) {
  World world(def);
  const BodyId anchor = add_anchor(world, {});
  const BodyId body = world.add(dynamic(box({0.1f, 0.2f, 0.3f}), {}, 2));
  JointDef joint = generic_joint(anchor, body, {}, {});
  for (JointAxis& axis : joint.axes) axis.mode = AxisMode::locked;
  JointAxis& about = joint.axis(JointAxisName::twist);
  about.mode = twist;
  if (twist == AxisMode::limited) about.limit(-0.5f, 0.5f);
  joint.hertz = 2, joint.damping_ratio = 1;
  world.add_joint(joint);
  world.exclude(anchor, body);
  for (int i = 0; i < 300; ++i) world.step();
  return -world.pose(body).position.z;
}

// Limits that are not reached take no load from a spring joint.
TEST_P(JointLaws, ASpringHoldsItsLoadBesideALimit) {
  const float omega = 4 * std::numbers::pi_v<float>, sag = 9.81f / (omega * omega);
  for (const AxisMode twist : {AxisMode::free, AxisMode::limited})
    EXPECT_NEAR(sag_of_spring(GetParam().quiet(), twist), sag, 0.01f * sag);
}

TEST_P(JointLaws, AFreeChainKeepsItsMomentum) {
  WorldDef def = GetParam().quiet();
  def.gravity = {};
  World world(def);
  Generator random(3);
  const Chain chain(world, {}, {}, {1, 0, 0}, 8);
  for (const BodyId id : chain.links) world.set_velocity(id, in_cube(random), 2 * in_cube(random));
  const auto momentum = [&] {
    Velocity sum;
    for (const BodyId id : chain.links) {
      const Vec3 p = world.mass(id) * world.velocity(id).linear;
      sum.linear += p;
      sum.angular += angular_momentum(world, id) + cross(world.pose(id).position, p);
    }
    return sum;
  };
  // The first step joins bodies with random velocities.
  const Velocity first = momentum();
  world.step();
  const Velocity begin = momentum();
  EXPECT_LT(length(begin.linear - first.linear), 1e-5f);
  run(world, 600);
  const Velocity end = momentum();
  EXPECT_LT(length(end.linear - begin.linear), 1e-4f);
  EXPECT_LT(length(end.angular - begin.angular), 0.03f * length(begin.angular));
}

/// How far a rigid joint yields under a load (N) on a mass (kg): it is a spring of 0.22 of the substep rate.
float give(float load, float mass) {
  const float omega = 2 * pi * 0.22f * 240;
  return load / (mass * omega * omega);
}

TEST_P(JointLaws, AChainHangsStill) {
  for (const int count : {1, 10, 40}) {
    World world(GetParam().quiet());
    const Chain chain(world, add_anchor(world, {}), {}, {0, 0, -1}, count);
    run(world, 1200);
    for (const BodyId id : chain.links) EXPECT_LT(length(world.velocity(id).linear), 5e-3f) << count;
    // A link's own inertia is half as stiff between two links as at the top.
    EXPECT_LT(widest_gap(world), 2.2f * give(9.81f * static_cast<float>(count), 1)) << count;
    for (int i = 0; i < count; ++i) {
      const float load = 9.81f * static_cast<float>(count - i);
      EXPECT_NEAR(world.reaction(chain.joints[static_cast<std::size_t>(i)]).force.z, load, 0.01f * load);
    }
  }
}

// Whichever of the definition's bodies can be pushed, reactions are those on B.
TEST_P(JointLaws, AWeightPullsAtItsJoint) {
  World world(GetParam().quiet());
  const BodyId top = add_anchor(world, {}), weight = world.add(dynamic(sphere(0.2f), {0, 0, -1}, 7));
  const JointId hung = world.add_joint(ball_joint(top, weight, {}, {0, 0, 1}));
  const BodyId other = world.add(dynamic(sphere(0.2f), {5, 0, -1}, 7));
  const JointId reverse = world.add_joint(ball_joint(other, add_anchor(world, {5, 0, 0}), {0, 0, 1}, {}));
  EXPECT_EQ(world.reaction(hung).force, Vec3{});
  run(world, 120);
  EXPECT_NEAR(world.reaction(hung).force.z, 7 * 9.81f, 0.01f * 7 * 9.81f);
  EXPECT_NEAR(world.reaction(reverse).force.z, -7 * 9.81f, 0.01f * 7 * 9.81f);
  EXPECT_EQ(world.reaction(hung).torque, Vec3{});
}

TEST_P(JointLaws, ASpringSwingsAtItsFrequency) {
  for (const float hertz : {0.5f, 1.0f, 3.0f}) {
    WorldDef def = GetParam().quiet();
    def.gravity = {};
    World world(def);
    const BodyId weight = world.add(dynamic(sphere(0.2f), {0, 0, 0.1f}, 3));
    JointDef spring = ball_joint(add_anchor(world, {}), weight, {}, {});
    spring.hertz = hertz, spring.damping_ratio = 0;
    world.add_joint(spring);
    // Times of upward zero crossings, with whole periods between them.
    double first = -1, last = -1, before = 0.1;
    int periods = -1;
    for (int i = 0; i < 600; ++i) {
      world.step();
      const double z = static_cast<double>(world.pose(weight).position.z);
      if (before < 0 && z >= 0) {
        last = world.time() - static_cast<double>(def.dt) * z / (z - before);
        if (periods++ < 0) first = last;
      }
      before = z;
    }
    ASSERT_GT(periods, 0);
    EXPECT_NEAR(periods / (last - first), static_cast<double>(hertz), 0.01 * static_cast<double>(hertz));
  }
}

// A net of 20 by 20 balls hangs from its corners; what falls on it stays on it.
TEST_P(JointLaws, ANetCatchesBalls) {
  constexpr int side = 20;
  constexpr float mesh = 0.25f;
  World world(GetParam().quiet(2));
  std::vector<BodyId> knots;
  for (int i = 0; i < side * side; ++i) {
    BodyDef def = dynamic(sphere(0.12f), {mesh * static_cast<float>(i % side), mesh * static_cast<float>(i / side), 0});
    const bool corner = (i % side) % (side - 1) == 0 && (i / side) % (side - 1) == 0;
    if (corner) def.motion = MotionType::fixed;
    def.mass = corner ? 0 : 0.2f;
    knots.push_back(world.add(def));
  }
  const auto tie = [&](int i, int j, Vec3 towards) {
    const Vec3 half = 0.5f * mesh * towards;
    if (world.motion(knots[i]) == MotionType::dynamic || world.motion(knots[j]) == MotionType::dynamic)
      world.add_joint(ball_joint(knots[i], knots[j], half, -half));
  };
  for (int i = 0; i < side * side; ++i) {
    if (i % side + 1 < side) tie(i, i + 1, {1, 0, 0});
    if (i / side + 1 < side) tie(i, i + side, {0, 1, 0});
  }
  Generator random(5);
  std::vector<BodyId> balls;
  for (int i = 0; i < 12; ++i)
    balls.push_back(world.add(
        dynamic(sphere(0.3f),
                {uniform(random, 1.5f, 3.5f), uniform(random, 1.5f, 3.5f), 1 + 0.7f * static_cast<float>(i)}, 1)));
  run(world, 1500);
  for (const BodyId ball : balls) EXPECT_GT(world.pose(ball).position.z, -4);
  EXPECT_LT(widest_gap(world), give(9.81f * 92, 0.2f));
  for (const BodyId id : world.bodies()) EXPECT_LT(length(world.velocity(id).linear), 5) << id.index;
}

}  // namespace
}  // namespace fathom::test::joint_laws_test
