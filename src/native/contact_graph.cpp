#include "native/contact_graph.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <utility>

#include "dynamics/manifold_update.hpp"
#include "dynamics/rolling.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/touch.hpp"
#include "native/pieces.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t ahead = 8;  // iterations ahead that scattered memory is prefetched
constexpr std::uint32_t fixed_colours = ~0u << first_fixed_colour;

}  // namespace

// --- pairs ---------------------------------------------------------------------------------------------------

void ContactGraph::add(std::span<const Pair> pairs, std::vector<std::uint32_t>* added) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Pair pair = pairs[i];
    if (i + ahead < pairs.size()) pairs_.prefetch(pairs[i + ahead].a, pairs[i + ahead].b);
    if (pairs_.contains(pair.a, pair.b)) continue;
    const std::uint32_t index = take_slot();
    fill(contacts_[index], pair, contacts_made_++);
    pairs_.insert(pair.a, pair.b);
    if (contacts_[index].in_parts) begin_ring(index);
    if (body_contacts_.are_kept()) body_contacts_.add(index, contacts_[index]);
    if (added) added->push_back(index);
  }
}

// Only contacts in parts use the ring.
void ContactGraph::begin_ring(std::uint32_t index, Children children) {
  if (parts_.size() < contacts_.size()) {
    const std::size_t before = parts_.size();
    grow_to(parts_, contacts_.size());
    std::fill(parts_.begin() + static_cast<std::ptrdiff_t>(before), parts_.end(), PartLink{});
  }
  parts_[index] = {index, children};
}

std::uint32_t ContactGraph::add_part(std::uint32_t first, Children children) {
  const std::uint32_t index = take_slot();
  Contact& part = contacts_[index];
  fill(part, {contacts_[first].a, contacts_[first].b}, contacts_made_++);
  part.is_part = true;
  begin_ring(index, children);
  std::swap(parts_[index].next, parts_[first].next);
  if (body_contacts_.are_kept()) body_contacts_.add(index, part);
  return index;
}

std::uint32_t ContactGraph::take_slot() {
  if (free_.empty()) {
    grow_contacts(1);
    return static_cast<std::uint32_t>(contacts_.size() - 1);
  }
  const std::uint32_t index = free_.back();
  free_.pop_back();
  return index;
}

void ContactGraph::grow_contacts(std::size_t count) {
  grow_to(contacts_, contacts_.size() + count);
  grow_to(list_positions_, contacts_.size());
}

void ContactGraph::fill(Contact& c, Pair pair, std::uint64_t born) const {
  c = {};
  c.a = std::min(pair.a, pair.b);
  c.b = std::max(pair.a, pair.b);
  if (!state_.is_dynamic(bodies_, c.b)) std::swap(c.a, c.b);
  c.fixed_a = !state_.is_dynamic(bodies_, c.a);
  c.born = born;
  c.in_use = true;
  const BodyBounds &a = state_.bounds[c.a], &b = state_.bounds[c.b];
  c.touch_halvings = touch_halvings(min(a.radius, b.radius)) & 15;
  const bool boxes = a.is_box() && b.is_box();
  c.slack = Slack::of_distance(boxes ? fathom::recycle_distance(ShapeType::box, a.radius, ShapeType::box, b.radius)
                                     : recycle_distance(c, {}, bodies_));
  c.in_parts = !boxes && !(bodies_[c.a].geometry.is_convex() && bodies_[c.b].geometry.is_convex());
}

void ContactGraph::add_new(std::span<const Pair> pairs, ThreadPool& pool, std::vector<std::uint32_t>* added) {
  if (pairs.empty()) return;
  // The same indices as for pairs added one by one: free ones from the last, then new ones.
  const std::size_t old = std::min(free_.size(), pairs.size()), first_new = contacts_.size();
  const auto index_at = [&](std::size_t i) {
    return i < old ? free_[free_.size() - 1 - i] : static_cast<std::uint32_t>(first_new + i - old);
  };
  grow_contacts(pairs.size() - old);
  const std::size_t parts = parts_for(pool, pairs.size());
  for_each_part(pool, parts, [&](std::size_t part) {
    const std::size_t end = (part + 1) * pairs.size() / parts;
    for (std::size_t i = part * pairs.size() / parts; i < end; ++i) {
      if (i + ahead < end) {
        prefetch_to_write(&contacts_[index_at(i + ahead)]);
        for (const std::uint32_t slot : {pairs[i + ahead].a, pairs[i + ahead].b})
          prefetch_to_read(&state_.bounds[slot]);
      }
      fill(contacts_[index_at(i)], pairs[i], contacts_made_ + i);
    }
    for_each_in_tables(pairs, part, parts, [&](Pair pair) { pairs_.insert(pair.a, pair.b); });
  });
  contacts_made_ += pairs.size();
  if (bodies_.any_in_parts())
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (contacts_[index_at(i)].in_parts) begin_ring(index_at(i));
  for (std::size_t i = 0; i < pairs.size() && body_contacts_.are_kept(); ++i)
    body_contacts_.add(index_at(i), contacts_[index_at(i)]);
  if (added)
    for (std::size_t i = 0; i < pairs.size(); ++i) added->push_back(index_at(i));
  free_.resize(free_.size() - old);
}

