#include "native/contact_graph.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>

#include "dynamics/manifold_update.hpp"
#include "dynamics/softness.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

// Contacts that are linked, looked up and coloured one by one lie anywhere in memory, so they are fetched ahead.
constexpr std::size_t ahead = 8, far_ahead = 16;

}  // namespace

void ContactGraph::add(std::span<const Pair> pairs, std::vector<std::uint32_t>* added) {
  if (added) make_room(*added, added->size() + pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i + far_ahead < pairs.size()) {
      const Pair pair = pairs[i + far_ahead];
      pairs_.prefetch(pair.a, pair.b);
      for (const std::uint32_t slot : {pair.a, pair.b}) {
        __builtin_prefetch(&bodies_[slot]);
        __builtin_prefetch(&state_.first_contact[slot]);
      }
    }
    if (i + ahead < pairs.size())
      for (const std::uint32_t slot : {pairs[i + ahead].a, pairs[i + ahead].b})
        if (state_.first_contact[slot] != none) __builtin_prefetch(&contacts_[state_.first_contact[slot] >> 1]);
    if (pairs_.contains(pairs[i].a, pairs[i].b)) continue;
    const std::uint32_t contact = add(pairs[i]);
    if (added) added->push_back(contact);
  }
}

std::uint32_t ContactGraph::add(Pair pair) {
  std::uint32_t index;
  if (free_.empty()) {
    index = static_cast<std::uint32_t>(contacts_.size());
    grow_to(contacts_, contacts_.size() + 1);
  } else {
    index = free_.back();
    free_.pop_back();
    contacts_[index] = {};
  }
  Contact& c = contacts_[index];
  c.a = std::min(pair.a, pair.b);
  c.b = std::max(pair.a, pair.b);
  if (bodies_[c.b].motion != MotionType::dynamic) std::swap(c.a, c.b);
  c.fixed_a = bodies_[c.a].motion != MotionType::dynamic;
  c.in_use = true;
  c.recycle_distance = recycle_distance(bodies_[c.a].radius, bodies_[c.b].radius);
  link(index, 0);
  link(index, 1);
  pairs_.insert(c.a, c.b);
  return index;
}

void ContactGraph::remove(std::uint32_t index) {
  Contact& c = contacts_[index];
  if (c.colour != no_colour) uncolour(index);
  unlink(index, 0);
  unlink(index, 1);
  pairs_.erase(c.a, c.b);
  if (c.touching()) end(index);
  c.in_use = false;
  free_.push_back(index);
}

void ContactGraph::begin(std::uint32_t index) {
  Contact& c = contacts_[index];
  if (free_manifolds_.empty()) {
    c.manifold = static_cast<std::uint32_t>(manifolds_.size());
    grow_to(manifolds_, manifolds_.size() + 1);
  } else {
    c.manifold = free_manifolds_.back();
    free_manifolds_.pop_back();
  }
}

void ContactGraph::end(std::uint32_t index) {
  free_manifolds_.push_back(contacts_[index].manifold);
  contacts_[index].manifold = none;
}

void ContactGraph::mix_materials(const Contact& c) {
  if (!c.touching()) return;
  ContactManifold& m = manifolds_[c.manifold];
  const Material &a = bodies_[c.a].material, &b = bodies_[c.b].material;
  m.friction = combine(a.friction, b.friction, a.friction_rule, b.friction_rule);
  m.restitution = combine(a.restitution, b.restitution, a.restitution_rule, b.restitution_rule);
  if (m.restitution > 0) std::atomic_ref(may_bounce_).store(true, std::memory_order_relaxed);
}

void ContactGraph::colour(std::uint32_t index) {
  ++colouring_;
  Contact& c = contacts_[index];
  constexpr std::uint32_t fixed_colours = ~0u << first_fixed_colour;
  std::uint32_t taken = state_.colour_mask[c.b];
  if (c.fixed_a)
    taken |= ~fixed_colours;
  else
    taken |= state_.colour_mask[c.a] | fixed_colours;
  if (~taken != 0) {
    c.colour = static_cast<std::uint8_t>(std::countr_one(taken));
    const std::uint32_t bit = 1u << c.colour;
    state_.colour_mask[c.b] |= bit;
    if (!c.fixed_a) state_.colour_mask[c.a] |= bit;
  } else {
    c.colour = overflow_colour;
    ++state_.overflow_count[c.b];
    if (!c.fixed_a) ++state_.overflow_count[c.a];
  }
  state_.note_to_solve(c.b);
  if (!c.fixed_a) state_.note_to_solve(c.a);
  ++sizes_[c.colour];
  between_ += !c.fixed_a;
  enlist(index);
}

