#include "native/contact_graph.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <utility>

#include "dynamics/manifold_update.hpp"
#include "dynamics/softness.hpp"
#include "native/prefetch.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

// Contacts that are linked, looked up and coloured one by one lie anywhere in memory, so they are fetched ahead.
constexpr std::size_t ahead = 8, far_ahead = 16;

constexpr std::size_t least_to_share = 128;  // pairs to add or to remove, in several threads
constexpr std::size_t slots_of_a_line = 16;  // heads of lists in a cache line

}  // namespace

void ContactGraph::add(std::span<const Pair> pairs, std::vector<std::uint32_t>* added) {
  if (added) make_room(*added, added->size() + pairs.size());
  if (pairs.size() > free_.size()) {
    make_room(contacts_, contacts_.size() + pairs.size() - free_.size());
    make_room(links_, contacts_.capacity());
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i + far_ahead < pairs.size()) {
      const Pair pair = pairs[i + far_ahead];
      pairs_.prefetch(pair.a, pair.b);
      for (const std::uint32_t slot : {pair.a, pair.b}) {
        __builtin_prefetch(&state_.bounds[slot]);
        __builtin_prefetch(&state_.first_contact[slot]);
      }
    }
    if (i + ahead < pairs.size())
      for (const std::uint32_t slot : {pairs[i + ahead].a, pairs[i + ahead].b})
        if (state_.first_contact[slot] != none) __builtin_prefetch(&links_[state_.first_contact[slot] >> 1]);
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
    grow_to(links_, contacts_.size());
  } else {
    index = free_.back();
    free_.pop_back();
  }
  Contact& c = contacts_[index];
  c = {};
  fill(c, pair);
  link(index, 0);
  link(index, 1);
  pairs_.insert(c.a, c.b);
  return index;
}

void ContactGraph::fill(Contact& c, Pair pair) const {
  c.a = std::min(pair.a, pair.b);
  c.b = std::max(pair.a, pair.b);
  if (!state_.is_dynamic(bodies_, c.b)) std::swap(c.a, c.b);
  c.fixed_a = !state_.is_dynamic(bodies_, c.a);
  c.in_use = true;
  const BodyBounds &a = state_.bounds[c.a], &b = state_.bounds[c.b];
  c.recycle_distance = a.is_box() && b.is_box()
                           ? fathom::recycle_distance(ShapeType::box, a.radius, ShapeType::box, b.radius)
                           : recycle_distance(bodies_[c.a], bodies_[c.b]);
}

// A body's list is all links on its side of its contacts, so whoever owns the body may change it whatever others do.
// Neighbours in number are mostly neighbours in space, so that most contacts have one owner. Lists and the set of pairs
// are different work: two threads take one each, and neither reads what the other writes.
template <class Alone, class OfBodies, class OfTables>
void ContactGraph::for_each_owner(ThreadPool& pool, const Alone& alone, const OfBodies& of_bodies,
                                  const OfTables& of_tables) const {
  const auto owners = static_cast<std::size_t>((pool.thread_count() + 1) / 2);
  const std::size_t lines = (state_.size() + slots_of_a_line - 1) / slots_of_a_line;
  pool.for_each_chunk_beside(alone, 2 * owners, 1, [&](std::size_t chunk, std::size_t) {
    if (chunk >= owners) return of_tables([=](std::size_t table) { return table % owners == chunk - owners; });
    const std::size_t first = chunk * lines / owners * slots_of_a_line;
    const std::size_t last = (chunk + 1) * lines / owners * slots_of_a_line;
    of_bodies([=](std::uint32_t slot) { return slot - first < last - first; });
  });
}

