// Compounds and surfaces on the device simulator: what it promises beyond the World's interface.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <vector>

#include "device/body_indices.hpp"
#include "test_compounds.hpp"
#include "world_fixture.hpp"

namespace fathom::test::device_parts_test {
namespace {

WorldDef device_world(int threads = 1) {
  WorldDef def;
  def.simulator = SimulatorKind::device;
  def.device = test_device();
  def.threads = threads;
  return def;
}

/// Compounds and convex bodies that fall on a wavy mesh.
std::vector<BodyDef> falling(int count, std::uint32_t seed) {
  Generator random(seed);
  std::vector<BodyDef> bodies;
  for (int i = 0; i < count; ++i) {
    const float size = uniform(random, 0.1f, 0.3f);
    BodyDef def = dynamic(i % 2 == 0 ? random_compound(random, size) : shapes_of(size)[random() % 4],
                          {3 * uniform(random, -1, 1), 3 * uniform(random, -1, 1), 2 + 0.05f * static_cast<float>(i)});
    def.pose.rotation = any_rotation(random);
    bodies.push_back(def);
  }
  return bodies;
}

World world_of(const WorldDef& def, int bodies) {
  World world(def);
  world.add(fixed(wavy_mesh(40)));
  for (const BodyDef& body : falling(bodies, 1)) world.add(body);
  return world;
}

TEST(DeviceParts, StepsThatRunOutOfRoomAreDoneAgain) {
  // From the start it has room for 1,024 manifolds; 1,200 bodies need some twice as many, and slots for patches.
  World grows = world_of(device_world(), 700), has_room(device_world());
  has_room.reserve(40'000);
  has_room.add(fixed(wavy_mesh(40)));
  for (const BodyDef& body : falling(700, 1)) has_room.add(body);
  for (int i = 0; i < 120; ++i) {
    grows.step();
    has_room.step();
  }
  EXPECT_EQ(grows.state_hash(), has_room.state_hash());
  EXPECT_GT(grows.profile().counts.manifolds, 1024u);
}

using Touch = std::tuple<std::uint32_t, std::uint32_t, std::uint64_t>;

TEST(DeviceParts, EventsArePairsHoweverTheyAreRead) {
  std::vector<std::set<Touch>> begun, ended;
  for (const int ahead : {0, 2})
    for (const int every : {1, 7}) {
      if (ahead == 0 && every > 1) continue;  // without running ahead, unread events are dropped
      WorldDef def = device_world();
      def.ahead = ahead;
      World world = world_of(def, 40);
      std::set<Touch> all_begun, all_ended;
      const auto read = [&] {
        for (const ContactEvent& e : world.contacts_begun()) all_begun.emplace(e.a.index, e.b.index, e.step);
        for (const ContactEvent& e : world.contacts_ended()) all_ended.emplace(e.a.index, e.b.index, e.step);
      };
      for (int i = 1; i <= 210; ++i) {
        world.step();
        if (i % every == 0) read();
      }
      world.wait();
      read();
      begun.push_back(all_begun), ended.push_back(all_ended);
      std::set<std::pair<std::uint32_t, std::uint32_t>> touching;
      for (const auto& [a, b, step] : all_begun) touching.emplace(a, b);
      EXPECT_GT(touching.size(), 40u);
      // Each pair begins and ends in turn.
      for (const auto& pair : touching) {
        const auto of_pair = [&](const std::set<Touch>& events) {
          return std::ranges::count_if(
              events, [&](const Touch& t) { return std::pair(std::get<0>(t), std::get<1>(t)) == pair; });
        };
        const auto more = of_pair(all_begun) - of_pair(all_ended);
        EXPECT_TRUE(more == 0 || more == 1);
      }
    }
  for (std::size_t i = 1; i < begun.size(); ++i) {
    EXPECT_EQ(begun[i], begun[0]);
    EXPECT_EQ(ended[i], ended[0]);
  }
}

TEST(DeviceParts, TouchesAreCountedWhileNobodyReads) {
  World world = world_of(device_world(), 30), read = world_of(device_world(), 30);
  for (int i = 0; i < 150; ++i) {
    world.step();
    read.step();
    (void)read.contacts_begun();
  }
  for (int i = 0; i < 60; ++i) {
    world.step();
    read.step();
    const auto pairs = [](std::span<const ContactEvent> events) {
      std::set<std::pair<std::uint32_t, std::uint32_t>> all;
      for (const ContactEvent& e : events) all.emplace(e.a.index, e.b.index);
      return all;
    };
    EXPECT_EQ(pairs(world.contacts_begun()), pairs(read.contacts_begun()));
    EXPECT_EQ(pairs(world.contacts_ended()), pairs(read.contacts_ended()));
  }
}

TEST(DeviceParts, StreamsOfCompoundsNeedNoMoreIndicesThanLiveAtOnce) {
  device::BodyIndices indices;
  std::uint32_t most = 0;
  for (std::uint64_t step = 1; step < 200; ++step) {
    const std::uint32_t slot = static_cast<std::uint32_t>(step % 3);
    if (step > 3) {
      indices.remove_children(slot, 5, step);
      indices.remove({slot, 1}, step);
    }
    indices.add(slot, step);
    indices.add_children(slot, 5, step);
    for (std::uint32_t other = 0; other < 3; ++other) {
      if (step < 4 || other == slot) continue;
      const std::uint32_t first = indices.first_child(slot), there = indices.first_child(other);
      EXPECT_TRUE(first + 5 <= there || there + 5 <= first);
    }
    if (step == 20) most = indices.size();
  }
  EXPECT_EQ(indices.size(), most);
}

TEST(DeviceParts, BodiesOfManyPartsComeAndGo) {
  std::set<std::uint64_t> hashes;
  for (const int threads : {1, 3}) {
    World world = world_of(device_world(threads), 10);
    Generator random(4);
    std::vector<BodyId> ids;
    for (int i = 0; i < 160; ++i) {
      for (const BodyDef& body : falling(2, static_cast<std::uint32_t>(random()))) ids.push_back(world.add(body));
      if (i == 60) ids.push_back(world.add(fixed(wavy_field(21), {-5, -5, 0.5f})));
      if (ids.size() > 30) {
        const std::size_t k = random() % ids.size();
        world.remove(ids[k]);
        ids.erase(ids.begin() + static_cast<std::ptrdiff_t>(k));
      }
      if (i % 9 == 0) world.set_shape(ids[random() % (ids.size() < 8 ? ids.size() : 8)], random_compound(random, 0.2f));
      world.step();
      for (const ContactEvent& e : world.contacts_ended()) EXPECT_NE(e.a, e.b);
    }
    hashes.insert(world.state_hash());
  }
  EXPECT_EQ(hashes.size(), 1u);
}

}  // namespace
}  // namespace fathom::test::device_parts_test
