// The device simulator's part of a snapshot: data that outlasts a step on the device, and the host's data.
//
// Indices in the arrays are saved unchanged, although no result depends on them. Graphs, the grid's table and the
// mirror are rebuilt; hulls get new indices.
#pragma once

#include <algorithm>
#include <utility>

#include "device/device_simulator.hpp"
#include "world/archive.hpp"

namespace fathom::device {

template <exec::Device D>
template <class T>
void DeviceSimulator<D>::upload(T* to, const std::vector<T>& from) {
  if (from.empty()) return;
  exec::PinnedBuffer<T> staging(device_, from.size());
  std::copy(from.begin(), from.end(), staging.begin());
  device_.copy_to_device(to, staging.data(), from.size());
  device_.wait();
}

template <exec::Device D>
void DeviceSimulator<D>::save(ByteWriter& write) const {
  DeviceSimulator& s = self();
  s.retire_all();
  s.device_.wait();
  fetch_events();
  write(submitted_, newest_, movable_, may_bounce_, any_extras_, shapes_, gravity_change_.wakes, grid_base_, edits_,
        data_);
  BodyIndices::archive(indices_, write);
  JointMirror::archive(joint_mirror_, write);
  // Steps do not depend on unread events: the last step's are enough.
  write(begun_.of_step(submitted_), ended_.of_step(submitted_), hits_.of_step(submitted_),
        quarantined_.of_step(submitted_));
  const Counters counters = s.download(counters_.data(), 1).front();
  write(counters);
  s.body_memory_.for_each_lasting(
      [&](auto& buffer) { write(s.download(buffer.data(), std::min<std::size_t>(counters.bodies, buffer.size()))); });
  const ContactArrays arrays = s.contact_memory_.contacts();
  write(s.download(arrays.contacts, counters.contacts), s.download(arrays.free, counters.free_contacts),
        s.download(arrays.manifolds, counters.manifolds), s.download(arrays.free_manifolds, counters.free_manifolds),
        s.own_slides(counters.contacts));
  // The layout of constraints, which is kept while no colour changes.
  const ConstraintArrays layout = s.contact_memory_.constraints();
  write(s.download(layout.bodies, counters.constraints), s.download(layout.contact, counters.constraints),
        s.download(layout.manifold, counters.constraints));
  const JointArrays joint_arrays = s.joint_memory_.arrays();
  write(s.download(joint_arrays.records, counters.joints),
        s.download(joint_arrays.generic_impulses, joint_arrays.generic_impulses ? counters.joints : 0));
  // The sweep's list, which may be unsorted if bodies move fast.
  const bool has_list = published_settings().sweep && submitted_ > 0 && !set_changed_;
  write(set_changed_, wanted_slots_,
        s.download(s.published_memory_.order.data(), has_list ? list_size(counters.bodies) : 0));
}

/// The application's slides of as many contacts, zero where it gave none.
template <exec::Device D>
std::vector<Vec3> DeviceSimulator<D>::own_slides(std::size_t contacts) {
  const ContactArrays arrays = contact_memory_.contacts();
  if (!arrays.own_slides) return {};
  std::vector<Vec3> slides = download(arrays.own_slides, contacts);
  const std::vector<Contact> all = download(arrays.contacts, contacts);
  for (std::size_t k = 0; k < contacts; ++k)
    if (!all[k].in_use() || !(all[k].bits & own_slide_bit)) slides[k] = {};
  return slides;
}

/// Requires that colours' stretches lie within the layout of constraints, which is kept while no colour changes.
inline void check_schedule(const ByteReader& in, const Counters& c) {
  in.require(c.sweeps <= schedule_size && c.first_dynamic <= c.sweeps &&
             c.dynamic_sweeps <= c.sweeps - c.first_dynamic && c.further_sweeps <= c.dynamic_sweeps);
  in.require(c.overflow <= c.constraints && c.first_overflow <= c.constraints - c.overflow);
  for (std::uint32_t k = 0; k < c.sweeps; ++k)
    in.require(c.schedule[k].count <= c.constraints && c.schedule[k].first <= c.constraints - c.schedule[k].count);
}

template <exec::Device D>
void DeviceSimulator<D>::restore(ByteReader& in) {
  in(submitted_, newest_, movable_, may_bounce_, any_extras_, shapes_, gravity_change_.wakes, grid_base_, edits_,
     data_);
  BodyIndices::archive(indices_, in);
  JointMirror::archive(joint_mirror_, in);
  const auto read_list = [&]<class T>(EventList<T>& list) {
    std::vector<T> events;
    in(events);
    list.add(events);
  };
  read_list(begun_), read_list(ended_), read_list(hits_), read_list(quarantined_);
  events_are_current_ = true;
  Counters counters;
  in(counters);
  counters.filled_entries = 0;
  std::ranges::fill(counters.per_colour, 0u);
  check_indices(in, counters);
  check_schedule(in, counters);
  joint_mirror_.rebuild(excluded, indices_, is_on_device());
  restore_hulls();
  list_last_edits();
  if (is_on_device()) make_room_for_restored(in, counters);
  const std::vector<BodyConstants> constants = restore_bodies(in, counters);
  restore_contacts(in, counters, constants);
  restore_layout(in, counters);
  restore_joints(in, counters);
  restore_list(in, counters);
  profile_is_current_ = true;
  if (is_on_device()) publish_restored();
}

/// Whether the saved world had made a step: before the first one the device holds nothing.
template <exec::Device D>
bool DeviceSimulator<D>::is_on_device() const {
  return submitted_ > 0;
}

/// Registers hulls in the order of slots, and sets their indices in constants.
template <exec::Device D>
void DeviceSimulator<D>::restore_hulls() {
  for (const BodyId id : bodies.living())
    for_each_hull(id.index, [&](const auto& hull) { hull_memory_.begin_use(hull); });
  for (const BodyId id : bodies.living())
    if (const auto surface = bodies[id.index].shape().surface) surface_memory_.begin_use(surface);
  const std::vector<PieceName> names = name_pieces();
  // What the bodies need is noted before room is made for them, whatever the bytes say.
  for (const PieceName& name : names)
    if (name.slot != none) name.child == none ? body_data(name.slot) : child_data(name.slot, name.child);
  for (const Edit& e : edits_)
    if (e.kind == EditKind::add || e.kind == EditKind::constants) {
      give_links(data_[e.data].constants, names[e.index]);
      data_[e.data].slot = indices_.slot(e.index);
    }
}

/// The owner of each index.
template <exec::Device D>
auto DeviceSimulator<D>::name_pieces() const -> std::vector<PieceName> {
  std::vector<PieceName> names(indices_.size());
  for (const BodyId id : bodies.living()) {
    names[indices_.of(id.index)] = {id.index, none};
    for (std::uint32_t k = 0; k < children_of(id.index); ++k) names[indices_.first_child(id.index) + k] = {id.index, k};
  }
  return names;
}

template <exec::Device D>
void DeviceSimulator<D>::make_room_for_restored(ByteReader& in, const Counters& counters) {
  in.require(counters.contacts <= in.left() / sizeof(Contact) &&
             counters.manifolds <= in.left() / sizeof(ContactManifold));
  in.require(counters.joints <= joints.slot_count());
  wanted_contacts_ = counters.contacts;
  wanted_manifolds_ = counters.manifolds;
  make_room();
  upload(counters_.data(), {counters});
}

/// Reads an array of `count` elements into memory with room for `room`, after `check` has accepted it.
template <exec::Device D>
template <class T, class Check>
void DeviceSimulator<D>::read_into(ByteReader& in, T* to, std::size_t room, std::size_t count, const Check& check) {
  std::vector<T> host;
  in(host);
  in.require(host.size() == count && count <= room);
  check(host);
  upload(to, host);
}

template <exec::Device D>
std::vector<BodyConstants> DeviceSimulator<D>::restore_bodies(ByteReader& in, const Counters& counters) {
  const std::vector<PieceName> names = name_pieces();
  std::vector<BodyConstants> constants;
  body_memory_.for_each_lasting([&](auto& buffer) {
    read_into(in, buffer.data(), buffer.size(), is_on_device() ? counters.bodies : 0, [&](auto& host) {
      if constexpr (std::is_same_v<std::decay_t<decltype(host)>, std::vector<BodyConstants>>) {
        question_bits_.assign(bodies.slot_count(), 0);
        for (std::uint32_t i = 0; i < host.size(); ++i) {
          give_links(host[i], names[i]);
          in.require(host[i].is_isotropic() || bodies.any_anisotropic() || !host[i].is_living());
          if (names[i].slot != none && names[i].child == none)
            question_bits_[names[i].slot] = host[i].bits & (asks_bit | filters_bit);
        }
        constants = host;
      }
      if constexpr (std::is_same_v<std::decay_t<decltype(host)>, std::vector<BodySupport>>)
        for (const BodySupport& s : host) in.require(s.level <= max_levels);
    });
  });
  for (const BodyId id : bodies.living()) note_fixed(id.index);
  if (!is_on_device()) return constants;
  upload(body_memory_.arrays().fast_pair, std::vector<std::uint32_t>(counters.bodies, none));
  std::vector<SurfaceTraits> traits(counters.bodies);
  std::vector<Pose> child_poses(counters.bodies);
  for (std::uint32_t i = 0; i < counters.bodies; ++i) {
    const auto [slot, child] = names[i];
    if (slot == none) continue;
    traits[i] = traits_of(bodies[slot].material);
    if (child == none) continue;
    const BodyData data = child_data(slot, child);
    child_poses[i] = data.pose, traits[i] = data.traits;
  }
  if (shapes_ & traits_bit) upload(body_memory_.arrays().traits, traits);
  if (has_compounds()) upload(body_memory_.arrays().child_poses, child_poses);
  return constants;
}

/// Requires that all indices are below `limit`.
inline auto are_below(ByteReader& in, std::uint32_t limit) {
  return [&in, limit](const std::vector<std::uint32_t>& indices) {
    for (const std::uint32_t index : indices) in.require(index < limit);
  };
}

/// Requires that every pair with a surface has all its patches to itself.
inline void check_patches(ByteReader& in, const std::vector<Contact>& contacts) {
  std::vector<bool> is_linked(contacts.size());
  for (const Contact& pair : contacts) {
    if (!pair.in_use() || !pair.is_with_surface()) continue;
    in.require(!pair.is_patch() && !pair.touching());
    std::uint32_t next = pair.manifold;
    for (std::uint32_t p = 0; p < patches_per_pair; ++p) {
      in.require(next < contacts.size() && !is_linked[next]);
      const Contact& patch = contacts[next];
      in.require(patch.in_use() && patch.is_patch() && !patch.is_with_surface() && patch.a == pair.a &&
                 patch.b == pair.b && patch.patch_number() < patches_per_pair);
      is_linked[next] = true;
      next = patch.next_patch();
    }
    in.require(next == none);
  }
  for (std::size_t i = 0; i < contacts.size(); ++i)
    in.require(!contacts[i].in_use() || !contacts[i].is_patch() || is_linked[i]);
}

template <exec::Device D>
void DeviceSimulator<D>::restore_contacts(ByteReader& in, const Counters& counters,
                                          const std::vector<BodyConstants>& constants) {
  const ContactArrays arrays = contact_memory_.contacts();
  const std::size_t room = contact_memory_.capacity(), manifold_room = contact_memory_.manifold_capacity();
  // A waiting edit may have removed a body or given it another shape. Its contacts are those of the former shape, and
  // the edit will drop them.
  std::vector<bool> has_other_shape(counters.bodies);
  for (const Edit& e : edits_)
    if (e.kind == EditKind::remove || (e.kind == EditKind::constants && (data_[e.data].changes & drop_contacts) != 0))
      if (e.index < counters.bodies) has_other_shape[e.index] = true;
  read_into(in, arrays.contacts, room, counters.contacts, [&](const std::vector<Contact>& contacts) {
    for (const Contact& c : contacts) {
      in.require(!c.in_use() || (c.a < counters.bodies && c.b < counters.bodies && c.colour() <= overflow_colour));
      const auto has_child = [&](std::uint32_t body, std::uint32_t child) {
        return has_other_shape[body] || !constants[body].is_compound() || child < constants[body].hull;
      };
      in.require(!c.in_use() || !c.in_parts() || (has_child(c.a, c.child_a()) && has_child(c.b, c.child_b())));
      in.require(!c.in_use() || !c.is_with_surface() || has_other_shape[c.a] || constants[c.a].is_surface());
      if (c.in_use() && (c.in_parts() || c.is_patch()) && c.in_touch())
        ++touching_parts_[std::uint64_t{c.a} << 32 | c.b];
      if (!c.in_use() || c.is_with_surface()) continue;
      in.require(c.touching() ? c.manifold < counters.manifolds : c.manifold == none);
    }
    check_patches(in, contacts);
    note_kept_out(contacts);
  });
  read_into(in, arrays.free, room, counters.free_contacts, are_below(in, counters.contacts));
  read_into(in, arrays.manifolds, manifold_room, counters.manifolds, [](const auto&) {});
  read_into(in, arrays.free_manifolds, manifold_room, counters.free_manifolds, are_below(in, counters.manifolds));
  read_into(in, arrays.own_slides, room, arrays.own_slides ? counters.contacts : 0,
            [&](const std::vector<Vec3>& slides) {
              for (const Vec3 slide : slides) in.require(is_finite(slide));
            });
}

template <exec::Device D>
void DeviceSimulator<D>::restore_layout(ByteReader& in, const Counters& counters) {
  const ConstraintArrays layout = contact_memory_.constraints();
  const std::size_t room = contact_memory_.constraint_capacity();
  read_into(in, layout.bodies, room, counters.constraints, [&](const std::vector<PairRecord>& pairs) {
    for (const PairRecord pair : pairs) in.require(pair.a < counters.bodies && pair.b < counters.bodies);
  });
  read_into(in, layout.contact, room, counters.constraints, [&](const std::vector<std::uint32_t>& numbers) {
    for (const std::uint32_t number : numbers)
      in.require(number & joint_tag ? (number & ~joint_tag) < counters.joints : number < counters.contacts);
  });
  // A joint's entry is 0, even without manifolds.
  read_into(in, layout.manifold, room, counters.constraints, are_below(in, std::max(counters.manifolds, 1u)));
}

template <exec::Device D>
void DeviceSimulator<D>::restore_joints(ByteReader& in, const Counters& counters) {
  read_into(in, joint_memory_.arrays().records, joint_memory_.capacity(), counters.joints,
            [&](const std::vector<JointRecord>& records) {
              for (const JointRecord& r : records)
                in.require(!r.in_use() || (r.a < counters.bodies && r.b < counters.bodies &&
                                           (r.colour < dynamic_colours || r.colour == overflow_colour) &&
                                           r.is_generic <= joint_mirror_.had_generic()));
            });
  restore_generic_joints(in, is_on_device() ? counters.joints : 0);
  if (is_on_device()) upload(joint_memory_.apart_pairs(), joint_mirror_.apart().pairs());
}

/// The sweep's list.
template <exec::Device D>
void DeviceSimulator<D>::restore_list(ByteReader& in, const Counters& counters) {
  std::vector<std::uint64_t> list;
  in(set_changed_, wanted_slots_, list);
  for (const std::uint64_t element : list) in.require(static_cast<std::uint32_t>(element) < list.size());
  if (!is_on_device()) return;
  make_room();
  const bool has_list = published_settings().sweep && !set_changed_;
  in.require(has_list ? list.size() == list_size(counters.bodies) && list.size() <= published_memory_.order.size()
                      : list.empty());
  upload(published_memory_.order.data(), list);
}

/// Publishes the newest step's results, as a finished step does.
template <exec::Device D>
void DeviceSimulator<D>::publish_restored() {
  // Slots of the saved world have been checked; bodies waiting to be added come after them.
  upload(body_memory_.arrays().slots, indices_.slots());
  device_.mark(end_of(submitted_));  // the next step is timed from here
  if (copies_results()) {
    PendingStep newest;
    newest.number = newest_.step, newest.indices = indices_.size(), newest.slots = bodies.slot_count();
    reserve_results(newest);
    submit_results(newest);
  }
  device_.wait();
}

/// Definitions follow from the application's; those of removed joints are not read before their edits.
template <exec::Device D>
void DeviceSimulator<D>::restore_generic_joints(ByteReader& in, std::uint32_t count) {
  std::vector<GenericImpulse> impulses;
  in(impulses);
  if (count == 0 || joint_memory_.generic_capacity() == 0) return in.require(impulses.empty());
  in.require(impulses.size() == count);
  std::vector<GenericJoint> definitions(count);
  for (std::uint32_t slot = 0; slot < count; ++slot)
    if (joints.alive(slot) && joints[slot].def.type != JointType::ball)
      definitions[slot] =
          make_generic_joint(joints[slot].def, {joints[slot].swapped, joints.is_alone(slot), joints[slot].masses},
                             def.dt / static_cast<float>(def.solver.substeps), def.solver.restitution_threshold);
  upload(joint_memory_.arrays().generic, definitions);
  upload(joint_memory_.arrays().generic_impulses, impulses);
}

/// Sets what a piece's constants refer to: the index that its hull has in this simulator, its body or its children.
template <exec::Device D>
void DeviceSimulator<D>::give_links(BodyConstants& constants, const PieceName& name) {
  if (name.slot == none) {
    // Its body was removed: an edit that waits will forget it.
    if (constants.is_child() || constants.is_compound() || constants.is_surface()) constants = {};
    constants.hull = 0, constants.link = none;
    return;
  }
  const BodyConstants current =
      (name.child == none ? body_data(name.slot) : child_data(name.slot, name.child)).constants;
  constants.hull = current.hull, constants.link = current.link;
  constants.bits = (constants.bits & ~(child_bit | shape_bits << shape_shift)) |
                   (current.bits & (child_bit | shape_bits << shape_shift));
}

template <exec::Device D>
void DeviceSimulator<D>::check_indices(const ByteReader& in, const Counters& counters) const {
  in.require(counters.bodies <= indices_.size());
  in.require(joint_mirror_.is_sound(joints, indices_.size()));
  in.require(indices_.is_sound(
      bodies.slot_count(), [&](std::uint32_t slot) { return bodies.alive(slot); },
      [&](std::uint32_t slot) { return reserved_indices(slot); }));
  in.require(counters.free_contacts <= counters.contacts && counters.free_manifolds <= counters.manifolds &&
             newest_.step == submitted_ && steps == submitted_);
  for (const Edit& e : edits_) {
    in.require(e.index < indices_.size() && (e.next == none || e.next < edits_.size()));
    in.require((e.kind != EditKind::add && e.kind != EditKind::constants) || e.data < data_.size());
  }
}

}  // namespace fathom::device
