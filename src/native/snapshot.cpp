// The native simulator's part of a snapshot: everything that later steps depend on, so that they are bit-identical.
// That includes the order of contacts, colours' lists and tree leaves. Derived data is rebuilt: the set of pairs, boxes
// of tree nodes, lists of active bodies, blocks of constraints.
#include <algorithm>

#include "native/native_simulator.hpp"
#include "world/archive.hpp"
#include "world/growth.hpp"

namespace fathom::native {

// --- reading the parts ---------------------------------------------------------------------------------------

void BodyState::restore(ByteReader& in, std::size_t slots) {
  archive(*this, in);
  for (const std::size_t size : {poses.size(), velocities.size(), bounds.size(), flags.size(), slow_time.size(),
                                 colour_mask.size(), overflow_count.size(), forces.size()})
    in.require(size == slots);
  for (std::uint32_t slot = 0; slot < slots; ++slot) {
    in.require(is_finite(poses[slot]) && abs(dot(poses[slot].rotation, poses[slot].rotation) - 1) < 1e-3f);
    in.require(is_finite(velocities[slot].linear) && is_finite(velocities[slot].angular));
    in.require(contains(bounds[slot].fat_box, bounds[slot].box));
  }
  resize(slots);
  for (std::uint32_t slot = 0; slot < slots; ++slot) note_to_solve(slot);
}

/// Requires that the ring of a contact's pair is closed and consists of contacts of the same bodies, one of them the
/// first.
void ContactGraph::check_ring(ByteReader& in, std::uint32_t index) const {
  const Contact& c = contacts_[index];
  const auto has_child = [&](std::uint32_t slot, std::uint32_t child) {
    const Geometry& shape = bodies_[slot].geometry;
    if (shape.is_surface()) return child < std::max<std::size_t>(1, shape.surface().materials().size());
    return child < (shape.is_compound() ? shape.compound().children().size() : 1);
  };
  int firsts = 0;
  std::size_t length = 0;
  for (std::uint32_t part = index; length == 0 || part != index; part = parts_[part].next) {
    in.require(part < parts_.size() && part < contacts_.size() && ++length <= contacts_.size());
    const Contact& other = contacts_[part];
    in.require(other.in_use && other.in_parts && other.a == c.a && other.b == c.b);
    in.require(has_child(c.a, parts_[part].children.a) && has_child(c.b, parts_[part].children.b));
    firsts += !other.is_part;
  }
  in.require(firsts == 1);
}

/// Whether what a step reads of it is finite, except impulses, which are lost with the first solution.
static bool can_be_solved(const ContactManifold& m) {
  for (int i = 0; i < m.point_count(); ++i)
    if (!is_finite(m.points[i].anchor_a) || !is_finite(m.points[i].anchor_b)) return false;
  return is_finite(m.normal) && is_finite(m.tangent) && is_finite(m.friction) && is_finite(m.restitution) &&
         is_finite(m.rotation_at_build) && is_finite(m.position_at_build());
}

void ContactGraph::restore(ByteReader& in) {
  domains_.restore(in, state_.size());
  archive(*this, in);
  in.require(colours_.size() == domains_.units() * (overflow_colour + 1));
  unit_sizes_.assign(domains_.units(), 0);
  const std::size_t slots = state_.size(), contacts = contacts_.size();
  grow_to(list_positions_, contacts);
  std::fill(list_positions_.begin(), list_positions_.end(), 0);
  colours_room_ = 0;
  for (const std::vector<std::uint32_t>& list : colours_) {
    colours_room_ += list.capacity();
    for (std::uint32_t index = 0; index < list.size(); ++index) {
      in.require(list[index] < contacts);
      list_positions_[list[index]] = index;
    }
  }
  for (const OwnSlide& own : own_slides_) in.require(own.contact < contacts && is_finite(own.slide));
  in.require(std::ranges::is_sorted(own_slides_, {}, &OwnSlide::contact));
  std::size_t in_use = 0, coloured = 0;
  std::vector<std::uint32_t> colours(slots, 0), overflow(slots, 0);
  for (const Contact& c : contacts_) {
    in.require(is_sound(c.in_use) && is_sound(c.fixed_a) && c.a < slots && c.b < slots);
    if (!c.in_use) continue;
    ++in_use;
    in.require(c.a != c.b && bodies_.alive(c.a) && bodies_.alive(c.b));
    in.require(c.fixed_a == (bodies_[c.a].motion != MotionType::dynamic));
    in.require(bodies_[c.b].motion == MotionType::dynamic);
    in.require(!c.touching() || c.manifold < manifolds_.size());
    if (!c.is_part) {
      in.require(!pairs_.contains(c.a, c.b));
      pairs_.insert(c.a, c.b);
    }
    in.require(c.in_parts == !(bodies_[c.a].geometry.is_convex() && bodies_[c.b].geometry.is_convex()));
    const auto number = static_cast<std::uint32_t>(&c - contacts_.data());
    if (c.in_parts) check_ring(in, number);
    in.require(!c.own_slide || std::ranges::binary_search(own_slides_, number, {}, &OwnSlide::contact));
    if (c.colour == no_colour) continue;
    ++coloured;
    in.require(c.touching() && c.colour <= overflow_colour);
    const GraphEdge edge = edge_of(number);
    const std::vector<std::uint32_t>& list = list_of(edge);
    in.require(list_positions_[edge.contact] < list.size() && list[list_positions_[edge.contact]] == edge.contact);
    edge.for_each_body([&](std::uint32_t slot) {
      const std::uint32_t bit = c.colour == overflow_colour ? 0 : 1u << c.colour;
      in.require((colours[slot] & bit) == 0);
      colours[slot] |= bit;
      overflow[slot] += bit == 0;
    });
    count(edge, 1);
  }
  in.require(joint_impulses_.size() == joints_.size() && generic_impulses_.size() <= joints_.size());
  for (const Joint& joint : joints_) {
    in.require(is_sound(joint.fixed_a) && is_sound(joint.in_use) && is_sound(joint.rigid));
    if (!joint.in_use) continue;
    in.require(joint.kind != ConstraintKind::contact && static_cast<std::size_t>(joint.kind) < constraint_kinds);
    in.require(joint.a < slots && joint.b < slots && joint.a != joint.b);
    if (joint.colour == no_colour) continue;
    in.require(joint.colour <= overflow_colour);
    const std::uint32_t bit = joint.colour == overflow_colour ? 0 : 1u << joint.colour;
    for (const std::uint32_t slot : {joint.a, joint.b}) {
      if (slot == joint.a && joint.fixed_a) continue;
      in.require((colours[slot] & bit) == 0);
      colours[slot] |= bit;
      overflow[slot] += bit == 0;
    }
    ++joint_counts_[joint.colour][kind_index(joint.kind)];
    between_ += !joint.fixed_a;
  }
  list_joints();
  in.require(colours == state_.colour_mask && overflow == state_.overflow_count);
  for (const std::vector<std::uint32_t>& list : colours_) {
    in.require(list.size() <= coloured);
    coloured -= list.size();
  }
  in.require(coloured == 0 && in_use + free_.size() == contacts);
  for (const std::uint32_t index : free_) in.require(index < contacts && !contacts_[index].in_use);
  for (const std::uint32_t index : free_manifolds_) in.require(index < manifolds_.size());
  for (const ContactManifold& m : manifolds_)
    in.require(m.point_count_as_float() >= 0 && m.point_count_as_float() <= static_cast<float>(max_manifold_points));
  for (const Contact& c : contacts_) in.require(!c.in_use || !c.touching() || can_be_solved(manifolds_[c.manifold]));
}

void Islands::restore(ByteReader& in) {
  archive(*this, in);
  in.require(sleeping_in_.size() <= state_.size());
  for (const std::uint32_t island : sleeping_in_) in.require(island == none || island < sleeping_.size());
  for (const auto& members : sleeping_)
    for (const std::uint32_t slot : members) in.require(slot < sleeping_in_.size());
  for (const std::uint32_t island : free_) in.require(island < sleeping_.size());
}

void Bvh::restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool) {
  ++times_built_, ++version_;
  in(leaves_, area_when_built_);
  for (const std::uint32_t leaf : leaves_) in.require(leaf < bounds.size());
  levels_.clear();
  if (leaves_.empty()) return;
  lay_out_levels();
  refit(bounds.data(), pool);
}

