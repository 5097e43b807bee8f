// What DeviceSimulator does; included by the one source of each back end, which instantiates it.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstring>
#include <numeric>

#include "device/device_simulator.hpp"
#include "device/morton_order.hpp"

namespace fathom::device {

/// Steps in flight at most, beside those asked for: enough to keep a GPU busy.
inline constexpr int fewest_in_flight = 3;
inline constexpr std::size_t first_bodies = 256;
inline constexpr std::size_t first_contacts = 2048;

template <exec::Device D>
template <class... Arguments>
DeviceSimulator<D>::DeviceSimulator(const WorldDef& definition, Arguments&&... device_arguments)
    : Simulator(definition),
      device_(std::forward<Arguments>(device_arguments)...),
      lanes_count_(static_cast<std::size_t>(std::max(definition.ahead + 1, fewest_in_flight))),
      body_memory_(device_),
      contact_memory_(device_),
      grid_memory_(device_),
      hull_memory_(device_),
      counters_(device_, 1),
      reports_(device_, lanes_count_),
      edit_buffer_(device_),
      data_buffer_(device_),
      slot_staging_(device_, 0) {
  const exec::PinnedBuffer<Counters> initial(device_, 1);
  device_.copy_to_device(counters_.data(), initial.data(), 1);
  device_.wait();
  for (std::size_t i = 0; i < lanes_count_; ++i) lanes_.push_back(std::make_unique<Lane>(device_));
  for (std::size_t i = 0; i <= lanes_count_; ++i) ends_.push_back(std::make_unique<Event>(device_));
}

template <exec::Device D>
DeviceSimulator<D>::~DeviceSimulator() {
  try {
    device_.wait();
  } catch (const std::exception&) {
    // A lost device has nothing left to wait for.
  }
}

// --- submitting --------------------------------------------------------------------------------------------------

template <exec::Device D>
void DeviceSimulator<D>::step() {
  while (flights_.size() >= lanes_count_) retire_oldest();
  if (submitted_ == 0) order_in_space();
  make_room();
  upload_slots();
  upload_gravity();
  if (!lanes_.front()->graph) record();
  Flight& flight = flights_.emplace_back();
  flight.number = ++submitted_;
  flight.edits = std::move(edits_);
  flight.data = std::move(data_);
  edits_.clear();
  data_.clear();
  for (const Edit& e : flight.edits) last_edit_[e.index] = none;
  try {
    submit(flight, true);
  } catch (...) {
    // Nothing of the step has run: it is as if it had not been asked for.
    edits_ = std::move(flight.edits);
    data_ = std::move(flight.data);
    flights_.pop_back();
    --submitted_;
    throw;
  }
  ++steps;
  bodies_are_current_ = bodies_are_current_ && copies_results();
  events_are_current_ = events_are_current_ && def.ahead > 0;
  while (def.ahead > 0 && (flights_.size() > static_cast<std::size_t>(def.ahead) || oldest_is_done())) retire_oldest();
}

/// Buffers for what was added since; growing waits for the steps in flight.
template <exec::Device D>
void DeviceSimulator<D>::make_room() {
  const std::size_t bodies_needed =
      std::max({slot_of_.size(), static_cast<std::size_t>(bodies.slot_count()), wanted_bodies_, first_bodies});
  const std::size_t contacts_needed = std::max({wanted_contacts_, bodies_needed + bodies_needed / 4, first_contacts});
  if (bodies_needed > body_memory_.capacity()) {
    retire_all();
    const std::size_t old = body_memory_.capacity();
    const std::size_t target = old == 0 ? bodies_needed : std::max(bodies_needed, old + old / 2);
    body_memory_.reserve(target);
    grid_memory_.reserve(target);
    forget_graphs();
    slots_are_current_ = false;
    bodies_are_current_ = false;
    // All boxes enter the larger grid.
    choose_grid();
  }
  if (contacts_needed > contact_memory_.capacity() || may_bounce_ != contact_memory_.may_bounce()) {
    retire_all();
    contact_memory_.reserve(contacts_needed, event_lists(), may_bounce_);
    forget_graphs();
  }
  if (!hull_memory_.is_current()) {
    retire_all();
    hull_memory_.upload(device_);
    body_memory_.hulls = hull_memory_.arrays();
    forget_graphs();
  }
}

/// Cells as large as the fat box of a typical body that turns but does not fly.
template <exec::Device D>
void DeviceSimulator<D>::choose_grid() {
  if (grid_base_ > 0) return;  // boxes know their level: it must not change under them
  std::vector<float> radii;
  for (const BodyId id : bodies.living())
    if (bodies[id.index].motion == MotionType::dynamic) radii.push_back(bodies[id.index].radius);
  float typical = 1;
  if (!radii.empty()) {
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    typical = *middle;
  }
  grid_base_ = 2.3f * typical + min(0.1f, typical);
}

template <exec::Device D>
void DeviceSimulator<D>::record() {
  const SolverSettings& s = def.solver;
  StepSettings settings;
  settings.dt = def.dt;
  settings.grid_base = grid_base_;
  settings.restitution_threshold = s.restitution_threshold;
  settings.solve = solve_parameters(def);
  settings.move = {def.dt, static_cast<std::uint32_t>(s.substeps), s.max_linear_speed, def.sleep.enabled,
                   def.sleep.linear_speed};
  settings.sleep_time = def.sleep.time;
  for (const auto& lane : lanes_) {
    Step<D> step(device_, body_memory_, contact_memory_, grid_memory_, counters_.data(), reports_.data(),
                 static_cast<std::uint32_t>(reports_.size()), settings, &lane->marks);
    lane->graph.emplace(device_.record([&] { step.submit(); }));
  }
}

template <exec::Device D>
void DeviceSimulator<D>::forget_graphs() {
  for (const auto& lane : lanes_) lane->graph.reset();
}

/// Bodies that are there before the first step lie along a space-filling curve.
template <exec::Device D>
void DeviceSimulator<D>::order_in_space() {
  std::vector<Vec3> places(slot_of_.size());
  for (const Edit& e : edits_)
    if (e.kind == EditKind::add)
      places[e.index] = data_[e.data].pose.position;
    else if (e.kind == EditKind::set_pose)
      places[e.index] = e.linear;
  const std::vector<std::uint32_t> order = morton_order(places);  // new → old
  std::vector<std::uint32_t> new_of(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) new_of[order[i]] = i;
  std::vector<std::uint32_t> slot_of(slot_of_.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) slot_of[i] = slot_of_[order[i]];
  slot_of_ = std::move(slot_of);
  for (std::uint32_t& index : index_of_)
    if (index != none) index = new_of[index];
  for (std::uint32_t& index : free_indices_) index = new_of[index];
  for (auto& [index, step] : resting_indices_) index = new_of[index];
  for (Edit& e : edits_) e.index = new_of[e.index];
  slots_are_current_ = false;
}

template <exec::Device D>
void DeviceSimulator<D>::submit(Flight& flight, bool with_edits) {
  Lane& lane = lane_of(flight.number);
  if (with_edits) stage_edits(flight);
  flight.was_idle = flight.number > 1 && end_of(flight.number - 1).is_done();
  device_.mark(lane.start);
  if (with_edits) upload_edits(flight);
  device_.launch(*lane.graph);
  if (copies_results()) submit_results(lane);
  device_.mark(end_of(flight.number));
  flight.traffic += device_.traffic() - counted_;
  counted_ = device_.traffic();
}

template <exec::Device D>
void DeviceSimulator<D>::submit_results(Lane& lane) {
  const std::size_t n = bodies.slot_count();
  if (lane.poses.size() < n) {
    const std::size_t room = body_memory_.capacity();
    lane.poses = exec::PinnedBuffer<Pose>(device_, room);
    lane.velocities = exec::PinnedBuffer<Velocity>(device_, room);
    lane.flags = exec::PinnedBuffer<std::uint32_t>(device_, room);
  }
  lane.slots = n;
  BodyMemory& m = body_memory_;
  device_.parallel_for(
      static_cast<std::uint32_t>(slot_of_.size()),
      PublishBodies{m.arrays(), m.slots.data(), m.slot_poses.data(), m.slot_velocities.data(), m.slot_flags.data()});
  device_.copy_to_host(lane.poses.data(), m.slot_poses.data(), n);
  device_.copy_to_host(lane.velocities.data(), m.slot_velocities.data(), n);
  device_.copy_to_host(lane.flags.data(), m.slot_flags.data(), n);
}

/// Copies edits to where the device can take them from.
template <exec::Device D>
void DeviceSimulator<D>::stage_edits(const Flight& flight) {
  Lane& lane = lane_of(flight.number);
  const auto stage = [&](auto& staging, auto& buffer, const auto& list) {
    using Staging = std::decay_t<decltype(staging)>;
    if (staging.size() < list.size()) staging = Staging(device_, list.size() + list.size() / 4);
    if (buffer.size() < list.size()) buffer.grow(list.size() + list.size() / 4);
    std::copy(list.begin(), list.end(), staging.begin());
  };
  stage(lane.edits, edit_buffer_, flight.edits);
  stage(lane.data, data_buffer_, flight.data);
}

template <exec::Device D>
void DeviceSimulator<D>::upload_edits(const Flight& flight) {
  if (flight.edits.empty()) return;
  const Lane& lane = lane_of(flight.number);
  device_.copy_to_device(edit_buffer_.data(), lane.edits.data(), flight.edits.size());
  if (!flight.data.empty()) device_.copy_to_device(data_buffer_.data(), lane.data.data(), flight.data.size());
  device_.parallel_for(static_cast<std::uint32_t>(flight.edits.size()),
                       ApplyEdits{body_memory_.arrays(), grid_memory_.grid(grid_base_), counters_.data(),
                                  edit_buffer_.data(), data_buffer_.data(), def.dt});
}

template <exec::Device D>
void DeviceSimulator<D>::upload_slots() {
  if (slots_are_current_) return;
  // The staging of an earlier upload may still be on its way.
  device_.wait();
  if (slot_staging_.size() < slot_of_.size())
    slot_staging_ = exec::PinnedBuffer<std::uint32_t>(device_, body_memory_.capacity());
  std::copy(slot_of_.begin(), slot_of_.end(), slot_staging_.begin());
  device_.copy_to_device(body_memory_.slots.data(), slot_staging_.data(), slot_of_.size());
  slots_are_current_ = true;
}

template <exec::Device D>
void DeviceSimulator<D>::upload_gravity() {
  if (gravity_is_current_) return;
  device_.parallel_for(1, SetGravity{counters_.data(), def.gravity});
  gravity_is_current_ = true;
}

// --- what the application changes --------------------------------------------------------------------------------

template <exec::Device D>
void DeviceSimulator<D>::add_edit(Edit edit) {
  if (last_edit_.size() < slot_of_.size()) last_edit_.resize(slot_of_.size() + slot_of_.size() / 2, none);
  const auto place = static_cast<std::uint32_t>(edits_.size());
  std::uint32_t& last = last_edit_[edit.index];
  if (last != none) {
    edits_[last].next = place;
    edit.later = 1;
  }
  last = place;
  edits_.push_back(edit);
  if (bodies_are_current_) mirror(edit, data_);
}

template <exec::Device D>
BodyData DeviceSimulator<D>::body_data(std::uint32_t slot) {
  const BodyInfo& info = bodies[slot];
  BodyData d;
  BodyConstants& c = d.constants;
  c.bits = static_cast<std::uint32_t>(info.motion) | living_bit | (info.isotropic ? isotropic_bit : 0u) |
           (info.can_sleep ? can_sleep_bit : 0u) | static_cast<std::uint32_t>(info.geometry.type) << shape_shift |
           static_cast<std::uint32_t>(info.material.friction_rule) << friction_rule_shift |
           static_cast<std::uint32_t>(info.material.restitution_rule) << restitution_rule_shift;
  c.radius = info.radius;
  c.inverse_mass = info.inverse_mass;
  c.inverse_inertia = info.isotropic ? info.inverse_inertia.xx : 0;
  c.half_extents = info.geometry.half_extents;
  c.shape_radius = info.geometry.radius;
  c.gravity_scale = info.gravity_scale;
  c.linear_damping = info.linear_damping;
  c.angular_damping = info.angular_damping;
  if (info.shape.hull) c.hull = hull_memory_.index_of(info.shape.hull);
  c.category = info.filter.category;
  c.mask = info.filter.mask;
  c.friction = info.material.friction;
  may_bounce_ = may_bounce_ || info.material.restitution > 0;
  c.restitution = info.material.restitution;
  d.tensors = {info.inertia, info.inverse_inertia};
  return d;
}

template <exec::Device D>
void DeviceSimulator<D>::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  const BodyData body = body_data(slot);
  movable_ += bodies[slot].motion != MotionType::fixed;
  release_rested_indices();
  if (index_of_.size() <= slot) index_of_.resize(slot + 1, none);
  std::uint32_t index;
  if (free_indices_.empty()) {
    index = static_cast<std::uint32_t>(slot_of_.size());
    slot_of_.push_back(slot);
  } else {
    index = free_indices_.back();
    free_indices_.pop_back();
    slot_of_[index] = slot;
  }
  former_ids_.erase(index);
  index_of_[slot] = index;
  slots_are_current_ = false;
  BodyData& data = data_.emplace_back(body);
  data.pose = pose;
  data.velocity = velocity;
  Edit edit = edit_of(EditKind::add, index, Velocity{});
  edit.data = static_cast<std::uint32_t>(data_.size() - 1);
  add_edit(edit);
}

