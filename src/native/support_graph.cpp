#include "native/support_graph.hpp"

#include <algorithm>
#include <utility>

#include "check/check.hpp"
#include "dynamics/support.hpp"
#include "native/prefetch.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t ahead = 8;  // iterations ahead that scattered memory is prefetched

/// True if any point of the manifold touches.
bool touches(const ContactManifold& m, const Pose& pose_a, const Pose& pose_b) {
  const Vec3 normal = rotate(pose_a.rotation, m.normal), between = pose_b.position - pose_a.position;
  const int count = m.point_count();
  for (int i = 0; i < count; ++i) {
    const Vec3 on_b = rotate(pose_b.rotation, m.points[i].anchor_b);
    const Vec3 on_a = rotate(pose_a.rotation, m.points[i].anchor_a);
    if (dot(between + on_b - on_a, normal) <= support_reach(on_b)) return true;
  }
  return false;
}

}  // namespace

void SupportGraph::clear_structures() {
  members_.clear();
  structures_.clear();
  supports_.clear();
  loads_.clear();
  is_built_ = false;
}

void SupportGraph::clear_levels() {
  levels_.clear();
  heaviest_.clear();
  levelled_.clear();
}

void SupportGraph::clear() {
  clear_structures();
  clear_levels();
  forget_levels();
}

void SupportGraph::restored(ByteReader& in, std::size_t slots) {
  in.require(levels_.size() <= slots && heaviest_.size() <= levels_.size());
  heaviest_.resize(levels_.size(), 0);
  levelled_.clear();
  for (std::uint32_t slot = 0; slot < levels_.size(); ++slot)
    if (levels_[slot] > 0) levelled_.push_back(slot);
  is_built_ = false;
}

bool SupportGraph::update(std::span<const std::uint32_t> in_contact, const Overloads& overloads, float stiffness,
                          std::uint64_t step) {
  const bool had_any = !members_.empty();
  const bool has_changed = levelled_at_ != graph_.colouring() && (!levels_.empty() || step >= search_at_);
  if (step < resume_at_ || (!has_changed && !overloads.any())) {
    clear_structures();
    if (step >= resume_at_) clear_levels();
    return had_any;
  }
  const auto is_new = [&](std::uint32_t slot) {
    return overloads.lasts(slot) && (slot >= levels_.size() || levels_[slot] == 0);
  };
  bool is_stale = has_changed || step % levels_last == 0;
  for (std::size_t i = 0; !is_stale && i < in_contact.size(); ++i) is_stale = is_new(in_contact[i]);
  // Without levels there is nothing to build, whether or not that was found since the last snapshot.
  if (!is_stale && (is_built_ || levels_.empty())) return false;
  number(in_contact);
  list_contacts(is_stale);
  if (is_stale) {
    levelled_at_ = graph_.colouring();
    list_links();
    find_levels();
    add_up_loads(stiffness);
    keep_overloaded(overloads);
    publish_levels();
  }
  build();
  if (members_.empty()) {
    clear_levels();
    search_at_ = step + steps_between_searches;
    give_back_search();
  }
  return had_any || !members_.empty();
}

// Memory of the search alone is kept only while there are structures to search again.
void SupportGraph::give_back_search() {
  std::vector<Link>().swap(links_);
  std::vector<Node>().swap(nodes_);
  std::vector<Coloured>().swap(contacts_);
  std::vector<Support>().swap(found_supports_);
  std::vector<Member>().swap(unsorted_);
  for (std::vector<std::uint32_t>* list : {&links_of_, &queue_, &places_}) std::vector<std::uint32_t>().swap(*list);
}

// A dynamic body with a coloured contact is in contact, so no arbitrary number is read. Bodies without contacts cost
// nothing.
void SupportGraph::number(std::span<const std::uint32_t> in_contact) {
  grow_to(numbers_, state_.size());
  grow_to(nodes_, in_contact.size());
  pool_.for_each_part(in_contact.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i + ahead < in_contact.size()) prefetch_to_read(&bodies_[in_contact[i + ahead]].mass);
      const BodyInfo& body = bodies_[in_contact[i]];
      const auto number = static_cast<std::uint32_t>(i);
      numbers_[in_contact[i]] = number;
      Node& node = nodes_[i] = {};
      node.slot = in_contact[i];
      node.parent = number;
      node.mass = body.mass, node.inverse_mass = body.inverse_mass;
      node.half_thickness = half_thickness(body);
    }
  });
}

