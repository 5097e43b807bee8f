#include "native/columns.hpp"

#include <algorithm>
#include <bit>

#include "dynamics/columns.hpp"
#include "native/prefetch.hpp"
#include "world/growth.hpp"

namespace fathom::native {

int Columns::contacts_of(std::uint32_t slot) const {
  return std::popcount(state_.colour_mask[slot]) + static_cast<int>(state_.overflow_count[slot]);
}

void Columns::update(std::span<const std::uint32_t> in_contact, std::span<const std::uint32_t> lanes) {
  columns_.clear();
  contacts_.clear();
  constexpr std::size_t ahead = 16;  // contacts lie anywhere in memory, in other cores' caches above all
  for (std::size_t i = 0; i < in_contact.size(); ++i) {
    if (i + ahead < in_contact.size()) {
      const std::uint32_t first = state_.first_contact[in_contact[i + ahead]];
      if (first != none) prefetch_to_read(&graph_[first >> 1]);
    }
    const std::uint32_t slot = in_contact[i];
    if (contacts_of(slot) == 1) follow_from(slot);
  }
  if (!columns_.empty()) find_lanes(lanes);
}

/// The body's contact that is solved, of two the one that is not `contact`.
std::uint32_t Columns::next_contact(std::uint32_t slot, std::uint32_t contact) const {
  std::uint32_t next = none;
  graph_.for_each_of(slot, [&](std::uint32_t index) {
    if (index != contact && graph_[index].colour != no_colour) next = index;
  });
  return next;
}

void Columns::follow_from(std::uint32_t top) {
  const auto first = static_cast<std::ptrdiff_t>(contacts_.size());
  std::uint32_t above = top, contact = none;
  bool stands = false;
  while (!stands && (contact = next_contact(above, contact)) != none) {
    const Contact& c = graph_[contact];
    const std::uint32_t below = c.a == above ? c.b : c.a;
    if (c.colour == overflow_colour || (!c.fixed_a && contacts_of(below) > 2)) break;
    stands = c.fixed_a;
    contacts_.push_back({contact, none, below, above, c.b == above});
    above = below;
    if (!stands && contacts_of(below) == 1) break;  // its other end
  }
  // Without anything fixed it may have two free ends and be found from both.
  const bool is_mine = stands || above < top || contacts_of(above) == 2;
  const auto count = static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(contacts_.size()) - first);
  if (is_mine && is_worth_bracing(count, count < least_column && count > 1 && is_uneven_from(first))) {
    std::reverse(contacts_.begin() + first, contacts_.end());
    columns_.push_back({none, static_cast<std::uint32_t>(first), count});
  } else {
    contacts_.resize(static_cast<std::size_t>(first));
  }
}

/// True where bodies of very different mass meet in any contact of the list from `first` on.
bool Columns::is_uneven_from(std::ptrdiff_t first) const {
  return std::any_of(contacts_.begin() + first, contacts_.end(), [&](const ColumnContact& c) {
    return is_uneven(bodies_[c.below].inverse_mass, bodies_[c.above].inverse_mass);
  });
}

void Columns::find_lanes(std::span<const std::uint32_t> lanes) {
  grow_to(lane_of_, graph_.size());
  for (std::size_t i = 0; i < lanes.size(); ++i)
    if (lanes[i] != none) lane_of_[lanes[i]] = static_cast<std::uint32_t>(i);
  for (ColumnContact& c : contacts_) c.lane = lane_of_[c.contact];
  for (Column& c : columns_) c.lane = contacts_[c.first].lane;
  std::sort(columns_.begin(), columns_.end(), [](const Column& a, const Column& b) { return a.lane < b.lane; });
}

void Columns::choose() {
  calm_.clear();
  for (const Column& c : columns_) {
    const Velocity& top = state_.velocities[contacts_[c.first + c.contacts - 1].above];
    if (is_calm(top.linear, state_.velocities[contacts_[c.first].below].linear)) calm_.push_back(c);
  }
}

std::span<const Columns::Column> Columns::within(std::size_t begin, std::size_t end) const {
  const auto at = [&](std::size_t lane) {
    return std::lower_bound(calm_.begin(), calm_.end(), lane,
                            [](const Column& c, std::size_t value) { return c.lane < value; });
  };
  return {at(begin), at(end)};
}

std::size_t Columns::memory_bytes() const {
  return (columns_.capacity() + calm_.capacity()) * sizeof(Column) + contacts_.capacity() * sizeof(ColumnContact) +
         lane_of_.capacity() * sizeof(std::uint32_t);
}

}  // namespace fathom::native
