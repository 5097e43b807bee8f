// The application's changes between steps, kept by the device simulator until it submits the next step.
#pragma once

#include "device/device_simulator.hpp"
#include "device/tuning.hpp"

namespace fathom::device {

template <exec::Device D>
void DeviceSimulator<D>::add_edit(Edit edit) {
  if (last_edit_.size() < indices_.size()) last_edit_.resize(indices_.size() + indices_.size() / 2, none);
  const auto entry = static_cast<std::uint32_t>(edits_.size());
  std::uint32_t& last = last_edit_[edit.index];
  if (last != none) {
    edits_[last].next = entry;
    edit.later = 1;
    if (last < uploaded_) {
      uploaded_ = last;
      uploads_ahead_ = false;
    }
  }
  last = entry;
  edits_.push_back(edit);
  if (bodies_are_current_) mirror(edit, data_);
  outdate_queries();
  if (edits_.size() >= uploaded_ + edits_at_once) upload_ahead();
}

/// Uploads waiting edits if the next step's buffers are free and have room: the changes of a million bodies take time
/// to make and to copy.
template <exec::Device D>
void DeviceSimulator<D>::upload_ahead() {
  if (!uploads_ahead_ || submitted_ == 0 || pending_steps_.size() >= max_pending_) return;
  StepBuffers& buffers = buffers_of(submitted_ + 1);
  if (edits_.size() > std::min(buffers.staged_edits.size(), buffers.edits.size())) return;
  std::copy(edits_.begin() + static_cast<std::ptrdiff_t>(uploaded_), edits_.end(),
            buffers.staged_edits.begin() + uploaded_);
  device_.copy_to_device_aside(buffers.edits.data() + uploaded_, buffers.staged_edits.data() + uploaded_,
                               edits_.size() - uploaded_);
  uploaded_ = edits_.size();
}

/// Lists each body's last waiting edit.
template <exec::Device D>
void DeviceSimulator<D>::list_last_edits() {
  last_edit_.assign(indices_.size(), none);
  for (std::uint32_t entry = 0; entry < edits_.size(); ++entry) last_edit_[edits_[entry].index] = entry;
}

template <exec::Device D>
BodyData DeviceSimulator<D>::body_data(std::uint32_t slot) {
  const BodyInfo& info = bodies[slot];
  BodyData d;
  BodyConstants& c = d.constants;
  const bool has_moving_surface = !(info.material.surface_velocity == Vec3{});
  c.bits = static_cast<std::uint32_t>(info.motion) | living_bit | (info.isotropic ? isotropic_bit : 0u) |
           (info.can_sleep ? can_sleep_bit : 0u) | (info.is_bullet ? bullet_bit : 0u) |
           (has_moving_surface ? moving_surface_bit : 0u) |
           static_cast<std::uint32_t>(info.geometry.type) << shape_shift |
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
  shapes_ |= shape_bit(info.geometry.type) | (info.is_bullet ? bullets_bit : 0u) |
             (has_moving_surface ? moving_surfaces_bit : 0u);
  note_fixed(slot);
  if (info.geometry.type == ShapeType::hull) c.hull = hull_memory_.index_of(info.hull().get());
  // Sensors collide with nothing.
  const Filter filter = info.is_sensor ? Filter{0, 0} : info.filter;
  d.filter = {filter.category, filter.mask};
  c.group = filter.group;
  if (may_keep_out(filter)) c.bits |= filtered_bit;
  c.friction = info.material.friction;
  may_bounce_ = may_bounce_ || info.material.restitution > 0;
  c.restitution = info.material.restitution;
  d.tensors = {info.inertia, info.inverse_inertia, info.material.rolling_resistance};
  d.surface_velocity = info.material.surface_velocity;
  any_extras_ = any_extras_ || info.material.rolling_resistance > 0 || has_moving_surface;
  return d;
}

/// From the second fixed body on there may be seams.
template <exec::Device D>
void DeviceSimulator<D>::note_fixed(std::uint32_t slot) {
  const BodyInfo& info = bodies[slot];
  if (info.motion != MotionType::fixed || !has_faces(info.geometry)) return;
  if (fixed_slot_ != none && fixed_slot_ != slot) shapes_ |= seams_bit;
  fixed_slot_ = slot;
}

template <exec::Device D>
void DeviceSimulator<D>::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  if (const auto hull = bodies[slot].hull()) hull_memory_.begin_use(hull);
  const BodyData body = body_data(slot);
  set_changed_ = true;
  tree_.note_set(slot);
  movable_ += bodies[slot].motion != MotionType::fixed;
  const std::uint32_t index = indices_.add(slot, submitted_ + 1);
  BodyData& data = data_.emplace_back(body);
  data.slot = slot;
  data.pose = pose;
  data.velocity = velocity;
  Edit edit = edit_of(EditKind::add, index, Velocity{});
  edit.data = static_cast<std::uint32_t>(data_.size() - 1);
  add_edit(edit);
}

