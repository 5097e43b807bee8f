#include "native/pair_runs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "random.hpp"

namespace fathom::native::pair_runs_test {
namespace {

std::vector<std::pair<std::uint32_t, std::uint32_t>> values(const std::vector<Pair>& pairs) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
  for (const Pair p : pairs) out.push_back({p.a, p.b});
  return out;
}

// The order in which a stable sort by the first body would leave the concatenated lists; again and again in the same
// memory.
TEST(PairRuns, InTheOrderOfBodies) {
  test::Generator random(3);
  PairRuns runs;
  std::vector<Pair> pairs;
  for (const std::uint32_t bodies : {2000u, 40u, 1u, 5000u, 300u}) {
    std::vector<std::uint32_t> slots(bodies), order;
    std::iota(slots.begin(), slots.end(), 7u);
    for (const std::uint32_t slot : slots)
      order.insert(order.begin() + static_cast<std::ptrdiff_t>(random() % (order.size() + 1)), slot);
    constexpr std::size_t a_list = 37;
    const std::size_t lists = (bodies + a_list - 1) / a_list;
    runs.make_room(lists, bodies + 7);
    std::vector<Pair> expected;
    for (std::size_t i = 0; i < lists; ++i) {
      std::vector<Pair>& list = runs.lists()[i];
      list.clear();
      for (std::size_t k = i * a_list; k < std::min<std::size_t>((i + 1) * a_list, bodies); ++k) {
        const std::size_t first = list.size();
        for (std::size_t found = random() % 4; found > 1; --found)
          list.push_back({order[k], static_cast<std::uint32_t>(random() % 10000)});
        runs.note(order[k], i, first, list.size() - first);
      }
      runs.note_list(i, list.size());
      expected.insert(expected.end(), list.begin(), list.end());
    }
    std::stable_sort(expected.begin(), expected.end(), [](Pair x, Pair y) { return x.a < y.a; });
    for (const int threads : {1, 3}) {
      ThreadPool pool(threads);
      runs.gather(lists, slots, pool, pairs);
      EXPECT_EQ(values(pairs), values(expected)) << bodies << " bodies, " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace fathom::native::pair_runs_test
