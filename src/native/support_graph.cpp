#include "native/support_graph.hpp"

#include <algorithm>
#include <numeric>

#include "dynamics/support.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

/// True where some point of the manifold touches.
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

bool SupportGraph::update(std::span<const std::uint32_t> in_contact, const Overloads& overloads, float stiffness,
                          std::uint64_t step) {
  const bool had_any = !members_.empty();
  const bool has_changed = levelled_at_ != graph_.colouring() && (!levels_.empty() || step >= search_at_);
  if (step < resume_at_ || (!has_changed && !overloads.any())) {
    clear_structures();
    if (step >= resume_at_) levels_.clear(), heaviest_.clear();
    return had_any;
  }
  const auto is_new = [&](std::uint32_t slot) {
    return overloads.lasts(slot) && (slot >= levels_.size() || levels_[slot] == 0);
  };
  bool is_stale = has_changed || step % levels_last == 0;
  for (std::size_t i = 0; !is_stale && i < in_contact.size(); ++i) is_stale = is_new(in_contact[i]);
  if (!is_stale && is_built_) return false;
  if (is_stale) {
    levelled_at_ = graph_.colouring();
    list_links(in_contact);
    find_levels();
    add_up_loads(stiffness);
    keep_overloaded(in_contact, overloads);
    find_heaviest();
  }
  build(in_contact);
  if (members_.empty()) {
    levels_.clear();
    heaviest_.clear();
    search_at_ = step + steps_between_searches;
    give_back_search();
  }
  return had_any || !members_.empty();
}

// What only a search needs is worth its memory where there are structures to search again.
void SupportGraph::give_back_search() {
  std::vector<Link>().swap(links_);
  for (std::vector<std::uint32_t>* list : {&first_link_, &links_of_, &base_links_, &queue_})
    std::vector<std::uint32_t>().swap(*list);
  std::vector<float>().swap(load_);
}

/// Calls act(index, contact) for contacts that have a colour, in the order of colours' lists.
template <class Act>
void SupportGraph::for_each_contact(const Act& act) const {
  for (int colour = 0; colour < colour_count; ++colour)
    graph_.for_each_of_colour(colour, [&](std::uint32_t index) { act(index, graph_[index]); });
}

std::uint32_t SupportGraph::root(std::uint32_t slot) {
  while (parent_[slot] != slot) slot = parent_[slot] = parent_[parent_[slot]];
  return slot;
}

// Contacts that touch without being hits, and for each body those that it has with others that can be pushed.
void SupportGraph::list_links(std::span<const std::uint32_t> in_contact) {
  grow_to(parent_, state_.size());
  for (const std::uint32_t slot : in_contact) parent_[slot] = slot;
  const auto is_hit = [&](std::uint32_t index, const Contact& c) {
    Vec3 speed = state_.velocities[c.b].linear - state_.velocities[c.a].linear;
    if (c.on_moving_surface) speed += graph_.surface_slide(index);
    return length_squared(speed) > loaded_speed * loaded_speed;
  };
  links_.clear();
  first_link_.assign(state_.size() + 1, 0);
  for_each_contact([&](std::uint32_t index, const Contact& c) {
    const bool base_a = is_base(c.a), base_b = is_base(c.b);
    if ((base_a && base_b) || is_hit(index, c)) return;
    if (!touches(graph_.manifold(c), state_.poses[c.a], state_.poses[c.b])) return;
    if (base_a || base_b) {
      links_.push_back({index, base_a ? c.a : c.b, base_a ? c.b : c.a, true});
      return;
    }
    links_.push_back({index, c.a, c.b, false});
    ++first_link_[c.a + 1], ++first_link_[c.b + 1];
    const std::uint32_t a = root(c.a), b = root(c.b);
    parent_[std::max(a, b)] = std::min(a, b);
  });
  std::partial_sum(first_link_.begin(), first_link_.end(), first_link_.begin());
  grow_to(links_of_, first_link_.back());
  for (std::uint32_t i = 0; i < links_.size(); ++i)
    if (!links_[i].fixed) links_of_[first_link_[links_[i].a]++] = i, links_of_[first_link_[links_[i].b]++] = i;
}

// A breadth-first search from what cannot be pushed. `first_link_` now has the ends of bodies' lists.
void SupportGraph::find_levels() {
  levels_.assign(state_.size(), 0);
  queue_.clear();
  for (const Link& l : links_) {
    if (!l.fixed || levels_[l.b] != 0) continue;
    levels_[l.b] = 1;
    queue_.push_back(l.b);
  }
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const std::uint32_t slot = queue_[i];
    if (levels_[slot] == max_levels) break;
    for (std::uint32_t k = slot == 0 ? 0 : first_link_[slot - 1]; k < first_link_[slot]; ++k) {
      const Link& l = links_[links_of_[k]];
      const std::uint32_t other = l.a == slot ? l.b : l.a;
      if (levels_[other] != 0) continue;
      levels_[other] = static_cast<std::uint16_t>(levels_[slot] + 1);
      queue_.push_back(other);
    }
  }
}