void ContactGraph::add_new(std::span<const Pair> pairs, ThreadPool& pool, std::vector<std::uint32_t>* added) {
  if (pool.thread_count() == 1 || pairs.size() < least_to_share) return add(pairs, added);
  // The places that one thread would have taken.
  const std::size_t old = std::min(free_.size(), pairs.size());
  grow_to(new_contacts_, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    new_contacts_[i] = i < old ? free_[free_.size() - 1 - i] : static_cast<std::uint32_t>(contacts_.size() + i - old);
  free_.resize(free_.size() - old);
  grow_to(contacts_, contacts_.size() + pairs.size() - old);
  grow_to(links_, contacts_.size());
  pool.for_each_part(pairs.size(), least_to_share / 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i + far_ahead < end) {
        prefetch_to_write(&contacts_[new_contacts_[i + far_ahead]]);
        for (const std::uint32_t slot : {pairs[i + far_ahead].a, pairs[i + far_ahead].b})
          prefetch_to_read(&state_.bounds[slot]);
      }
      contacts_[new_contacts_[i]] = {};
      fill(contacts_[new_contacts_[i]], pairs[i]);
    }
  });
  const auto link_all = [&](const auto& owns) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (i + far_ahead < pairs.size()) prefetch(new_contacts_[i + far_ahead]);
      if (i + ahead < pairs.size())
        for (const std::uint32_t slot : {pairs[i + ahead].a, pairs[i + ahead].b})
          if (owns(slot) && state_.first_contact[slot] != none)
            prefetch_to_write(&links_[state_.first_contact[slot] >> 1]);
      if (!owns(pairs[i].a) && !owns(pairs[i].b)) continue;
      const std::uint32_t index = new_contacts_[i];
      const Contact& c = contacts_[index];
      if (owns(c.a)) link(index, 0);
      if (owns(c.b)) link(index, 1);
    }
  };
  const auto insert_all = [&](const auto& owns_table) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto is_mine = [&](Pair p) { return owns_table(PairSet::table(p.a, p.b)); };
      if (i + ahead < pairs.size() && is_mine(pairs[i + ahead]))
        pairs_.prefetch(pairs[i + ahead].a, pairs[i + ahead].b);
      if (is_mine(pairs[i])) pairs_.insert(pairs[i].a, pairs[i].b);
    }
  };
  for_each_owner(
      pool, [] {}, link_all, insert_all);
  if (added) added->insert(added->end(), new_contacts_.begin(), new_contacts_.end());
}

void ContactGraph::remove(std::span<const PartedContact> parted, ThreadPool& pool,
                          const std::function<void()>& end_touch) {
  if (pool.thread_count() == 1 || parted.size() < least_to_share) {
    end_touch();
    for (std::size_t i = 0; i < parted.size(); ++i) {
      if (i + ahead < parted.size()) {
        pairs_.prefetch(parted[i + ahead].a, parted[i + ahead].b);
        prefetch_neighbours(parted[i + ahead].contact, 0);
        prefetch_neighbours(parted[i + ahead].contact, 1);
      }
      if (parted[i].gone) remove(parted[i].contact);
    }
    return;
  }
  const auto unlink_all = [&](const auto& owns) {
    for (std::size_t i = 0; i < parted.size(); ++i) {
      if (i + far_ahead < parted.size()) prefetch(parted[i + far_ahead].contact);
      if (i + ahead < parted.size()) {
        const PartedContact& next = parted[i + ahead];
        if (owns(next.a)) prefetch_neighbours(next.contact, 0);
        if (owns(next.b)) prefetch_neighbours(next.contact, 1);
      }
      const PartedContact& p = parted[i];
      if (!p.gone) continue;
      if (owns(p.a)) unlink(p.contact, 0);
      if (owns(p.b)) {
        unlink(p.contact, 1);
        contacts_[p.contact].in_use = false;
      }
    }
  };
  const auto erase_all = [&](const auto& owns_table) {
    for (std::size_t i = 0; i < parted.size(); ++i) {
      const auto is_mine = [&](const PartedContact& p) { return owns_table(PairSet::table(p.a, p.b)); };
      if (i + ahead < parted.size() && is_mine(parted[i + ahead]))
        pairs_.prefetch(parted[i + ahead].a, parted[i + ahead].b);
      if (parted[i].gone && is_mine(parted[i])) pairs_.erase(parted[i].a, parted[i].b);
    }
  };
  for_each_owner(pool, end_touch, unlink_all, erase_all);
  for (const PartedContact& p : parted)
    if (p.gone) free_.push_back(p.contact);
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

void ContactGraph::make_manifolds(std::size_t count) {
  const std::size_t old = std::min(free_manifolds_.size(), count);
  grow_to(new_manifolds_, count);
  std::reverse_copy(free_manifolds_.end() - static_cast<std::ptrdiff_t>(old), free_manifolds_.end(),
                    new_manifolds_.begin());
  free_manifolds_.resize(free_manifolds_.size() - old);
  for (std::size_t i = old; i < count; ++i) new_manifolds_[i] = static_cast<std::uint32_t>(manifolds_.size() + i - old);
  grow_to(manifolds_, manifolds_.size() + count - old);
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
  note_in_bodies(index);
  ++sizes_[c.colour];
  between_ += !c.fixed_a;
  enlist(index);
}

void ContactGraph::note_in_bodies(std::uint32_t index) {
  const Contact& c = contacts_[index];
  state_.contacts_xor[c.b] ^= index;
  state_.neighbours_xor[c.b] ^= c.a;
  if (c.fixed_a) return;
  state_.contacts_xor[c.a] ^= index;
  state_.neighbours_xor[c.a] ^= c.b;
}

std::vector<std::uint32_t>& ContactGraph::list_of(const Contact& c) { return colours_[list_number(c)]; }

void ContactGraph::enlist(std::uint32_t index) {
  Contact& c = contacts_[index];
  std::vector<std::uint32_t>& list = list_of(c);
  c.colour_slot = static_cast<std::uint32_t>(list.size());
  make_room(list, list.size() + 1);
  list.push_back(index);
  ++unit_sizes_[domains_.unit(c)];
}

void ContactGraph::divide(std::span<const std::uint32_t> slots, ThreadPool& pool) {
  ++colouring_;
  if (slots.empty())
    domains_.clear();
  else
    domains_.divide(slots, contacts_, between_, state_, pool);
  enlist_all(pool);
}

// In the order of contacts. Two passes, so that several threads know where to write.
void ContactGraph::enlist_all(ThreadPool& pool) {
  constexpr std::size_t grain = 4096;
  const std::size_t lists = domains_.units() * (overflow_colour + 1), chunks = (contacts_.size() + grain - 1) / grain;
  colours_.resize(lists);
  std::vector<std::uint32_t> places(chunks * lists);  // by chunk and list: how many, then the next one's
  const auto for_each_in = [&](std::size_t begin, std::size_t end, const auto& act) {
    for (std::size_t index = begin; index < end; ++index)
      if (const Contact& c = contacts_[index]; c.in_use && c.colour != no_colour)
        act(static_cast<std::uint32_t>(index), places[begin / grain * lists + list_number(c)]);
  };
  pool.for_each_chunk(contacts_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for_each_in(begin, end, [](std::uint32_t, std::uint32_t& count) { ++count; });
  });
  std::vector<std::uint32_t> sizes(lists);
  for (std::uint32_t* of_chunk = places.data(); of_chunk != places.data() + places.size(); of_chunk += lists)
    for (std::size_t list = 0; list < lists; ++list) sizes[list] += std::exchange(of_chunk[list], sizes[list]);
  unit_sizes_.assign(domains_.units(), 0);
  for (std::size_t list = 0; list < lists; ++list) {
    make_room(colours_[list], sizes[list]);
    colours_[list].resize(sizes[list]);
    unit_sizes_[list / (overflow_colour + 1)] += sizes[list];
  }
  pool.for_each_chunk(contacts_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for_each_in(begin, end, [&](std::uint32_t index, std::uint32_t& place) {
      Contact& c = contacts_[index];
      c.colour_slot = place++;
      colours_[list_number(c)][c.colour_slot] = index;
    });
  });
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
  note_in_bodies(index);
  state_.note_to_solve(c.b);
  if (!c.fixed_a) state_.note_to_solve(c.a);
  c.colour = no_colour;
}

