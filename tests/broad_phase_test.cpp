// Both broad phases against brute force, and the trees and tables they are made of.
#include "native/broad_phase.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include "native/radix_sort.hpp"
#include "world_fixture.hpp"

namespace fathom::native::broad_phase_test {
namespace {

using Found = std::set<std::pair<std::uint32_t, std::uint32_t>>;

struct Boxes {
  BodyTable bodies;
  BodyState state;
  PairSet known;
  std::vector<std::uint32_t> changed, set_changes;
  std::mt19937 random{11};

  float uniform(float lo, float hi) { return lo + (hi - lo) * static_cast<float>(random() >> 8) / 16777216.0f; }

  std::uint32_t add(MotionType motion, const Aabb& box) {
    BodyDef def = test::cube({});
    def.motion = motion;
    const std::uint32_t slot = bodies.add(def).index;
    if (slot >= state.size()) state.resize(slot + 1);
    state.bounds[slot].fat_box = box;
    return slot;
  }
  Aabb random_box(float space, float size) {
    const Vec3 c{uniform(-space, space), uniform(-space, space), uniform(-space, space)};
    return {c, c + Vec3{uniform(0, size), uniform(0, size), uniform(0, size)}};
  }
  BroadPhaseInput input(bool set_changed) {
    return {bodies, state, known, changed, true, set_changed ? std::span<const std::uint32_t>(changed) : set_changes};
  }

