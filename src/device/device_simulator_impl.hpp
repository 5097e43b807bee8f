// Implementation of DeviceSimulator; included by the one source file of each back end that instantiates it. This file
// constructs it and submits steps; the other subjects are included at the end, but for queries: they have sources of
// their own (simulator_queries.hpp), as their kernels would change what g++ inlines into those of steps.
#pragma once

#include <algorithm>

#include "device/device_simulator.hpp"
#include "device/tuning.hpp"
#include "geometry/morton_order.hpp"

namespace fathom::device {

template <exec::Device D>
template <class... Arguments>
DeviceSimulator<D>::DeviceSimulator(const WorldDef& definition, Arguments&&... device_arguments)
    : Simulator(definition),
      device_(std::forward<Arguments>(device_arguments)...),
      max_pending_(static_cast<std::size_t>(std::max(definition.ahead + 1, min_in_flight))),
      body_memory_(device_),
      contact_memory_(device_),
      joint_memory_(device_),
      mechanism_memory_(device_),
      results_(device_),
      grid_memory_(device_),
      published_memory_(device_, max_pending_),
      hull_memory_(device_),
      surface_memory_(device_),
      counters_(device_, 1),
      reports_(device_, max_pending_),
      gravity_change_{definition.gravity, true, false},
      poses_(device_, 0),
      velocities_(device_, 0),
      flags_(device_, 0),
      query_memory_(device_),
      contacts_read_(device_, 0),
      manifolds_read_(device_, 0),
      joints_read_(device_, 0),
      generic_impulses_read_(device_, 0) {
  const exec::PinnedBuffer<Counters> initial(device_, 1);
  device_.copy_to_device(counters_.data(), initial.data(), 1);
  device_.wait();
  for (std::size_t i = 0; i < max_pending_; ++i) step_buffers_.push_back(std::make_unique<StepBuffers>(device_));
  for (std::size_t i = 0; i <= max_pending_; ++i) ends_.push_back(std::make_unique<Event>(device_));
}

template <exec::Device D>
DeviceSimulator<D>::~DeviceSimulator() {
  try {
    device_.wait();
  } catch (const std::exception&) {
    // A lost device has nothing left to wait for.
  }
}

template <exec::Device D>
void DeviceSimulator<D>::step() {
  while (pending_steps_.size() >= max_pending_) retire_oldest();
  if (asks()) {
    retire_all();
    fetch_bodies();
  }
  if (submitted_ == 0) order_in_space();
  PendingStep next;
  list_joint_edits(next);
  list_mechanisms(next);
  try {
    make_room();
  } catch (...) {
    trees_are_stale_ = true;
    joint_mirror_.take_back(next.joint_edits, next.pair_notes, next.apart_edits);
    throw;
  }
  if (!step_buffers_.front()->graph) record();
  PendingStep& pending = pending_steps_.emplace_back(std::move(next));
  pending.number = ++submitted_;
  pending.indices = indices_.size();
  pending.slots = bodies.slot_count();
  pending.gravity = std::exchange(gravity_change_, {});
  pending.edits = std::move(edits_);
  pending.data = std::move(data_);
  pending.uploaded = std::exchange(uploaded_, 0);
  pending.set_changed = std::exchange(set_changed_, false);
  uploads_ahead_ = true;
  edits_.clear();
  data_.clear();
  for (const Edit& e : pending.edits) last_edit_[e.index] = none;
  try {
    submit(pending, true);
    events_are_read_ = false;
  } catch (...) {
    // Nothing of the step has run: restore the state from before the request.
    gravity_change_ = pending.gravity;
    edits_ = std::move(pending.edits);
    data_ = std::move(pending.data);
    list_last_edits();
    uploads_ahead_ = false;
    set_changed_ = pending.set_changed;
    trees_are_stale_ = true;
    joint_mirror_.take_back(pending.joint_edits, pending.pair_notes, pending.apart_edits);
    pending_steps_.pop_back();
    --submitted_;
    throw;
  }
  ++steps;
  bodies_are_current_ = bodies_are_current_ && copies_results();
  outdate_queries();
  events_are_current_ = events_are_current_ && def.ahead > 0;
  begun_.begin_step(), ended_.begin_step(), hits_.begin_step(), quarantined_.begin_step();
  if (asks()) retire_all();
  while (def.ahead > 0 && (pending_steps_.size() > static_cast<std::size_t>(def.ahead) || oldest_is_done()))
    retire_oldest();
}

/// Grows buffers for whatever was added, after waiting for the steps in flight. Graphs contain addresses, so they are
/// dropped before a buffer is replaced: if memory runs out halfway, the next call continues from there.
template <exec::Device D>
void DeviceSimulator<D>::make_room() {
  const std::size_t bodies_needed = std::max(
      {std::size_t{indices_.size()}, static_cast<std::size_t>(bodies.slot_count()), wanted_bodies_, first_bodies});
  const std::size_t contacts_needed = std::max({wanted_contacts_, bodies_needed + bodies_needed / 4, first_contacts});
  const std::size_t manifolds_needed = std::max({wanted_manifolds_, bodies_needed + bodies_needed / 4, first_contacts});
  if (bodies_needed > std::min(body_memory_.capacity(), grid_memory_.capacity())) {
    retire_all();
    forget_graphs();
    const std::size_t old = body_memory_.capacity();
    const std::size_t target = old == 0 ? bodies_needed : std::max(bodies_needed, old + old / 2);
    body_memory_.reserve(target);
    grid_memory_.reserve(target);
    bodies_are_current_ = false;
    // All boxes move to the larger grid.
    choose_grid();
  }
  make_room_for_joints();
  make_room_for_mechanisms();
  if (contacts_needed > contact_memory_.capacity() || manifolds_needed > contact_memory_.manifold_capacity() ||
      joint_memory_.capacity() > contact_memory_.joint_capacity() || may_bounce_ != contact_memory_.may_bounce() ||
      any_extras_ != contact_memory_.any_extras()) {
    retire_all();
    forget_graphs();
    contact_memory_.reserve(contacts_needed, manifolds_needed, joint_memory_.capacity(), event_lists(), may_bounce_,
                            any_extras_);
  }
  if (shapes_ != recorded_shapes_) {
    retire_all();
    forget_graphs();
    if (shapes_ & bullets_bit) {
      body_memory_.reserve_for_bullets();
      contact_memory_.reserve_for_bullets();
    }
    if (shapes_ & seams_bit) {
      body_memory_.reserve_for_seams();
      contact_memory_.reserve_for_seams();
    }
    if (shapes_ & questions_bit) contact_memory_.reserve_for_questions();
    if (shapes_ & traits_bit) body_memory_.reserve_for_traits();
    if (has_compounds()) body_memory_.reserve_for_compounds();
    if (has_surfaces())
      contact_memory_.reserve_for_surfaces(device_.info().backend == exec::Backend::host ? surface_teams_of_host
                                                                                         : surface_teams_of_gpu);
  }
  const std::size_t old_list = published_memory_.order.size();
  if (published_memory_.needs(published_settings(), published_room())) {
    retire_all();
    forget_graphs();
    published_memory_.reserve(published_settings(), published_room());
    set_changed_ = set_changed_ || published_memory_.order.size() != old_list;
  }
  upload_shapes();
}

/// Brings hulls and surfaces on the device up to date, as `make_room` does with everything else.
template <exec::Device D>
void DeviceSimulator<D>::upload_shapes() {
  if (!hull_memory_.is_current()) {
    if (hull_memory_.must_grow()) {
      retire_all();
      forget_graphs();
    }
    hull_memory_.upload(device_);
    body_memory_.hulls = hull_memory_.arrays();
  }
  if (!surface_memory_.is_current()) {
    if (surface_memory_.must_grow()) {
      retire_all();
      forget_graphs();
    }
    surface_memory_.upload(device_);
    body_memory_.surfaces = surface_memory_.views();
  }
}

/// Cells as large as the fat box of a typical body that turns but does not fly.
template <exec::Device D>
void DeviceSimulator<D>::choose_grid() {
  if (grid_base_ > 0) return;  // boxes store their level, which must not change
  std::vector<float> radii;
  for (const BodyId id : bodies.living()) {
    const BodyInfo& info = bodies[id.index];
    if (info.motion != MotionType::dynamic) continue;
    if (!info.geometry.is_compound()) radii.push_back(info.radius);
    for (std::uint32_t k = 0; k < children_of(id.index); ++k) radii.push_back(native::piece_of(info, k).radius);
  }
  float typical = 1;
  if (!radii.empty()) {
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    typical = *middle;
  }
  grid_base_ = grid_base(typical);
}

template <exec::Device D>
Step<D> DeviceSimulator<D>::step_of(StepBuffers& buffers) {
  const SolverSettings& s = def.solver;
  StepSettings settings;
  settings.dt = def.dt;
  settings.grid_base = grid_base_;
  settings.restitution_threshold = s.restitution_threshold;
  settings.sag = contact_sag(def);
  settings.solve = solve_parameters(def);
  settings.move = {def.dt,
                   static_cast<std::uint32_t>(s.substeps),
                   settings.solve.limits,
                   def.sleep.enabled,
                   def.sleep.linear_speed,
                   joint_memory_.capacity() > 0};
  settings.sleep_time = def.sleep.time;
  settings.bounces = contact_memory_.may_bounce();
  settings.shapes = shapes_;
  settings.published = published_settings();
  return Step<D>(device_, body_memory_, contact_memory_, joint_memory_, mechanism_memory_, grid_memory_,
                 published_memory_, counters_.data(), reports_.data(), static_cast<std::uint32_t>(reports_.size()),
                 settings, &buffers.marks);
}

template <exec::Device D>
void DeviceSimulator<D>::record() {
  recorded_shapes_ = shapes_;
  for (const auto& buffers : step_buffers_) {
    Step<D> step = step_of(*buffers);
    buffers->graph.emplace(device_.record([&] { step.submit(false); }));
    if (published_settings().sweep) buffers->set_changed_graph.emplace(device_.record([&] { step.submit(true); }));
  }
}

template <exec::Device D>
void DeviceSimulator<D>::forget_graphs() {
  for (const auto& buffers : step_buffers_)
    for (auto* graph : {&buffers->graph, &buffers->set_changed_graph, &buffers->repeat_graph, &buffers->pairs_graphs[0],
                        &buffers->pairs_graphs[1], &buffers->manifolds_graph, &buffers->bodies_graph})
      graph->reset();
}

template <exec::Device D>
PublishedSettings DeviceSimulator<D>::published_settings() const {
  return {.sweep = def.broad_phase == fathom::BroadPhase::sweep,
          .cells = def.partition == Partition::cells,
          .axis = def.sweep_axis,
          .wide_length = wide_bodies * grid_base_,
          .rounds = static_cast<std::uint32_t>(def.solver.marking_rounds)};
}

template <exec::Device D>
PublishedRoom DeviceSimulator<D>::published_room() const {
  return {body_memory_.capacity(), contact_memory_.capacity(), contact_memory_.manifold_capacity(), wanted_slots_};
}

/// Orders the bodies added before the first step along a space-filling curve. Children follow all bodies, in the order
/// of their compounds.
template <exec::Device D>
void DeviceSimulator<D>::order_in_space() {
  std::vector<ChildRange> ranges = indices_.unused_children();
  std::vector<bool> is_child(indices_.size());
  const auto mark = [&](const ChildRange& range) { std::fill_n(is_child.begin() + range.first, range.count, true); };
  for (const ChildRange& range : ranges) mark(range);
  for (const BodyId id : bodies.living())
    if (const std::uint32_t count = reserved_indices(id.index)) mark({0, indices_.first_child(id.index), count});

  std::vector<Vec3> positions;
  std::vector<std::uint32_t> rank(indices_.size()), heads;  // those without children: by index, and all
  for (std::uint32_t i = 0; i < indices_.size(); ++i)
    if (!is_child[i]) rank[i] = static_cast<std::uint32_t>(heads.size()), heads.push_back(i);
  positions.resize(heads.size());
  for (const Edit& e : edits_) {
    if (is_child[e.index]) continue;
    if (e.kind == EditKind::add)
      positions[rank[e.index]] = data_[e.data].pose.position;
    else if (e.kind == EditKind::set_pose)
      positions[rank[e.index]] = e.linear;
  }
  std::vector<std::uint32_t> new_of(indices_.size());
  std::uint32_t next = 0;
  std::vector<ChildRange> living;
  for (const std::uint32_t k : morton_order(positions)) {
    const std::uint32_t index = heads[k], slot = indices_.slot(index);
    new_of[index] = next++;
    if (const std::uint32_t count = slot != none ? reserved_indices(slot) : 0)
      living.push_back({0, indices_.first_child(slot), count});
  }
  ranges.insert(ranges.begin(), living.begin(), living.end());
  for (const ChildRange& range : ranges)
    for (std::uint32_t k = 0; k < range.count; ++k) new_of[range.first + k] = next++;
  indices_.reorder(new_of);
  for (Edit& e : edits_) e.index = new_of[e.index];
  for (BodyData& data : data_)
    if (data.constants.link != none) data.constants.link = new_of[data.constants.link];
  joint_mirror_.reorder(new_of);
  list_last_edits();
}

template <exec::Device D>
void DeviceSimulator<D>::submit(PendingStep& pending, bool with_edits, Stop after) {
  StepBuffers& buffers = buffers_of(pending.number);
  if (with_edits) stage_edits(pending);
  if (with_edits) stage_joint_edits(pending);
  if (with_edits) stage_mechanisms(pending);
  if (copies_results()) reserve_results(pending);
  const bool brings_events = def.ahead > 0 || events_are_read_ || has_parts();
  if (brings_events) reserve_events(buffers, first_events);
  pending.was_idle = pending.number > 1 && end_of(pending.number - 1).is_done();
  device_.mark(buffers.start);
  if (with_edits) change_gravity(pending);
  if (with_edits) upload_edits(pending);
  if (with_edits) upload_joint_edits(pending);
  if (with_edits) upload_mechanisms(pending);
  if (body_fault.is_due(SolverStage::before_step, 0))
    device_.parallel_for(pending.indices,
                         IsolateOnRequest{body_memory_.arrays(), counters_.data(), body_fault.category});
  if (after != body_failed && asks()) {
    submit_asking(pending, after);
  } else if (after != no_stop) {
    buffers.repeat_graph.emplace(device_.record([step = step_of(buffers), after]() mutable {
      if (after == body_failed) return step.submit_again();
      step.submit_deferred_manifolds();
      step.submit_bodies();
    }));
    device_.launch(*buffers.repeat_graph);
  } else {
    device_.launch(pending.set_changed && buffers.set_changed_graph ? *buffers.set_changed_graph : *buffers.graph);
  }
  if (copies_results()) submit_results(pending);
  if (brings_events)
    device_.parallel_for(static_cast<std::uint32_t>(buffers.begun.size()),
                         CopyNewestEvents{copy_of_events(buffers, pending.number), counters_.data()});
  buffers.events_of = brings_events ? pending.number : 0;
  device_.mark(end_of(pending.number));
  pending.traffic += device_.traffic() - counted_;
  counted_ = device_.traffic();
}

/// Reserves memory for results before anything of the step is submitted.
template <exec::Device D>
void DeviceSimulator<D>::reserve_results(const PendingStep& pending) {
  StepBuffers& buffers = buffers_of(pending.number);
  const std::size_t room = body_memory_.capacity();
  buffers.results.reserve(room);
  const auto reserve = [&](auto& buffer) {
    if (buffer.size() < pending.slots) buffer = std::decay_t<decltype(buffer)>(device_, room);
  };
  reserve(buffers.poses), reserve(buffers.velocities), reserve(buffers.flags);
}

/// Copies of one step's results overlap the next step's kernels; until they are done, nothing else uses their source.
template <exec::Device D>
void DeviceSimulator<D>::submit_results(const PendingStep& pending) {
  StepBuffers& buffers = buffers_of(pending.number);
  const std::size_t n = buffers.slots = pending.slots;
  SlotResults& results = publish(buffers.results, pending.indices);
  device_.copy_to_host_aside(buffers.poses.data(), results.poses.data(), n);
  device_.copy_to_host_aside(buffers.velocities.data(), results.velocities.data(), n);
  device_.copy_to_host_aside(buffers.flags.data(), results.flags.data(), n);
  device_.mark_aside(buffers.copied);
}

template <exec::Device D>
SlotResults& DeviceSimulator<D>::publish(SlotResults& results, std::uint32_t indices) {
  results.reserve(body_memory_.capacity());
  device_.parallel_for(indices, PublishBodies{body_memory_.arrays(), counters_.data(), results.poses.data(),
                                              results.velocities.data(), results.flags.data()});
  return results;
}

/// Copies edits to pinned memory.
template <exec::Device D>
void DeviceSimulator<D>::stage_edits(PendingStep& pending) {
  StepBuffers& buffers = buffers_of(pending.number);
  pending.uploaded = stage(buffers.staged_edits, buffers.edits, pending.edits, pending.uploaded);
  stage(buffers.staged_data, buffers.data, pending.data, 0);
}

/// Copies a list except its first `done` items; all items if the memory is new. Returns the number not copied.
template <exec::Device D>
template <class T>
std::size_t DeviceSimulator<D>::stage(exec::PinnedBuffer<T>& staging, exec::Buffer<T>& buffer,
                                      const std::vector<T>& list, std::size_t done) {
  if (std::min(staging.size(), buffer.size()) < list.size()) {
    done = 0;
    staging = exec::PinnedBuffer<T>(device_, list.size() + list.size() / 4);
    buffer.grow(list.size() + list.size() / 4);
  }
  std::copy(list.begin() + static_cast<std::ptrdiff_t>(done), list.end(), staging.begin() + done);
  return done;
}

/// Uploads overlap the steps in flight.
template <exec::Device D>
void DeviceSimulator<D>::upload_edits(const PendingStep& pending) {
  if (pending.edits.empty()) return;
  StepBuffers& buffers = buffers_of(pending.number);
  device_.copy_to_device_aside(buffers.edits.data() + pending.uploaded, buffers.staged_edits.data() + pending.uploaded,
                               pending.edits.size() - pending.uploaded);
  if (!pending.data.empty())
    device_.copy_to_device_aside(buffers.data.data(), buffers.staged_data.data(), pending.data.size());
  // Visiting every body is worthwhile if many are edited.
  const bool follows = 8 * pending.edits.size() > pending.indices;
  const ApplyEdits apply{body_memory_.arrays(),
                         grid_memory_.grid(grid_base_),
                         counters_.data(),
                         buffers.edits.data(),
                         buffers.data.data(),
                         def.dt,
                         follows};
  device_.parallel_for(static_cast<std::uint32_t>(pending.edits.size()), apply);
  if (follows) device_.parallel_for(pending.indices, FollowEdits{apply});
}

/// Applied before the step's edits and, like them, not while the simulator is stopped.
template <exec::Device D>
void DeviceSimulator<D>::change_gravity(const PendingStep& pending) {
  const GravityChange& change = pending.gravity;
  if (!change.is_new) return;
  device_.parallel_for(1, SetGravity{counters_.data(), change.gravity});
  if (change.wakes) device_.parallel_for(pending.indices, WakeByGravity{body_memory_.arrays(), counters_.data()});
}

}  // namespace fathom::device

#include "device/simulator_edits.hpp"
#include "device/simulator_joints.hpp"
#include "device/simulator_mechanisms.hpp"
#include "device/simulator_mirror.hpp"
#include "device/simulator_pending.hpp"
#include "device/simulator_questions.hpp"
#include "device/simulator_results.hpp"
#include "device/snapshot.hpp"
