#include "native/constraint_layout.hpp"

#include <algorithm>
#include <bit>
#include <iterator>
#include <utility>

#include "native/prefetch.hpp"
#include "native/tuning.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t ahead = 16;  // contacts to prefetch ahead

std::size_t blocks_of(std::size_t lanes, std::size_t width) { return (lanes + width - 1) / width; }

constexpr ConstraintKind joint_kinds[] = {ConstraintKind::ball_joint, ConstraintKind::generic_joint,
                                          ConstraintKind::coupling};

/// Writes references to these joints from `lane` on; returns the end.
template <class Lane>
Lane copy_joints(ConstraintKind kind, std::span<const std::uint32_t> joints, Lane lane) {
  return std::transform(joints.begin(), joints.end(), lane,
                        [kind](std::uint32_t slot) { return constraint_ref(kind, slot); });
}

/// Moves the even cut towards the desired one as far as shares stay nearly even: all threads wait for the largest.
std::size_t near_even(std::size_t even, std::size_t wanted, std::size_t share) {
  const std::size_t slack = share / 8;
  return std::clamp(wanted, even - std::min(even, slack), even + slack);
}

}  // namespace

bool ConstraintLayout::update(const BodiesInContact& in_contact, const Neighbourhood& neighbourhood) {
  const bool same_bodies = version_ == in_contact.version;
  const bool same_colours = colouring_ == graph_.colouring() && threads_ == threads();
  if (same_colours && (same_bodies || (groups_.empty() && units_.empty()))) {
    if (!same_bodies) order_bodies(in_contact.slots, neighbourhood);
    version_ = in_contact.version;
    return false;
  }
  version_ = in_contact.version;
  colouring_ = graph_.colouring();
  threads_ = threads();
  colours_ = 0;
  for (int colour = 0; colour < colour_count; ++colour)
    colours_ += graph_.size_of(colour) + graph_.joints_of_colour(colour) > 0;
  groups_.clear();
  units_.clear();
  stretches_.clear();
  blocks_ = 0;
  kinematic_ = in_contact.kinematic;
  const std::span<const std::uint32_t> dynamic = without_kinematic(in_contact);
  if (may_use_domains()) {
    fill_by_unit();
    list_bodies_by_unit(dynamic);
  } else if (may_group(dynamic) && form_groups(dynamic)) {
    list_bodies(dynamic);
    fill_by_group();
  } else {
    kinematic_ = {};
    fill_by_colour(neighbourhood);
    order_bodies(in_contact.slots, neighbourhood);
  }
  return true;
}

std::span<const std::uint32_t> ConstraintLayout::without_kinematic(const BodiesInContact& in_contact) {
  if (in_contact.kinematic.empty()) return in_contact.slots;
  dynamic_.clear();
  make_room(dynamic_, in_contact.slots.size());
  std::ranges::set_difference(in_contact.slots, in_contact.kinematic, std::back_inserter(dynamic_));
  return dynamic_;
}

// --- shared by all threads -----------------------------------------------------------------------------------

