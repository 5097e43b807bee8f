// Joints of the graph. They are coloured one by one, because an application makes and removes few per step. They are
// listed in slot order, because their order within a colour must not depend on when bodies fell asleep.
#include <algorithm>

#include "native/contact_graph.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

/// Whether mechanisms and their lanes can go on with `b` in place of `a`: what they read of it is the same.
bool is_alike(const GenericJoint& a, const GenericJoint& b) {
  for (int i = 0; i < axis_count; ++i) {
    const GenericAxis<float>&x = a.axes[i], &y = b.axes[i];
    if (x.locked != y.locked || x.limited != y.limited || (x.most > 0) != (y.most > 0) ||
        (x.armature > 0) != (y.armature > 0))
      return false;
  }
  return a.distance == b.distance && a.cone == b.cone && a.moves == b.moves && a.reacts == b.reacts;
}

}  // namespace

void ContactGraph::add_joint(std::uint32_t slot, const Joint& joint) {
  if (slot >= joints_.size()) {
    grow_to(joints_, slot + 1);
    grow_to(joint_impulses_, slot + 1);
  }
  joints_[slot] = joint;
  forget_joint_impulse(slot);
}

void ContactGraph::define_joint(std::uint32_t slot, const GenericJoint& joint) {
  if (slot >= generic_joints_.size()) grow_to(generic_joints_, slot + 1);
  if (slot >= generic_impulses_.size()) grow_to(generic_impulses_, slot + 1);
  if (!is_alike(generic_joints_[slot], joint)) ++joint_definitions_;
  generic_joints_[slot] = joint;
  forget_what_ended(joint, generic_impulses_[slot]);
}

void ContactGraph::remove_joint(std::uint32_t slot) {
  if (joints_[slot].colour != no_colour) uncolour_joint(slot);
  joints_[slot] = {};
  forget_joint_impulse(slot);
}

std::vector<std::uint32_t>& ContactGraph::joint_list(const Joint& joint) {
  const std::size_t lists = joint_list_number(ConstraintKind::ball_joint, domains_.units(), 0);
  if (joint_lists_.size() < lists) joint_lists_.resize(lists);
  return joint_lists_[joint_list_number(joint.kind, domains_.unit(joint.a, joint.b, joint.fixed_a), joint.colour)];
}

void ContactGraph::colour_joint(std::uint32_t slot) {
  Joint& joint = joints_[slot];
  joint.colour = take_colour(joint.a, joint.b, joint.fixed_a);
  std::vector<std::uint32_t>& list = joint_list(joint);
  list.insert(std::lower_bound(list.begin(), list.end(), slot), slot);
  ++joint_counts_[joint.colour][kind_index(joint.kind)];
  between_ += !joint.fixed_a;
  ++colouring_;
}

void ContactGraph::uncolour_joint(std::uint32_t slot) {
  Joint& joint = joints_[slot];
  give_back_colour(joint.a, joint.b, joint.fixed_a, joint.colour);
  std::vector<std::uint32_t>& list = joint_list(joint);
  list.erase(std::lower_bound(list.begin(), list.end(), slot));
  --joint_counts_[joint.colour][kind_index(joint.kind)];
  between_ -= !joint.fixed_a;
  joint.colour = no_colour;
  ++colouring_;
}

void ContactGraph::list_joints() {
  for (std::vector<std::uint32_t>& list : joint_lists_) list.clear();
  for (std::uint32_t slot = 0; slot < joints_.size(); ++slot)
    if (joints_[slot].in_use && joints_[slot].colour != no_colour) joint_list(joints_[slot]).push_back(slot);
}

}  // namespace fathom::native