// Each thread scans all pairs for those of its tables, which is cheaper than sorting them. It scans in batches without
// branches, which would be unpredictable.
template <class Act>
void ContactGraph::for_each_in_tables(std::span<const Pair> pairs, std::size_t part, std::size_t parts,
                                      const Act& act) const {
  constexpr std::size_t batch = 32;
  const std::size_t first = part * PairSet::tables / parts, count = (part + 1) * PairSet::tables / parts - first;
  std::uint32_t mine[batch];
  for (std::size_t i = 0; i < pairs.size();) {
    std::size_t found = 0;
    for (; i < pairs.size() && found < batch; ++i) {
      mine[found] = static_cast<std::uint32_t>(i);
      found += PairSet::table(pairs[i].a, pairs[i].b) - first < count;
    }
    for (std::size_t k = 0; k < found; ++k) pairs_.prefetch(pairs[mine[k]].a, pairs[mine[k]].b);
    for (std::size_t k = 0; k < found; ++k) act(pairs[mine[k]]);
  }
}

bool ContactGraph::is_mostly_parts() const {
  if (!any_parts()) return false;
  constexpr std::size_t sample = 512;  // scanning all would cost more than it gains
  std::size_t in_use = 0, in_parts = 0;
  for (std::size_t i = 0; i < std::min(contacts_.size(), sample); ++i) {
    const Contact& c = contacts_[i];
    in_use += c.in_use, in_parts += c.in_use && c.in_parts;
  }
  return 2 * in_parts > in_use;
}

void ContactGraph::remove(std::uint32_t index) {
  Contact& c = contacts_[index];
  if (c.colour != no_colour) uncolour(index);
  if (c.touching()) free_manifolds_.push_back(c.manifold);
  c.manifold = none;
  if (!c.is_part) pairs_.erase(c.a, c.b);
  c.in_use = false;
  free_.push_back(index);
}

// --- all changes of a step -----------------------------------------------------------------------------------

void ContactGraph::expect(std::size_t ended, std::size_t gone) {
  first_ended_ = free_manifolds_.size();
  first_gone_ = free_.size();
  grow_to(free_manifolds_, first_ended_ + ended);
  grow_to(free_, first_gone_ + gone);
}

GraphEdge ContactGraph::end(std::size_t i, std::uint32_t index) {
  const GraphEdge edge = edge_of(index);
  Contact& c = contacts_[index];
  free_manifolds_[first_ended_ + i] = c.manifold;
  c.manifold = none;
  c.colour = no_colour;
  c.hits = false;
  return edge;
}

Pair ContactGraph::leave(std::size_t i, std::uint32_t index) {
  Contact& c = contacts_[index];
  free_[first_gone_ + i] = index;
  c.in_use = false;
  return c.is_part ? Pair{c.a, c.a} : Pair{c.a, c.b};  // the pair goes with its first contact
}

void ContactGraph::forget(std::span<const Pair> pairs, std::size_t part, std::size_t parts) {
  for_each_in_tables(pairs, part, parts, [&](Pair pair) {
    if (pair.a != pair.b) pairs_.erase(pair.a, pair.b);
  });
}

void ContactGraph::make_manifolds(std::size_t count) {
  const std::size_t old = std::min(free_manifolds_.size(), count);
  if (new_manifolds_.size() < count) grow_to(new_manifolds_, count);
  std::reverse_copy(free_manifolds_.end() - static_cast<std::ptrdiff_t>(old), free_manifolds_.end(),
                    new_manifolds_.begin());
  free_manifolds_.resize(free_manifolds_.size() - old);
  for (std::size_t i = old; i < count; ++i) new_manifolds_[i] = static_cast<std::uint32_t>(manifolds_.size() + i - old);
  grow_to(manifolds_, manifolds_.size() + count - old);
}