template <exec::Device D>
void DeviceSimulator<D>::body_removed(std::uint32_t slot) {
  const std::uint32_t index = index_of_[slot];
  movable_ -= bodies[slot].motion != MotionType::fixed;
  add_edit(edit_of(EditKind::remove, index, Velocity{}));
  former_ids_[index] = bodies.id(slot);
  slot_of_[index] = none;
  index_of_[slot] = none;
  resting_indices_.emplace_back(index, submitted_ + 1);
  slots_are_current_ = false;
}

/// Indices whose last owners' contacts a finished step has dropped.
template <exec::Device D>
void DeviceSimulator<D>::release_rested_indices() {
  while (!resting_indices_.empty() && resting_indices_.front().second <= newest_.step) {
    free_indices_.push_back(resting_indices_.front().first);
    resting_indices_.pop_front();
  }
}

template <exec::Device D>
void DeviceSimulator<D>::set_pose(std::uint32_t slot, const Pose& pose) {
  add_edit(edit_of(EditKind::set_pose, index_of_[slot], pose));
}
template <exec::Device D>
void DeviceSimulator<D>::set_velocity(std::uint32_t slot, const Velocity& velocity) {
  add_edit(edit_of(EditKind::set_velocity, index_of_[slot], velocity));
}
template <exec::Device D>
void DeviceSimulator<D>::add_velocity(std::uint32_t slot, const Velocity& change) {
  add_edit(edit_of(EditKind::add_velocity, index_of_[slot], change));
}
template <exec::Device D>
void DeviceSimulator<D>::add_impulse(std::uint32_t slot, const Velocity& impulse) {
  if (bodies[slot].motion == MotionType::dynamic) add_edit(edit_of(EditKind::impulse, index_of_[slot], impulse));
}
template <exec::Device D>
void DeviceSimulator<D>::apply(std::uint32_t slot, Vec3 force, Vec3 torque) {
  if (bodies[slot].motion == MotionType::dynamic)
    add_edit(edit_of(EditKind::force, index_of_[slot], Velocity{force, 0, torque, 0}));
}
template <exec::Device D>
void DeviceSimulator<D>::wake(std::uint32_t slot) {
  add_edit(edit_of(EditKind::wake, index_of_[slot], Velocity{}));
}
template <exec::Device D>
void DeviceSimulator<D>::constants_changed(std::uint32_t slot, std::uint32_t changes) {
  data_.push_back(body_data(slot));
  data_.back().changes = changes;
  Edit edit = edit_of(EditKind::constants, index_of_[slot], Velocity{});
  edit.data = static_cast<std::uint32_t>(data_.size() - 1);
  add_edit(edit);
}

