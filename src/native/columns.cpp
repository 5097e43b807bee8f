#include "native/columns.hpp"

#include <algorithm>
#include <bit>

#include "dynamics/columns.hpp"
#include "world/growth.hpp"

namespace fathom::native {

bool Columns::is_part(std::uint32_t slot) const {
  return std::popcount(state_.colour_mask[slot]) <= 2 && state_.overflow_count[slot] == 0;
}
bool Columns::has_two(std::uint32_t slot) const { return std::popcount(state_.colour_mask[slot]) == 2; }

/// The body's other contact that is solved.
std::uint32_t Columns::next_contact(std::uint32_t slot, std::uint32_t contact) const {
  std::uint32_t next = none;
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    if (index != contact && graph_[index].colour != no_colour) next = index;
  });
  return next;
}

void Columns::update(std::span<const std::uint32_t> in_contact, std::span<const std::uint32_t> lanes) {
  columns_.clear();
  contacts_.clear();
  for (const std::uint32_t slot : in_contact)
    if (is_part(slot) && bodies_[slot].motion == MotionType::dynamic) start_at(slot);
  if (!columns_.empty()) find_lanes(lanes);
}

// Columns that begin with this body, or with one that cannot be pushed below it.
void Columns::start_at(std::uint32_t slot) {
  const bool has_one = !has_two(slot);
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    const Contact& c = graph_[index];
    if (c.colour == no_colour) return;
    if (c.fixed_a) return follow(c.a, index);
    if (!is_part(c.a == slot ? c.b : c.a)) return;
    if (has_one) return follow(slot, index);
    const Contact& other = graph_[next_contact(slot, index)];
    if (!other.fixed_a && !is_part(other.a == slot ? other.b : other.a)) follow(slot, index);
  });
}

void Columns::follow(std::uint32_t below, std::uint32_t contact) {
  const bool stands = graph_[contact].fixed_a;
  const auto first = static_cast<std::uint32_t>(contacts_.size());
  bool uneven = false, between_fixed = false;
  while (contact != none) {
    const Contact& c = graph_[contact];
    const std::uint32_t above = c.a == below ? c.b : c.a;
    between_fixed = c.fixed_a && contacts_.size() > first;
    if (between_fixed || !is_part(above)) break;
    contacts_.push_back({contact, none, below, above, c.b == above});
    uneven |= is_uneven(bodies_[below].inverse_mass, bodies_[above].inverse_mass);
    contact = has_two(above) ? next_contact(above, contact) : none;
    below = above;
  }
  const auto count = static_cast<std::uint32_t>(contacts_.size()) - first;
  // A column is found from both of its ends: from what is fixed rather, else from the lower slot.
  const auto end = [&] { return stands ? contacts_[first].above : contacts_[first].below; };
  const bool is_mine = count > 0 && (stands != between_fixed ? stands : end() < below);
  if (is_mine && is_worth_bracing(count, uneven))
    columns_.push_back({none, first, count});
  else
    contacts_.resize(first);
}

void Columns::find_lanes(std::span<const std::uint32_t> lanes) {
  grow_to(lane_of_, graph_.size());
  for (std::size_t i = 0; i < lanes.size(); ++i)
    if (lanes[i] != none) lane_of_[lanes[i]] = static_cast<std::uint32_t>(i);
  for (ColumnContact& c : contacts_) c.lane = lane_of_[c.contact];
  for (Column& c : columns_) c.lane = contacts_[c.first].lane;
  std::sort(columns_.begin(), columns_.end(), [](const Column& a, const Column& b) { return a.lane < b.lane; });
}

std::span<const Columns::Column> Columns::within(std::size_t begin, std::size_t end) const {
  const auto at = [&](std::size_t lane) {
    return std::lower_bound(columns_.begin(), columns_.end(), lane,
                            [](const Column& c, std::size_t value) { return c.lane < value; });
  };
  return {at(begin), at(end)};
}

std::size_t Columns::memory_bytes() const {
  return columns_.capacity() * sizeof(Column) + contacts_.capacity() * sizeof(ColumnContact) +
         lane_of_.capacity() * sizeof(std::uint32_t);
}

}  // namespace fathom::native