  void change_all() {
    changed.clear();
    for (std::uint32_t slot = 0; slot < bodies.slot_count(); ++slot) change(slot);
  }
  void change(std::uint32_t slot) {
    changed.push_back(slot);
    state.flags[slot] |= box_changed;
  }
  void settle() {
    for (const std::uint32_t slot : changed) state.flags[slot] = 0;
    changed.clear();
  }
  Found brute_force() {
    Found pairs;
    for (std::uint32_t a = 0; a < bodies.slot_count(); ++a)
      for (std::uint32_t b = a + 1; b < bodies.slot_count(); ++b)
        if (meet(a, b)) pairs.insert({a, b});
    return pairs;
  }
  bool meet(std::uint32_t a, std::uint32_t b) const {
    return bodies.alive(a) && bodies.alive(b) && overlaps(state.bounds[a].fat_box, state.bounds[b].fat_box) &&
           (bodies[a].motion == MotionType::dynamic || bodies[b].motion == MotionType::dynamic);
  }
  bool is_new(std::uint32_t slot) const { return std::ranges::find(set_changes, slot) != set_changes.end(); }
};

Found search(BroadPhase& broad_phase, const BroadPhaseInput& input, int threads) {
  ThreadPool pool(threads);
  std::vector<std::vector<Pair>> lists;
  lists.resize(broad_phase.find(input, pool, lists));
  Found found;
  for (const auto& list : lists)
    for (const Pair p : list) {
      const bool is_new = found.insert({std::min(p.a, p.b), std::max(p.a, p.b)}).second;
      EXPECT_TRUE(is_new) << "pair " << p.a << ", " << p.b << " reported twice";
    }
  return found;
}

class BroadPhases : public testing::TestWithParam<bool> {
 protected:
  std::unique_ptr<BroadPhase> make() const {
    return GetParam() ? make_sweep_broad_phase(normalize(Vec3{3, 2, 1})) : make_tree_broad_phase();
  }
};

TEST_P(BroadPhases, FindAllPairsOfRandomBoxes) {
  for (const int count : {0, 1, 2, 7, 8, 9, 64, 65, 700}) {
    Boxes boxes;
    for (int i = 0; i < count; ++i)
      boxes.add(i % 10 == 3 ? MotionType::fixed : MotionType::dynamic, boxes.random_box(6, 2));
    boxes.change_all();
    const auto broad_phase = make();
    EXPECT_EQ(search(*broad_phase, boxes.input(true), 2), boxes.brute_force()) << count << " boxes";
  }
}

TEST_P(BroadPhases, FindAllPairsWithHugeAndTinyAndFlatBoxes) {
  Boxes boxes;
  boxes.add(MotionType::fixed, {{-500, -500, -1}, {500, 500, 0}});
  boxes.add(MotionType::dynamic, {{-50, -50, -1}, {50, 50, 60}});
  for (int i = 0; i < 500; ++i) boxes.add(MotionType::dynamic, boxes.random_box(30, i % 3 == 0 ? 0.01f : 3.0f));
  for (int i = 0; i < 50; ++i) boxes.add(MotionType::dynamic, {{1, 1, 1}, {1, 1, 1}});  // coincident points
  boxes.change_all();
  const auto broad_phase = make();
  EXPECT_EQ(search(*broad_phase, boxes.input(true), 2), boxes.brute_force());
}

TEST_P(BroadPhases, FindOnlyNewPairsAsBoxesMove) {
  Boxes boxes;
  for (int i = 0; i < 300; ++i)
    boxes.add(i % 20 == 0 ? MotionType::fixed : MotionType::dynamic, boxes.random_box(5, 1.5f));
  boxes.change_all();
  const auto broad_phase = make();
  for (const auto& [a, b] : search(*broad_phase, boxes.input(true), 1)) boxes.known.insert(a, b);
  for (int step = 0; step < 200; ++step) {
    boxes.settle();
    const Found before = boxes.brute_force();
    for (std::uint32_t slot = 0; slot < boxes.bodies.slot_count(); ++slot) {
      if (boxes.random() % 4 != 0) continue;
      const Vec3 d{boxes.uniform(-0.5f, 0.5f), boxes.uniform(-0.5f, 0.5f), boxes.uniform(-0.5f, 0.5f)};
      boxes.state.bounds[slot].fat_box.lower += d;
      boxes.state.bounds[slot].fat_box.upper += d;
      boxes.change(slot);
    }
    const Found now = boxes.brute_force();
    for (const auto& [a, b] : before)
      if (!now.count({a, b})) boxes.known.erase(a, b);
    Found expected;
    for (const auto& pair : now)
      if (!before.count(pair)) expected.insert(pair);
    const Found found = search(*broad_phase, boxes.input(false), 2);
    ASSERT_EQ(found, expected) << "step " << step;
    for (const auto& [a, b] : found) boxes.known.insert(a, b);
  }
}

TEST_P(BroadPhases, FollowBodiesThatComeGoAndAreMovedByHand) {
  Boxes boxes;
  for (int i = 0; i < 1500; ++i)
    boxes.add(i % 3 != 0 ? MotionType::fixed : MotionType::dynamic, boxes.random_box(8, 1.5f));
  boxes.change_all();
  const auto broad_phase = make();
  for (const auto& [a, b] : search(*broad_phase, boxes.input(true), 1)) boxes.known.insert(a, b);
  for (int step = 0; step < 300; ++step) {
    boxes.settle();
    boxes.set_changes.clear();
    const Found before = boxes.brute_force();
    const auto any_slot = [&] { return static_cast<std::uint32_t>(boxes.random() % boxes.bodies.slot_count()); };
    // None, a few, or too many to be processed one by one.
    const unsigned edits = step % 10 == 9 ? 200 : boxes.random() % 4;
    for (unsigned i = 0; i < edits; ++i) {
      const std::uint32_t slot = any_slot();
      if (!boxes.bodies.alive(slot)) continue;
      boxes.bodies.remove(boxes.bodies.id(slot));
      boxes.state.flags[slot] = 0;
      std::erase(boxes.changed, slot);
      boxes.set_changes.push_back(slot);
    }
    for (unsigned i = 0; i < edits; ++i) {
      const MotionType motion = boxes.random() % 4 == 0 ? MotionType::dynamic : MotionType::fixed;
      const std::uint32_t slot = boxes.add(motion, boxes.random_box(8, 1.5f));
      boxes.change(slot);
      boxes.set_changes.push_back(slot);
    }
    for (unsigned i = 0; i < 5; ++i) {
      const std::uint32_t slot = any_slot();
      if (!boxes.bodies.alive(slot) || boxes.state.flags[slot] != 0) continue;
      boxes.state.bounds[slot].fat_box = boxes.random_box(8, 1.5f);
      boxes.change(slot);
    }
    std::ranges::sort(boxes.changed);
    for (const auto& [a, b] : before)
      if (boxes.is_new(a) || boxes.is_new(b) || !boxes.meet(a, b)) boxes.known.erase(a, b);
    Found expected;
    for (const auto& pair : boxes.brute_force())
      if (!boxes.known.contains(pair.first, pair.second)) expected.insert(pair);
    const Found found = search(*broad_phase, boxes.input(false), 2);
    ASSERT_EQ(found, expected) << "step " << step;
    for (const auto& [a, b] : found) boxes.known.insert(a, b);
  }
}

INSTANTIATE_TEST_SUITE_P(TreeAndSweep, BroadPhases, testing::Bool(),
                         [](const auto& parameter) { return parameter.param ? "sweep" : "tree"; });

TEST(TreeBroadPhase, ListsPairsInOneOrderHoweverItSearches) {
  Boxes boxes;
  for (int i = 0; i < 900; ++i) boxes.add(MotionType::dynamic, boxes.random_box(7, 2));
  boxes.change_all();
  const auto list = [&](bool changed_at_rest, int threads) {
    BroadPhaseInput input{boxes.bodies, boxes.state, boxes.known, boxes.changed, changed_at_rest, boxes.changed};
    ThreadPool pool(threads);
    std::vector<std::vector<Pair>> lists;
    lists.resize(make_tree_broad_phase()->find(input, pool, lists));
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const auto& some : lists)
      for (const Pair p : some) pairs.emplace_back(p.a, p.b);
    return pairs;
  };
  const auto pairs = list(true, 1);  // bodies at rest make it search in the order of slots
  EXPECT_GT(pairs.size(), 1000u);
  EXPECT_EQ(list(false, 1), pairs);
  EXPECT_EQ(list(false, 3), pairs);
}

// Bodies are in the tree's order, so that families are neighbours; in a dense heap a family has too many neighbours.
TEST(Tree, SearchesOfAFamilyFindWhatThoseFromTheRootFind) {
  for (const float space : {30.0f, 1.0f}) {
    Boxes boxes;
    for (int i = 0; i < 6000; ++i) boxes.add(MotionType::dynamic, boxes.random_box(space, 2));
    std::vector<std::uint32_t> items(6000);
    std::iota(items.begin(), items.end(), 0u);
    Bvh tree;
    ThreadPool pool(1);
    tree.build(items, boxes.state.bounds.data(), pool);
    std::size_t known = 0;
    for (std::size_t i = 0; i < tree.leaves().size(); i += 7) {
      Bvh::Nearby nearby;
      tree.list_nearby(i / Bvh::family, nearby);
      known += nearby.is_known;
      const Aabb& box = boxes.state.bounds[tree.leaves()[i]].fat_box;
      std::vector<std::uint32_t> from_root, from_near;
      tree.overlap(box, from_root);
      tree.overlap(box, nearby, from_near);
      ASSERT_EQ(from_root, from_near);
    }
    EXPECT_EQ(known > 500, space > 1) << known;
  }
}

TEST(RadixSort, SortsAndIsStable) {
  std::mt19937 random(5);
  for (const std::size_t size : {0u, 1u, 2u, 64u, 65u, 3000u}) {
    std::vector<Pair> items, scratch;
    for (std::uint32_t i = 0; i < size; ++i) items.push_back({static_cast<std::uint32_t>(random() % 5000), i});
    std::vector<Pair> expected = items;
    std::stable_sort(expected.begin(), expected.end(), [](Pair x, Pair y) { return x.a < y.a; });
    radix_sort(items, scratch, 13, [](Pair p) { return p.a; });
    for (std::size_t i = 0; i < size; ++i) EXPECT_EQ(items[i].b, expected[i].b) << size;
  }
}

TEST(PairSet, HoldsWhatASetWouldHold) {
  PairSet set;
  std::set<std::pair<std::uint32_t, std::uint32_t>> oracle;
  std::mt19937 random(3);
  for (int i = 0; i < 50000; ++i) {
    const auto a = static_cast<std::uint32_t>(random() % 80), b = static_cast<std::uint32_t>(80 + random() % 40);
    if (oracle.count({a, b})) {
      set.erase(b, a);
      oracle.erase({a, b});
    } else {
      set.insert(a, b);
      oracle.insert({a, b});
    }
    ASSERT_EQ(set.size(), oracle.size());
    const auto c = static_cast<std::uint32_t>(random() % 80), d = static_cast<std::uint32_t>(80 + random() % 40);
    ASSERT_EQ(set.contains(c, d), oracle.count({c, d}) == 1);
  }
}

}  // namespace
}  // namespace fathom::native::broad_phase_test