// --- finished steps ----------------------------------------------------------------------------------------------

template <exec::Device D>
bool DeviceSimulator<D>::oldest_is_done() const {
  return !flights_.empty() && end_of(flights_.front().number).is_done();
}

template <exec::Device D>
void DeviceSimulator<D>::retire_oldest() {
  const Event& end = end_of(flights_.front().number);
  end.wait();
  const Report report = reports_[flights_.front().number % lanes_count_];
  if (report.stopped) return repair(report);
  newest_ = report;
  const Flight& flight = flights_.front();
  newest_interval_ = flight.was_idle || report.step == 1 ? end.milliseconds_since(lane_of(flight.number).start)
                                                         : end.milliseconds_since(end_of(report.step - 1));
  newest_traffic_ = flight.traffic;
  flights_.pop_front();
  profile_is_current_ = false;
  if (def.ahead > 0) {
    bodies_are_current_ = events_are_current_ = false;
  }
  const std::size_t in_use = newest_.contacts - newest_.free_contacts;
  if (10 * in_use > 8 * contact_memory_.capacity()) wanted_contacts_ = 2 * contact_memory_.capacity();
}

template <exec::Device D>
void DeviceSimulator<D>::retire_all() const {
  while (!flights_.empty()) self().retire_oldest();
}

