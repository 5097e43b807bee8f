// Machines of joints that sweeps cannot hold: chains with heavy ends, arms with heavy loads, loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/world.hpp>
#include <vector>

#include "joint_worlds.hpp"

namespace fathom::test::joint_machines_test {
namespace {

class JointMachines : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, JointMachines, testing::ValuesIn(joint_worlds), joint_world_name);

class Machine {
 public:
  explicit Machine(const JointWorlds& worlds) : world_(worlds.quiet()) {}
  BodyId add(Vec3 at, Vec3 half_extents, float mass, MotionType motion = MotionType::dynamic, Quat rotation = {}) {
    BodyDef def;
    def.shape = box(half_extents), def.mass = mass, def.motion = motion, def.filter = {2, 0};
    def.pose.position = at, def.pose.rotation = rotation;
    return world_.add(def);
  }
  /// Between points of two bodies, about the x axis.
  JointDef hinge(BodyId a, BodyId b, Vec3 on_a, Vec3 on_b) {
    return revolute_joint(a, b, {on_a, 0, {}}, {on_b, 0, {}});
  }
  JointId join(const JointDef& def) { return joints_.emplace_back(world_.add_joint(def)); }
  World& world() { return world_; }
  /// m or rad, of all axes but the twists
  float widest_gap() const {
    float widest = 0;
    for (const JointId joint : joints_) {
      const JointPositions at = world_.joint_positions(joint);
      for (std::size_t i = 0; i < joint_axis_count; ++i)
        if (i != static_cast<std::size_t>(JointAxisName::twist)) widest = std::max(widest, std::fabs(at[i]));
    }
    return widest;
  }

