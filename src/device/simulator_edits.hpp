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
  BodyData d = surface_data(info, info.geometry, info.material, info.filter);
  BodyConstants& c = d.constants;
  c.bits |= living_bit | (info.isotropic ? isotropic_bit : 0u) | (info.can_sleep ? can_sleep_bit : 0u) |
            (info.is_bullet ? bullet_bit : 0u);
  if (question_bits_.size() <= slot) question_bits_.resize(slot + slot / 2 + 1);
  question_bits_[slot] = question_bits(info);
  c.radius = info.radius;
  c.inverse_mass = info.inverse_mass;
  c.inverse_inertia = info.isotropic ? info.inverse_inertia.xx : 0;
  c.gravity_scale = info.gravity_scale;
  c.linear_damping = info.linear_damping;
  c.angular_damping = info.angular_damping;
  shapes_ |= info.is_bullet ? bullets_bit : 0u;
  note_fixed(slot);
  if (info.geometry.type == ShapeType::hull) c.hull = hull_memory_.index_of(info.hull().get());
  if (info.geometry.is_surface()) {
    c.hull = surface_memory_.index_of(&info.geometry.surface());
    c.link = indices_.first_child(slot);
    for (const Material& material : info.geometry.surface().materials()) note_material(material);
  }
  if (info.geometry.is_compound()) {
    c.hull = children_of(slot);
    c.link = indices_.first_child(slot);
    for (const ChildShape& child : info.geometry.compound().children())
      if (child.material) c.bits |= trait_bits(*child.material);
  }
  d.tensors.inertia = info.inertia;
  d.tensors.inverse = info.inverse_inertia;
  return d;
}

/// Data of child number `child` of the compound in `slot`.
template <exec::Device D>
BodyData DeviceSimulator<D>::child_data(std::uint32_t slot, std::uint32_t child) {
  const BodyInfo& info = bodies[slot];
  const native::Piece piece = native::piece_of(info, child);
  BodyData d = surface_data(info, piece.geometry, piece.material, piece.filter);
  BodyConstants& c = d.constants;
  c.bits |= child_bit;
  c.radius = piece.radius;
  c.link = indices_.of(slot);
  if (piece.geometry.type == ShapeType::hull)
    c.hull = hull_memory_.index_of(info.geometry.compound().children()[child].shape.hull.get());
  d.pose = piece.pose;
  d.traits.velocity = inverse_rotate(piece.pose.rotation, native::surface_velocity(info, child));
  d.traits.friction_axis = inverse_rotate(piece.pose.rotation, native::friction_axis(info, child));
  return d;
}

/// What bodies and children of compounds have in common: shape, material and filter.
template <exec::Device D>
BodyData DeviceSimulator<D>::surface_data(const BodyInfo& info, const Geometry& shape, const Material& material,
                                          const Filter& own_filter) {
  BodyData d;
  BodyConstants& c = d.constants;
  c.bits = static_cast<std::uint32_t>(info.motion) | trait_bits(material) |
           static_cast<std::uint32_t>(shape.type) << shape_shift |
           static_cast<std::uint32_t>(material.friction_rule) << friction_rule_shift |
           static_cast<std::uint32_t>(material.restitution_rule) << restitution_rule_shift;
  c.bits |= question_bits(info);
  if (c.bits & (asks_bit | filters_bit)) {
    shapes_ |= questions_bit;
    may_bounce_ = any_extras_ = true;  // whatever the answers
  }
  c.half_extents = shape.half_extents;
  c.shape_radius = shape.radius;
  shapes_ |= shape_bit(shape.type);
  note_material(material);
  // Sensors collide with nothing.
  const Filter filter = info.is_sensor ? Filter{0, 0} : own_filter;
  d.filter = {filter.category, filter.mask};
  c.group = filter.group;
  if (may_keep_out(filter)) c.bits |= filtered_bit;
  c.friction = material.friction;
  c.restitution = material.restitution;
  d.tensors.rolling_resistance = material.rolling_resistance;
  d.traits = traits_of(material);
  return d;
}

/// Notes which parts of a step its contacts will need.
template <exec::Device D>
void DeviceSimulator<D>::note_material(const Material& material) {
  const bool has_traits = trait_bits(material) != 0;
  shapes_ |= has_traits ? traits_bit : 0u;
  may_bounce_ = may_bounce_ || material.restitution > 0;
  any_extras_ = any_extras_ || material.rolling_resistance > 0 || has_traits;
}