void SupportGraph::list_contacts(bool for_links) {
  contacts_.clear();
  for (int colour = 0; colour < colour_count; ++colour)
    graph_.for_each_of_colour(colour, [&](std::uint32_t index) { contacts_.push_back({index, 0, 0, 0, false}); });
  const auto fetch = [&](const Coloured& c) {
    const auto* const manifold = reinterpret_cast<const std::byte*>(&graph_.manifold_at(c.manifold));
    prefetch_to_read(manifold), prefetch_to_read(manifold + 64);  // as far as the second point
    for (const std::uint32_t slot : {c.a, c.b})
      prefetch_to_read(&state_.poses[slot]), prefetch_to_read(&state_.velocities[slot]);
  };
  pool_.for_each_part(contacts_.size(), bodies_a_thread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i + ahead < contacts_.size()) prefetch_to_read(&graph_[contacts_[i + ahead].contact]);
      const Contact& c = graph_[contacts_[i].contact];
      contacts_[i].a = c.a, contacts_[i].b = c.b, contacts_[i].manifold = c.manifold;
    }
    for (std::size_t i = begin; for_links && i < end; ++i) {
      if (i + ahead < end) fetch(contacts_[i + ahead]);
      contacts_[i].presses = presses(contacts_[i]);
    }
  });
}

/// Whether the contact may carry something: it touches and is not a hit.
bool SupportGraph::presses(const Coloured& c) const {
  if (is_base(c.a) && is_base(c.b)) return false;
  Vec3 speed = state_.velocities[c.b].linear - state_.velocities[c.a].linear;
  if (graph_.any_moving_surface() && graph_[c.contact].on_moving_surface) speed += graph_.surface_slide(c.contact);
  if (length_squared(speed) > loaded_speed * loaded_speed) return false;
  return native::touches(graph_.manifold_at(c.manifold), state_.poses[c.a], state_.poses[c.b]);
}

bool SupportGraph::touches(std::uint32_t contact) const {
  const Contact& c = graph_[contact];
  return native::touches(graph_.manifold_at(c.manifold), state_.poses[c.a], state_.poses[c.b]);
}

std::uint32_t SupportGraph::node_of(std::uint32_t slot) const {
  FATHOM_ASSERT(numbers_[slot] < nodes_.size() && nodes_[numbers_[slot]].slot == slot, slot);
  return numbers_[slot];
}

std::uint32_t SupportGraph::root(std::uint32_t node) {
  while (nodes_[node].parent != node) node = nodes_[node].parent = nodes_[nodes_[node].parent].parent;
  return node;
}

void SupportGraph::join(std::uint32_t a, std::uint32_t b) {
  a = root(a), b = root(b);
  nodes_[std::max(a, b)].parent = std::min(a, b);
}

// Lists contacts that press, and for each body its contacts with dynamic ones.
void SupportGraph::list_links() {
  links_.clear();
  for (const Coloured& c : contacts_) {
    if (!c.presses) continue;
    const bool base_a = is_base(c.a), base_b = is_base(c.b);
    if (base_a || base_b) {
      const std::uint32_t node = node_of(base_a ? c.b : c.a);
      links_.push_back({none, node});
      ++nodes_[node].base_links;
      continue;
    }
    const std::uint32_t a = node_of(c.a), b = node_of(c.b);
    links_.push_back({a, b});
    ++nodes_[a].end_link, ++nodes_[b].end_link;  // a count until summed below
    join(a, b);
  }
  std::uint32_t end = 0;
  for (Node& node : nodes_) {
    node.first_link = end;
    end += std::exchange(node.end_link, end);
  }
  grow_to(links_of_, end);
  for (std::uint32_t i = 0; i < links_.size(); ++i)
    if (links_[i].a != none)
      links_of_[nodes_[links_[i].a].end_link++] = i, links_of_[nodes_[links_[i].b].end_link++] = i;
}

template <class Act>
void SupportGraph::for_each_neighbour(std::uint32_t node, const Act& act) const {
  for (std::uint32_t k = nodes_[node].first_link; k < nodes_[node].end_link; ++k) {
    const Link& l = links_[links_of_[k]];
    act(l.a == node ? l.b : l.a);
  }
}