void ConstraintLayout::fill_by_colour(const Neighbourhood& neighbourhood) {
  colour_of_.clear();
  for (int colour = 0; colour < colour_count; ++colour) {
    std::size_t blocks = blocks_of(graph_.size_of(colour), width_);
    for (const ConstraintKind kind : joint_kinds) blocks += blocks_of(graph_.joints_of_colour(kind, colour), width_);
    if (blocks == 0) continue;
    stretches_.push_back({blocks_, blocks_ + blocks, 1});
    colour_of_.push_back(colour);
    blocks_ = stretches_.back().end;
  }
  grow_to(lanes_, blocks_ * width_);
  offsets_.resize(threads() > 1 ? stretches_.size() : 0);
  const auto fill = [&](std::size_t s) {
    std::vector<std::uint32_t> of_all_units;
    if (graph_.domains().in_use())
      graph_.for_each_of_colour(colour_of_[s], [&](std::uint32_t index) { of_all_units.push_back(index); });
    const std::vector<std::uint32_t>& contacts = graph_.domains().in_use() ? of_all_units : graph_.of(0, colour_of_[s]);
    const std::span<std::uint32_t> lanes{lanes_.data() + stretches_[s].first * width_,
                                         lanes_.data() + stretches_[s].end * width_};
    if (threads() > 1)
      offsets_[s] = neighbourhood.sort(
          contacts, [&](std::uint32_t contact) { return graph_[contact].b; }, lanes);
    else
      std::copy(contacts.begin(), contacts.end(), lanes.begin());
    std::uint32_t* lane = lanes.data() + contacts.size();
    std::fill(lane, lanes.data() + lanes.size(), none);
    std::size_t block = blocks_of(contacts.size(), width_);
    for (const ConstraintKind kind : joint_kinds) {
      lane = lanes.data() + block * width_;
      for (std::size_t unit = 0; unit < graph_.domains().units(); ++unit)
        lane = copy_joints(kind, graph_.joints_of(kind, unit, colour_of_[s]), lane);
      block += blocks_of(graph_.joints_of_colour(kind, colour_of_[s]), width_);
    }
  };
  const bool alone = lanes_.size() < min_to_sort;
  pool_.for_each_part(stretches_.size(), alone ? stretches_.size() : 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) fill(s);
  });
  share_out();
}

void ConstraintLayout::share_out() {
  std::size_t total = 0;
  for (const Neighbourhood::Offsets& offsets : offsets_) total += offsets.back();
  region_cuts_.assign(threads() + 1, Neighbourhood::region_count);
  for (std::size_t region = 0, t = 0; threads() > 1 && region < Neighbourhood::region_count; ++region) {
    std::size_t before = 0;
    for (const Neighbourhood::Offsets& offsets : offsets_) before += offsets[region];
    while (t <= threads() && before * threads() >= t * total) region_cuts_[t++] = region;
  }
  cuts_.resize(stretches_.size() * (threads() + 1));
  for (std::size_t s = 0; s < stretches_.size(); ++s) {
    Stretch& stretch = stretches_[s];
    const std::size_t blocks = stretch.end - stretch.first;
    stretch.shares = std::clamp<std::size_t>(blocks / min_blocks(), 1, threads());
    for (std::size_t t = 0; t <= threads(); ++t) {
      const std::size_t even = std::min(t, stretch.shares) * blocks / stretch.shares;
      const bool inner = stretch.shares == threads() && t > 0 && t < threads();
      const std::size_t cut =
          inner ? near_even(even, (offsets_[s][region_cuts_[t]] + width_ / 2) / width_, blocks / threads()) : even;
      cuts(s)[t] = stretch.first + cut;
    }
  }
}

void ConstraintLayout::order_bodies(std::span<const std::uint32_t> in_contact, const Neighbourhood& neighbourhood) {
  grow_to(bodies_, in_contact.size());
  if (threads() > 1)
    neighbourhood.sort(
        in_contact, [](std::uint32_t slot) { return slot; }, bodies_);
  else
    std::copy(in_contact.begin(), in_contact.end(), bodies_.begin());
  share_out_bodies(neighbourhood);
}

void ConstraintLayout::share_out_bodies(const Neighbourhood& neighbourhood) {
  const std::size_t shares = std::clamp<std::size_t>(bodies_.size() / min_bodies, 1, threads());
  body_cuts_.resize(shares + 1);
  for (std::size_t t = 0; t <= shares; ++t) {
    body_cuts_[t] = t * bodies_.size() / shares;
    if (shares < threads() || threads() == 1 || t == 0 || t == threads()) continue;
    const auto wanted = std::partition_point(bodies_.begin(), bodies_.end(), [&](std::uint32_t slot) {
      return neighbourhood.region(slot) < region_cuts_[t];
    });
    body_cuts_[t] =
        near_even(body_cuts_[t], static_cast<std::size_t>(wanted - bodies_.begin()), bodies_.size() / threads());
  }
}