std::vector<std::uint32_t>& ContactGraph::list_of(const Contact& c) {
  return colours_[domains_.unit(c) * (overflow_colour + 1) + c.colour];
}

void ContactGraph::enlist(std::uint32_t index) {
  Contact& c = contacts_[index];
  std::vector<std::uint32_t>& list = list_of(c);
  c.colour_slot = static_cast<std::uint32_t>(list.size());
  make_room(list, list.size() + 1);
  list.push_back(index);
  ++unit_sizes_[domains_.unit(c)];
}

void ContactGraph::divide(std::span<const std::uint32_t> slots) {
  ++colouring_;
  if (slots.empty())
    domains_.clear();
  else
    domains_.divide(slots, between_, state_);
  colours_.resize(domains_.units() * (overflow_colour + 1));
  for (std::vector<std::uint32_t>& list : colours_) list.clear();
  unit_sizes_.assign(domains_.units(), 0);
  for (std::uint32_t index = 0; index < contacts_.size(); ++index)
    if (contacts_[index].in_use && contacts_[index].colour != no_colour) enlist(index);
}

void ContactGraph::uncolour(std::uint32_t index) {
  ++colouring_;
  Contact& c = contacts_[index];
  std::vector<std::uint32_t>& list = list_of(c);
  --sizes_[c.colour];
  --unit_sizes_[domains_.unit(c)];
  between_ -= !c.fixed_a;
  contacts_[list.back()].colour_slot = c.colour_slot;
  list[c.colour_slot] = list.back();
  list.pop_back();
  if (c.colour == overflow_colour) {
    --state_.overflow_count[c.b];
    if (!c.fixed_a) --state_.overflow_count[c.a];
  } else {
    const std::uint32_t bit = 1u << c.colour;
    state_.colour_mask[c.b] &= ~bit;
    if (!c.fixed_a) state_.colour_mask[c.a] &= ~bit;
  }
  state_.note_to_solve(c.b);
  if (!c.fixed_a) state_.note_to_solve(c.a);
  c.colour = no_colour;
}

void ContactGraph::link(std::uint32_t index, std::uint32_t side) {
  Contact& c = contacts_[index];
  std::uint32_t& head = state_.first_contact[body(c, side)];
  c.next[side] = head;
  c.previous[side] = none;
  if (head != none) contacts_[head >> 1].previous[head & 1] = index << 1 | side;
  head = index << 1 | side;
}

void ContactGraph::unlink(std::uint32_t index, std::uint32_t side) {
  const Contact& c = contacts_[index];
  const std::uint32_t next = c.next[side], previous = c.previous[side];
  if (previous == none)
    state_.first_contact[body(c, side)] = next;
  else
    contacts_[previous >> 1].next[previous & 1] = next;
  if (next != none) contacts_[next >> 1].previous[next & 1] = previous;
}

void ContactGraph::prefetch(std::uint32_t index) const {
  const auto* bytes = reinterpret_cast<const std::byte*>(&contacts_[index]);
  __builtin_prefetch(bytes);
  __builtin_prefetch(bytes + sizeof(Contact) - 1);
}

void ContactGraph::prefetch_neighbours(std::uint32_t index) const {
  const Contact& c = contacts_[index];
  pairs_.prefetch(c.a, c.b);
  for (int side = 0; side < 2; ++side) {
    if (c.next[side] != none) __builtin_prefetch(&contacts_[c.next[side] >> 1]);
    if (c.previous[side] != none) __builtin_prefetch(&contacts_[c.previous[side] >> 1]);
  }
}

void ContactGraph::prefetch_bodies(std::uint32_t index) const {
  for (const std::uint32_t slot : {contacts_[index].a, contacts_[index].b}) {
    __builtin_prefetch(&state_.colour_mask[slot]);
    __builtin_prefetch(&state_.flags[slot]);
    __builtin_prefetch(&bodies_[slot]);
  }
}

std::size_t ContactGraph::memory_bytes() const {
  std::size_t sum = contacts_.capacity() * sizeof(Contact) + manifolds_.capacity() * sizeof(ContactManifold) +
                    pairs_.memory_bytes() + domains_.memory_bytes() + colours_.capacity() * sizeof(colours_[0]) +
                    (free_.capacity() + free_manifolds_.capacity()) * sizeof(std::uint32_t);
  for (const auto& list : colours_) sum += list.capacity() * sizeof(std::uint32_t);
  return sum;
}

}  // namespace fathom::native
