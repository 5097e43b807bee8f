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

void Columns::update(std::span<const std::uint32_t> in_contact, std::size_t largest_island, ThreadPool& pool) {
  columns_.clear();
  links_.clear();
  tops_.clear();
  is_bundled_ = knows_lanes_ = false;
  any_is_uneven_ = fathom::is_uneven(bodies_.least_inverse_mass(), bodies_.most_inverse_mass());
  if (!is_worth_bracing(static_cast<std::uint32_t>(std::min<std::size_t>(largest_island, least_column)),
                        any_is_uneven_))
    return;
  for (const std::uint32_t slot : in_contact)
    if (contacts_of(slot) == 1 && contacts_of(state_.solved[slot].neighbours_xor) == 2) tops_.push_back(slot);
  const std::size_t chunks = (tops_.size() + top_grain - 1) / top_grain;
  if (found_.size() < chunks) found_.resize(chunks);
  pool.for_each_chunk(tops_.size(), top_grain, [&](std::size_t begin, std::size_t end) {
    find(std::span(tops_).subspan(begin, end - begin), found_[begin / top_grain]);
  });
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto before = static_cast<std::uint32_t>(links_.size());
    for (const Column& c : found_[i].columns) columns_.push_back({none, before + c.first, c.contacts});
    links_.insert(links_.end(), found_[i].links.begin(), found_[i].links.end());
  }
}

void Columns::find(std::span<const std::uint32_t> tops, Found& found) const {
  found.columns.clear();
  found.links.clear();
  // Contacts lie anywhere in memory, in other cores' caches above all.
  for (const std::uint32_t top : tops) prefetch_to_read(&graph_[state_.solved[top].contacts_xor]);
  for (const std::uint32_t top : tops) follow_from(top, found);
}

void Columns::follow_from(std::uint32_t top, Found& found) const {
  std::vector<Link>& links = found.links;
  const auto first = static_cast<std::ptrdiff_t>(links.size());
  std::uint32_t above = top, contact = 0;
  bool stands = false;
  while (!stands) {
    contact ^= state_.solved[above].contacts_xor;
    const Contact& c = graph_[contact];
    const std::uint32_t below = c.a == above ? c.b : c.a;
    if (c.colour == overflow_colour || (!c.fixed_a && contacts_of(below) > 2)) break;
    stands = c.fixed_a;
    links.push_back({contact, none, below, above, c.b == above});
    above = below;
    if (!stands && contacts_of(below) == 1) break;  // its other end
  }
  // Without anything fixed it may have two free ends and be found from both.
  const bool is_mine = stands || above < top || contacts_of(above) == 2;
  const auto count = static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(links.size()) - first);
  const std::span<const Link> column{links.data() + first, count};
  if (is_mine && is_worth_bracing(count, any_is_uneven_ && count > 1 && count < least_column && is_uneven(column))) {
    std::reverse(links.begin() + first, links.end());
    found.columns.push_back({none, static_cast<std::uint32_t>(first), count});
  } else {
    links.resize(static_cast<std::size_t>(first));
  }
}

/// True where bodies of very different mass meet in any of them.
bool Columns::is_uneven(std::span<const Link> links) const {
  return std::any_of(links.begin(), links.end(), [&](const Link& c) {
    return fathom::is_uneven(bodies_[c.below].inverse_mass, bodies_[c.above].inverse_mass);
  });
}

void Columns::find_lanes(std::span<const std::uint32_t> lanes, ThreadPool& pool) {
  grow_to(lane_of_, graph_.size());
  pool.for_each_part(lanes.size(), least_lanes, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (lanes[i] != none) lane_of_[lanes[i]] = static_cast<std::uint32_t>(i);
  });
  for (Link& c : links_) c.lane = lane_of_[c.contact];
  for (Column& c : columns_) c.lane = links_[c.first].lane;
  knows_lanes_ = true;
}

bool Columns::is_calm(const Column& c) const {
  const std::uint32_t slot = links_[c.first + c.contacts - 1].above;
  const Velocity& top = state_.velocities[slot];
  // One that stands still because it was isolated is no top.
  return !(state_.flags[slot] & isolated) &&
         fathom::is_calm(top.linear, state_.velocities[links_[c.first].below].linear);
}

void Columns::choose(const ConstraintLayout& layout, ThreadPool& pool) {
  bool same = is_bundled_ && was_calm_.size() == columns_.size();
  was_calm_.resize(columns_.size());
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const bool calm = is_calm(columns_[i]);
    same = same && was_calm_[i] == calm;
    was_calm_[i] = calm;
  }
  if (!same) bundle(layout, pool);
  is_bundled_ = true;
}

// --- side by side --------------------------------------------------------------------------------------------