void ContactGraph::mix_materials(Contact& c) {
  if (c.touching()) mix_materials(c, manifolds_[c.manifold]);
}

void ContactGraph::mix_materials(Contact& c, ContactManifold& m) {
  const Children children = this->children(static_cast<std::uint32_t>(&c - contacts_.data()));
  const Piece piece_a = piece_of(bodies_[c.a], children.a), piece_b = piece_of(bodies_[c.b], children.b);
  const Material &a = piece_a.material, &b = piece_b.material;
  m.friction = combine(largest_friction(a), largest_friction(b), a.friction_rule, b.friction_rule);
  m.restitution = combine(a.restitution, b.restitution, a.restitution_rule, b.restitution_rule);
  c.by_direction = !(a.friction_axis == Vec3{} && b.friction_axis == Vec3{});
  if (c.by_direction) std::atomic_ref(any_by_direction_).store(true, std::memory_order_relaxed);
  if (m.restitution > 0) std::atomic_ref(may_bounce_).store(true, std::memory_order_relaxed);
  c.own_slide = false;
  c.on_moving_surface = !(a.surface_velocity == Vec3{} && b.surface_velocity == Vec3{});
  if (c.on_moving_surface) std::atomic_ref(any_moving_surface_).store(true, std::memory_order_relaxed);
  if (!c.round) return;
  const auto radius = [](const Geometry& shape) { return is_round(shape.type) ? shape.radius : 0.0f; };
  set_round(m, radius(piece_a.geometry), radius(piece_b.geometry), a.rolling_resistance, b.rolling_resistance);
  if (m.rolling_length() > 0) std::atomic_ref(may_roll_).store(true, std::memory_order_relaxed);
}

ContactMaterials ContactGraph::mixed_materials(std::uint32_t a, std::uint32_t b, Children children) const {
  return native::mixed_materials(bodies_[a], bodies_[b], children, state_.poses[a].rotation, state_.poses[b].rotation);
}

void ContactGraph::give(std::uint32_t index, const ContactMaterials& materials) {
  Contact& c = contacts_[index];
  ContactManifold& m = manifold(c);
  c.by_direction = c.by_direction && m.friction == materials.friction;
  m.friction = materials.friction, m.restitution = materials.restitution;
  may_bounce_ = may_bounce_ || m.restitution > 0;
  c.own_slide = c.on_moving_surface = !(materials.slide == Vec3{});
  if (!c.own_slide) return;
  any_moving_surface_ = true;
  const auto entry = std::ranges::lower_bound(own_slides_, index, {}, &OwnSlide::contact);
  if (entry != own_slides_.end() && entry->contact == index)
    entry->slide = materials.slide;
  else
    own_slides_.insert(entry, {index, materials.slide});
}

void ContactGraph::drop_old_slides() {
  std::erase_if(own_slides_, [this](const OwnSlide& own) {
    return !contacts_[own.contact].in_use || !contacts_[own.contact].own_slide;
  });
}

Vec3 ContactGraph::surface_slide(std::uint32_t index) const {
  const Contact& c = contacts_[index];
  if (c.own_slide) return std::ranges::lower_bound(own_slides_, index, {}, &OwnSlide::contact)->slide;
  return mixed_materials(c.a, c.b, children(index)).slide;
}

FrictionEllipse ContactGraph::friction_ellipse(std::uint32_t index, Vec3 normal) const {
  const Contact& c = contacts_[index];
  const Children children = this->children(index);
  const auto side = [&](std::uint32_t slot, std::uint32_t child) {
    const Piece piece = piece_of(bodies_[slot], child);
    const Material& m = piece.material;
    return side_friction(m.friction, m.friction_along, m.friction_rule, friction_axis(bodies_[slot], child),
                         state_.poses[slot].rotation);
  };
  return fathom::friction_ellipse(side(c.a, children.a), side(c.b, children.b), normal);
}

Vec3 surface_slide(const ContactGraph& graph, std::uint32_t contact) { return graph.surface_slide(contact); }
FrictionEllipse friction_ellipse(const ContactGraph& graph, std::uint32_t contact, Vec3 normal) {
  return graph.friction_ellipse(contact, normal);
}