// --- in domains ----------------------------------------------------------------------------------------------

// Contacts cut by the first divisions are few, but their colours, chosen for whole bodies, are many, so nearly all
// lanes would be empty. They are coloured again among themselves, in the order of their colours. The result depends on
// contacts only, because it determines the solving order.
bool ConstraintLayout::recolour(std::size_t unit) {
  std::size_t contacts = 0, colours = 0;
  for (int colour = 0; colour < first_fixed_colour; ++colour) {
    contacts += graph_.of(unit, colour).size();
    colours += !graph_.of(unit, colour).empty();
  }
  if (contacts >= few_of_a_colour * colours) return false;
  grow_to(own_colours_, state_.size());
  for (std::vector<std::uint32_t>& list : recoloured_) list.clear();
  const auto for_each_contact = [&](const auto& act) {
    for (int colour = 0; colour < first_fixed_colour; ++colour)
      for (const std::uint32_t index : graph_.of(unit, colour)) act(index, graph_[index]);
  };
  bool have_all = true;
  for_each_contact([&](std::uint32_t index, const Contact& c) {
    const int own = std::countr_one(own_colours_[c.a] | own_colours_[c.b]);
    have_all = have_all && own < first_fixed_colour;
    if (!have_all) return;
    own_colours_[c.a] |= 1u << own;
    own_colours_[c.b] |= 1u << own;
    recoloured_[static_cast<std::size_t>(own)].push_back(index);
  });
  for_each_contact([&](std::uint32_t, const Contact& c) { own_colours_[c.a] = own_colours_[c.b] = 0; });
  return have_all;
}

void ConstraintLayout::fill_by_unit() {
  const auto add_stretch = [&](std::span<const std::uint32_t> list) {
    const std::size_t blocks = blocks_of(list.size(), width_);
    if (blocks > 0) stretches_.push_back({blocks_, blocks_ + blocks, 1});
    blocks_ += blocks;
    return blocks > 0;
  };
  const auto add_contacts = [&](std::size_t unit, int first, int end) {
    for (int colour = first; colour < end; ++colour)
      if (add_stretch(graph_.of(unit, colour))) lists_.push_back(&graph_.of(unit, colour));
  };
  // Written directly: they are few.
  const auto add_joints = [&](std::size_t unit, int first, int end) {
    for (int colour = first; colour < end; ++colour)
      for (const ConstraintKind kind : joint_kinds)
        if (const auto joints = graph_.joints_of(kind, unit, colour); add_stretch(joints)) {
          lists_.push_back(nullptr);
          grow_to(lanes_, blocks_ * width_);
          std::fill(copy_joints(kind, joints, first_lane(stretches_.back())), lanes_.end(), none);
        }
  };
  // Written directly, by the thread that recoloured them.
  const auto add_recoloured = [&] {
    for (const std::vector<std::uint32_t>& list : recoloured_)
      if (add_stretch(list)) {
        lists_.push_back(nullptr);
        grow_to(lanes_, blocks_ * width_);
        std::fill(std::copy(list.begin(), list.end(), first_lane(stretches_.back())), lanes_.end(), none);
      }
  };
  lists_.clear();
  const Domains& domains = graph_.domains();
  for (std::size_t i = 0; i < domains.units(); ++i) {
    Unit unit;
    unit.blocks.begin = blocks_;
    unit.between.begin = stretches_.size();
    if (i >= domains.first_unit(2) && recolour(i))
      add_recoloured();
    else
      add_contacts(i, 0, first_fixed_colour);
    add_joints(i, 0, first_fixed_colour);
    unit.between.end = unit.on_fixed.begin = stretches_.size();
    add_contacts(i, first_fixed_colour, colour_count);
    add_joints(i, first_fixed_colour, colour_count);
    unit.on_fixed.end = stretches_.size();
    unit.blocks.end = blocks_;
    units_.push_back(unit);
  }
  grow_to(lanes_, blocks_ * width_);
  pool_.for_each_part(stretches_.size(), min_stretches, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      if (!lists_[s]) continue;
      const auto rest = std::copy(lists_[s]->begin(), lists_[s]->end(), first_lane(stretches_[s]));
      std::fill(rest, lanes_.begin() + static_cast<std::ptrdiff_t>(stretches_[s].end * width_), none);
    }
  });
}

