// Breaks joints after each step, in slot order.
#include <cmath>

#include "world/simulator.hpp"

namespace fathom {

// A coupling's reactions on its two bodies are not opposite; simulators report the one on the definition's B.
JointReaction Simulator::reaction(std::uint32_t slot) const {
  const JointInfo& info = joints[slot];
  const float rate = info.swapped && info.def.type != JointType::coupling ? -1 / def.dt : 1 / def.dt;
  const JointReaction impulse = joint_impulse(slot);
  return {rate * impulse.force, rate * impulse.torque};
}

/// In double precision, where squares do not overflow.
static bool exceeds(Vec3 v, float most) {
  const double x = static_cast<double>(v.x), y = static_cast<double>(v.y), z = static_cast<double>(v.z);
  return std::sqrt(x * x + y * y + z * z) > static_cast<double>(most);
}

// Finds all joints to break, then removes them: removing one does not change another's reaction.
void Simulator::break_joints() {
  collects_events() ? broken.begin_step() : broken.clear();
  if (joints.breakable_count() == 0) return;
  synchronise();
  std::vector<JointBreak> breaks;
  for (const JointId id : joints.living()) {
    const JointDef& joint = joints[id.index].def;
    if (!joint.can_break()) continue;
    const JointReaction r = reaction(id.index);
    if (exceeds(r.force, joint.break_force) || exceeds(r.torque, joint.break_torque))
      breaks.push_back({id, joint.a, joint.b, r.force, r.torque, joint.user_data, steps});
  }
  for (const JointBreak& b : breaks) {
    joint_removed(b.joint.index);
    joints.remove(b.joint.index);
  }
  broken.add(breaks);
}

}  // namespace fathom
