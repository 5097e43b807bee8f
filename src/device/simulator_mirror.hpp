// The device simulator's mirror: poses and velocities on the host, fetched on demand, with edits applied on top.
#pragma once

#include <algorithm>

#include "device/device_simulator.hpp"

namespace fathom::device {

template <exec::Device D>
void DeviceSimulator<D>::fetch_bodies() const {
  if (is_asking_) return;
  if (copies_results())
    look();
  else
    retire_all();
  if (!bodies_are_current_) self().fetch_bodies_now();
}

template <exec::Device D>
void DeviceSimulator<D>::fetch_bodies_now() {
  outdate_queries();
  const std::size_t n = bodies.slot_count();
  const auto reserve = [&](auto& buffer) {
    if (buffer.size() < n) buffer = std::decay_t<decltype(buffer)>(device_, n + n / 2);
  };
  reserve(poses_), reserve(velocities_), reserve(flags_);
  const std::size_t known = newest_.step > 0 ? fetch_results(n) : 0;
  std::fill(poses_.begin() + known, poses_.begin() + n, Pose{});
  std::fill(velocities_.begin() + known, velocities_.begin() + n, Velocity{});
  std::fill(flags_.begin() + known, flags_.begin() + n, 0u);
  // Clears data that former owners left in free slots.
  if (known > 0 && bodies.count() < n)
    for (std::uint32_t slot = 0; slot < known; ++slot)
      if (!bodies.alive(slot)) poses_[slot] = {}, velocities_[slot] = {}, flags_[slot] = 0;
  for (const PendingStep& pending : pending_steps_)
    for (const Edit& e : pending.edits)
      if (e.kind == EditKind::add) mirror(e, pending.data);
  for (const Edit& e : edits_) mirror(e, data_);
  mirror_gravity();
  bodies_are_current_ = true;
}

/// Fetches the newest finished step's results for up to so many slots; returns the number fetched.
template <exec::Device D>
std::size_t DeviceSimulator<D>::fetch_results(std::size_t slots) {
  if (copies_results()) {
    const StepBuffers& buffers = buffers_of(newest_.step);
    const std::size_t known = std::min(buffers.slots, slots);
    std::copy_n(buffers.poses.begin(), known, poses_.begin());
    std::copy_n(buffers.velocities.begin(), known, velocities_.begin());
    std::copy_n(buffers.flags.begin(), known, flags_.begin());
    return known;
  }
  make_room();
  const SlotResults& results = publish(results_, indices_.size());
  device_.copy_to_host(poses_.data(), results.poses.data(), slots);
  device_.copy_to_host(velocities_.data(), results.velocities.data(), slots);
  device_.copy_to_host(flags_.data(), results.flags.data(), slots);
  device_.wait();
  return slots;
}

template <exec::Device D>
std::optional<DevicePoses> DeviceSimulator<D>::publish_poses() {
  if constexpr (requires { device_.stream(); }) {
    if (!edits_.empty()) return {};
    retire_all();
    if (newest_.step == 0) return {};
    make_room();
    return DevicePoses{publish(results_, indices_.size()).poses.data(), bodies.slot_count(), device_.stream(),
                       static_cast<int>(device_.info().index)};
  } else {
    return {};
  }
}

/// Applies an edit to the poses and velocities that the application reads.
template <exec::Device D>
void DeviceSimulator<D>::mirror(const Edit& e, const std::vector<BodyData>& data) {
  const std::uint32_t slot = indices_.slot(e.index);
  if (slot == none) return;
  if (slot >= mirror_room()) {
    bodies_are_current_ = false;  // they are fetched again on demand
    return;
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
    case EditKind::move_to:
      v = velocity_between(poses_[slot], e.pose(), def.dt);
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
    case EditKind::joints:
      if (flags_[slot] & isolated_flag) return;
      break;
    default:
      break;
  }
  if (info.motion != MotionType::fixed) mirror_waking(slot);
}

/// A body that wakes wakes all bodies that fell asleep with it.
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

/// Wakes bodies for a change of gravity that waits for the next step.
template <exec::Device D>
void DeviceSimulator<D>::mirror_gravity() {
  if (!gravity_change_.wakes) return;
  for (const BodyId id : bodies.living()) {
    const BodyInfo& info = bodies[id.index];
    const bool asleep = !(flags_[id.index] & (awake_flag | isolated_flag));
    if (asleep && info.motion == MotionType::dynamic && info.gravity_scale != 0) mirror_waking(id.index);
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

}  // namespace fathom::device
