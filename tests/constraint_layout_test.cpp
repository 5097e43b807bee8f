#include "native/constraint_layout.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::native::constraint_layout_test {
namespace {

/// Cubes in a row of rows on a ground, with contacts between requested pairs.
struct Contacts {
  BodyTable bodies;
  BodyState state;
  ContactGraph graph{bodies, state};
  std::unique_ptr<BroadPhase> broad_phase = make_tree_broad_phase();
  Neighbourhood neighbourhood;
  std::vector<std::uint32_t> in_contact, kinematic_in_contact;

  explicit Contacts(std::uint32_t count) {
    add(test::ground(), 0);
    for (std::uint32_t i = 1; i <= count; ++i)
      add(test::cube({static_cast<float>(i % 40) * 1.2f, static_cast<float>(i / 40) * 1.2f, 1}), awake);
  }

  void touch(std::uint32_t a, std::uint32_t b) {
    const Pair pair{a, b};
    if (graph.pairs().contains(a, b)) return;
    graph.add({&pair, 1});
    const auto contact = static_cast<std::uint32_t>(graph.size() - 1);
    graph.make_manifolds(1);
    graph.begin(0, contact);
    graph.colour(contact);
  }

  ConstraintLayout lay_out(ThreadPool& pool, std::size_t width) {
    in_contact.clear();
    kinematic_in_contact.clear();
    for (std::uint32_t slot = 1; slot < state.size(); ++slot) {
      if (!state.is_to_solve(slot)) continue;
      in_contact.push_back(slot);
      if (state.flags[slot] & kinematic) kinematic_in_contact.push_back(slot);
    }
    std::vector<std::uint32_t> changed, set_changes;
    for (const BodyId id : bodies.living()) set_changes.push_back(id.index);
    std::vector<std::vector<Pair>> found;
    broad_phase->find({bodies, state, graph.pairs(), changed, true, set_changes}, pool, found);
    neighbourhood.update(*broad_phase, state.size());
    ConstraintLayout layout(state, graph, pool, width);
    EXPECT_TRUE(layout.update({in_contact, 1, kinematic_in_contact}, neighbourhood));
    EXPECT_FALSE(layout.update({in_contact, 1, kinematic_in_contact}, neighbourhood));
    return layout;
  }

