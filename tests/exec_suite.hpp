// What every back end of the execution layer must do with kernels and primitives, each compared with the standard
// library. A program includes it and, after defining make_device, instantiates it for its device.
#pragma once

#include <cstring>

#include "exec/load.hpp"
#include "exec/reduce.hpp"
#include "exec_fixture.hpp"
#include "math/team.hpp"

namespace fathom::exec::test {

TYPED_TEST_SUITE_P(ExecTest);

TYPED_TEST_P(ExecTest, ParallelForVisitsEveryItemOnce) {
  for (const std::uint32_t n : sizes) {
    const auto input = random_numbers<std::uint32_t>(n, 1000);
    const Buffer<std::uint32_t> in = to_device(this->device(), input);
    Buffer<std::uint32_t> out = to_device(this->device(), std::vector<std::uint32_t>(n + 1, 7u));
    this->device().parallel_for(n, Triple{in.data(), out.data()});
    const auto result = to_host(this->device(), out);
    for (std::uint32_t i = 0; i < n; ++i) ASSERT_EQ(result[i], 3 * input[i] + i);
    EXPECT_EQ(result[n], 7u) << "wrote past the end";
  }
}

struct CountByTeams {
  static constexpr bool runs_in_teams = true;
  const std::uint32_t* in;
  std::uint32_t* out;