template <exec::Device D>
void DeviceSimulator<D>::body_removed(std::uint32_t slot) {
  set_changed_ = true;
  tree_.note_set(slot);
  movable_ -= bodies[slot].motion != MotionType::fixed;
  add_edit(edit_of(EditKind::remove, indices_.of(slot), Velocity{}));
  indices_.remove(bodies.id(slot), submitted_ + 1);
  if (const auto hull = bodies[slot].hull()) hull_memory_.end_use(hull.get(), submitted_ + 1);
}

template <exec::Device D>
void DeviceSimulator<D>::set_pose(std::uint32_t slot, const Pose& pose) {
  if (bodies[slot].motion == MotionType::fixed) tree_.note_fixed_moved(slot);
  add_edit(edit_of(EditKind::set_pose, indices_.of(slot), pose));
}
template <exec::Device D>
void DeviceSimulator<D>::set_velocity(std::uint32_t slot, const Velocity& velocity) {
  add_edit(edit_of(EditKind::set_velocity, indices_.of(slot), velocity));
}
template <exec::Device D>
void DeviceSimulator<D>::move_to(std::uint32_t slot, const Pose& pose) {
  add_edit(edit_of(EditKind::move_to, indices_.of(slot), pose));
}
template <exec::Device D>
void DeviceSimulator<D>::add_velocity(std::uint32_t slot, const Velocity& change) {
  add_edit(edit_of(EditKind::add_velocity, indices_.of(slot), change));
}
template <exec::Device D>
void DeviceSimulator<D>::add_impulse(std::uint32_t slot, const Velocity& impulse) {
  add_edit(edit_of(EditKind::impulse, indices_.of(slot), impulse));
}
template <exec::Device D>
void DeviceSimulator<D>::apply(std::uint32_t slot, Vec3 force, Vec3 torque) {
  add_edit(edit_of(EditKind::force, indices_.of(slot), Velocity{force, 0, torque, 0}));
}
template <exec::Device D>
void DeviceSimulator<D>::gravity_changed() {
  gravity_change_ = {def.gravity, true, def.sleep.enabled && submitted_ > 0};
  if (bodies_are_current_) mirror_gravity();
}
template <exec::Device D>
void DeviceSimulator<D>::wake(std::uint32_t slot) {
  add_edit(edit_of(EditKind::wake, indices_.of(slot), Velocity{}));
}
template <exec::Device D>
void DeviceSimulator<D>::constants_changed(std::uint32_t slot, std::uint32_t changes) {
  data_.push_back(body_data(slot));
  data_.back().changes = changes;
  Edit edit = edit_of(EditKind::constants, indices_.of(slot), Velocity{});
  edit.data = static_cast<std::uint32_t>(data_.size() - 1);
  add_edit(edit);
}

}  // namespace fathom::device