/// Makes room for what a step found no room for, then submits it and all that came after it once more. The first one's
/// edits have been applied already, those of the others have been passed over.
template <exec::Device D>
void DeviceSimulator<D>::repair(const Report& report) {
  device_.wait();
  const std::size_t needed = static_cast<std::size_t>(report.contacts) + report.found;
  contact_memory_.reserve(needed + needed / 4, event_lists(), may_bounce_);
  forget_graphs();
  record();
  device_.parallel_for(1, GoOn{counters_.data()});
  bool first = true;
  for (Flight& flight : flights_) {
    submit(flight, !first);
    first = false;
  }
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
    while (oldest_is_done()) self().retire_oldest();
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
  const Lane& lane = lane_of(newest_.step);
  const StageMarks<D>& m = lane.marks;
  profile.times = {m.pairs.milliseconds_since(m.begin), m.manifolds.milliseconds_since(m.pairs),
                   m.built.milliseconds_since(m.manifolds), m.solved.milliseconds_since(m.built),
                   m.end.milliseconds_since(m.solved)};
  StepCounts& c = profile.counts;
  c.bodies = bodies.count();
  c.active = def.sleep.enabled ? newest_.active : movable_;
  c.pairs = newest_.contacts - newest_.free_contacts;
  c.manifolds = newest_.constraints;
  c.points = newest_.points;
  c.colours = newest_.colours;
  c.overflow = newest_.overflow;
  c.islands = newest_.islands;
  c.recycled = newest_.recycled;
  c.quarantined = newest_.quarantined;
  c.launches = newest_traffic_.launches;
  c.bytes_to_device = newest_traffic_.bytes_to_device;
  c.bytes_to_host = newest_traffic_.bytes_to_host;
  c.memory_bytes = device_.bytes_in_use();
}