  FATHOM_HD void operator()(std::uint32_t i) const {
    const std::uint32_t number = in[i];
    team::sync();
    if (team::is_leader()) atomic_add(out[i], number + 1);
  }
};

TYPED_TEST_P(ExecTest, TeamsRunEveryItemOnce) {
  for (const std::uint32_t n : sizes) {
    const auto input = random_numbers<std::uint32_t>(n, 1000);
    const Buffer<std::uint32_t> in = to_device(this->device(), input);
    Buffer<std::uint32_t> out = to_device(this->device(), std::vector<std::uint32_t>(n + 1, 0u));
    this->device().parallel_for(n, CountByTeams{in.data(), out.data()});
    const auto result = to_host(this->device(), out);
    for (std::uint32_t i = 0; i < n; ++i) ASSERT_EQ(result[i], input[i] + 1);
    EXPECT_EQ(result[n], 0u) << "wrote past the end";
  }
}

TYPED_TEST_P(ExecTest, CountsInDeviceMemoryAreCutToTheCapacity) {
  constexpr std::uint32_t capacity = 70'000;
  const auto input = random_numbers<std::uint32_t>(capacity + 1, 1000);
  const Buffer<std::uint32_t> in = to_device(this->device(), input);
  for (const std::uint32_t count : {0u, 1u, 257u, 69'999u, capacity, capacity + 1, ~0u}) {
    const Buffer<std::uint32_t> count_on_device = to_device(this->device(), std::vector{count});
    Buffer<std::uint32_t> out = to_device(this->device(), std::vector<std::uint32_t>(capacity + 1, 7u));
    this->device().parallel_for({count_on_device.data(), capacity}, Triple{in.data(), out.data()});
    const auto result = to_host(this->device(), out);
    for (std::uint32_t i = 0; i <= capacity; ++i) {
      ASSERT_EQ(result[i], i < std::min(count, capacity) ? 3 * input[i] + i : 7u);
    }
  }
}

TYPED_TEST_P(ExecTest, FillsAndZeroes) {
  Buffer<std::uint64_t> buffer(this->device(), 1001);
  this->device().fill(buffer.data(), 1001, std::uint64_t{0x1234567890abcdef});
  this->device().zero(buffer.data(), 1000);
  const auto result = to_host(this->device(), buffer);
  EXPECT_EQ(std::count(result.begin(), result.end(), 0u), 1000);
  EXPECT_EQ(result[1000], 0x1234567890abcdefu);
}

TYPED_TEST_P(ExecTest, BuffersGrowWithOrWithoutContents) {
  const auto input = random_numbers<std::uint32_t>(5000, 0);
  Buffer<std::uint32_t> buffer = to_device(this->device(), input);
  const std::uint32_t* const before = buffer.data();
  buffer.grow(100);
  EXPECT_EQ(buffer.data(), before) << "never shrinks";
  const std::size_t in_use = this->device().bytes_in_use();
  buffer.grow(10'000, Contents::keep);
  EXPECT_EQ(this->device().bytes_in_use(), in_use + 20'000);
  for (const std::size_t size : {1, 3, 5, 1000}) {
    const Buffer<std::byte> bytes(this->device(), size);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(bytes.data()) % 64, 0u) << "a cache line's alignment";
  }
  EXPECT_EQ(to_host(this->device(), buffer, 5000), input);
  Buffer<std::uint32_t> second(this->device(), 10'000);
  this->device().copy(second.data(), buffer.data(), 5000);
  EXPECT_EQ(to_host(this->device(), second, 5000), input);
}

struct AtomicCounters {
  std::uint32_t* sum;
  std::int32_t* lowest;
  std::uint32_t* highest;
  std::uint64_t* long_sum;
  std::uint64_t* long_lowest;
  std::uint64_t* long_highest;
  std::uint64_t* mask;
  std::uint32_t* winner;
  std::uint32_t* slots;
  FATHOM_HD void operator()(std::uint32_t i) const {
    const std::uint32_t x = i * 2654435761u;
    slots[atomic_add(*sum, 1u)] = i;
    atomic_min(*lowest, static_cast<std::int32_t>(x));
    atomic_max(*highest, x);
    atomic_add(*long_sum, std::uint64_t{x} << 8);
    atomic_min(*long_lowest, ~(std::uint64_t{x} << 20));
    atomic_max(*long_highest, std::uint64_t{x} << 20);
    atomic_or(*mask, std::uint64_t{1} << (i % 61));
    if (atomic_cas(*winner, 0u, i + 1) == 0) atomic_store(winner[1], atomic_load(*winner));
  }
};

TYPED_TEST_P(ExecTest, AtomicsLoseNothing) {
  constexpr std::uint32_t n = 200'000;
  std::uint64_t long_sum = 0, long_highest = 0;
  std::uint32_t highest = 0;
  std::int32_t lowest = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t x = i * 2654435761u;
    long_sum += std::uint64_t{x} << 8;
    long_highest = std::max(long_highest, std::uint64_t{x} << 20);
    highest = std::max(highest, x);
    lowest = std::min(lowest, static_cast<std::int32_t>(x));
  }
  Buffer<std::uint32_t> words = to_device(this->device(), std::vector<std::uint32_t>(4, 0u));
  Buffer<std::int32_t> low = to_device(this->device(), std::vector<std::int32_t>{0});
  Buffer<std::uint64_t> longs = to_device(this->device(), std::vector<std::uint64_t>{0, ~std::uint64_t{0}, 0, 0});
  Buffer<std::uint32_t> slots(this->device(), n);
  std::uint32_t* const w = words.data();
  std::uint64_t* const l = longs.data();
  this->device().parallel_for(n, AtomicCounters{w, low.data(), w + 1, l, l + 1, l + 2, l + 3, w + 2, slots.data()});
  const auto words_after = to_host(this->device(), words);
  EXPECT_EQ(words_after[0], n);
  EXPECT_EQ(words_after[1], highest);
  EXPECT_TRUE(words_after[2] >= 1 && words_after[2] <= n);
  EXPECT_EQ(words_after[3], words_after[2]);
  EXPECT_EQ(to_host(this->device(), low)[0], lowest);
  EXPECT_EQ(to_host(this->device(), longs),
            (std::vector<std::uint64_t>{long_sum, ~long_highest, long_highest, (std::uint64_t{1} << 61) - 1}));
  auto taken = to_host(this->device(), slots);
  std::sort(taken.begin(), taken.end());
  for (std::uint32_t i = 0; i < n; ++i) ASSERT_EQ(taken[i], i) << "each slot is taken once";
}

/// Sorts 512 numbers per group in local memory, and counts swaps in private variables.
struct BitonicSort {
  static constexpr std::uint32_t group_size = 256;
  static constexpr std::uint32_t tile = 512;
  struct Local {
    std::uint32_t numbers[tile];
  };
  std::uint32_t* numbers;
  std::uint32_t* swaps;  // one per group

  FATHOM_HD void operator()(auto group, Local& local) const {
    std::uint32_t* const mine = numbers + group.index() * tile;
    auto swapped = per_item<std::uint32_t>(group);
    group.for_each([&](std::uint32_t item) { swapped[item] = 0; });
    group.for_each(tile, [&](std::uint32_t i) { local.numbers[i] = mine[i]; });
    for (std::uint32_t run = 2; run <= tile; run *= 2) {
      for (std::uint32_t distance = run / 2; distance > 0; distance /= 2) {
        group.for_each([&](std::uint32_t item) {
          const std::uint32_t a = 2 * item - item % distance, b = a + distance;
          const bool ascending = (a & run) == 0;
          const std::uint32_t x = local.numbers[a], y = local.numbers[b];
          if ((x > y) != ascending) return;
          local.numbers[a] = y;
          local.numbers[b] = x;
          ++swapped[item];
        });
      }
    }
    group.for_each(tile, [&](std::uint32_t i) { mine[i] = local.numbers[i]; });
    group.for_each([&](std::uint32_t item) { atomic_add(swaps[group.index()], swapped[item]); });
  }
};

TYPED_TEST_P(ExecTest, SectionsSortInLocalMemory) {
  for (const std::uint32_t groups : {0u, 1u, 3u, 700u}) {
    auto expected = random_numbers<std::uint32_t>(std::size_t{groups} * 512, 100'000);
    Buffer<std::uint32_t> numbers = to_device(this->device(), expected, 1);
    Buffer<std::uint32_t> swaps = to_device(this->device(), std::vector<std::uint32_t>(groups, 0u), 1);
    this->device().parallel_groups(groups, BitonicSort{numbers.data(), swaps.data()});
    for (std::uint32_t g = 0; g < groups; ++g) {
      std::sort(expected.begin() + g * 512, expected.begin() + (g + 1) * 512);
    }
    EXPECT_EQ(to_host(this->device(), numbers, expected.size()), expected);
    for (const std::uint32_t count : to_host(this->device(), swaps, groups)) EXPECT_GT(count, 1000u);
  }
}

/// Halves a number in local memory until it is odd: a loop whose length only the device knows.
struct HalveWhileEven {
  static constexpr std::uint32_t group_size = 64;
  struct Local {
    std::uint32_t number;
    std::uint32_t bits[group_size];
  };
  const std::uint32_t* numbers;
  std::uint32_t* halvings;

  FATHOM_HD void operator()(auto group, Local& local) const {
    std::uint32_t rounds = 0;
    group.once([&] { local.number = numbers[group.index()]; });
    while (group.broadcast(local.number) % 2 == 0) {
      group.for_each([&](std::uint32_t item) { local.bits[item] = local.number; });
      group.once([&] { local.number = local.bits[group_size - 1] / 2; });
      ++rounds;
    }
    group.once([&] { halvings[group.index()] = rounds; });
  }
};

TYPED_TEST_P(ExecTest, BroadcastSteersLoopsOfAGroup) {
  constexpr std::uint32_t capacity = 3000, groups = 2777;
  std::vector<std::uint32_t> numbers(capacity), expected(capacity, 99u);
  for (std::uint32_t i = 0; i < capacity; ++i) {
    numbers[i] = (2 * i + 1) << (i % 17);
    if (i < groups) expected[i] = i % 17;
  }
  const Buffer<std::uint32_t> in = to_device(this->device(), numbers);
  const Buffer<std::uint32_t> count = to_device(this->device(), std::vector{groups});
  Buffer<std::uint32_t> out = to_device(this->device(), std::vector<std::uint32_t>(capacity, 99u));
  this->device().parallel_groups({count.data(), capacity}, HalveWhileEven{in.data(), out.data()});
  EXPECT_EQ(to_host(this->device(), out), expected);
}

/// Sections in nested loops, some of which have no iterations, with conditions around them.
struct NestedSections {
  static constexpr std::uint32_t group_size = 64;
  struct Local {
    std::uint32_t now[group_size];
    std::uint32_t before[group_size];
  };
  std::uint32_t* out;

  FATHOM_HD void operator()(auto group, Local& local) const {
    const std::uint32_t g = group.index();
    group.for_each([&](std::uint32_t item) { local.now[item] = item * 7 + g; });
    for (std::uint32_t a = 0; a < g % 5; ++a) {
      for (std::uint32_t b = 0; b < (a + g) % 4; ++b) {
        if ((a + b) % 3 == 1) continue;
        for (std::uint32_t c = 0; c < a + b; ++c) {
          group.for_each([&](std::uint32_t item) { local.before[item] = local.now[item]; });
          group.for_each([&](std::uint32_t item) { local.now[item] += 3 * local.before[(item + c + 1) % 64] + b; });
          if ((a ^ c) == 2) group.once([&] { local.now[b] += a; });
        }
      }
    }
    group.for_each([&](std::uint32_t item) { out[g * group_size + item] = local.now[item]; });
  }
};

TYPED_TEST_P(ExecTest, SectionsMayBeInNestedLoops) {
  constexpr std::uint32_t groups = 61, n = groups * 64;
  Buffer<std::uint32_t> out(this->device(), n);
  this->device().parallel_groups(groups, NestedSections{out.data()});
  std::vector<std::uint32_t> expected(n);
  for (std::uint32_t g = 0; g < groups; ++g) {
    NestedSections::Local local;
    NestedSections{expected.data()}(HostGroup<64>(g), local);
  }
  EXPECT_EQ(to_host(this->device(), out), expected);
}

TYPED_TEST_P(ExecTest, PhasesFollowEachOther) {
  constexpr std::uint32_t width = 50'000, most = 12, count = 9;
  const auto input = random_numbers<std::uint32_t>(width, 0);
  Buffer<std::uint32_t> values = to_device(this->device(), input, std::size_t{width} * most);
  const Buffer<std::uint32_t> phase_count = to_device(this->device(), std::vector{count});
  this->device().parallel_phases(most, width, Neighbours{phase_count.data(), values.data(), width});
  std::vector<std::uint32_t> row = input;
  const auto result = to_host(this->device(), values);
  for (std::uint32_t phase = 1; phase <= most; ++phase) {
    for (std::uint32_t i = 0; i + phase < width; ++i) row[i] = phase <= count ? row[i] + row[i + 1] : 0;
    const std::uint32_t written = width - phase;
    ASSERT_TRUE(std::equal(row.begin(), row.begin() + written, result.begin() + phase * width)) << "phase " << phase;
  }
}

/// Pairs of a butterfly: item k of a phase mixes two of 2·`pairs` quads, whose last elements count phases.
struct Butterfly {
  struct alignas(16) Quad {
    float x, y, z, w;
  };
  struct Plan {
    std::uint32_t phases;
  };
  struct Fetched {
    std::uint32_t salt;
  };
  using Cursor = std::uint32_t;
  static constexpr std::uint32_t plan_parts = 1, group_size = 64;

  Quad* quads;
  const std::uint32_t* salts;  ///< one per pair
  std::uint32_t pairs, max_phases;
  bool by_data;  ///< if the device supports it, pairs wait only for their quads

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t) const { plan.phases = max_phases; }
  FATHOM_HD std::uint32_t phases(const Plan& plan) const { return plan.phases; }
  FATHOM_HD Cursor cursor_at(const Plan&, std::uint32_t phase) const { return phase; }
  FATHOM_HD Cursor next(const Plan&, Cursor phase) const { return phase + 1; }
  FATHOM_HD std::uint32_t items(const Plan&, Cursor) const { return pairs; }
  FATHOM_HD bool needs_barriers(const Plan&) const { return !(can_wait_for_data && by_data); }
  FATHOM_HD void fetch(const Plan&, Cursor, std::uint32_t k, Fetched& f) const { f.salt = salts[k]; }

  FATHOM_HD void operator()(const Plan& plan, Cursor phase, std::uint32_t k, const Fetched& f) const {
    const std::uint32_t bit = std::uint32_t{1} << phase % 10;
    const std::uint32_t first = (k & (bit - 1)) | (k & ~(bit - 1)) << 1, second = first | bit;
    Quad a, b;
    do {
      a = load_shared_quad(quads[first]);
      b = load_shared_quad(quads[second]);
    } while (!needs_barriers(plan) && !all_ready(count(a) == phase && count(b) == phase));
    store_shared_quad(quads[first], mixed(a, b, f.salt, phase + 1));
    store_shared_quad(quads[second], mixed(b, a, f.salt + 1, phase + 1));
  }

  FATHOM_HD static std::uint32_t count(const Quad& q) { return __builtin_bit_cast(std::uint32_t, q.w); }
  FATHOM_HD static Quad mixed(const Quad& a, const Quad& b, std::uint32_t salt, std::uint32_t phases) {
    const float s = static_cast<float>(salt % 16);
    return {0.5f * (a.x - b.y) + s, 0.5f * (a.y + b.z) - s, 0.25f * (a.z + b.x), __builtin_bit_cast(float, phases)};
  }
};

TYPED_TEST_P(ExecTest, ItemsOfPhasesMayWaitForWhatTheyRead) {
  for (const std::uint32_t pairs : {1024u, 65'536u}) {
    const std::uint32_t phases = 70;
    std::vector<Butterfly::Quad> input(2 * pairs);
    for (std::uint32_t i = 0; i < input.size(); ++i)
      input[i] = {static_cast<float>(i % 37), static_cast<float>(i % 11), static_cast<float>(i % 5), 0};
    const auto salts = random_numbers<std::uint32_t>(pairs, 0);
    std::vector<Butterfly::Quad> expected = input;
    const Butterfly on_host{expected.data(), salts.data(), pairs, phases, false};
    for (std::uint32_t phase = 0; phase < phases; ++phase)
      for (std::uint32_t k = 0; k < pairs; ++k) on_host({phases}, phase, k, {salts[k]});
    const Buffer<std::uint32_t> salts_on_device = to_device(this->device(), salts);
    for (const bool by_data : {false, true}) {
      Buffer<Butterfly::Quad> quads = to_device(this->device(), input);
      this->device().parallel_phases(phases, pairs,
                                     Butterfly{quads.data(), salts_on_device.data(), pairs, phases, by_data});
      const auto result = to_host(this->device(), quads);
      ASSERT_EQ(std::memcmp(result.data(), expected.data(), sizeof(Butterfly::Quad) * expected.size()), 0)
          << pairs << " pairs, " << (by_data ? "by data" : "phase by phase");
    }
  }
}

/// Rounds of three phases: item i of the second and the third reads from its neighbour within the same 32, item i of
/// the first from the next 32.
struct WarpRounds {
  struct Plan {
    std::uint32_t items;
  };
  struct Fetched {};
  using Cursor = std::uint32_t;
  static constexpr std::uint32_t plan_parts = 1, group_size = 96;

  std::uint32_t* values;  ///< one row per phase, the first given
  std::uint32_t width, rounds;

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t) const { plan.items = width; }
  FATHOM_HD std::uint32_t phases(const Plan&) const { return 3 * rounds; }
  FATHOM_HD Cursor cursor_at(const Plan&, std::uint32_t phase) const { return phase; }
  FATHOM_HD Cursor next(const Plan&, Cursor phase) const { return phase + 1; }
  FATHOM_HD std::uint32_t items(const Plan& plan, Cursor) const { return plan.items; }
  FATHOM_HD Wait wait_before(const Plan&, Cursor phase) const { return phase % 3 > 0 ? Wait::for_warp : Wait::for_all; }
  FATHOM_HD void fetch(const Plan&, Cursor, std::uint32_t, Fetched&) const {}
  FATHOM_HD void operator()(const Plan&, Cursor phase, std::uint32_t i, const Fetched&) const {
    const std::uint32_t* const before = values + phase * width;
    std::uint32_t neighbour = i + 32 < width ? i + 32 : i % 32;
    if (phase % 3 > 0) {
      const std::uint32_t first = i / 32 * 32, most = width - first < 32 ? width - first : 32;
      neighbour = first + (i - first + 7) % most;
    }
    values[(phase + 1) * width + i] = 3 * before[i] + before[neighbour];
  }
};

TYPED_TEST_P(ExecTest, PhasesMayKeepToWarps) {
  for (const std::uint32_t width : {1u, 32u, 1000u, 100'000u}) {
    constexpr std::uint32_t rounds = 4;
    std::vector<std::uint32_t> expected = random_numbers<std::uint32_t>(width, 0);
    Buffer<std::uint32_t> values = to_device(this->device(), expected, std::size_t{width} * 3 * rounds);
    this->device().parallel_phases(3 * rounds, width, WarpRounds{values.data(), width, rounds});
    expected.resize(std::size_t{width} * (3 * rounds + 1));
    const WarpRounds on_host{expected.data(), width, rounds};
    for (std::uint32_t phase = 0; phase < 3 * rounds; ++phase)
      for (std::uint32_t i = 0; i < width; ++i) on_host({width}, phase, i, {});
    EXPECT_EQ(to_host(this->device(), values), expected) << width;
  }
}

/// Two phases over `width` items, launched for `launched` of them: the first writes, the second reads from the end.
struct Mirrored {
  struct Plan {
    std::uint32_t items;
  };
  struct Fetched {};
  using Cursor = std::uint32_t;
  static constexpr std::uint32_t plan_parts = 1, group_size = 64;

  std::uint32_t* values;
  std::uint32_t width;

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t) const { plan.items = width; }
  FATHOM_HD std::uint32_t phases(const Plan&) const { return 2; }
  FATHOM_HD Cursor cursor_at(const Plan&, std::uint32_t phase) const { return phase; }
  FATHOM_HD Cursor next(const Plan&, Cursor phase) const { return phase + 1; }
  FATHOM_HD std::uint32_t items(const Plan& plan, Cursor) const { return plan.items; }
  FATHOM_HD bool may_exceed_launch(const Plan&, Cursor) const { return true; }
  FATHOM_HD void fetch(const Plan&, Cursor, std::uint32_t, Fetched&) const {}
  FATHOM_HD void operator()(const Plan& plan, Cursor phase, std::uint32_t i, const Fetched&) const {
    if (phase == 0)
      values[i] = 3 * i + 1;
    else
      values[plan.items + i] = values[plan.items - 1 - i];
  }
};

TYPED_TEST_P(ExecTest, PhasesMayHaveMoreItemsThanWereLaunched) {
  constexpr std::uint32_t width = 10'007;
  Buffer<std::uint32_t> values = to_device(this->device(), std::vector<std::uint32_t>(2 * width, 0));
  this->device().parallel_phases(2, 40, Mirrored{values.data(), width});
  const auto result = to_host(this->device(), values);
  for (std::uint32_t i = 0; i < width; ++i) {
    ASSERT_EQ(result[i], 3 * i + 1);
    ASSERT_EQ(result[width + i], 3 * (width - 1 - i) + 1);
  }
}

template <class Key, class D>
void expect_sorted_like_the_standard_library(D& device, std::uint32_t n, std::uint32_t capacity, std::uint64_t below,
                                             int bits) {
  const auto keys = random_numbers<Key>(capacity, below, n + 1);
  std::vector<std::uint32_t> values(capacity);
  std::iota(values.begin(), values.end(), 0u);
  Buffer<Key> keys_on_device = to_device(device, keys, 1);
  Buffer<std::uint32_t> values_on_device = to_device(device, values, 1);
  const Buffer<std::uint32_t> count = to_device(device, std::vector{n});
  Scratch scratch(device);
  scratch.reserve(device.template sort_scratch_bytes<Key>(capacity));
  const Range range = n == capacity ? Range(n) : Range(count.data(), capacity);
  device.sort_by_key(scratch, range, keys_on_device.data(), values_on_device.data(), bits);

  std::stable_sort(values.begin(), values.begin() + n,
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  values.resize(n);
  std::vector<Key> sorted(n);
  for (std::uint32_t i = 0; i < n; ++i) sorted[i] = keys[values[i]];
  ASSERT_EQ(to_host(device, keys_on_device, n), sorted) << n << " of " << capacity << ", " << bits << " bits";
  ASSERT_EQ(to_host(device, values_on_device, n), values) << n << " of " << capacity << ", " << bits << " bits";
}

TYPED_TEST_P(ExecTest, SortIsStableAndEqualsTheStandardLibrary) {
  for (const std::uint32_t n : sizes) {
    expect_sorted_like_the_standard_library<std::uint32_t>(this->device(), n, n, 0, 32);
    expect_sorted_like_the_standard_library<std::uint64_t>(this->device(), n, n, 0, 64);
    expect_sorted_like_the_standard_library<std::uint32_t>(this->device(), n, n, 100, 7);
  }
}

TYPED_TEST_P(ExecTest, SortTakesItsCountFromTheDevice) {
  for (const std::uint32_t n : {0u, 1u, 777u, 40'001u}) {
    expect_sorted_like_the_standard_library<std::uint32_t>(this->device(), n, 2 * n + 5, 0, 32);
    expect_sorted_like_the_standard_library<std::uint32_t>(this->device(), n, 2 * n + 5, 1u << 20, 20);
    expect_sorted_like_the_standard_library<std::uint64_t>(this->device(), n, 2 * n + 5, std::uint64_t{1} << 42, 42);
  }
  // Keys with all bits set sort before the padding of the capacity.
  expect_sorted_like_the_standard_library<std::uint32_t>(this->device(), 5000, 9000, 2, 1);
}

TYPED_TEST_P(ExecTest, ScanEqualsTheStandardLibrary) {
  for (const std::uint32_t n : sizes) {
    for (const std::uint32_t spare : {0u, 5000u}) {
      const auto input = random_numbers<std::uint32_t>(n + spare, 0);
      std::vector<std::uint32_t> expected(n);
      std::exclusive_scan(input.begin(), input.begin() + n, expected.begin(), 0u);
      Buffer<std::uint32_t> items = to_device(this->device(), input, 1);
      Buffer<std::uint32_t> out(this->device(), n + 1);
      Buffer<std::uint32_t> totals = to_device(this->device(), std::vector{n, 0u, 0u});
      std::uint32_t* const t = totals.data();
      const Range range = spare == 0 ? Range(n) : Range(t, n + spare);
      Scratch scratch(this->device());
      scratch.reserve(this->device().scan_scratch_bytes(n + spare));
      this->device().exclusive_scan(scratch, range, items.data(), out.data(), t + 1);
      this->device().exclusive_scan(scratch, range, items.data(), items.data(), t + 2);
      ASSERT_EQ(to_host(this->device(), out, n), expected);
      ASSERT_EQ(to_host(this->device(), items, n), expected) << "in place";
      const std::uint32_t sum = std::accumulate(input.begin(), input.begin() + n, 0u);
      ASSERT_EQ(to_host(this->device(), totals), (std::vector{n, sum, sum}));
    }
  }
}

TYPED_TEST_P(ExecTest, SelectKeepsTheOrder) {
  for (const std::uint32_t n : sizes) {
    for (const std::uint32_t spare : {0u, 5000u}) {
      const auto flags = random_numbers<std::uint32_t>(n + spare, 3);
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < n; ++i) {
        if (flags[i] != 0) expected.push_back(i);
      }
      const Buffer<std::uint32_t> flags_on_device = to_device(this->device(), flags, 1);
      Buffer<std::uint32_t> indices(this->device(), n + 1);
      Buffer<std::uint32_t> counts = to_device(this->device(), std::vector{n, 0u});
      const Range range = spare == 0 ? Range(n) : Range(counts.data(), n + spare);
      Scratch scratch(this->device());
      scratch.reserve(this->device().select_scratch_bytes(n + spare));
      this->device().select(scratch, range, flags_on_device.data(), indices.data(), counts.data() + 1);
      ASSERT_EQ(to_host(this->device(), counts)[1], expected.size());
      ASSERT_EQ(to_host(this->device(), indices, expected.size()), expected);
    }
  }
}

struct Extent {
  float lower = 0, upper = 0;
};
struct MergeExtents {
  FATHOM_HD Extent operator()(Extent a, Extent b) const { return {min(a.lower, b.lower), max(a.upper, b.upper)}; }
};
struct ExtentOf {
  const float* x;
  FATHOM_HD Extent operator()(std::uint32_t i) const { return {x[i] - 1, x[i] + 1}; }
};

TYPED_TEST_P(ExecTest, ReducesToMinimaMaximaAndStructs) {
  for (const std::uint32_t n : sizes) {
    const auto numbers = random_numbers<std::uint32_t>(n + 100, 1'000'000, n);
    const std::vector<float> floats(numbers.begin(), numbers.end());
    const Buffer<std::uint32_t> in = to_device(this->device(), numbers);
    const Buffer<float> floats_in = to_device(this->device(), floats);
    const Buffer<std::uint32_t> count = to_device(this->device(), std::vector{n});
    Buffer<std::uint32_t> out(this->device(), 2);
    Buffer<Extent> extent(this->device(), 1);
    Scratch scratch(this->device());
    scratch.reserve(reduce_scratch_bytes<Extent>());
    const LoadFrom<std::uint32_t> load{in.data()};
    reduce(this->device(), scratch, n, load, Min{}, ~0u, out.data());
    reduce(this->device(), scratch, {count.data(), n + 100}, load, Max{}, 0u, out.data() + 1);
    reduce(this->device(), scratch, {count.data(), n + 100}, ExtentOf{floats_in.data()}, MergeExtents{},
           Extent{1e30f, -1e30f}, extent.data());
    const auto end = numbers.begin() + n;
    const auto result = to_host(this->device(), out);
    EXPECT_EQ(result[0], n == 0 ? ~0u : *std::min_element(numbers.begin(), end));
    EXPECT_EQ(result[1], n == 0 ? 0u : *std::max_element(numbers.begin(), end));
    const Extent whole = to_host(this->device(), extent)[0];
    EXPECT_EQ(whole.lower, n == 0 ? 1e30f : static_cast<float>(result[0]) - 1);
    EXPECT_EQ(whole.upper, n == 0 ? -1e30f : static_cast<float>(result[1]) + 1);
  }
}

/// Roundings that differ if a compiler contracts, approximates or reorders.
struct Roundings {
  const float* x;
  float* out;
  FATHOM_HD void operator()(std::uint32_t i) const {
    const float a = x[i], b = x[i + 1], c = x[i + 2];
    out[i] = fathom::sqrt(a * b + c) / (a + 1.25f) - fathom::fma(a, b, -c) * (c / b);
  }
};

TYPED_TEST_P(ExecTest, FloatsHaveTheHostsBits) {
  constexpr std::uint32_t n = 500'000;
  std::vector<float> x(n + 2);
  std::mt19937 engine(5);
  for (float& value : x) value = static_cast<float>(engine()) * 0x1p-20f + 0x1p-9f;
  const Buffer<float> in = to_device(this->device(), x);
  Buffer<float> out(this->device(), n), sum(this->device(), 1);
  this->device().parallel_for(n, Roundings{in.data(), out.data()});
  Scratch scratch(this->device());
  scratch.reserve(reduce_scratch_bytes<float>());
  reduce(this->device(), scratch, n, LoadFrom<float>{in.data()}, Add{}, 0.0f, sum.data());
  const auto result = to_host(this->device(), out);
  std::vector<float> expected(n);
  for (std::uint32_t i = 0; i < n; ++i) Roundings{x.data(), expected.data()}(i);
  EXPECT_EQ(result, expected);
  // What the host computes for the sum, whose order is part of the interface.
  EXPECT_EQ(to_host(this->device(), sum)[0], 0x1.e8880ap+29f);
}

/// Counts the numbers of each stretch whose root is wrong: squared, they lie beyond its neighbours' midpoints.
struct WrongRoots {
  static constexpr std::uint32_t stretch = 4096;
  std::uint32_t first;
  std::uint32_t* wrong;
  FATHOM_HD static double number(std::uint32_t bits) { return static_cast<double>(__builtin_bit_cast(float, bits)); }
  FATHOM_HD void operator()(std::uint32_t i) const {
    for (std::uint32_t k = 0; k < stretch; ++k) {
      const std::uint32_t bits = first + i * stretch + k;
      const double a = number(bits);
      const std::uint32_t root = __builtin_bit_cast(std::uint32_t, fathom::sqrt(__builtin_bit_cast(float, bits)));
      // The midpoints have 25 bits: in double their squares are exact.
      const double lower = 0.5 * (number(root) + number(root - 1));
      const double upper = 0.5 * (number(root) + number(root + 1));
      if (!(lower * lower < a && a < upper * upper)) atomic_add(*wrong, 1u);
    }
  }
};

TYPED_TEST_P(ExecTest, RootsOfAllMantissasAreCorrectlyRounded) {
  // [1, 4): every mantissa with an even and an odd exponent; then the smallest and largest normal numbers.
  for (const std::uint32_t first : {0x3f800000u, 0x40000000u, 0x00800000u, 0x7f000000u}) {
    Buffer<std::uint32_t> wrong = to_device(this->device(), std::vector{0u});
    this->device().parallel_for((1u << 23) / WrongRoots::stretch, WrongRoots{first, wrong.data()});
    EXPECT_EQ(to_host(this->device(), wrong)[0], 0u) << "from " << __builtin_bit_cast(float, first);
  }
}

REGISTER_TYPED_TEST_SUITE_P(ExecTest, ParallelForVisitsEveryItemOnce, TeamsRunEveryItemOnce,
                            CountsInDeviceMemoryAreCutToTheCapacity, FillsAndZeroes, BuffersGrowWithOrWithoutContents,
                            AtomicsLoseNothing, SectionsSortInLocalMemory, BroadcastSteersLoopsOfAGroup,
                            SectionsMayBeInNestedLoops, PhasesFollowEachOther, ItemsOfPhasesMayWaitForWhatTheyRead,
                            PhasesMayKeepToWarps, PhasesMayHaveMoreItemsThanWereLaunched,
                            SortIsStableAndEqualsTheStandardLibrary, SortTakesItsCountFromTheDevice,
                            ScanEqualsTheStandardLibrary, SelectKeepsTheOrder, ReducesToMinimaMaximaAndStructs,
                            FloatsHaveTheHostsBits, RootsOfAllMantissasAreCorrectlyRounded);

}  // namespace fathom::exec::test
