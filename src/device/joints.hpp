// Operations of steps and edits on joints, other than solving (device/solve.hpp).
#pragma once

#include "device/contact_arrays.hpp"
#include "device/joint_arrays.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// Calls `act` for each body that the joint can push: these reserve its colour and count it.
template <class Act>
FATHOM_HD void for_each_pushed(const JointRecord& joint, const Act& act) {
  act(joint.b);
  if (!joint.fixed_a) act(joint.a);
}

/// The first of two passes over a batch of edits, after ApplyEdits: removed joints release their colours. Does nothing
/// while the simulator is stopped: the batch is submitted again.
struct ForgetJoints {
  Bodies<body_colours> bodies;
  Joints<> joints;
  const Counters* counters;
  const JointEdit* edits;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped || !edits[k].is_new) return;
    const JointRecord old = joints.records[edits[k].slot];
    if (!old.in_use() || edits[k].slot >= counters->joints) return;
    for_each_pushed(old, [&](std::uint32_t i) {
      exec::atomic_add(bodies.touching[i], ~0u);
      if (old.colour == overflow_colour) return;
      // Only this joint has set the bit, so subtraction clears it.
      const std::uint64_t bit = std::uint64_t{1} << old.colour;
      exec::atomic_add(bodies.joint_colours[i], ~bit + 1);
      exec::atomic_add(bodies.colours[i], ~bit + 1);
    });
  }
};

/// The second pass: new joints reserve theirs. A contact with the same colour gives it up when it is visited
/// (`ContactChanges::meet_joints`).
struct TakeJoints {
  Bodies<body_colours> bodies;
  Joints<joint_records> joints;
  Counters* counters;
  const JointEdit* edits;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped) return;
    const JointEdit& edit = edits[k];
    JointRecord record = edit.record;
    const JointRecord& old = joints.records[edit.slot];
    if (!edit.is_new) record.impulse = old.impulse, record.total = old.total;
    joints.records[edit.slot] = record;
    exec::atomic_max(counters->joints, edit.slot + 1);
    exec::atomic_store(counters->layout_dirty, 1u);
    if (!edit.is_new || !record.in_use()) return;
    for_each_pushed(record, [&](std::uint32_t i) {
      exec::atomic_add(bodies.touching[i], 1u);
      if (record.colour == overflow_colour) return;
      const std::uint64_t bit = std::uint64_t{1} << record.colour;
      exec::atomic_or(bodies.joint_colours[i], bit);
      exec::atomic_or(bodies.colours[i], bit);
    });
  }
};

/// Adopts the definitions of generic joints.
struct TakeGenericJoints {
  Joints<joint_definitions, joint_impulses> joints;
  const Counters* counters;
  const GenericEdit* edits;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (counters->stopped) return;
    const GenericEdit& edit = edits[k];
    joints.generic[edit.slot] = edit.joint;
    GenericImpulse& impulse = joints.generic_impulses[edit.slot];
    if (edit.is_new) impulse = {};
    forget_what_ended(edit.joint, impulse);
  }
};

struct EditApartTable {
  std::uint64_t* pairs;
  const Counters* counters;
  const ApartEdit* edits;

  FATHOM_HD void operator()(std::uint32_t k) const {
    if (!counters->stopped) pairs[edits[k].slot] = edits[k].pair;
  }
};

/// Wakes a sleeping body together with what it is joined to, if only one of the bodies is awake, or if one that cannot
/// be pushed was moved.
struct WakeJoined {
  Bodies<body_islands> bodies;
  Joints<> joints;
  Counters* counters;

  FATHOM_HD void operator()(std::uint32_t slot) const {
    if (slot >= counters->joints || counters->live_bodies == 0) return;
    const JointRecord& joint = joints.records[slot];
    if (!joint.in_use()) return;
    if (joint.fixed_a ? bodies.fat[joint.a].changes & wake_partners : bodies.is_awake(joint.a)) wake(joint.b);
    if (!joint.fixed_a && bodies.is_awake(joint.b)) wake(joint.a);
  }

 private:
  FATHOM_HD void wake(std::uint32_t i) const {
    if (bodies.flags[i] & (awake_flag | isolated_flag)) return;
    exec::atomic_store(bodies.island_woken[bodies.island[i]], counters->step + 1);
    exec::atomic_store(counters->waking, counters->live_bodies);
  }
};

}  // namespace fathom::device