// --- the mirror --------------------------------------------------------------------------------------------------

template <exec::Device D>
void DeviceSimulator<D>::fetch_bodies() const {
  if (copies_results())
    look();
  else
    retire_all();
  if (!bodies_are_current_) self().fetch_bodies_now();
}

template <exec::Device D>
void DeviceSimulator<D>::fetch_bodies_now() {
  bodies_are_current_ = true;
  const std::size_t n = bodies.slot_count();
  poses_.assign(std::max(n, poses_.size()), Pose{});
  velocities_.assign(poses_.size(), Velocity{});
  flags_.assign(poses_.size(), 0);
  if (newest_.step > 0) {
    Lane& lane = lane_of(newest_.step);
    if (!copies_results()) {
      make_room();
      upload_slots();
      submit_results(lane);
      device_.wait();
    }
    const std::size_t known = std::min(lane.slots, n);
    std::copy_n(lane.poses.begin(), known, poses_.begin());
    std::copy_n(lane.velocities.begin(), known, velocities_.begin());
    std::copy_n(lane.flags.begin(), known, flags_.begin());
    // What an earlier owner of a slot left there is nobody's.
    for (std::uint32_t slot = 0; slot < n; ++slot)
      if (!bodies.alive(slot)) poses_[slot] = {}, velocities_[slot] = {}, flags_[slot] = 0;
  }
  for (const Flight& flight : flights_)
    for (const Edit& e : flight.edits)
      if (e.kind == EditKind::add) mirror(e, flight.data);
  for (const Edit& e : edits_) mirror(e, data_);
}

template <exec::Device D>
std::optional<DevicePoses> DeviceSimulator<D>::publish_poses() {
  if constexpr (requires { device_.stream(); }) {
    if (!edits_.empty()) return {};
    retire_all();
    if (newest_.step == 0) return {};
    make_room();
    upload_slots();
    BodyMemory& m = body_memory_;
    device_.parallel_for(
        static_cast<std::uint32_t>(slot_of_.size()),
        PublishBodies{m.arrays(), m.slots.data(), m.slot_poses.data(), m.slot_velocities.data(), m.slot_flags.data()});
    return DevicePoses{m.slot_poses.data(), bodies.slot_count(), device_.stream(),
                       static_cast<int>(device_.info().index)};
  } else {
    return {};
  }
}

