// Mechanisms of the device simulator: the host finds the trees of joints whenever joints change, and the next step
// uploads them.
#pragma once

#include <algorithm>

#include "device/device_simulator.hpp"
#include "device/tree_source.hpp"

namespace fathom::device {

/// Sequential impulses and cells use only sweeps, and so do worlds that ask for it.
template <exec::Device D>
bool DeviceSimulator<D>::solves_directly() const {
  return def.solver.method == Solver::soft && def.solver.direct_joints && def.partition == Partition::colours;
}

template <exec::Device D>
void DeviceSimulator<D>::list_mechanisms(PendingStep& pending) {
  if (!trees_are_stale_ || !solves_directly()) return;
  trees_.find(TreeSource(joints, bodies));
  trees_are_stale_ = false;
  if (trees_.mechanisms().empty() && mechanism_memory_.capacity() == 0) return;
  FoundMechanisms& found = pending.mechanisms;
  found.are_new = true;
  found.links = trees_.links();
  found.levels = trees_.levels();
  found.of_joint.assign(joints.slot_count(), none);
  for (const Mechanism& tree : trees_.mechanisms()) {
    MechanismRecord& record = found.records.emplace_back();
    record.tree = tree;
    for (std::uint32_t i = tree.first; i < tree.end; ++i) {
      MechanismLink& link = found.links[i];
      link.body = indices_.of(link.body);
      if (link.obstacle != none) link.obstacle = indices_.of(link.obstacle);
      if (link.joint == none) continue;
      found.of_joint[link.joint] = link.mechanism;
      if (trees_.direct()[link.joint] == JointTrees::driven) record.is_driven = 1;
    }
  }
}

template <exec::Device D>
void DeviceSimulator<D>::make_room_for_mechanisms() {
  const auto with_some_more = [](std::size_t n) { return n + n / 4; };
  MechanismMemory::Room room{trees_.mechanisms().size(), trees_.links().size(),   trees_.levels().size(),
                             trees_.generic(),           trees_.closure_floats(), joint_memory_.capacity()};
  // Once there is memory, steps ask it about every joint, even if there are no mechanisms any more.
  if (room.mechanisms == 0 && mechanism_memory_.capacity() == 0) return;
  if (!mechanism_memory_.has_room_for_bodies(body_memory_.capacity())) {
    retire_all();
    forget_graphs();
    mechanism_memory_.reserve_bodies(body_memory_.capacity());
  }
  if (mechanism_memory_.has_room_for(room)) return;
  retire_all();
  forget_graphs();
  for (std::size_t* part : {&room.mechanisms, &room.links, &room.levels, &room.generic, &room.closure_floats})
    *part = with_some_more(*part);
  mechanism_memory_.reserve(room);
}

template <exec::Device D>
void DeviceSimulator<D>::stage_mechanisms(PendingStep& pending) {
  FoundMechanisms& found = pending.mechanisms;
  if (!found.are_new) return;
  StepBuffers& buffers = buffers_of(pending.number);
  stage(buffers.staged_links, buffers.links, found.links, 0);
  stage(buffers.staged_mechanisms, buffers.mechanisms, found.records, 0);
  stage(buffers.staged_levels, buffers.levels, found.levels, 0);
  stage(buffers.staged_of_joint, buffers.of_joint, found.of_joint, 0);
}

template <exec::Device D>
void DeviceSimulator<D>::upload_mechanisms(const PendingStep& pending) {
  const FoundMechanisms& found = pending.mechanisms;
  if (!found.are_new) return;
  StepBuffers& buffers = buffers_of(pending.number);
  const auto copy = [&](auto& to, auto& from, std::size_t count) {
    if (count > 0) device_.copy_to_device_aside(to.data(), from.data(), count);
    return static_cast<std::uint32_t>(count);
  };
  MechanismTables tables{};
  tables.link_count = copy(buffers.links, buffers.staged_links, found.links.size());
  tables.count = copy(buffers.mechanisms, buffers.staged_mechanisms, found.records.size());
  tables.level_count = copy(buffers.levels, buffers.staged_levels, found.levels.size());
  tables.joint_count = copy(buffers.of_joint, buffers.staged_of_joint, found.of_joint.size());
  tables.links = buffers.links.data(), tables.records = buffers.mechanisms.data();
  tables.levels = buffers.levels.data(), tables.of_joint = buffers.of_joint.data();
  const MechanismArrays arrays = mechanism_memory_.arrays();
  const std::uint32_t most = std::max({tables.link_count, tables.level_count, arrays.joint_capacity, 1u});
  device_.parallel_for(most, TakeMechanisms{arrays, tables, counters_.data()});
}

}  // namespace fathom::device