/// Number of children of the body in `slot`, 0 if it is no compound.
template <exec::Device D>
std::uint32_t DeviceSimulator<D>::children_of(std::uint32_t slot) const {
  const Geometry& shape = bodies[slot].geometry;
  return shape.is_compound() ? static_cast<std::uint32_t>(shape.compound().children().size()) : 0;
}

/// Number of indices beside its own that a body takes: those of its children, or of a surface's patches.
template <exec::Device D>
std::uint32_t DeviceSimulator<D>::reserved_indices(std::uint32_t slot) const {
  return bodies[slot].geometry.is_surface() ? patches_per_pair : children_of(slot);
}

/// Calls act(hull) for the hulls of the body's shape and of its children.
template <exec::Device D>
template <class Act>
void DeviceSimulator<D>::for_each_hull(std::uint32_t slot, const Act& act) const {
  if (const auto hull = bodies[slot].hull()) act(hull);
  if (!bodies[slot].geometry.is_compound()) return;
  for (const ChildShape& child : bodies[slot].geometry.compound().children())
    if (child.shape.hull) act(child.shape.hull);
}

/// From the second shape with faces on that cannot be pushed there may be seams.
template <exec::Device D>
void DeviceSimulator<D>::note_fixed(std::uint32_t slot) {
  const BodyInfo& info = bodies[slot];
  if (info.motion == MotionType::dynamic) return;
  if (info.motion == MotionType::fixed && children_of(slot) > 1) shapes_ |= seams_bit;
  if (!has_faces(info.geometry) && info.geometry.is_convex()) return;
  if (fixed_slot_ != none && fixed_slot_ != slot) shapes_ |= seams_bit;
  fixed_slot_ = slot;
}

template <exec::Device D>
void DeviceSimulator<D>::add_data_edit(EditKind kind, std::uint32_t index, const BodyData& data) {
  data_.push_back(data);
  Edit edit = edit_of(kind, index, Velocity{});
  edit.data = static_cast<std::uint32_t>(data_.size() - 1);
  add_edit(edit);
}

template <exec::Device D>
void DeviceSimulator<D>::body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) {
  for_each_hull(slot, [&](const auto& hull) { hull_memory_.begin_use(hull); });
  if (const auto surface = bodies[slot].shape().surface) surface_memory_.begin_use(surface);
  const std::uint32_t index = indices_.add(slot, submitted_ + 1), reserved = reserved_indices(slot);
  if (reserved > 0) indices_.add_children(slot, reserved, submitted_ + 1);
  set_changed_ = true;
  tree_.note_set(slot);
  query_memory_.note_bodies();
  movable_ += bodies[slot].motion != MotionType::fixed;
  BodyData data = body_data(slot);
  data.slot = slot;
  data.pose = pose;
  data.velocity = velocity;
  add_data_edit(EditKind::add, index, data);
  for (std::uint32_t k = 0; k < reserved; ++k) {
    const std::uint32_t piece = indices_.first_child(slot) + k;
    if (bodies[slot].geometry.is_compound())
      add_data_edit(EditKind::add, piece, child_data(slot, k));
    else
      add_edit(edit_of(EditKind::reserve, piece, Velocity{}));
  }
}

template <exec::Device D>
void DeviceSimulator<D>::body_removed(std::uint32_t slot) {
  set_changed_ = true;
  tree_.note_set(slot);
  query_memory_.note_bodies();
  movable_ -= bodies[slot].motion != MotionType::fixed;
  const std::uint32_t index = indices_.of(slot);
  std::erase_if(kept_out_, [&](std::uint64_t key) { return key >> 32 == index || (key & 0xffffffffu) == index; });
  add_edit(edit_of(EditKind::remove, indices_.of(slot), Velocity{}));
  for (std::uint32_t k = 0; k < children_of(slot); ++k)
    add_edit(edit_of(EditKind::remove, indices_.first_child(slot) + k, Velocity{}));
  if (const std::uint32_t reserved = reserved_indices(slot)) indices_.remove_children(slot, reserved, submitted_ + 1);
  indices_.remove(bodies.id(slot), submitted_ + 1);
  for_each_hull(slot, [&](const auto& hull) { hull_memory_.end_use(hull.get(), submitted_ + 1); });
  if (const auto surface = bodies[slot].shape().surface) surface_memory_.end_use(surface.get(), submitted_ + 1);
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
  query_memory_.note_bodies();
  BodyData data = body_data(slot);
  data.changes = changes;
  add_data_edit(EditKind::constants, indices_.of(slot), data);
  // Their body's changes are theirs, too.
  for (std::uint32_t k = 0; k < children_of(slot); ++k)
    add_data_edit(EditKind::constants, indices_.first_child(slot) + k, child_data(slot, k));
}

}  // namespace fathom::device