/// What an edit does to poses and velocities that the application reads.
template <exec::Device D>
void DeviceSimulator<D>::mirror(const Edit& e, const std::vector<BodyData>& data) {
  const std::uint32_t slot = slot_of_[e.index];
  if (slot == none) return;
  if (poses_.size() <= slot) {
    poses_.resize(slot + 1 + slot / 2);
    velocities_.resize(poses_.size());
    flags_.resize(poses_.size());
  }
  const BodyInfo& info = bodies[slot];
  Velocity& v = velocities_[slot];
  switch (e.kind) {
    case EditKind::add:
      poses_[slot] = data[e.data].pose;
      v = data[e.data].velocity;
      flags_[slot] = info.motion == MotionType::fixed ? 0u : static_cast<std::uint32_t>(awake_flag);
      return;
    case EditKind::remove:
      poses_[slot] = {};
      v = {};
      flags_[slot] = 0;
      return;
    case EditKind::set_pose:
      poses_[slot] = e.pose();
      break;
    case EditKind::set_velocity:
      v = e.velocity();
      break;
    case EditKind::add_velocity:
      v.linear += e.linear;
      v.angular += e.angular;
      break;
    case EditKind::impulse: {
      const BodyData body = body_data(slot);
      v = pushed(v, body.constants, body.tensors, poses_[slot].rotation, e.velocity());
      break;
    }
    default:
      break;
  }
  if (info.motion != MotionType::fixed) mirror_waking(slot);
}

/// A body that wakes takes along all that fell asleep with it.
template <exec::Device D>
void DeviceSimulator<D>::mirror_waking(std::uint32_t slot) {
  const std::uint32_t flags = flags_[slot];
  flags_[slot] = (flags & ~isolated_flag) | awake_flag;
  if (flags & (awake_flag | isolated_flag)) return;
  for (const BodyId id : bodies.living()) {
    std::uint32_t& other = flags_[id.index];
    const bool asleep = bodies[id.index].motion == MotionType::dynamic && !(other & (awake_flag | isolated_flag));
    if (asleep && other >> island_shift == flags >> island_shift) other |= awake_flag;
  }
}

template <exec::Device D>
std::span<const Pose> DeviceSimulator<D>::poses() const {
  fetch_bodies();
  return {poses_.data(), bodies.slot_count()};
}
template <exec::Device D>
std::span<const Velocity> DeviceSimulator<D>::velocities() const {
  fetch_bodies();
  return {velocities_.data(), bodies.slot_count()};
}
template <exec::Device D>
bool DeviceSimulator<D>::is_awake(std::uint32_t slot) const {
  fetch_bodies();
  return flags_[slot] & awake_flag;
}

template <exec::Device D>
template <class T>
std::vector<T> DeviceSimulator<D>::download(const T* from, std::size_t count) {
  exec::PinnedBuffer<T> staging(device_, count);
  if (count > 0) {
    device_.copy_to_host(staging.data(), from, count);
    device_.wait();
  }
  return {staging.begin(), staging.end()};
}

template <exec::Device D>
BodyId DeviceSimulator<D>::id_of(std::uint32_t index) const {
  const auto former = former_ids_.find(index);
  return former != former_ids_.end() ? former->second : bodies.id(slot_of_[index]);
}

template <exec::Device D>
ContactEvent DeviceSimulator<D>::event(PairRecord pair) const {
  const BodyId a = id_of(pair.a), b = id_of(pair.b);
  return a.index < b.index ? ContactEvent{a, b} : ContactEvent{b, a};
}

template <exec::Device D>
void DeviceSimulator<D>::fetch_events() const {
  look();
  if (!events_are_current_) self().fetch_events_now();
}

// Lists come in any order; the application gets them by index.
template <exec::Device D>
void DeviceSimulator<D>::fetch_events_now() {
  events_are_current_ = true;
  begun_.clear();
  ended_.clear();
  hits_.clear();
  quarantined_.clear();
  if (newest_.step == 0) return;
  const ContactArrays arrays = contact_memory_.contacts();
  const std::size_t first = arrays.events_of(newest_.step);
  const auto before = [](const auto& x, const auto& y) {
    return x.a.index != y.a.index ? x.a.index < y.a.index : x.b.index < y.b.index;
  };
  for (const PairRecord& pair : download(arrays.begun + first, newest_.begun)) begun_.push_back(event(pair));
  for (const PairRecord& pair : download(arrays.ended + first, newest_.ended)) ended_.push_back(event(pair));
  for (const HitRecord& hit : download(arrays.hits + first, newest_.hits)) {
    const ContactEvent ids = event({hit.a, hit.b});
    const bool swapped = ids.a != id_of(hit.a);
    hits_.push_back({ids.a, ids.b, hit.point, swapped ? -hit.normal : hit.normal, hit.speed});
  }
  std::sort(begun_.begin(), begun_.end(), before);
  std::sort(ended_.begin(), ended_.end(), before);
  std::sort(hits_.begin(), hits_.end(), before);
  for (const std::uint32_t index : download(body_memory_.quarantined.data(), newest_.quarantined))
    quarantined_.push_back({id_of(index), newest_.step});
  std::sort(quarantined_.begin(), quarantined_.end(),
            [](const Quarantine& x, const Quarantine& y) { return x.body.index < y.body.index; });
}