// Loads from the top level down, each body's shared out evenly among its supports. A structure is overloaded where one
// of its contacts is.
void SupportGraph::add_up_loads(float stiffness) {
  grow_to(load_, state_.size());
  is_overloaded_.assign(state_.size(), 0);
  for (const std::uint32_t slot : queue_) load_[slot] = bodies_[slot].mass;
  const auto is_too_much = [&](float load, const BodyInfo& upper, const BodyInfo* lower) {
    const float inverse_mass = upper.inverse_mass + (lower ? lower->inverse_mass : 0);
    const float thinner = lower ? min(half_thickness(upper), half_thickness(*lower)) : half_thickness(upper);
    return load * inverse_mass > sweep_load(thinner, lower ? stiffness : fixed_stiffness_ratio * stiffness);
  };
  std::vector<std::uint32_t>& base_links = base_links_;
  base_links.assign(state_.size(), 0);
  for (const Link& l : links_) base_links[l.b] += l.fixed;
  for (std::size_t i = queue_.size(); i-- > 0;) {
    const std::uint32_t slot = queue_[i];
    const std::uint32_t begin = slot == 0 ? 0 : first_link_[slot - 1], end = first_link_[slot];
    const auto lower_of = [&](std::uint32_t k) {
      const Link& l = links_[links_of_[k]];
      const std::uint32_t other = l.a == slot ? l.b : l.a;
      return levels_[other] < levels_[slot] && levels_[other] > 0 ? other : none;
    };
    std::uint32_t supports = base_links[slot];
    for (std::uint32_t k = begin; k < end; ++k) supports += lower_of(k) != none;
    const float share = load_[slot] / static_cast<float>(std::max(supports, 1u));
    bool overloaded = base_links[slot] > 0 && is_too_much(share, bodies_[slot], nullptr);
    for (std::uint32_t k = begin; k < end; ++k) {
      const std::uint32_t lower = lower_of(k);
      if (lower == none) continue;
      load_[lower] += share;
      overloaded = overloaded || is_too_much(share, bodies_[slot], &bodies_[lower]);
    }
    if (overloaded) is_overloaded_[root(slot)] = 1;
  }
}

// Levels of other structures are forgotten.
void SupportGraph::keep_overloaded(std::span<const std::uint32_t> in_contact, const Overloads& overloads) {
  if (overloads.any())
    for (const std::uint32_t slot : in_contact)
      if (overloads.lasts(slot)) is_overloaded_[root(slot)] = 1;
  for (const std::uint32_t slot : queue_)
    if (!is_overloaded_[root(slot)]) levels_[slot] = 0;
}

void SupportGraph::find_heaviest() {
  heaviest_.assign(state_.size(), 0);
  for (const std::uint32_t slot : queue_) {
    float& of_root = heaviest_[root(slot)];
    if (levels_[slot] > 0) of_root = max(of_root, bodies_[slot].mass);
  }
  for (const std::uint32_t slot : queue_) heaviest_[slot] = levels_[slot] > 0 ? heaviest_[root(slot)] : 0;
}

// Members by structure, level and slot; their supports by contact.
void SupportGraph::build(std::span<const std::uint32_t> in_contact) {
  is_built_ = true;
  members_.clear();
  structures_.clear();
  grow_to(parent_, state_.size());
  grow_to(member_of_, state_.size());
  levels_.resize(state_.size(), 0);
  for (const std::uint32_t slot : in_contact) {
    parent_[slot] = slot;
    if (levels_[slot] > 0 && !is_base(slot)) members_.push_back({slot, 0, levels_[slot], 0, 0, 0, 0});
  }
  const auto is_member = [&](std::uint32_t slot) { return levels_[slot] > 0 && !is_base(slot); };
  for_each_contact([&](std::uint32_t, const Contact& c) {
    if (!is_member(c.a) || !is_member(c.b)) return;
    const std::uint32_t a = root(c.a), b = root(c.b);
    parent_[std::max(a, b)] = std::min(a, b);
  });
  for (Member& m : members_) m.structure = root(m.slot);
  std::sort(members_.begin(), members_.end(), [](const Member& x, const Member& y) {
    if (x.structure != y.structure) return x.structure < y.structure;
    return x.level != y.level ? x.level < y.level : x.slot < y.slot;
  });
  for (std::uint32_t i = 0; i < members_.size(); ++i) {
    member_of_[members_[i].slot] = i;
    if (i == 0 || members_[i].structure != members_[i - 1].structure) structures_.push_back({i, i});
    structures_.back().end = i + 1;
  }
  list_supports();
}

void SupportGraph::list_supports() {
  supports_.clear();
  for_each_contact([&](std::uint32_t index, const Contact& c) {
    const bool member_a = levels_[c.a] > 0 && !is_base(c.a), member_b = levels_[c.b] > 0 && !is_base(c.b);
    if (member_a && member_b) {
      if (levels_[c.a] == levels_[c.b]) return;
      const bool b_is_upper = levels_[c.b] > levels_[c.a];
      const std::uint32_t upper = member_of_[b_is_upper ? c.b : c.a], lower = member_of_[b_is_upper ? c.a : c.b];
      supports_.push_back({index, upper, lower, none, b_is_upper});
    } else if (member_b && is_base(c.a)) {
      supports_.push_back({index, member_of_[c.b], none, c.a, true});
    } else if (member_a && is_base(c.b)) {
      supports_.push_back({index, member_of_[c.a], none, c.b, false});
    }
  });
  std::sort(supports_.begin(), supports_.end(), [](const Support& x, const Support& y) {
    return x.upper != y.upper ? x.upper < y.upper : x.contact < y.contact;
  });
  for (Member& m : members_) m.support_count = m.load_count = 0;
  for (std::uint32_t i = 0; i < supports_.size(); ++i) {
    Member& upper = members_[supports_[i].upper];
    if (upper.support_count++ == 0) upper.first_support = i;
    if (supports_[i].lower != none) ++members_[supports_[i].lower].load_count;
  }
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
  return bytes_of(levels_, heaviest_, structures_, members_, supports_, loads_, member_of_, parent_, is_overloaded_,
                  links_, load_, first_link_, links_of_, base_links_, queue_);
}

}  // namespace fathom::native