void ContactGraph::link(std::uint32_t index, std::uint32_t side) {
  ContactLinks& links = links_[index];
  std::uint32_t& head = state_.first_contact[body(contacts_[index], side)];
  links.next[side] = head;
  links.previous[side] = none;
  if (head != none) links_[head >> 1].previous[head & 1] = index << 1 | side;
  head = index << 1 | side;
}

void ContactGraph::unlink(std::uint32_t index, std::uint32_t side) {
  const std::uint32_t next = links_[index].next[side], previous = links_[index].previous[side];
  if (previous == none)
    state_.first_contact[body(contacts_[index], side)] = next;
  else
    links_[previous >> 1].next[previous & 1] = next;
  if (next != none) links_[next >> 1].previous[next & 1] = previous;
}

void ContactGraph::prefetch(std::uint32_t index) const {
  __builtin_prefetch(&contacts_[index]);
  __builtin_prefetch(&links_[index]);
}

void ContactGraph::prefetch_neighbours(std::uint32_t index, std::uint32_t side) const {
  const ContactLinks& links = links_[index];
  for (const std::uint32_t link : {links.next[side], links.previous[side]})
    if (link != none) __builtin_prefetch(&links_[link >> 1]);
}

void ContactGraph::prefetch_bodies(std::uint32_t index) const {
  for (const std::uint32_t slot : {contacts_[index].a, contacts_[index].b}) {
    __builtin_prefetch(&state_.colour_mask[slot]);
    __builtin_prefetch(&state_.contacts_xor[slot]);
    __builtin_prefetch(&state_.neighbours_xor[slot]);
    __builtin_prefetch(&state_.flags[slot]);
    __builtin_prefetch(&bodies_[slot]);
  }
}

std::size_t ContactGraph::memory_bytes() const {
  std::size_t sum =
      contacts_.capacity() * sizeof(Contact) + links_.capacity() * sizeof(ContactLinks) +
      manifolds_.capacity() * sizeof(ContactManifold) + pairs_.memory_bytes() + domains_.memory_bytes() +
      colours_.capacity() * sizeof(colours_[0]) +
      (free_.capacity() + free_manifolds_.capacity() + new_contacts_.capacity() + new_manifolds_.capacity()) *
          sizeof(std::uint32_t);
  for (const auto& list : colours_) sum += list.capacity() * sizeof(std::uint32_t);
  return sum;
}

}  // namespace fathom::native
