#include "native/domains.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "native/body_state.hpp"
#include "native/radix_sort.hpp"
#include "native/tuning.hpp"
#include "threads/thread_pool.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::uint32_t key_bits = 11;  // per coordinate
constexpr std::uint32_t key_range = 1u << key_bits;

float contacts_of(const BodyState& state, std::uint32_t slot) {
  return static_cast<float>(std::popcount(state.colour_mask[slot]));
}
float contacts_with_fixed(const BodyState& state, std::uint32_t slot) {
  return static_cast<float>(std::popcount(state.colour_mask[slot] >> first_fixed_colour));
}

/// Mean and standard deviation along each axis.
struct Spread {
  double mean[3] = {}, deviation[3] = {};
};

Spread spread_of(std::span<const std::uint32_t> slots, const BodyState& state) {
  Spread spread;
  double squares[3] = {};
  const double n = static_cast<double>(slots.size());
  for (const std::uint32_t slot : slots)
    for (int axis = 0; axis < 3; ++axis) {
      const double x = static_cast<double>(state.poses[slot].position[axis]);
      spread.mean[axis] += x / n;
      squares[axis] += x * x / n;
    }
  for (int axis = 0; axis < 3; ++axis)
    spread.deviation[axis] = std::sqrt(std::max(squares[axis] - spread.mean[axis] * spread.mean[axis], 1e-6));
  return spread;
}

/// The coordinate in `key_range` steps over ±4 deviations.
std::uint32_t quantised(double x, double mean, double deviation) {
  const double step = (x - mean) / (8 * deviation) + 0.5;
  return static_cast<std::uint32_t>(std::clamp(step, 0.0, 1.0) * (key_range - 1));
}

/// Which of `count` equal parts contains the fraction `at` of the whole, shifted by `shift` parts. Parts wrap around: a
/// fractional shift makes the last and the first one part.
std::size_t part(float at, float shift, std::size_t count) {
  const float position = at * static_cast<float>(count) + shift;
  const auto index = static_cast<std::size_t>(position);
  return index >= count ? index - count : index;
}

/// Runs both, on two threads if available.
template <class First, class Second>
void do_both(ThreadPool& pool, const First& first, const Second& second) {
  pool.for_each_part(2, 1, [&](std::size_t begin, std::size_t end) {
    if (begin == 0) first();
    if (end == 2) second();
  });
}

}  // namespace

// As square as integer part counts allow.
Domains::Grid Domains::grid(std::size_t count, float aspect) {
  Grid best{count, 1};
  for (Grid g{count, 1}; g.columns >= 1; g = {g.columns / 2, g.rows * 2}) {
    const auto badness = [&](Grid of) {
      return std::abs(std::log2(static_cast<float>(of.columns) / static_cast<float>(of.rows) / aspect));
    };
    if (badness(g) < badness(best)) best = g;
    if (g.columns == 1) break;
  }
  return best;
}

void Domains::set_counts(const std::array<std::uint32_t, divisions>& counts) {
  counts_ = counts;
  for (std::size_t i = 0; i < divisions; ++i) first_units_[i + 1] = first_units_[i] + counts_[i];
}

void Domains::clear() { set_counts({}); }

