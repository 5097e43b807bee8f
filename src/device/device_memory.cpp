#include "device/device_memory.hpp"

#include <bit>

namespace fathom::device {

BodyMemory::BodyMemory(exec::Memory& m)
    : slots_(m),
      constants_(m),
      tensors_(m),
      filters_(m),
      forces_(m),
      targets_(m),
      traits_(m),
      poses_(m),
      child_poses_(m),
      before_(m),
      ends_(m),
      velocities_(m),
      flags_(m),
      slow_time_(m),
      fat_(m),
      known_(m),
      boxes_(m),
      colours_(m),
      further_(m),
      joint_colours_(m),
      recoloured_(m),
      further_recoloured_(m),
      best_(m),
      touching_(m),
      island_(m),
      island_woken_(m),
      isolated_in_(m),
      fast_pair_(m),
      fast_(m),
      fixed_contact_(m),
      parent_(m),
      island_slow_(m),
      support_(m),
      nodes_(m),
      moves_(m),
      structures_(m),
      by_level_(m),
      solver_(m),
      motion_(m),
      warm_(m),
      inertia_(m),
      split_(m) {}

template <class Act>
void BodyMemory::for_each_passing(const Act& act) {
  act(parent_), act(island_slow_), act(recoloured_), act(further_recoloured_), act(nodes_), act(moves_);
  act(structures_), act(by_level_), act(motion_), act(warm_), act(inertia_), act(before_);
  act(split_);
}

void BodyMemory::reserve(std::size_t bodies) {
  for_each_lasting([&](auto& buffer) { buffer.grow(bodies, exec::Contents::keep); });
  for_each_passing([&](auto& buffer) { buffer.grow(bodies); });
  fast_pair_.grow(bodies, exec::Contents::keep);
  fast_.grow(bodies, exec::Contents::keep);
  if (ends_.size() > 0) ends_.grow(bodies);
  if (fixed_contact_.size() > 0) fixed_contact_.grow(bodies);
  if (traits_.size() > 0) traits_.grow(bodies, exec::Contents::keep);
  if (child_poses_.size() > 0) child_poses_.grow(bodies, exec::Contents::keep);
  capacity_ = std::max(capacity_, bodies);
}

void BodyMemory::reserve_for_bullets() { ends_.grow(capacity_); }
void BodyMemory::reserve_for_seams() { fixed_contact_.grow(capacity_); }
void BodyMemory::reserve_for_traits() { traits_.grow(capacity_, exec::Contents::keep); }
void BodyMemory::reserve_for_compounds() { child_poses_.grow(capacity_, exec::Contents::keep); }

BodyArrays BodyMemory::arrays() {
  return {.slots = slots_.data(),
          .constants = constants_.data(),
          .tensors = tensors_.data(),
          .filters = filters_.data(),
          .forces = forces_.data(),
          .targets = targets_.data(),
          .traits = traits_.data(),
          .child_poses = child_poses_.data(),
          .hulls = hulls,
          .surfaces = surfaces,
          .poses = poses_.data(),
          .velocities = velocities_.data(),
          .flags = flags_.data(),
          .slow_time = slow_time_.data(),
          .fat = fat_.data(),
          .known = known_.data(),
          .boxes = boxes_.data(),
          .colours = colours_.data(),
          .further = further_.data(),
          .joint_colours = joint_colours_.data(),
          .touching = touching_.data(),
          .recoloured = recoloured_.data(),
          .further_recoloured = further_recoloured_.data(),
          .best = best_.data(),
          .island = island_.data(),
          .parent = parent_.data(),
          .island_slow = island_slow_.data(),
          .island_woken = island_woken_.data(),
          .isolated_in = isolated_in_.data(),
          .fast = fast_.data(),
          .before = before_.data(),
          .ends = ends_.data(),
          .fast_pair = fast_pair_.data(),
          .fixed_contact = fixed_contact_.data(),
          .support = support_.data(),
          .nodes = nodes_.data(),
          .moves = moves_.data(),
          .structures = structures_.data(),
          .by_level = by_level_.data(),
          .solver = solver_.data(),
          .motion = motion_.data(),
          .warm = warm_.data(),
          .inertia = inertia_.data(),
          .split = split_.data()};
}

ContactMemory::ContactMemory(exec::Memory& m)
    : contacts_(m),
      manifolds_(m),
      free_(m),
      found_(m),
      fast_(m),
      next_of_a_(m),
      fixed_contacts_(m),
      own_slides_(m),
      filter_questions_(m),
      contact_questions_(m),
      answers_(m),
      refused_contacts_(m),
      refused_(m),
      team_touches_(m),
      surface_arrays_(m),
      to_collide_(m),
      free_manifolds_(m),
      uncoloured_0_(m),
      uncoloured_1_(m),
      begun_(m),
      ended_(m),
      hits_(m),
      bodies_(m),
      heads_(m),
      contact_(m),
      manifold_(m),
      contacts_of_(m),
      supports_(m),
      rows_(m),
      bounces_(m),
      extras_(m) {}

void ContactMemory::reserve(std::size_t contacts, std::size_t manifolds, std::size_t joints, std::size_t event_lists,
                            bool bounces, bool extras) {
  const std::size_t n = std::max(contacts, capacity());
  contacts_.grow(n, exec::Contents::keep);
  free_.grow(n, exec::Contents::keep);
  found_.grow(n);
  to_collide_.grow(2 * n);
  const std::size_t j = std::max(joints, joint_capacity());
  if (fixed_contacts_.size() > 0) fixed_contacts_.grow(n, exec::Contents::keep);
  capacity_ = n;
  fast_.grow(n, exec::Contents::keep);
  if (next_of_a_.size() > 0) next_of_a_.grow(n, exec::Contents::keep);

  const std::size_t m = std::max(manifolds, manifold_capacity());
  manifolds_.grow(m, exec::Contents::keep);
  free_manifolds_.grow(m, exec::Contents::keep);
  // Holds contacts that began before their step stopped.
  uncoloured_0_.grow(m, exec::Contents::keep);
  uncoloured_1_.grow(m);
  for (auto* buffer : {&begun_, &ended_}) buffer->grow(m * event_lists, exec::Contents::keep);
  hits_.grow(m * event_lists, exec::Contents::keep);
  const std::size_t n_constraints = m + j;
  // The layout of constraints outlives a step while no colour changes.
  bodies_.grow(n_constraints, exec::Contents::keep);
  for (auto* buffer : {&contact_, &manifold_}) buffer->grow(n_constraints, exec::Contents::keep);
  contacts_of_.grow(2 * n_constraints);
  supports_.grow(n_constraints);
  heads_.grow(n_constraints);
  rows_.grow((n_constraints + tile_width - 1) / tile_width * tile_width * row_count);
  if (bounces) bounces_.grow(n_constraints);
  if (extras) extras_.grow(n_constraints);
  event_lists_ = static_cast<std::uint32_t>(event_lists);
  may_bounce_ = bounces;
  any_extras_ = extras;
  manifold_capacity_ = m;
  joint_capacity_ = j;
  if (own_slides_.size() > 0) reserve_for_questions();
  if (team_touches_.size() > 0) reserve_for_surfaces(static_cast<std::uint32_t>(team_touches_.size()));
}

void ContactMemory::reserve_for_questions() {
  own_slides_.grow(capacity_, exec::Contents::keep);
  filter_questions_.grow(capacity_);
  refused_contacts_.grow(capacity_);
  refused_.grow(capacity_ + manifold_capacity_, exec::Contents::keep);
  contact_questions_.grow(manifold_capacity_);
  answers_.grow(manifold_capacity_);
}

void ContactMemory::reserve_for_seams() { fixed_contacts_.grow(capacity_, exec::Contents::keep); }

void ContactMemory::reserve_for_surfaces(std::uint32_t teams) {
  team_touches_.grow(teams);
  const std::size_t pairs = capacity_ / (1 + patches_per_pair);
  surface_arrays_.grow(SurfaceWork::bytes(pairs));
  pairs_with_surfaces_ = static_cast<std::uint32_t>(pairs);
}

void ContactMemory::reserve_for_bullets() { next_of_a_.grow(fast_.size(), exec::Contents::keep); }

ContactArrays ContactMemory::contacts() {
  return {.contacts = contacts_.data(),
          .free = free_.data(),
          .found = found_.data(),
          .to_collide = to_collide_.data(),
          .deferred = reinterpret_cast<std::uint32_t*>(found_.data()),
          .fast = fast_.data(),
          .next_of_a = next_of_a_.data(),
          .refused = refused_.data(),
          .own_slides = own_slides_.data(),
          .fixed_contacts = fixed_contacts_.data(),
          .capacity = static_cast<std::uint32_t>(capacity()),
          .manifolds = manifolds_.data(),
          .free_manifolds = free_manifolds_.data(),
          .uncoloured = {uncoloured_0_.data(), uncoloured_1_.data()},
          .begun = begun_.data(),
          .ended = ended_.data(),
          .hits = hits_.data(),
          .event_lists = event_lists_,
          .manifold_capacity = static_cast<std::uint32_t>(manifold_capacity())};
}

ConstraintArrays ContactMemory::constraints() {
  return {.bodies = bodies_.data(),
          .heads = heads_.data(),
          .contact = contact_.data(),
          .manifold = manifold_.data(),
          .rows = rows_.data(),
          .bounces = bounces_.data(),
          .extras = extras_.data(),
          .supports = supports_.data(),
          .contacts_of = contacts_of_.data(),
          .capacity = static_cast<std::uint32_t>(constraint_capacity())};
}

void JointMemory::reserve(std::size_t joints, std::size_t apart_slots, bool generic) {
  records_.grow(joints, exec::Contents::keep);
  if (generic) {
    generic_.grow(capacity(), exec::Contents::keep);
    generic_impulses_.grow(capacity(), exec::Contents::keep);
    reactions_.grow(capacity());
  }
  apart_.grow(apart_slots);
  apart_slots_ = apart_slots;
}

JointArrays JointMemory::arrays() {
  return {.records = records_.data(),
          .generic = generic_.data(),
          .generic_impulses = generic_impulses_.data(),
          .reactions = reactions_.data(),
          .capacity = static_cast<std::uint32_t>(capacity()),
          .apart = {
              .pairs = apart_.data(), .mask = static_cast<std::uint32_t>(apart_slots_) - 1, .is_on = apart_slots_ > 0}};
}

void MechanismMemory::reserve(const Room& room) {
  records_.grow(room.mechanisms);
  links_.grow(room.links);
  parents_.grow(room.mechanisms);
  contacts_.grow(room.links);
  contact_states_.grow(room.links);
  states_.grow(room.links);
  pushes_.grow(room.links);
  levels_.grow(room.levels);
  generic_.grow(room.generic);
  closures_.grow(room.closure_floats);
  of_joint_.grow(room.joints);
}

MechanismArrays MechanismMemory::arrays() {
  return {.links = links_.data(),
          .records = records_.data(),
          .levels = levels_.data(),
          .of_joint = of_joint_.data(),
          .of_body = of_body_.data(),
          .pushed_by = pushed_by_.data(),
          .parents = parents_.data(),
          .contacts = contacts_.data(),
          .contact_states = contact_states_.data(),
          .states = states_.data(),
          .pushes = pushes_.data(),
          .generic = generic_.data(),
          .closures = closures_.data(),
          .capacity = static_cast<std::uint32_t>(records_.size()),
          .link_capacity = static_cast<std::uint32_t>(links_.size()),
          .joint_capacity = static_cast<std::uint32_t>(of_joint_.size())};
}

void GridMemory::reserve(std::size_t bodies) {
  // At most half full; a multiple of four entries, because the table is cleared in groups of four.
  heads_.grow(std::bit_ceil(std::max<std::size_t>(2 * bodies, 64)));
  next_.grow(bodies, exec::Contents::keep);
  big_.grow(bodies, exec::Contents::keep);
  capacity_ = std::max(capacity_, bodies);
}

Grid GridMemory::grid(float base) {
  return {base, static_cast<std::uint32_t>(heads_.size() - 1), heads_.data(), next_.data(), big_.data()};
}

}  // namespace fathom::device