// --- colours -------------------------------------------------------------------------------------------------

GraphEdge ContactGraph::edge_of(std::uint32_t index) const {
  const Contact& c = contacts_[index];
  return {index, c.a, c.b, static_cast<std::uint16_t>(domains_.unit(c)), c.colour, c.fixed_a};
}

void ContactGraph::colour(std::uint32_t index) {
  GraphEdge edge = edge_of(index);
  constexpr std::uint32_t only = 0;
  colour({&edge, 1}, {&only, 1});
  relist({}, {&edge, 1}, 0, 1);
}

void ContactGraph::uncolour(std::uint32_t index) {
  const GraphEdge edge = edge_of(index);
  contacts_[index].colour = no_colour;
  uncolour({&edge, 1});
  relist({&edge, 1}, {}, 0, 1);
}

void ContactGraph::colour(std::span<GraphEdge> edges, std::span<const std::uint32_t> order) {
  colouring_ += !edges.empty();
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + ahead < order.size()) prefetch_bodies(edges[order[i + ahead]]);
    GraphEdge& edge = edges[order[i]];
    edge.colour = take_colour(edge.a, edge.b, edge.fixed_a);
    count(edge, 1);
  }
}

/// Takes the lowest colour free on all dynamic bodies.
std::uint8_t ContactGraph::take_colour(std::uint32_t a, std::uint32_t b, bool fixed_a) {
  std::uint32_t taken = state_.colour_mask[b];
  taken |= fixed_a ? ~fixed_colours : state_.colour_mask[a] | fixed_colours;
  const bool is_free = ~taken != 0;
  const std::uint8_t colour = is_free ? static_cast<std::uint8_t>(std::countr_one(taken)) : overflow_colour;
  const auto mark = [&](std::uint32_t slot) {
    if (is_free)
      state_.colour_mask[slot] |= 1u << colour;
    else
      ++state_.overflow_count[slot];
    state_.note_to_solve(slot);
  };
  mark(b);
  if (!fixed_a) mark(a);
  return colour;
}

void ContactGraph::give_back_colour(std::uint32_t a, std::uint32_t b, bool fixed_a, std::uint8_t colour) {
  const auto unmark = [&](std::uint32_t slot) {
    if (colour != overflow_colour)
      state_.colour_mask[slot] &= ~(1u << colour);
    else
      --state_.overflow_count[slot];
    state_.note_to_solve(slot);
  };
  unmark(b);
  if (!fixed_a) unmark(a);
}

void ContactGraph::uncolour(std::span<const GraphEdge> edges) {
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i + ahead < edges.size()) prefetch_bodies(edges[i + ahead]);
    const GraphEdge& edge = edges[i];
    if (edge.colour == no_colour) continue;
    ++colouring_;
    give_back_colour(edge.a, edge.b, edge.fixed_a, edge.colour);
    count(edge, -1);
  }
}

void ContactGraph::prefetch_bodies(const GraphEdge& edge) const {
  edge.for_each_body([&](std::uint32_t slot) { prefetch_to_write(&state_.colour_mask[slot]); });
}

void ContactGraph::count(const GraphEdge& edge, int more) {
  const auto add = [&](std::size_t& sum) { sum += static_cast<std::size_t>(more); };
  add(sizes_[edge.colour]);
  add(unit_sizes_[edge.unit]);
  if (!edge.fixed_a) add(between_);
}

void ContactGraph::relist(std::span<const GraphEdge> ended, std::span<const GraphEdge> begun, std::size_t part,
                          std::size_t parts) {
  const bool by_unit = domains_.in_use();
  const std::size_t owned = by_unit ? domains_.units() : overflow_colour + 1;
  const std::size_t first = part * owned / parts, count = (part + 1) * owned / parts - first;
  const auto is_mine = [&](const GraphEdge& s) { return (by_unit ? s.unit : s.colour) - first < count; };
  for (std::size_t i = 0; i < ended.size(); ++i) {
    if (i + ahead < ended.size() && is_mine(ended[i + ahead]))
      prefetch_to_read(&list_positions_[ended[i + ahead].contact]);
    const GraphEdge& edge = ended[i];
    if (!is_mine(edge) || edge.colour == no_colour) continue;
    std::vector<std::uint32_t>& list = list_of(edge);
    const std::uint32_t index = list_positions_[edge.contact], last = list.back();
    list[index] = last;
    list_positions_[last] = index;
    list.pop_back();
  }
  for (std::size_t i = 0; i < begun.size(); ++i) {
    if (i + ahead < begun.size() && is_mine(begun[i + ahead])) {
      prefetch_to_write(&list_positions_[begun[i + ahead].contact]);
      prefetch_to_write(&contacts_[begun[i + ahead].contact]);
    }
    if (!is_mine(begun[i])) continue;
    contacts_[begun[i].contact].colour = begun[i].colour;
    enlist(begun[i]);
  }
}

