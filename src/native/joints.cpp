// How the native simulator handles joints that the application adds, removes or changes.
#include <algorithm>

#include "dynamics/generic_joint.hpp"
#include "native/native_simulator.hpp"

namespace fathom::native {

static ConstraintKind kind_of(JointType type) {
  if (type == JointType::ball) return ConstraintKind::ball_joint;
  return type == JointType::coupling ? ConstraintKind::coupling : ConstraintKind::generic_joint;
}

/// The joint, still without a colour.
static Joint joint_of(const JointInfo& info, float h) {
  const JointDef& def = info.def;
  return {info.a,
          info.b,
          info.anchor_a,
          info.anchor_b,
          joint_softness(def.hertz, def.damping_ratio, info.masses[0], h),
          max_impulse(def.hertz, def.max_force, h),
          max_start(info.swing_rate, h),
          no_colour,
          info.fixed_a,
          true,
          def.hertz == 0,
          kind_of(def.type)};
}

void NativeSimulator::define_joint(std::uint32_t slot, std::uint32_t ignoring) {
  const JointInfo& info = joints[slot];
  if (info.def.type == JointType::ball) return;
  graph_.define_joint(
      slot, make_generic_joint(info.def, {info.swapped, joints.is_alone(slot, ignoring), info.masses},
                               def.dt / static_cast<float>(def.solver.substeps), def.solver.restitution_threshold));
}

void NativeSimulator::define_couplings_beside(std::uint32_t joint, std::uint32_t ignoring) {
  for (const std::uint32_t body : {joints[joint].a, joints[joint].b})
    for (const std::uint32_t other : joints.of(body))
      if (other != joint && joints[other].def.type == JointType::coupling) define_joint(other, ignoring);
}

void NativeSimulator::wake_joined(std::uint32_t joint) {
  for (const std::uint32_t slot : {joints[joint].a, joints[joint].b}) wake_island(slot);
}

void NativeSimulator::joint_added(std::uint32_t slot) {
  const JointInfo& info = joints[slot];
  graph_.add_joint(slot, joint_of(info, def.dt / static_cast<float>(def.solver.substeps)));
  define_joint(slot);
  define_couplings_beside(slot);
  wake_joined(slot);
  if (graph_.joint(slot).colour == no_colour) graph_.colour_joint(slot);
  for (const std::uint32_t body : {info.a, info.b}) state_.flags[body] |= jointed;
  active_.outdate_in_contact();
  if (info.def.collide_connected) return;
  keep_apart(info.a, info.b);
}

/// `b`, which has fewer contacts, is dynamic, unless neither is.
void NativeSimulator::keep_apart(std::uint32_t a, std::uint32_t b) {
  graph_.for_each_of(b, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    if (c.a == a || c.b == a) drop_contact(index, ended_by_removal_);
  });
  graph_.keep_apart(a, b);
}

void NativeSimulator::keep_apart_no_more(std::uint32_t a, std::uint32_t b) {
  graph_.keep_apart_no_more(a, b);
  state_.flags[b] |= box_changed;  // makes it find the pair again
}

void NativeSimulator::pair_excluded(std::uint32_t a, std::uint32_t b) {
  wake_island(a), wake_island(b);
  bodies[b].motion == MotionType::dynamic ? keep_apart(a, b) : keep_apart(b, a);
}

void NativeSimulator::pair_included(std::uint32_t a, std::uint32_t b) {
  wake_island(a), wake_island(b);
  if (joints.keeps_apart(a, b)) return;
  bodies[b].motion == MotionType::dynamic ? keep_apart_no_more(a, b) : keep_apart_no_more(b, a);
}

void NativeSimulator::joint_removed(std::uint32_t slot) {
  const JointInfo& info = joints[slot];
  wake_joined(slot);
  graph_.remove_joint(slot);
  define_couplings_beside(slot, slot);
  active_.outdate_in_contact();
  for (const std::uint32_t body : {info.a, info.b})
    if (joints.of(body).size() == 1) state_.flags[body] &= static_cast<std::uint8_t>(~jointed);
  const bool others_do = std::ranges::any_of(joints.of(info.b), [&](std::uint32_t other) {
    const JointInfo& joint = joints[other];
    return other != slot && !joint.def.collide_connected && (joint.a == info.a || joint.b == info.a);
  });
  if (info.def.collide_connected || others_do || excluded.contains(info.a, info.b)) return;
  keep_apart_no_more(info.a, info.b);
}

void NativeSimulator::joint_changed(std::uint32_t slot) {
  graph_.change_joint(slot, joint_of(joints[slot], def.dt / static_cast<float>(def.solver.substeps)));
  define_joint(slot);
  wake_joined(slot);
}

JointReaction NativeSimulator::joint_impulse(std::uint32_t slot) const {
  if (joints[slot].def.type == JointType::ball) return {graph_.joint_impulse(slot).total, {}};
  const GenericImpulse& impulse = graph_.generic_impulse(slot);
  return {impulse.force, impulse.torque};
}

void NativeSimulator::restore_joints(ByteReader& in) {
  for (const JointId id : joints.living()) {
    const JointInfo& info = joints[id.index];
    in.require(id.index < graph_.joint_slots());
    const Joint& joint = graph_.joint(id.index);
    in.require(joint.in_use && joint.a == info.a && joint.b == info.b && joint.fixed_a == info.fixed_a &&
               joint.kind == kind_of(info.def.type));
    define_joint(id.index);
    if (!info.def.collide_connected) graph_.keep_apart(info.a, info.b);
  }
  excluded.for_each([&](std::uint32_t a, std::uint32_t b) { graph_.keep_apart(a, b); });
  std::size_t in_use = 0;
  for (std::uint32_t slot = 0; slot < graph_.joint_slots(); ++slot) in_use += graph_.joint(slot).in_use;
  in.require(in_use == joints.count());
}

}  // namespace fathom::native