void Domains::divide(std::span<const std::uint32_t> slots, std::span<const Contact> contacts, std::size_t between,
                     const BodyState& state, ThreadPool& pool) {
  // Few enough to fill the lanes of their colours, many enough for the threads that such a heap can use.
  std::size_t count = 16;
  while (count < 128 && between > 1600 * count) count *= 2;

  const Spread spread = spread_of(slots, state);
  int first = 0, second = 1;
  const int third = static_cast<int>(std::min_element(spread.deviation, spread.deviation + 3) - spread.deviation);
  if (third == 0) first = 1, second = 2;
  if (third == 1) second = 2;
  if (spread.deviation[second] > spread.deviation[first]) std::swap(first, second);

  Orders orders{std::vector<Entry>(slots.size()), std::vector<Entry>(slots.size())};
  pool.for_each_part(slots.size(), min_slots_to_divide, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t slot = slots[i];
      const auto key = [&](int axis) {
        return quantised(static_cast<double>(state.poses[slot].position[axis]), spread.mean[axis],
                         spread.deviation[axis]);
      };
      const std::uint32_t along_first = key(first), along_second = key(second);
      orders.by_first[i] = {along_first << key_bits | along_second, slot};
      orders.by_second[i] = {along_second << key_bits | along_first, slot};
    }
  });
  const auto sort = [](std::vector<Entry>& order) {
    std::vector<Entry> sorted;
    radix_sort(order, sorted, 2 * key_bits, [](const Entry& entry) { return entry.key; });
  };
  do_both(
      pool, [&] { sort(orders.by_first); }, [&] { sort(orders.by_second); });
  std::fill(ids_.begin(), ids_.end(), Ids{});
  const float aspect = static_cast<float>(spread.deviation[first] / spread.deviation[second]);
  // Borders of the second division are midway between those of the first, those of the third midway again. Both have
  // fewer contacts, hence fewer domains.
  const Grid fine = grid(count, aspect), coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2};
  const Grid middle = count > 16 ? Grid{(fine.columns + 1) / 2, fine.rows} : fine;
  const auto size = [](Grid g) { return static_cast<std::uint32_t>(g.columns * g.rows); };
  set_counts({size(fine), size(middle), size(coarse)});
  weights_.assign(ids_.size(), 0);
  for (const std::uint32_t slot : slots) weights_[slot] = min_body_weight + contacts_of(state, slot);
  divide(0, fine, fine, 0, orders);
  balance_first(contacts, orders, state, pool);
  divide(0, fine, fine, 0, orders);
  do_both(
      pool, [&] { divide(1, middle, fine, 0.5f, orders); }, [&] { divide(2, coarse, fine, 0.25f, orders); });
}

// Borders lie `offset` cells of the finest grid before those of that grid.
void Domains::divide(std::size_t division, Grid grid, Grid finest, float offset, const Orders& orders) {
  const auto shift = [offset](std::size_t parts, std::size_t of_finest) {
    return offset * static_cast<float>(parts) / static_cast<float>(of_finest);
  };
  const float column_shift = shift(grid.columns, finest.columns), row_shift = shift(grid.rows, finest.rows);
  std::vector<float> seen(grid.columns + 1, 0.0f), of_column(grid.columns, 0.0f);
  float total = 0, sum = 0;
  for (const Entry& entry : orders.by_first) total += weights_[entry.slot];
  for (const Entry& entry : orders.by_first) {
    const float w = weights_[entry.slot];
    const std::size_t column = part((sum + 0.5f * w) / total, column_shift, grid.columns);
    sum += w;
    of_column[column] += w;
    ids_[entry.slot][division] = static_cast<std::uint8_t>(column);
  }
  for (const Entry& entry : orders.by_second) {
    const float w = weights_[entry.slot];
    const std::size_t column = ids_[entry.slot][division];
    const std::size_t row = part((seen[column] + 0.5f * w) / of_column[column], row_shift, grid.rows);
    seen[column] += w;
    ids_[entry.slot][division] = static_cast<std::uint8_t>(column * grid.rows + row);
  }
}

// Domains at the rim of a heap lose fewer contacts to borders, so they get fewer bodies.
void Domains::balance_first(std::span<const Contact> contacts, const Orders& orders, const BodyState& state,
                            ThreadPool& pool) {
  std::vector<float> weight(counts_[0], 0.0f), work(counts_[0], 0.0f);
  for (const Entry& entry : orders.by_first) {
    weight[home(entry.slot)] += weights_[entry.slot];
    work[home(entry.slot)] += min_body_weight + contacts_with_fixed(state, entry.slot);
  }
  std::vector<std::uint32_t> within((contacts.size() / placing_grain + 1) * counts_[0]);  // by chunk and domain
  pool.for_each_chunk(contacts.size(), placing_grain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const counts = &within[begin / placing_grain * counts_[0]];
    for (const Contact& c : contacts.subspan(begin, end - begin))
      if (c.in_use && c.colour != no_colour && !c.fixed_a && home(c.a) == home(c.b)) ++counts[home(c.a)];
  });
  for (std::size_t i = 0; i < within.size(); ++i) work[i % counts_[0]] += static_cast<float>(within[i]);
  for (const Entry& entry : orders.by_first) weights_[entry.slot] *= work[home(entry.slot)] / weight[home(entry.slot)];
}

void Domains::restore(ByteReader& in, std::size_t slots) {
  archive(*this, in);
  in.require(ids_.size() == slots);
  for (const std::uint32_t count : counts_) in.require(count <= 128 && (count > 0) == in_use());
  set_counts(std::array(counts_));
  if (!in_use()) return;
  for (const Ids& ids : ids_)
    for (std::size_t division = 0; division < divisions; ++division) in.require(ids[division] < counts_[division]);
}

}  // namespace fathom::native