// A breadth-first search from non-dynamic bodies.
void SupportGraph::find_levels() {
  queue_.clear();
  for (const Link& l : links_) {
    if (l.a != none || nodes_[l.b].level != 0) continue;
    nodes_[l.b].level = 1;
    queue_.push_back(l.b);
  }
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const std::uint16_t level = nodes_[queue_[i]].level;
    if (level == max_levels) break;
    for_each_neighbour(queue_[i], [&](std::uint32_t other) {
      if (nodes_[other].level != 0) return;
      nodes_[other].level = static_cast<std::uint16_t>(level + 1);
      queue_.push_back(other);
    });
  }
}

// Sums loads from the top level down; each body's load is divided evenly among its supports. A structure is overloaded
// if any of its contacts is.
void SupportGraph::add_up_loads(float stiffness) {
  for (const std::uint32_t node : queue_) nodes_[node].load = nodes_[node].mass;
  // A cube root takes long: only where the contact may be overloaded, and once for bodies of the same thickness.
  struct {
    float half_thickness = -1, load = 0;
  } last_of[2];
  const auto is_too_much = [&](float load, const Node& upper, const Node* lower) {
    const float inverse_mass = upper.inverse_mass + (lower ? lower->inverse_mass : 0);
    const float thinner = lower ? min(upper.half_thickness, lower->half_thickness) : upper.half_thickness;
    const float weights = load * inverse_mass, rigidity = lower ? stiffness : fixed_stiffness_ratio * stiffness;
    if (weights <= 12 && thinner * rigidity > 343) return false;  // there `sweep_load` is 12.6 at least
    auto& last = last_of[lower != nullptr];
    if (last.half_thickness != thinner) last = {thinner, sweep_load(thinner, rigidity)};
    return weights > last.load;
  };
  for (std::size_t i = queue_.size(); i-- > 0;) {
    const Node& upper = nodes_[queue_[i]];
    const auto for_each_lower = [&](const auto& act) {
      for_each_neighbour(queue_[i], [&](std::uint32_t other) {
        Node& lower = nodes_[other];
        if (lower.level < upper.level && lower.level > 0) act(lower);
      });
    };
    std::uint32_t supports = upper.base_links;
    for_each_lower([&](Node&) { ++supports; });
    const float share = upper.load / static_cast<float>(std::max(supports, 1u));
    // One overloaded contact is enough for a structure.
    bool overloaded = nodes_[root(queue_[i])].is_overloaded;
    overloaded = overloaded || (upper.base_links > 0 && is_too_much(share, upper, nullptr));
    for_each_lower([&](Node& lower) {
      lower.load += share;
      overloaded = overloaded || is_too_much(share, upper, &lower);
    });
    if (overloaded) nodes_[root(queue_[i])].is_overloaded = true;
  }
}

// Drops the levels of other structures.
void SupportGraph::keep_overloaded(const Overloads& overloads) {
  if (overloads.any())
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
      if (overloads.lasts(nodes_[i].slot)) nodes_[root(i)].is_overloaded = true;
  for (const std::uint32_t node : queue_) {
    Node& of_root = nodes_[root(node)];
    if (of_root.is_overloaded)
      of_root.heaviest = max(of_root.heaviest, nodes_[node].mass);
    else
      nodes_[node].level = 0;
  }
}

void SupportGraph::publish_levels() {
  for (const std::uint32_t slot : levelled_) levels_[slot] = 0, heaviest_[slot] = 0;
  levelled_.clear();
  for (const std::uint32_t node : queue_)
    if (nodes_[node].level > 0) levelled_.push_back(nodes_[node].slot);
  if (levelled_.empty()) return clear_levels();
  levels_.resize(state_.size(), 0);
  heaviest_.resize(state_.size(), 0);
  for (const std::uint32_t node : queue_) {
    const Node& n = nodes_[node];
    if (n.level > 0) levels_[n.slot] = n.level, heaviest_[n.slot] = nodes_[root(node)].heaviest;
  }
}

// Members are sorted by structure, level and slot; their supports by contact.
void SupportGraph::build() {
  is_built_ = true;
  members_.clear();
  structures_.clear();
  if (!levels_.empty()) levels_.resize(state_.size(), 0), heaviest_.resize(state_.size(), 0);
  if (!levels_.empty()) list_members();
  list_supports();
}

bool SupportGraph::is_member(std::uint32_t slot) const { return levels_[slot] > 0 && !is_base(slot); }

