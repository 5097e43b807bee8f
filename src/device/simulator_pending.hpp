// Steps in flight: how the device simulator detects their end, repairs those that ran out of room, and reports them.
#pragma once

#include <algorithm>

#include "device/device_simulator.hpp"

namespace fathom::device {

template <exec::Device D>
bool DeviceSimulator<D>::oldest_is_done() const {
  if (pending_steps_.empty()) return false;
  const std::uint64_t number = pending_steps_.front().number;
  return end_of(number).is_done() && buffers_of(number).copied.is_done();
}

template <exec::Device D>
void DeviceSimulator<D>::retire_oldest() {
  const Event& end = end_of(pending_steps_.front().number);
  end.wait();
  buffers_of(pending_steps_.front().number).copied.wait();
  const Report report = reports_[pending_steps_.front().number % max_pending_];
  if (report.stopped) return repair(report);
  if (def.ahead > 0)
    collect_events(pending_steps_.front().number, report);
  else
    clear_events();
  // The number of touching parts has to follow even if nobody reads events.
  const bool counts_parts = def.ahead == 0 && has_parts();
  if (counts_parts) collect_events(pending_steps_.front().number, report);
  indices_.forget_before(pending_steps_.front().number + (def.ahead > 0));
  hull_memory_.step_finished(pending_steps_.front().number);
  surface_memory_.step_finished(pending_steps_.front().number);
  newest_ = report;
  newest_published_ = published_memory_.reports[pending_steps_.front().number % max_pending_];
  const PendingStep& pending = pending_steps_.front();
  newest_interval_ = pending.was_idle || report.step == 1 ? end.milliseconds_since(buffers_of(pending.number).start)
                                                          : end.milliseconds_since(end_of(report.step - 1));
  newest_traffic_ = pending.traffic;
  // Buffers that added most of the bodies will hardly be needed again.
  StepBuffers& buffers = buffers_of(pending.number);
  if (4 * buffers.data.size() > body_memory_.capacity()) {
    buffers.data = exec::Buffer<BodyData>(device_);
    buffers.staged_data = exec::PinnedBuffer<BodyData>(device_, 0);
  }
  pending_steps_.pop_front();
  if (report.overrun)
    throw Error(ErrorCode::capacity,
                "step " + std::to_string(report.step) +
                    ": the device's solver had more phases or items than it was launched for; "
                    "this is an error of the simulator, and the step's contacts are not all solved");
  profile_is_current_ = false;
  events_are_current_ = counts_parts;
  joints_are_current_ = false;
  if (def.ahead > 0) bodies_are_current_ = false;
  outdate_queries();
  const std::size_t in_use = newest_.contacts - newest_.free_contacts;
  if (10 * in_use > 8 * contact_memory_.capacity()) wanted_contacts_ = 2 * contact_memory_.capacity();
  if (10 * std::size_t{newest_.manifolds} > 8 * contact_memory_.manifold_capacity())
    wanted_manifolds_ = 2 * contact_memory_.manifold_capacity();
}

template <exec::Device D>
void DeviceSimulator<D>::retire_all() const {
  while (!is_asking_ && !pending_steps_.empty()) self().retire_oldest();
}

/// Makes room for a step that ran out of it; failed bodies are already isolated. Then resubmits the step, or what
/// remains of it, and all later steps. The first one's edits have already been applied, those of the others were
/// skipped.
template <exec::Device D>
void DeviceSimulator<D>::repair(const Report& report) {
  device_.wait();
  if (report.stopped != body_failed) make_room_for(report);
  const bool begins_anew = report.stopped == no_room_for_pairs;
  if (begins_anew) device_.parallel_for(1, GoOn{counters_.data()});
  bool first = true;
  for (PendingStep& pending : pending_steps_) {
    submit(pending, !first, first && !begins_anew ? static_cast<Stop>(report.stopped) : no_stop);
    first = false;
  }
}

template <exec::Device D>
void DeviceSimulator<D>::make_room_for(const Report& report) {
  forget_graphs();
  const bool resumes = report.stopped == no_room_for_manifolds;
  // With only a quarter more it would be 80 % full at once.
  const auto room_for = [](std::size_t needed) { return needed + 13 * needed / 50; };
  contact_memory_.reserve(resumes ? 0 : room_for(std::size_t{report.contacts} + report.found),
                          resumes ? room_for(report.manifolds) : 0, joint_memory_.capacity(), event_lists(),
                          may_bounce_, any_extras_);
  // In multiples of eight, or they would grow with every single overlap.
  const std::uint32_t overlaps = published_memory_.reports[pending_steps_.front().number % max_pending_].max_overlaps;
  wanted_slots_ = std::max(wanted_slots_, (overlaps + 7) / 8 * 8);
  published_memory_.reserve(published_settings(), published_room());
  record();
}

template <exec::Device D>
void DeviceSimulator<D>::synchronise() const {
  retire_all();
}

template <exec::Device D>
void DeviceSimulator<D>::look() const {
  if (def.ahead == 0)
    retire_all();
  else
    while (!is_asking_ && oldest_is_done()) self().retire_oldest();
}

template <exec::Device D>
const Profile& DeviceSimulator<D>::current_profile() const {
  look();
  if (!profile_is_current_) self().make_profile();
  return profile;
}

template <exec::Device D>
void DeviceSimulator<D>::make_profile() {
  profile_is_current_ = true;
  profile = {};
  profile.step = newest_.step;
  if (newest_.step == 0) return;
  profile.interval = newest_interval_;
  const StepBuffers& buffers = buffers_of(newest_.step);
  const StageMarks<D>& m = buffers.marks;
  profile.times = {m.pairs.milliseconds_since(m.begin), m.manifolds.milliseconds_since(m.pairs),
                   m.built.milliseconds_since(m.manifolds), m.solved.milliseconds_since(m.built),
                   m.end.milliseconds_since(m.solved)};
  StepCounts& c = profile.counts;
  c.bodies = bodies.count();
  c.active = def.sleep.enabled ? newest_.active : movable_;
  c.pairs = newest_.contacts - newest_.free_contacts - newest_.patches;
  c.manifolds = newest_.constraints - newest_.solved_joints;
  c.points = newest_.points;
  c.colours = newest_.colours;
  c.overflow = newest_.overflow;
  if (def.partition == Partition::cells) {
    c.colours = newest_published_.batches;
    c.overflow = 0;
    c.unbatched = newest_published_.unbatched;
    c.work_groups = newest_published_.work_groups;
  }
  c.overlaps = newest_published_.max_overlaps;
  c.islands = newest_.islands;
  c.recycled = newest_.recycled;
  c.quarantined = newest_.quarantined;
  c.launches = newest_traffic_.launches;
  c.bytes_to_device = newest_traffic_.bytes_to_device;
  c.bytes_to_host = newest_traffic_.bytes_to_host;
  c.memory_bytes = device_.bytes_in_use();
}

}  // namespace fathom::device