 private:
  void add(const BodyDef& def, std::uint8_t flags) {
    const std::uint32_t slot = bodies.add(def).index;
    state.resize(slot + 1);
    graph.resize(slot + 1);
    state.clear(slot);
    state.poses[slot] = def.pose;
    state.flags[slot] = flags;
    state.bounds[slot].fat_box = motion_box(bodies[slot], def.pose, {}, 1.0f / 60);
  }
};

/// Every coloured contact has one lane, every body one slot, and no block contains a body twice.
void check(const ConstraintLayout& layout, const Contacts& c, std::size_t width) {
  std::multiset<std::uint32_t> expected, seen;
  for (int colour = 0; colour < colour_count; ++colour)
    c.graph.for_each_of_colour(colour, [&](std::uint32_t index) { expected.insert(index); });
  std::size_t blocks = 0;
  for (const auto& stretch : layout.stretches())
    for (std::size_t block = stretch.first; block < stretch.end; ++block, ++blocks) {
      std::set<std::uint32_t> of_block;
      for (std::size_t lane = block * width; lane < (block + 1) * width; ++lane) {
        const std::uint32_t index = layout.lanes()[lane];
        if (index == none) continue;
        seen.insert(index);
        const Contact& contact = c.graph[index];
        EXPECT_TRUE(of_block.insert(contact.b).second);
        EXPECT_TRUE(contact.fixed_a || of_block.insert(contact.a).second);
      }
    }
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(blocks, layout.blocks());
  const std::multiset<std::uint32_t> bodies(layout.bodies().begin(), layout.bodies().end());
  EXPECT_EQ(bodies, std::multiset<std::uint32_t>(c.in_contact.begin(), c.in_contact.end()));
}

TEST(ConstraintLayout, ManyIslandsMakeGroupsThatShareNoBody) {
  Contacts c(1200);
  for (std::uint32_t i = 1; i <= 1200; ++i) {
    c.touch(0, i);
    if (i % 3 != 0) c.touch(i, i + 1);
  }
  for (const int threads : {2, 4}) {
    ThreadPool pool(threads);
    ConstraintLayout layout = c.lay_out(pool, 8);
    check(layout, c, 8);
    ASSERT_GE(layout.groups().size(), 2u * static_cast<std::size_t>(threads));
    std::map<std::uint32_t, std::size_t> group_of;
    for (std::size_t g = 0; g < layout.groups().size(); ++g)
      for (const std::uint32_t slot : layout.bodies(layout.groups()[g])) group_of[slot] = g;
    for (std::size_t g = 0; g < layout.groups().size(); ++g)
      for (std::size_t lane = layout.groups()[g].blocks.begin * 8; lane < layout.groups()[g].blocks.end * 8; ++lane)
        if (const std::uint32_t index = layout.lanes()[lane]; index != none) {
          EXPECT_EQ(group_of.at(c.graph[index].b), g);
          EXPECT_TRUE(c.graph[index].fixed_a || group_of.at(c.graph[index].a) == g);
        }
  }
}

TEST(ConstraintLayout, OneLargeIslandIsSharedByAllThreads) {
  Contacts c(600);
  test::Generator random(7);
  for (std::uint32_t i = 1; i < 600; ++i) c.touch(i, i + 1);
  for (int i = 0; i < 900; ++i) {
    const auto a = 1 + static_cast<std::uint32_t>(random() % 600), b = 1 + static_cast<std::uint32_t>(random() % 600);
    if (a != b) c.touch(a, b);
  }
  for (const int threads : {1, 3, 8}) {
    ThreadPool pool(threads);
    ConstraintLayout layout = c.lay_out(pool, 16);
    EXPECT_TRUE(layout.groups().empty());
    check(layout, c, 16);
    std::vector<int> visits(layout.blocks(), 0), of_all(layout.blocks(), 0), bodies(c.in_contact.size(), 0);
    for (std::size_t s = 0; s < layout.stretches().size(); ++s)
      layout.for_each_part(s, [&](std::size_t begin, std::size_t end, std::size_t share_end) {
        EXPECT_LE(end, share_end);
        EXPECT_LE(share_end, layout.stretches()[s].end);
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
      });
    layout.for_each_part_of_all([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++of_all[i];
    });
    layout.for_each_part_of_bodies([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++bodies[i];
    });
    for (const auto* counts : {&visits, &of_all, &bodies})
      EXPECT_TRUE(std::all_of(counts->begin(), counts->end(), [](int n) { return n == 1; })) << threads;
  }
}

TEST(ConstraintLayout, KinematicBodiesBelongToNoGroup) {
  Contacts c(1200);
  const std::uint32_t lift = 17;
  c.state.flags[lift] |= kinematic;
  c.state.note_to_solve(lift);
  for (std::uint32_t i = 1; i <= 1200; ++i)
    if (i != lift) c.touch(i % 2 == 0 ? 0 : lift, i);
  ThreadPool pool(2);
  const ConstraintLayout layout = c.lay_out(pool, 8);
  ASSERT_GE(layout.groups().size(), 4u);
  EXPECT_EQ(std::vector(layout.kinematic().begin(), layout.kinematic().end()), std::vector{lift});
  std::erase(c.in_contact, lift);
  check(layout, c, 8);
  std::size_t bodies = 0;
  for (const ConstraintLayout::Group& group : layout.groups()) bodies += layout.bodies(group).size();
  EXPECT_EQ(bodies, 1199u);
}

TEST(ConstraintLayout, ALargeHeapIsDividedIntoDomainsThatShareNoBody) {
  Contacts c(3200);
  for (std::uint32_t i = 1; i + 41 <= 3200; ++i) {
    c.touch(0, i);
    for (const std::uint32_t other : {i + 1, i + 40, i + 41})
      if (other % 40 != 0 || other == i + 40) c.touch(i, other);
  }
  std::vector<std::uint32_t> all;
  for (std::uint32_t slot = 1; slot <= 3200; ++slot) all.push_back(slot);
  ThreadPool dividing(2);
  c.graph.divide(all, dividing);
  const Domains& domains = c.graph.domains();
  ASSERT_TRUE(domains.in_use());
  ThreadPool pool(3);
  const ConstraintLayout layout = c.lay_out(pool, 8);
  check(layout, c, 8);
  ASSERT_EQ(layout.units().size(), domains.units());
  for (std::size_t division = 0; division < Domains::divisions; ++division) {
    std::map<std::uint32_t, std::size_t> unit_of;
    std::size_t largest = 0, sum = 0;
    for (std::size_t u = domains.first_unit(division); u < domains.first_unit(division + 1); ++u) {
      const ConstraintLayout::Unit& unit = layout.units()[u];
      for (std::size_t lane = unit.blocks.begin * 8; lane < unit.blocks.end * 8; ++lane) {
        if (layout.lanes()[lane] == none) continue;
        const Contact& contact = c.graph[layout.lanes()[lane]];
        EXPECT_EQ(unit_of.emplace(contact.b, u).first->second, u);
        EXPECT_TRUE(contact.fixed_a || unit_of.emplace(contact.a, u).first->second == u);
      }
      for (const std::uint32_t slot : layout.bodies(unit)) EXPECT_TRUE(division == 0 && domains.home(slot) == u);
      largest = std::max(largest, c.graph.size_of_unit(u));
      sum += c.graph.size_of_unit(u);
    }
    if (division == 0) {
      EXPECT_LT(largest * domains.count(0), sum * 5 / 4);
    }
  }
  EXPECT_LT(c.graph.size_of_unit(domains.remainder()), c.graph.between() / 50);
  c.graph.divide({}, dividing);
  EXPECT_FALSE(domains.in_use());
  check(c.lay_out(pool, 8), c, 8);
}

}  // namespace
}  // namespace fathom::native::constraint_layout_test