void Columns::bundle(const ConstraintLayout& layout, ThreadPool& pool) {
  const auto width = static_cast<std::size_t>(kernels_.width);
  const auto threads = static_cast<std::size_t>(pool.thread_count());
  const std::span<const ConstraintLayout::Group> groups = layout.groups();
  // Most columns that fall never need their lanes.
  const bool any_calm = std::find(was_calm_.begin(), was_calm_.end(), true) != was_calm_.end();
  if (any_calm && !knows_lanes_) find_lanes({layout.lanes(), layout.blocks() * width}, pool);
  calm_.clear();
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (was_calm_[i]) calm_.push_back(columns_[i]);
  std::sort(calm_.begin(), calm_.end(), [](const Column& a, const Column& b) { return a.lane < b.lane; });
  bundles_.clear();
  first_of_group_.clear();
  lengths_.clear();
  slots_.clear();
  lanes_.clear();
  up_.clear();
  if (calm_.empty()) return;
  if (groups.empty()) bundle(calm_, std::max((calm_.size() + width - 1) / width, std::min(calm_.size(), threads)));
  auto next = calm_.begin();
  for (const ConstraintLayout::Group& group : groups) {
    const auto first = next;
    while (next != calm_.end() && next->lane < group.blocks.end * width) ++next;
    const auto count = static_cast<std::size_t>(next - first);
    first_of_group_.push_back(bundles_.size());
    bundle({first, next}, (count + width - 1) / width);
  }
  first_of_group_.push_back(bundles_.size());
  place_bundles();
}

void Columns::bundle(std::span<Column> columns, std::size_t bundles) {
  std::sort(columns.begin(), columns.end(), [](const Column& a, const Column& b) {
    return a.contacts != b.contacts ? a.contacts > b.contacts : a.lane < b.lane;
  });
  for (std::size_t i = 0; i < bundles; ++i) {
    const std::size_t first = i * columns.size() / bundles, end = (i + 1) * columns.size() / bundles;
    lay_out(columns.subspan(first, end - first));
  }
}

void Columns::lay_out(std::span<const Column> columns) {
  const auto width = static_cast<std::size_t>(kernels_.width);
  const std::uint32_t contacts = columns.front().contacts;
  bundles_.push_back({});
  bundles_.back().contacts = contacts;
  const std::size_t lengths = lengths_.size(), bodies = slots_.size(), lanes = lanes_.size();
  grow_to(lengths_, lengths + width);
  grow_to(slots_, bodies + (contacts + 1) * width);
  grow_to(lanes_, lanes + contacts * width);
  grow_to(up_, lanes_.size());
  for (std::size_t i = 0; i < width; ++i) {
    const Column& c = columns[std::min(i, columns.size() - 1)];
    const bool used = i < columns.size();
    lengths_[lengths + i] = c.contacts;
    slots_[bodies + i] = used ? links_[c.first].below : none;
    for (std::uint32_t k = 0; k < contacts; ++k) {
      const Link& link = links_[c.first + std::min(k, c.contacts - 1)];
      slots_[bodies + (k + 1) * width + i] = used && k < c.contacts ? link.above : none;
      lanes_[lanes + k * width + i] = link.lane;
      up_[lanes + k * width + i] = link.upward ? 1.0f : -1.0f;
    }
  }
}

void Columns::place_bundles() {
  constexpr std::size_t alignment = 64 / sizeof(float);
  const auto width = static_cast<std::size_t>(kernels_.width);
  std::size_t floats = alignment;
  for (const ColumnBundle& b : bundles_) floats += (b.contacts + 1) * kernels_.column_floats;
  if (work_.size() < floats) grow_to(work_, floats);
  const std::size_t off = reinterpret_cast<std::uintptr_t>(work_.data()) / sizeof(float) % alignment;
  float* work = work_.data() + (off ? alignment - off : 0);
  std::size_t row = 0;
  for (std::size_t i = 0; i < bundles_.size(); ++i) {
    ColumnBundle& b = bundles_[i];
    b.lengths = lengths_.data() + i * width;
    b.bodies = slots_.data() + (row + i) * width;
    b.lanes = lanes_.data() + row * width;
    b.up = up_.data() + row * width;
    b.work = work;
    row += b.contacts;
    work += (b.contacts + 1) * kernels_.column_floats;
  }
}

std::span<const ColumnBundle> Columns::of_group(std::size_t group) const {
  if (bundles_.empty()) return {};
  return {bundles_.data() + first_of_group_[group], bundles_.data() + first_of_group_[group + 1]};
}

std::size_t Columns::memory_bytes() const {
  std::size_t bytes = 0;
  for (const Found& found : found_)
    bytes += found.columns.capacity() * sizeof(Column) + found.links.capacity() * sizeof(Link);
  return bytes + (columns_.capacity() + calm_.capacity()) * sizeof(Column) + links_.capacity() * sizeof(Link) +
         bundles_.capacity() * sizeof(ColumnBundle) + first_of_group_.capacity() * sizeof(std::size_t) +
         (tops_.capacity() + lane_of_.capacity() + lengths_.capacity() + slots_.capacity() + lanes_.capacity()) *
             sizeof(std::uint32_t) +
         (up_.capacity() + work_.capacity()) * sizeof(float);
}

}  // namespace fathom::native