// --- the whole -----------------------------------------------------------------------------------------------

void NativeSimulator::save(ByteWriter& write) const {
  BodyState::archive(state_, write);
  Domains::archive(graph_.domains(), write);
  ContactGraph::archive(graph_, write);
  HeapDivision::archive(division_, write);
  SupportSolver::archive(solver_.supports(), write);
  Islands::archive(islands_, write);
  broad_phase_->save(write);
  write(set_changes_, begun_, ended_, ended_by_removal_, hits_, quarantined_, targets_);
}

void NativeSimulator::restore(ByteReader& in) {
  state_.restore(in, bodies.slot_count());
  for (const BodyId id : bodies.living()) {
    copy_shape(bodies[id.index], state_.bounds[id.index]);
    state_.flight[id.index] = flight_data(bodies[id.index]);
    state_.note_filter(id.index, bodies[id.index]);
  }
  graph_.restore(in);
  restore_joints(in);
  HeapDivision::archive(division_, in);
  solver_.supports().restore(in, state_.size());
  solver_.mechanisms().find_anew();
  islands_.restore(in);
  broad_phase_->restore(in, state_.bounds, pool_);
  in(set_changes_, begun_, ended_, ended_by_removal_, hits_, quarantined_, targets_);
  for (const std::uint32_t slot : set_changes_) in.require(slot < state_.size());
  for (const Target& target : targets_) in.require(target.slot < state_.size());
  // Lists bodies flagged for a force again.
  for (std::uint32_t slot = 0; slot < state_.size(); ++slot)
    if (state_.flags[slot] & has_force) forced_.push_back(slot);
}

}  // namespace fathom::native
