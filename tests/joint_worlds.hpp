// Worlds with joints, for tests that apply to every simulator that has them.
#pragma once

#include <gtest/gtest.h>

#include <fathom/joint.hpp>
#include <ostream>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::test {

struct JointWorlds {
  const char* name;
  SimulatorKind simulator;

  WorldDef quiet(int threads = 1) const {
    WorldDef def;
    def.simulator = simulator;
    def.device = test_device();
    def.threads = threads;
    def.sleep.enabled = false;
    return def;
  }
  WorldDef sleepy(int threads = 1) const {
    WorldDef def = quiet(threads);
    def.sleep.enabled = true;
    return def;
  }
  friend std::ostream& operator<<(std::ostream& out, const JointWorlds& worlds) { return out << worlds.name; }
};

inline constexpr JointWorlds joint_worlds[] = {
    {"native", SimulatorKind::native}, {"device", SimulatorKind::device}, {"hybrid", SimulatorKind::hybrid}};

class OfJointWorlds : public testing::TestWithParam<JointWorlds> {};

inline const auto joint_world_name = [](const testing::TestParamInfo<JointWorlds>& info) {
  return std::string(info.param.name);
};

/// A fixed body of negligible size to hang things from.
inline BodyId add_anchor(World& world, Vec3 position, MotionType motion = MotionType::fixed) {
  BodyDef def;
  def.motion = motion;
  def.shape = sphere(0.01f);
  def.pose.position = position;
  return world.add(def);
}

/// Capsule links along `direction`, joined end to end.
struct Chain {
  static constexpr float length = 0.5f;
  std::vector<BodyId> links;
  std::vector<JointId> joints;

  /// Hangs from the centre of `top`, if that is a body.
  Chain(World& world, BodyId top, Vec3 from, Vec3 direction, int count, float mass = 1) {
    const Vec3 axis{0, 0, 1}, turn = cross(axis, direction);
    Quat q = normalize(Quat{1 + dot(axis, direction), turn.x, turn.y, turn.z});
    if (!(dot(axis, direction) > -0.999f)) q = {0, 1, 0, 0};
    for (int i = 0; i < count; ++i) {
      BodyDef def = dynamic(capsule(0.2f, 0.04f), from + (0.5f + static_cast<float>(i)) * length * direction, mass);
      def.pose.rotation = q;
      links.push_back(world.add(def));
      const BodyId before = i > 0 ? links[links.size() - 2] : top;
      if (before == BodyId{}) continue;
      const Vec3 on_before = i > 0 ? Vec3{0, 0, 0.5f * length} : Vec3{};
      joints.push_back(world.add_joint(ball_joint(before, links.back(), on_before, {0, 0, -0.5f * length})));
    }
  }
};

/// J, of all bodies: kinetic, plus potential above height 0.
inline float energy(const World& world) {
  float sum = 0;
  for (const BodyId id : world.bodies())
    if (world.motion(id) == MotionType::dynamic)
      sum += kinetic_energy(world, id) + 9.81f * world.mass(id) * world.pose(id).position.z;
  return sum;
}

/// Distance between a joint's anchors (m).
inline float gap_of(const World& world, JointId id) {
  const JointDef& def = world.joint(id);
  return length(transform(world.pose(def.a), def.frame_a.position) -
                transform(world.pose(def.b), def.frame_b.position));
}
inline float widest_gap(const World& world) {
  float widest = 0;
  for (const JointId id : world.joints()) widest = std::max(widest, gap_of(world, id));
  return widest;
}

}  // namespace fathom::test