void SupportGraph::list_members() {
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i].parent = i;
    const std::uint32_t slot = nodes_[i].slot;
    if (is_member(slot)) members_.push_back({slot, 0, levels_[slot], 0, 0, 0, 0});
  }
  for (const Coloured& c : contacts_)
    if (is_member(c.a) && is_member(c.b)) join(node_of(c.a), node_of(c.b));
  for (Member& m : members_) m.structure = root(node_of(m.slot));
  sort_members();
  for (std::uint32_t i = 0; i < members_.size(); ++i) {
    nodes_[node_of(members_[i].slot)].member = i;
    if (i == 0 || members_[i].structure != members_[i - 1].structure) structures_.push_back({i, i});
    structures_.back().end = i + 1;
  }
}

// Members come in the order of their slots. Two stable passes put them in that of structures, levels and slots.
void SupportGraph::sort_members() {
  const auto sort = [this](std::size_t keys, const auto& key_of) {
    places_.assign(keys + 1, 0);
    for (const Member& m : members_) ++places_[key_of(m) + 1];
    for (std::size_t k = 0; k < keys; ++k) places_[k + 1] += places_[k];
    unsorted_.assign(members_.begin(), members_.end());
    for (const Member& m : unsorted_) members_[places_[key_of(m)]++] = m;
  };
  std::uint32_t top = 0;
  bool several = false;
  for (const Member& m : members_) top = std::max(top, m.level), several |= m.structure != members_[0].structure;
  sort(top + 1, [](const Member& m) { return m.level; });
  if (several) sort(nodes_.size(), [](const Member& m) { return m.structure; });
}

// By member, each one's by contact.
void SupportGraph::sort_supports() {
  std::uint32_t end = 0;
  for (Member& m : members_) {
    const std::uint32_t count = std::exchange(m.support_count, 0);
    m.first_support = count > 0 ? end : 0;
    end += count;
  }
  supports_.resize(end);
  for (const Support& support : found_supports_) {
    Member& upper = members_[support.upper];
    supports_[upper.first_support + upper.support_count++] = support;
  }
  for (const Member& m : members_)
    std::ranges::sort(std::span(supports_).subspan(m.first_support, m.support_count), {}, &Support::contact);
}

void SupportGraph::list_supports() {
  found_supports_.clear();
  for (Member& m : members_) m.support_count = m.load_count = 0;
  const auto member_of = [this](std::uint32_t slot) { return nodes_[node_of(slot)].member; };
  const auto add = [this](const Support& support) {
    found_supports_.push_back(support);
    ++members_[support.upper].support_count;
    if (support.lower != none) ++members_[support.lower].load_count;
  };
  for (std::size_t i = 0; i < contacts_.size() && !members_.empty(); ++i) {
    const Coloured& c = contacts_[i];
    const bool member_a = is_member(c.a), member_b = is_member(c.b);
    if (member_a && member_b) {
      if (levels_[c.a] == levels_[c.b]) continue;
      const bool b_is_upper = levels_[c.b] > levels_[c.a];
      const std::uint32_t upper = member_of(b_is_upper ? c.b : c.a), lower = member_of(b_is_upper ? c.a : c.b);
      add({c.contact, upper, lower, none, b_is_upper});
    } else if (member_b && is_base(c.a)) {
      add({c.contact, member_of(c.b), none, c.a, true});
    } else if (member_a && is_base(c.b)) {
      add({c.contact, member_of(c.a), none, c.b, false});
    }
  }
  sort_supports();
  std::uint32_t first = 0;
  for (Member& m : members_) {
    m.first_load = first;
    first += m.load_count;
    m.load_count = 0;
  }
  loads_.resize(first);
  for (std::uint32_t i = 0; i < supports_.size(); ++i) {
    if (supports_[i].lower == none) continue;
    Member& lower = members_[supports_[i].lower];
    loads_[lower.first_load + lower.load_count++] = i;
  }
}

std::size_t SupportGraph::memory_bytes() const {
  const auto bytes_of = [](const auto&... array) { return (... + (array.capacity() * sizeof(*array.data()))); };
  return bytes_of(levels_, heaviest_, levelled_, structures_, members_, supports_, loads_, numbers_, nodes_, contacts_,
                  links_, links_of_, queue_, found_supports_, unsorted_, places_);
}

}  // namespace fathom::native