std::vector<std::uint32_t>& ContactGraph::list_of(const GraphEdge& edge) {
  return colours_[edge.unit * (overflow_colour + 1) + edge.colour];
}

void ContactGraph::enlist(const GraphEdge& edge) {
  std::vector<std::uint32_t>& list = list_of(edge);
  list_positions_[edge.contact] = static_cast<std::uint32_t>(list.size());
  if (list.size() == list.capacity()) {
    const std::size_t before = list.capacity();
    make_room(list, list.size() + 1);
    std::atomic_ref(colours_room_).fetch_add(list.capacity() - before, std::memory_order_relaxed);
  }
  list.push_back(edge.contact);
}

// --- domains -------------------------------------------------------------------------------------------------

void ContactGraph::divide(std::span<const std::uint32_t> slots, ThreadPool& pool) {
  ++colouring_;
  if (slots.empty())
    domains_.clear();
  else
    domains_.divide(slots, contacts_, between_, state_, pool);
  enlist_all(pool);
  list_joints();
}

// In the order of contacts. Two passes, so that several threads know where to write.
void ContactGraph::enlist_all(ThreadPool& pool) {
  constexpr std::size_t grain = 4096;
  const std::size_t lists = domains_.units() * (overflow_colour + 1), chunks = (contacts_.size() + grain - 1) / grain;
  colours_.resize(lists);
  std::vector<std::uint32_t> next(chunks * lists);  // by chunk and list: first the count, then the next index
  const auto for_each_in = [&](std::size_t begin, std::size_t end, const auto& act) {
    for (std::size_t index = begin; index < end; ++index)
      if (const Contact& c = contacts_[index]; c.in_use && c.colour != no_colour)
        act(static_cast<std::uint32_t>(index), next[begin / grain * lists + list_number(c)]);
  };
  pool.for_each_chunk(contacts_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for_each_in(begin, end, [](std::uint32_t, std::uint32_t& count) { ++count; });
  });
  std::vector<std::uint32_t> sizes(lists);
  for (std::uint32_t* of_chunk = next.data(); of_chunk != next.data() + next.size(); of_chunk += lists)
    for (std::size_t list = 0; list < lists; ++list) sizes[list] += std::exchange(of_chunk[list], sizes[list]);
  unit_sizes_.assign(domains_.units(), 0);
  colours_room_ = 0;
  for (std::size_t list = 0; list < lists; ++list) {
    make_room(colours_[list], sizes[list]);
    colours_[list].resize(sizes[list]);
    unit_sizes_[list / (overflow_colour + 1)] += sizes[list];
    colours_room_ += colours_[list].capacity();
  }
  pool.for_each_chunk(contacts_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for_each_in(begin, end, [&](std::uint32_t index, std::uint32_t& entry) {
      colours_[list_number(contacts_[index])][entry] = index;
      list_positions_[index] = entry++;
    });
  });
}

std::size_t ContactGraph::memory_bytes() const {
  return contacts_.capacity() * sizeof(Contact) + manifolds_.capacity() * sizeof(ContactManifold) +
         pairs_.memory_bytes() + body_contacts_.memory_bytes() + domains_.memory_bytes() +
         touch_changes_.memory_bytes() + colours_.capacity() * sizeof(colours_[0]) +
         joints_.capacity() * sizeof(Joint) + joint_impulses_.capacity() * sizeof(JointImpulse) +
         generic_joints_.capacity() * sizeof(GenericJoint) + generic_impulses_.capacity() * sizeof(GenericImpulse) +
         (list_positions_.capacity() + free_.capacity() + free_manifolds_.capacity() + new_manifolds_.capacity() +
          colours_room_) *
             sizeof(std::uint32_t);
}

}  // namespace fathom::native