void ConstraintLayout::list_bodies_by_unit(std::span<const std::uint32_t> in_contact) {
  const Domains& domains = graph_.domains();
  const std::size_t count = domains.count(0), chunks = blocks_of(in_contact.size(), layout_grain);
  grow_to(bodies_, in_contact.size());
  grow_to(next_body_, chunks * count);
  std::fill(next_body_.begin(), next_body_.end(), 0);
  // Two passes, so that several threads know where to write.
  pool_.for_each_chunk(in_contact.size(), layout_grain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const counts = &next_body_[begin / layout_grain * count];
    for (std::size_t i = begin; i < end; ++i) ++counts[domains.home(in_contact[i])];
  });
  std::uint32_t next = 0;
  for (std::size_t u = 0; u < count; ++u) {
    units_[u].bodies.begin = next;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) next += std::exchange(next_body_[chunk * count + u], next);
    units_[u].bodies.end = next;
  }
  pool_.for_each_chunk(in_contact.size(), layout_grain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const indices = &next_body_[begin / layout_grain * count];
    for (std::size_t i = begin; i < end; ++i) bodies_[indices[domains.home(in_contact[i])]++] = in_contact[i];
  });
}

// --- in groups -----------------------------------------------------------------------------------------------

// Expect many islands if there are fewer contacts between bodies than bodies. Overflow contacts are not sorted by
// island: if there are any, everything is one group.
bool ConstraintLayout::may_group(std::span<const std::uint32_t> in_contact) const {
  if (in_contact.size() < (threads() > 1 ? min_to_group : cached_bodies)) return false;
  if (graph_.any_overflow() || graph_.domains().in_use()) return false;
  return graph_.between() < in_contact.size();
}

// Path halving; the smaller root wins.
std::uint32_t ConstraintLayout::root(std::uint32_t slot) {
  while (island_[slot].parent != slot) slot = island_[slot].parent = island_[island_[slot].parent].parent;
  return slot;
}

void ConstraintLayout::join_islands() {
  grow_to(island_, state_.size());
  links_.clear();
  for (std::uint32_t colour = 0; colour < colour_count; ++colour) {
    const std::vector<std::uint32_t>& contacts = graph_.of(0, static_cast<int>(colour));
    make_room(links_, links_.size() + contacts.size());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (i + ahead < contacts.size()) prefetch_to_read(&graph_[contacts[i + ahead]]);
      const Contact& c = graph_[contacts[i]];
      for (const std::uint32_t slot : {c.a, c.b}) island_[slot] = {slot, 0, none};
      links_.push_back({contacts[i], colour, c.b, c.a});
    }
    for (const ConstraintKind kind : joint_kinds)
      for (const std::uint32_t joint : graph_.joints_of(kind, 0, static_cast<int>(colour))) {
        const Joint& j = graph_.joint(joint);
        for (const std::uint32_t slot : {j.a, j.b}) island_[slot] = {slot, 0, none};
        links_.push_back({constraint_ref(kind, joint), colour, j.b, j.a});
      }
  }
  for (const Link& link : links_) {
    if (link.colour >= first_fixed_colour) break;
    const std::uint32_t a = root(link.root), b = root(link.b);
    island_[std::max(a, b)].parent = std::min(a, b);
  }
  std::uint32_t largest = 0;
  for (Link& link : links_) {
    link.root = root(link.b);
    largest = std::max(largest, ++island_[link.root].weight);
  }
}

