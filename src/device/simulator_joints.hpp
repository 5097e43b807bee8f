// Joints of the device simulator: the application's changes go to the device with the next step.
#pragma once

#include <algorithm>

#include "device/device_simulator.hpp"

namespace fathom::device {

/// Both bodies wake, and their contacts are visited.
template <exec::Device D>
void DeviceSimulator<D>::note_joint(std::uint32_t slot) {
  joint_mirror_.note(slot);
  trees_are_stale_ = true;
  // Neighbouring couplings may have become, or ceased to be, alone.
  for (const std::uint32_t body : {joints[slot].a, joints[slot].b})
    for (const std::uint32_t other : joints.of(body))
      if (joints[other].def.type == JointType::coupling) joint_mirror_.note(other);
  for (const std::uint32_t body : {joints[slot].a, joints[slot].b}) {
    const std::uint32_t index = indices_.of(body), last = index < last_edit_.size() ? last_edit_[index] : none;
    // A body with many joints gets only one edit.
    if (last == none || edits_[last].kind != EditKind::joints) add_edit(edit_of(EditKind::joints, index, Velocity{}));
  }
}

/// Contacts are visited, as for a joint that keeps its bodies apart, or is removed.
template <exec::Device D>
void DeviceSimulator<D>::note_pair(std::uint32_t a, std::uint32_t b, bool apart) {
  joint_mirror_.note_pair(indices_.of(a), indices_.of(b), apart);
  for (const std::uint32_t body : {a, b}) add_edit(edit_of(EditKind::joints, indices_.of(body), Velocity{}));
}

template <exec::Device D>
void DeviceSimulator<D>::list_joint_edits(PendingStep& pending) {
  if (!joint_mirror_.has_notes()) return;
  pending.joint_edits = joint_mirror_.take_edits(joints, indices_, def.dt / static_cast<float>(def.solver.substeps),
                                                 def.solver.restitution_threshold);
  pending.generic_edits = joint_mirror_.take_generic_edits();
  pending.pair_notes = joint_mirror_.take_pair_notes();
  pending.apart_edits = joint_mirror_.take_apart_edits();
}

/// If the table of pairs grows, all of its slots are uploaded as edits.
template <exec::Device D>
void DeviceSimulator<D>::make_room_for_joints() {
  const std::size_t joints_needed = joints.slot_count(), old = joint_memory_.capacity();
  const std::size_t apart_slots = joint_mirror_.apart().size();
  const bool generic = joint_mirror_.had_generic();
  if (apart_slots == 0 || (joints_needed <= old && apart_slots == joint_memory_.apart_slots() &&
                           (!generic || joint_memory_.generic_capacity() == old)))
    return;
  retire_all();
  forget_graphs();
  joint_memory_.reserve(joints_needed > old ? std::max(joints_needed, old + old / 2) : old, apart_slots, generic);
}

template <exec::Device D>
void DeviceSimulator<D>::stage_joint_edits(PendingStep& pending) {
  StepBuffers& buffers = buffers_of(pending.number);
  stage(buffers.staged_joint_edits, buffers.joint_edits, pending.joint_edits, 0);
  stage(buffers.staged_generic_edits, buffers.generic_edits, pending.generic_edits, 0);
  stage(buffers.staged_apart_edits, buffers.apart_edits, pending.apart_edits, 0);
}

template <exec::Device D>
void DeviceSimulator<D>::upload_joint_edits(const PendingStep& pending) {
  upload_apart_edits(pending);
  if (pending.joint_edits.empty()) return;
  StepBuffers& buffers = buffers_of(pending.number);
  const JointArrays arrays = joint_memory_.arrays();
  const auto count = static_cast<std::uint32_t>(pending.joint_edits.size());
  device_.copy_to_device_aside(buffers.joint_edits.data(), buffers.staged_joint_edits.data(), count);
  device_.parallel_for(count,
                       ForgetJoints{body_memory_.arrays(), arrays, counters_.data(), buffers.joint_edits.data()});
  device_.parallel_for(count, TakeJoints{body_memory_.arrays(), arrays, counters_.data(), buffers.joint_edits.data()});
  if (!pending.generic_edits.empty()) {
    device_.copy_to_device_aside(buffers.generic_edits.data(), buffers.staged_generic_edits.data(),
                                 pending.generic_edits.size());
    device_.parallel_for(static_cast<std::uint32_t>(pending.generic_edits.size()),
                         TakeGenericJoints{arrays, counters_.data(), buffers.generic_edits.data()});
  }
}

template <exec::Device D>
void DeviceSimulator<D>::upload_apart_edits(const PendingStep& pending) {
  if (pending.apart_edits.empty()) return;
  StepBuffers& buffers = buffers_of(pending.number);
  device_.copy_to_device_aside(buffers.apart_edits.data(), buffers.staged_apart_edits.data(),
                               pending.apart_edits.size());
  device_.parallel_for(static_cast<std::uint32_t>(pending.apart_edits.size()),
                       EditApartTable{joint_memory_.apart_pairs(), counters_.data(), buffers.apart_edits.data()});
}

template <exec::Device D>
JointReaction DeviceSimulator<D>::joint_impulse(std::uint32_t slot) const {
  retire_all();
  if (newest_.step == 0 || !joint_mirror_.is_known(joints, slot)) return {};
  DeviceSimulator& s = self();
  if (!joints_are_current_) {
    const JointArrays arrays = s.joint_memory_.arrays();
    s.fetch(joints_read_, arrays.records, s.joint_memory_.capacity());
    s.fetch(generic_impulses_read_, arrays.generic_impulses, s.joint_memory_.generic_capacity());
    joints_are_current_ = true;
  }
  if (!joints_read_[slot].is_generic) return {joints_read_[slot].total, {}};
  return {generic_impulses_read_[slot].force, generic_impulses_read_[slot].torque};
}

}  // namespace fathom::device