 private:
  World world_;
  std::vector<JointId> joints_;
};

/// Widest gap (m) within 10 s of fifty links with a ton at the end, released level and joined by `join(a, b, on_a,
/// on_b)`.
template <class Join>
float widest_gap_of_fifty(Machine& m, const Join& join) {
  BodyId last = m.add({0, 0, 50}, {0.1f, 0.1f, 0.1f}, 1, MotionType::fixed);
  for (int i = 0; i < 50; ++i) {
    const BodyId link = m.add({0, 0.1f + 0.2f * static_cast<float>(i), 50}, {0.02f, 0.1f, 0.02f}, 1);
    m.join(join(last, link, Vec3{0, i > 0 ? 0.1f : 0, 0}, Vec3{0, -0.1f, 0}));
    last = link;
  }
  const BodyId load = m.add({0, 10.5f, 50}, {0.5f, 0.5f, 0.5f}, 1000);
  m.join(join(last, load, Vec3{0, 0.1f, 0}, Vec3{0, -0.5f, 0}));
  float widest = 0;
  for (int step = 0; step < 600; ++step) {
    m.world().step();
    widest = std::max(widest, widest_gap(m.world()));
  }
  return std::max(widest, m.widest_gap());
}
TEST_P(JointMachines, FiftyHingesHoldATonLetGoLevel) {
  Machine m(GetParam());
  const auto hinge = [&](BodyId a, BodyId b, Vec3 on_a, Vec3 on_b) { return m.hinge(a, b, on_a, on_b); };
  EXPECT_LT(widest_gap_of_fifty(m, hinge), 1e-5f);
}
TEST_P(JointMachines, FiftyBallJointsDoToo) {
  Machine m(GetParam());
  EXPECT_LT(widest_gap_of_fifty(m, ball_joint), 1e-5f);
}

TEST_P(JointMachines, AnArmHoldsTenTimesItsWeight) {
  Machine m(GetParam());
  BodyId last = m.add({0, 0, 5}, {0.1f, 0.1f, 0.1f}, 1, MotionType::fixed);
  std::vector<JointId> joints;
  for (int i = 0; i < 6; ++i) {
    const BodyId link = m.add({0, 0.25f + 0.5f * static_cast<float>(i), 5}, {0.05f, 0.25f, 0.05f}, 5);
    JointDef hinge = m.hinge(last, link, {0, i > 0 ? 0.25f : 0, 0}, {0, -0.25f, 0});
    hinge.axis(JointAxisName::twist).drive_position(0, 1e7f, 1e5f);
    joints.push_back(m.join(hinge));
    last = link;
  }
  const BodyId load = m.add({0, 3.2f, 5}, {0.2f, 0.2f, 0.2f}, 300);
  m.join(fixed_joint(last, load, {{0, 0.25f, 0}, 0, {}}, {{0, -0.2f, 0}, 0, {}}));
  for (int step = 0; step < 600; ++step) m.world().step();
  EXPECT_LT(m.widest_gap(), 1e-5f);
  EXPECT_LT(length(m.world().velocity(load).linear), 1e-4f);
  EXPECT_NEAR(m.world().reaction(joints[0]).torque.x, 9.81f * (30 * 1.5f + 300 * 3.2f), 1);
}

/// Angle (rad) of the direction from one point to another in the y, z plane.
float angle(Vec3 from, Vec3 to) { return std::atan2(to.z - from.z, to.y - from.y); }

TEST_P(JointMachines, AFourBarLinkageTurns) {
  constexpr float crank_length = 0.3f, coupler_length = 1, rocker_length = 0.6f, ground_length = 1;
  const auto tip = [](Vec3 crank_end) {  // where coupler and rocker meet, above the line to the rocker's pivot
    const Vec3 way = Vec3{0, ground_length, 0} - crank_end;
    const float distance = length(way);
    const float along =
        (coupler_length * coupler_length - rocker_length * rocker_length + distance * distance) / (2 * distance);
    const Vec3 unit = (1 / distance) * way, normal{0, -unit.z, unit.y};
    return crank_end + along * unit + std::sqrt(coupler_length * coupler_length - along * along) * normal;
  };
  Machine m(GetParam());
  const auto bar = [&m](Vec3 from, Vec3 to) {
    const float half = 0.5f * angle(from, to);
    return m.add(0.5f * (from + to), {0.02f, 0.5f * distance(from, to), 0.02f}, 1, MotionType::dynamic,
                 {std::cos(half), std::sin(half), 0, 0});
  };
  const Vec3 crank_end{0, crank_length, 0}, pivot{0, ground_length, 0}, meeting = tip(crank_end);
  const BodyId ground = m.add({}, {0.05f, 0.05f, 0.05f}, 1, MotionType::fixed);
  const BodyId crank = bar({}, crank_end), coupler = bar(crank_end, meeting), rocker = bar(pivot, meeting);
  JointDef motor = m.hinge(ground, crank, {}, {0, -crank_length / 2, 0});
  motor.axis(JointAxisName::twist).drive_velocity(2, 1e6f);
  m.join(motor);
  m.join(m.hinge(crank, coupler, {0, crank_length / 2, 0}, {0, -coupler_length / 2, 0}));
  m.join(m.hinge(ground, rocker, pivot, {0, -rocker_length / 2, 0}));
  m.join(m.hinge(coupler, rocker, {0, coupler_length / 2, 0}, {0, rocker_length / 2, 0}));
  float widest = 0, worst_angle = 0;
  for (int step = 0; step < 1885; ++step) {  // ten turns
    m.world().step();
    widest = std::max(widest, m.widest_gap());
    const Vec3 end = crank_length * rotate(m.world().pose(crank).rotation, {0, 1, 0});
    const Vec3 is = rotate(m.world().pose(rocker).rotation, {0, 1, 0});
    const Vec3 should = (1 / rocker_length) * (tip(end) - pivot);
    worst_angle = std::max(worst_angle, length(cross(is, should)));
  }
  EXPECT_LT(widest, 1e-5f);
  EXPECT_LT(worst_angle, 1e-4f);
}

/// Links in the y, z plane from point to point, joined end to end by hinges; the first and the last hang on `anchor`.
void add_row(Machine& m, BodyId anchor, const std::vector<Vec3>& points, Vec3 half_extents, float mass) {
  BodyId last = anchor;
  Vec3 on_last = points.front();
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Vec3 from = points[i], to = points[i + 1];
    const float half = 0.5f * angle(from, to), length = distance(from, to);
    half_extents.y = 0.45f * length;
    const BodyId link =
        m.add(0.5f * (from + to), half_extents, mass, MotionType::dynamic, {std::cos(half), std::sin(half), 0, 0});
    m.join(m.hinge(last, link, on_last, {0, -0.5f * length, 0}));
    last = link, on_last = {0, 0.5f * length, 0};
  }
  m.join(m.hinge(anchor, last, points.back(), on_last));
}

// Hung at both ends, so that each of its joints is part of a loop.
TEST_P(JointMachines, ABridgeOfFiftyPlanksHangsAtBothEnds) {
  Machine m(GetParam());
  const BodyId ground = m.add({}, {0.1f, 0.1f, 0.1f}, 1, MotionType::fixed);
  std::vector<Vec3> points{{0, 0, 0}};
  for (int i = 0; i < 50; ++i) {
    const float slope = 0.9f * (static_cast<float>(i) - 24.5f) / 25;
    points.push_back(points.back() + 0.5f * Vec3{0, std::cos(slope), std::sin(slope)});
  }
  add_row(m, ground, points, {1, 0, 0.05f}, 20);
  float widest = 0;
  for (int step = 0; step < 600; ++step) m.world().step(), widest = std::max(widest, m.widest_gap());
  EXPECT_LT(widest, 1e-4f);
}