template <exec::Device D>
std::span<const ContactEvent> DeviceSimulator<D>::contacts_begun() const {
  fetch_events();
  return begun_;
}
template <exec::Device D>
std::span<const ContactEvent> DeviceSimulator<D>::contacts_ended() const {
  fetch_events();
  return ended_;
}
template <exec::Device D>
std::span<const HitEvent> DeviceSimulator<D>::hits() const {
  fetch_events();
  return hits_;
}
template <exec::Device D>
std::span<const Quarantine> DeviceSimulator<D>::quarantined() const {
  fetch_events();
  return quarantined_;
}

template <exec::Device D>
void DeviceSimulator<D>::for_each_contact(const std::function<void(const ContactInfo&)>& visit) const {
  fetch_bodies();
  const ContactArrays arrays = self().contact_memory_.contacts();
  const auto contacts = self().download(arrays.contacts, newest_.contacts);
  const auto manifolds = self().download(arrays.manifolds, newest_.contacts);
  std::vector<ContactInfo> infos;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    if (!c.in_use() || !c.touching() || slot_of_[c.a] == none || slot_of_[c.b] == none) continue;
    const ContactManifold& m = manifolds[i];
    const Pose &pa = poses_[slot_of_[c.a]], &pb = poses_[slot_of_[c.b]];
    const ContactEvent ids = event({c.a, c.b});
    const Vec3 normal = rotate(pa.rotation, m.normal);
    ContactInfo info{ids.a, ids.b, ids.a.index == slot_of_[c.a] ? normal : -normal, m.point_count(), {}};
    if ((c.bits & colour_bits) < overflow_colour) info.colour = static_cast<int>(c.bits & colour_bits);
    for (int p = 0; p < info.point_count; ++p) {
      const Vec3 on_a = transform(pa, m.points[p].anchor_a), on_b = transform(pb, m.points[p].anchor_b);
      info.points[p] = {0.5f * (on_a + on_b), dot(on_b - on_a, normal), m.impulses[p]};
    }
    infos.push_back(info);
  }
  std::sort(infos.begin(), infos.end(), [](const ContactInfo& x, const ContactInfo& y) {
    return x.a.index != y.a.index ? x.a.index < y.a.index : x.b.index < y.b.index;
  });
  for (const ContactInfo& info : infos) visit(info);
}

// Queries look at every body's bounds on the host: they are rare beside steps, and the mirror is there.
template <exec::Device D>
std::optional<RayHit> DeviceSimulator<D>::ray_cast(Vec3 origin, Vec3 translation, std::uint32_t mask) const {
  fetch_bodies();
  const Aabb around{min(origin, origin + translation), max(origin, origin + translation)};
  std::optional<RayHit> nearest;
  for (const BodyId id : bodies.living()) {
    const BodyInfo& info = bodies[id.index];
    if ((info.filter.category & mask) == 0 || !overlaps(grown(bounds(id.index), 1e-3f * info.radius), around)) continue;
    const auto hit = fathom::ray_cast(info.geometry, poses_[id.index], origin, translation);
    if (!hit || (nearest && nearest->fraction <= hit->fraction)) continue;
    nearest = RayHit{id, hit->fraction, mul_add(origin, hit->fraction, translation), hit->normal};
  }
  return nearest;
}

template <exec::Device D>
void DeviceSimulator<D>::overlap(const Aabb& box, std::uint32_t mask, std::vector<std::uint32_t>& slots) const {
  fetch_bodies();
  for (const BodyId id : bodies.living())
    if (bodies[id.index].filter.category & mask && overlaps(bounds(id.index), box)) slots.push_back(id.index);
}

}  // namespace fathom::device

#include "device/snapshot.hpp"
