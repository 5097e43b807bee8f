#include "native/columns.hpp"

#include <algorithm>
#include <bit>

#include "dynamics/columns.hpp"
#include "native/prefetch.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t top_grain = 8;
constexpr std::size_t least_lanes = 2048;  // worth another thread

}  // namespace

int Columns::contacts_of(std::uint32_t slot) const {
  return std::popcount(state_.colour_mask[slot]) + static_cast<int>(state_.overflow_count[slot]);
}

void Columns::update(std::span<const std::uint32_t> in_contact, std::span<const std::uint32_t> lanes,
                     ThreadPool& pool) {
  columns_.clear();
  contacts_.clear();
  tops_.clear();
  for (const std::uint32_t slot : in_contact)
    if (contacts_of(slot) == 1 && contacts_of(state_.neighbours_xor[slot]) == 2) tops_.push_back(slot);
  const std::size_t chunks = (tops_.size() + top_grain - 1) / top_grain;
  if (found_.size() < chunks) found_.resize(chunks);
  pool.for_each_chunk(tops_.size(), top_grain, [&](std::size_t begin, std::size_t end) {
    find(std::span(tops_).subspan(begin, end - begin), found_[begin / top_grain]);
  });
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto before = static_cast<std::uint32_t>(contacts_.size());
    for (const Column& c : found_[i].columns) columns_.push_back({none, before + c.first, c.contacts});
    contacts_.insert(contacts_.end(), found_[i].contacts.begin(), found_[i].contacts.end());
  }
  if (!columns_.empty()) find_lanes(lanes, pool);
}

void Columns::find(std::span<const std::uint32_t> tops, Found& found) const {
  found.columns.clear();
  found.contacts.clear();
  // Contacts lie anywhere in memory, in other cores' caches above all.
  for (const std::uint32_t top : tops) prefetch_both_lines(&graph_[state_.contacts_xor[top]]);
  for (const std::uint32_t top : tops) follow_from(top, found);
}

void Columns::follow_from(std::uint32_t top, Found& found) const {
  std::vector<ColumnContact>& contacts = found.contacts;
  const auto first = static_cast<std::ptrdiff_t>(contacts.size());
  std::uint32_t above = top, contact = 0;
  bool stands = false;
  while (!stands) {
    contact ^= state_.contacts_xor[above];
    const Contact& c = graph_[contact];
    const std::uint32_t below = c.a == above ? c.b : c.a;
    if (c.colour == overflow_colour || (!c.fixed_a && contacts_of(below) > 2)) break;
    stands = c.fixed_a;
    contacts.push_back({contact, none, below, above, c.b == above});
    above = below;
    if (!stands && contacts_of(below) == 1) break;  // its other end
  }
  // Without anything fixed it may have two free ends and be found from both.
  const bool is_mine = stands || above < top || contacts_of(above) == 2;
  const auto count = static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(contacts.size()) - first);
  const std::span<const ColumnContact> column{contacts.data() + first, count};
  if (is_mine && is_worth_bracing(count, count > 1 && count < least_column && is_uneven(column))) {
    std::reverse(contacts.begin() + first, contacts.end());
    found.columns.push_back({none, static_cast<std::uint32_t>(first), count});
  } else {
    contacts.resize(static_cast<std::size_t>(first));
  }
}

/// True where bodies of very different mass meet in any of them.
bool Columns::is_uneven(std::span<const ColumnContact> contacts) const {
  return std::any_of(contacts.begin(), contacts.end(), [&](const ColumnContact& c) {
    return fathom::is_uneven(bodies_[c.below].inverse_mass, bodies_[c.above].inverse_mass);
  });
}

void Columns::find_lanes(std::span<const std::uint32_t> lanes, ThreadPool& pool) {
  grow_to(lane_of_, graph_.size());
  pool.for_each_part(lanes.size(), least_lanes, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (lanes[i] != none) lane_of_[lanes[i]] = static_cast<std::uint32_t>(i);
  });
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
  std::size_t bytes = 0;
  for (const Found& found : found_)
    bytes += found.columns.capacity() * sizeof(Column) + found.contacts.capacity() * sizeof(ColumnContact);
  return bytes + tops_.capacity() * sizeof(std::uint32_t) + (columns_.capacity() + calm_.capacity()) * sizeof(Column) +
         contacts_.capacity() * sizeof(ColumnContact) + lane_of_.capacity() * sizeof(std::uint32_t);
}

}  // namespace fathom::native