// Forms groups from islands, in the order of their first bodies. False if one thread would get too much.
bool ConstraintLayout::form_groups(std::span<const std::uint32_t> in_contact) {
  join_islands();
  // If several groups per thread would leave lanes empty, one group per thread.
  const std::size_t several = links_.size() / (threads() * groups_a_thread);
  const std::size_t full = several < min_group_weight
                               ? std::max(min_group_weight / 4, blocks_of(links_.size(), threads()))
                               : std::min(several, max_group_weight);
  std::size_t weight = 0, largest = 0;
  groups_.push_back({});
  grow_to(group_of_body_, in_contact.size());
  for (std::size_t i = 0; i < in_contact.size(); ++i) {
    Island& island = island_[root(in_contact[i])];
    if (island.group == none) {
      if (weight >= full) {
        groups_.push_back({});
        weight = 0;
      }
      island.group = static_cast<std::uint32_t>(groups_.size() - 1);
      weight += island.weight;
      largest = std::max(largest, weight);
    }
    group_of_body_[i] = island.group;
  }
  if (groups_.size() > 1 && largest <= std::max(2 * full, links_.size() / threads())) return true;
  groups_.clear();
  return false;
}

void ConstraintLayout::list_bodies(std::span<const std::uint32_t> in_contact) {
  for (const std::uint32_t group : group_of_body_) ++groups_[group].bodies.end;
  std::size_t first = 0;
  for (Group& group : groups_) {
    const std::size_t count = group.bodies.end;
    group.bodies = {first, first};  // grows as bodies are added
    first += count;
  }
  grow_to(bodies_, in_contact.size());
  for (std::size_t i = 0; i < in_contact.size(); ++i) bodies_[groups_[group_of_body_[i]].bodies.end++] = in_contact[i];
}

void ConstraintLayout::fill_by_group() {
  next_lane_.assign(groups_.size() * colour_count * constraint_kinds, 0);
  const auto next_lane = [&](const Link& link) -> std::uint32_t& {
    const std::uint32_t group = island_[link.root].group;
    // Contacts between quarantined bodies belong to no group; any group will do.
    return next_lane_[((group == none ? 0 : group) * colour_count + link.colour) * constraint_kinds +
                      static_cast<std::size_t>(kind_of(link.constraint))];
  };
  for (const Link& link : links_) ++next_lane(link);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    groups_[g].stretches.begin = stretches_.size();
    groups_[g].blocks.begin = blocks_;
    for (std::size_t colour = 0; colour < colour_count * constraint_kinds; ++colour) {
      std::uint32_t& lane = next_lane_[g * colour_count * constraint_kinds + colour];
      const std::size_t blocks = blocks_of(lane, width_);
      lane = static_cast<std::uint32_t>(blocks_ * width_);
      if (blocks > 0) stretches_.push_back({blocks_, blocks_ + blocks, 1});
      blocks_ += blocks;
    }
    groups_[g].stretches.end = stretches_.size();
    groups_[g].blocks.end = blocks_;
  }
  grow_to(lanes_, blocks_ * width_);
  std::fill(lanes_.begin(), lanes_.end(), none);
  for (const Link& link : links_) lanes_[next_lane(link)++] = link.constraint;
}

std::size_t ConstraintLayout::memory_bytes() const {
  std::size_t recoloured = 0;
  for (const std::vector<std::uint32_t>& list : recoloured_) recoloured += list.capacity();
  return (recoloured + own_colours_.capacity() + lanes_.capacity() + bodies_.capacity() + dynamic_.capacity() +
          next_body_.capacity() + group_of_body_.capacity() + next_lane_.capacity()) *
             sizeof(std::uint32_t) +
         links_.capacity() * sizeof(Link) + stretches_.capacity() * sizeof(Stretch) +
         offsets_.capacity() * sizeof(Neighbourhood::Offsets) + cuts_.capacity() * sizeof(std::size_t) +
         groups_.capacity() * sizeof(Group) + island_.capacity() * sizeof(Island);
}

}  // namespace fathom::native
