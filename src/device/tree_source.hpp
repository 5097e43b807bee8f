// Source from which the device simulator's host finds trees of joints (world/joint_trees.hpp), by slot.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/generic_joint.hpp"
#include "world/body_table.hpp"
#include "world/joint_table.hpp"
#include "world/joint_trees.hpp"

namespace fathom::device {

class TreeSource {
 public:
  TreeSource(const JointTable& joints, const BodyTable& bodies) : joints_(joints), bodies_(bodies) {
    generic_.resize(joints.slot_count());
    for (const JointId id : joints.living()) {
      const JointInfo& info = joints[id.index];
      if (is_generic(id.index))
        generic_[id.index] = make_generic_joint(info.def, {info.swapped, false, info.masses}, 1, 0);
    }
  }

  std::uint32_t bodies() const { return bodies_.slot_count(); }
  std::uint32_t joints() const { return joints_.slot_count(); }
  /// Joints that only drive are left to sweeps.
  bool is_candidate(std::uint32_t slot) const {
    if (!joints_.alive(slot) || is_coupling(slot)) return false;
    if (!is_generic(slot)) return !is_soft(slot);
    return is_soft(slot) ? generic_[slot].distance == 0 : generic_[slot].holds();
  }
  bool is_soft(std::uint32_t slot) const { return joints_[slot].def.hertz > 0; }
  std::uint32_t a(std::uint32_t slot) const { return joints_[slot].a; }
  std::uint32_t b(std::uint32_t slot) const { return joints_[slot].b; }
  bool is_generic(std::uint32_t slot) const { return joints_[slot].def.type != JointType::ball; }
  bool is_driven(std::uint32_t slot) const { return is_generic(slot) && generic_[slot].is_driven(); }
  bool is_stiff(std::uint32_t slot) const { return is_generic(slot) && generic_[slot].is_stiff(); }
  bool is_weld(std::uint32_t slot) const { return is_generic(slot) && generic_[slot].is_weld(); }
  bool is_obstacle(std::uint32_t body) const { return bodies_[body].motion != MotionType::dynamic; }
  float inverse_mass(std::uint32_t body) const { return bodies_[body].inverse_mass; }
  bool may_collide(std::uint32_t body) const { return fathom::may_collide(bodies_[body]); }
  /// A coupling's row and a direct solution of the bodies it pushes would work against each other.
  bool accepts(std::span<const MechanismLink> tree) const {
    return std::ranges::none_of(tree, [this](const MechanismLink& link) {
      return std::ranges::any_of(joints_.of(link.body), [this](std::uint32_t slot) { return is_coupling(slot); });
    });
  }

 private:
  bool is_coupling(std::uint32_t slot) const { return joints_[slot].def.type == JointType::coupling; }

  const JointTable& joints_;
  const BodyTable& bodies_;
  std::vector<GenericJoint> generic_;  // by slot
};

}  // namespace fathom::device