// A lift of crossed bars: five loops, and many impulses out of the plane that nothing responds to.
TEST_P(JointMachines, AScissorLiftHoldsItsLoad) {
  Machine m(GetParam());
  const BodyId ground = m.add({}, {0.1f, 0.1f, 0.1f}, 1, MotionType::fixed);
  constexpr float tilt = 0.6f;
  const float y = std::cos(tilt), z = std::sin(tilt);
  BodyId rising{}, falling{};
  for (int i = 0; i < 4; ++i) {
    const Vec3 centre{0, 0, (2 * static_cast<float>(i) + 1) * z};
    const auto bar = [&](float turn) {
      return m.add(centre, {0.04f, 1, 0.04f}, 5, MotionType::dynamic, {std::cos(turn), std::sin(turn), 0, 0});
    };
    const BodyId below_rising = rising, below_falling = falling;
    rising = bar(0.5f * tilt), falling = bar(-0.5f * tilt);
    m.join(m.hinge(rising, falling, {}, {}));
    if (i == 0) {
      m.join(m.hinge(ground, rising, {0, -y, 0}, {0, -1, 0}));
      m.join(m.hinge(ground, falling, {0, y, 0}, {0, 1, 0}));
    } else {
      m.join(m.hinge(below_falling, rising, {0, -1, 0}, {0, -1, 0}));
      m.join(m.hinge(below_rising, falling, {0, 1, 0}, {0, 1, 0}));
    }
  }
  const BodyId load = m.add({0, 0, 8 * z}, {0.2f, 0.2f, 0.2f}, 500);
  m.join(m.hinge(rising, load, {0, 1, 0}, {0, y, 0}));
  m.join(ball_joint(falling, load, {0, -1, 0}, {0, -y, 0}));
  float widest = 0;
  for (int step = 0; step < 300; ++step) {
    m.world().step();
    widest = std::max(widest, widest_gap(m.world()));
  }
  EXPECT_LT(widest, 1e-5f);
  EXPECT_LT(length(m.world().velocity(load).linear), 2e-3f);
}

// Nothing in it can satisfy the last weld, and each weld's load is undetermined, but bounded.
TEST_P(JointMachines, AWeldedFrameHoldsThoughItDoesNotFitByAMillimetre) {
  Machine m(GetParam());
  const BodyId ground = m.add({}, {0.1f, 0.1f, 0.1f}, 1, MotionType::fixed);
  const BodyId left = m.add({0, -1, 1}, {0.05f, 0.05f, 1}, 10), right = m.add({0, 1, 1}, {0.05f, 0.05f, 1}, 10);
  const BodyId top = m.add({0, 0, 2}, {0.05f, 1, 0.05f}, 10);
  const auto weld = [&](BodyId a, BodyId b, Vec3 on_a, Vec3 on_b) {
    return m.join(fixed_joint(a, b, {on_a, 0, {}}, {on_b, 0, {}}));
  };
  weld(ground, left, {0, -1, 0}, {0, 0, -1});
  const JointId loose = weld(ground, right, {0, 1, 0}, {0, 0, -1});
  weld(left, top, {0, 0, 1}, {0, -1, 0});
  weld(right, top, {0, 0, 1}, {0, 1.001f, 0});
  float force = 0;
  for (int step = 0; step < 600; ++step) {
    m.world().step();
    if (step >= 300) force = std::max(force, length(m.world().reaction(loose).force));
    ASSERT_LT(m.widest_gap(), 1.1e-3f);
    ASSERT_LT(length(m.world().velocity(top).linear), 0.3f);
  }
  EXPECT_LT(length(m.world().velocity(top).linear), 1e-3f);
  EXPECT_LT(force, 1e6f);
}

// Nothing is singular as an axis passes through a right angle: a hinge that may also swing about y hangs straight down.
TEST_P(JointMachines, ATwistLimitHoldsAtAnySwingShortOfAHalfTurn) {
  Machine m(GetParam());
  const BodyId post = m.add({0, 0, 2}, {0.1f, 0.1f, 0.1f}, 1, MotionType::fixed);
  const BodyId arm = m.add({1, 0, 2}, {0.5f, 0.1f, 0.1f}, 40), weight = m.add({1, 0, 1}, {0.1f, 0.1f, 0.1f}, 4);
  JointDef hinge = m.hinge(post, arm, {}, {-1, 0, 0});
  hinge.axis(JointAxisName::swing_y).mode = AxisMode::free;
  hinge.axis(JointAxisName::twist).limit(-1, 1).drive_velocity(3, 50);
  const JointId joint = m.world().add_joint(hinge);
  m.world().add_joint(distance_joint(arm, weight, {}, {}, 0, 1));
  float max_twist = 0, max_swing = 0;
  for (int step = 0; step < 600; ++step) {
    m.world().step();
    const JointPositions at = m.world().joint_positions(joint);
    max_twist = std::max(max_twist, at[3]), max_swing = std::max(max_swing, at[4]);
  }
  EXPECT_GT(max_swing, 1.3f);
  EXPECT_NEAR(max_twist, 1, 1e-4f);
}

}  // namespace
}  // namespace fathom::test::joint_machines_test
