// Streams: bodies that come and go in every step. The results depend only on what was requested, not on how, or
// whether, they are read; and every event is reported once, with the ids of its step.
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <tuple>

#include "device/body_indices.hpp"
#include "late_device.hpp"
#include "random.hpp"
#include "world/event_list.hpp"
#include "world_fixture.hpp"

namespace fathom::streams_test {
namespace {

using test::Generator;
using test::uniform;

/// Bodies of several shapes that rain on a floor and are removed after a while, with other actions of an application.
struct Stream {
  Stream(unsigned seed, int count, const WorldDef& def) : random(seed), a_step(count), world(def) {
    world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({20, 20, 0.5f})});
    // Some are removed before the first step.
    for (int i = 0; i < 3 * a_step; ++i) {
      add();
      if (random() % 3 == 0) remove(random() % living.size());
    }
  }

  void add() {
    BodyDef def;
    const float size = uniform(random, 0.1f, 0.4f);
    const auto kind = random() % 3;
    def.shape = kind == 0   ? sphere(size)
                : kind == 1 ? box({size, 0.7f * size, 0.5f * size})
                            : capsule(0.5f * size, 0.4f * size);
    def.density = 1000;
    def.pose = {.position = {uniform(random, -3, 3), uniform(random, -3, 3), uniform(random, 0.5f, 4)}};
    def.velocity.linear = 3 * test::in_cube(random);
    def.material.restitution = random() % 4 == 0 ? 0.5f : 0.0f;
    living.push_back(world.add(def));
  }
  void remove(std::size_t which) {
    world.remove(living[which]);
    living.erase(living.begin() + static_cast<std::ptrdiff_t>(which));
  }

  void step() {
    for (int i = 0; i < a_step; ++i) add();
    // Occasionally in larger numbers, for which buffers grow.
    if (world.step_count() % 40 == 20)
      for (int i = 0; i < 20 * a_step; ++i) add();
    while (living.size() > 30 * static_cast<std::size_t>(a_step)) remove(random() % 5 ? 0 : random() % living.size());
    // Some are removed before they are ever simulated.
    add(), remove(living.size() - 1);
    if (random() % 4 == 0) world.set_velocity(living[random() % living.size()], 5 * test::in_cube(random), {});
    if (world.step_count() % 32 == 31) world.set_gravity({0, 0, uniform(random, -12, -8)});
    world.step();
  }

  Generator random;
  int a_step;
  World world;
  std::deque<BodyId> living;
};

enum class Reading { nothing, poses, awake, events, contacts, profile, now_and_then };
constexpr Reading all_readings[] = {Reading::nothing,  Reading::poses,   Reading::awake,       Reading::events,
                                    Reading::contacts, Reading::profile, Reading::now_and_then};

void read(const Stream& stream, Reading reading, int step) {
  const World& world = stream.world;
  switch (reading) {
    case Reading::nothing:
      return;
    case Reading::poses:
      return (void)world.poses();
    case Reading::awake:
      return (void)world.is_awake(stream.living.front());
    case Reading::events:
      return (void)(world.contacts_begun().size() + world.hits().size());
    case Reading::contacts:
      return world.for_each_contact([](const ContactInfo&) {});
    case Reading::profile:
      return (void)world.profile();
    case Reading::now_and_then:
      if (step % 7 == 3) world.wait();
      if (step % 5 == 0) read(stream, Reading::events, step);
      if (step % 11 == 0) read(stream, Reading::contacts, step);
  }
}

std::vector<int> steps_ahead(const WorldDef& def) {
  if (def.simulator == SimulatorKind::device) return {0, 1, 2, 3};
  return {0};
}

/// The variant's world, and on the host also the device's.
std::vector<WorldDef> worlds() {
  std::vector<WorldDef> all{test::sleepy_world()};
  if (all[0].simulator != SimulatorKind::native) return all;
  for (const SimulatorKind kind : {SimulatorKind::hybrid, SimulatorKind::device}) {
    all.push_back(all[0]);
    all.back().simulator = kind;
    all.back().device = test::test_device();
  }
  return all;
}

TEST(Streams, SameBitsHoweverResultsAreRead) {
  constexpr int steps = 60;
  unsigned seed = 0;
  for (WorldDef def : worlds())
    for (const int a_step : {1, 8}) {
      ++seed;
      std::uint64_t expected = 0;
      for (def.ahead = 0; def.ahead < static_cast<int>(steps_ahead(def).size()); ++def.ahead)
        for (const Reading reading : all_readings) {
          def.threads = 1 + static_cast<int>(reading) % 4;
          Stream stream(seed, a_step, def);
          for (int i = 0; i < steps; ++i) stream.step(), read(stream, reading, i);
          const std::uint64_t hash = stream.world.state_hash();
          if (expected == 0) expected = hash;
          ASSERT_EQ(hash, expected) << "simulator " << static_cast<int>(def.simulator) << ", " << a_step
                                    << " a step, ahead " << def.ahead << ", reading " << static_cast<int>(reading);
        }
    }
}

using Touch = std::tuple<std::uint64_t, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;
struct Told {
  std::vector<Touch> begun, ended, hits;
  bool operator==(const Told&) const = default;
};

/// All events of a stream that is read after every `every`-th step.
Told told(unsigned seed, int a_step, const WorldDef& def, int every) {
  constexpr int steps = 80;
  Stream stream(seed, a_step, def);
  Told all;
  const auto add = [&](auto& list, const auto& events) {
    for (const auto& e : events) {
      EXPECT_LE(e.step, stream.world.step_count());
      list.emplace_back(e.step, e.a.index, e.a.generation, e.b.index, e.b.generation);
    }
  };
  for (int i = 1; i <= steps; ++i) {
    stream.step();
    if (i == steps) stream.world.wait();
    if (i % every && i < steps) continue;
    add(all.begun, stream.world.contacts_begun());
    add(all.ended, stream.world.contacts_ended());
    add(all.hits, stream.world.hits());
  }
  return all;
}

TEST(Streams, EveryEventIsToldOnceWithItsStep) {
  for (WorldDef def : worlds())
    for (const unsigned seed : {1u, 2u}) {
      const int a_step = seed == 1 ? 2 : 12;
      def.ahead = 0;
      const Told expected = told(seed, a_step, def, 1);
      const auto enough = static_cast<std::size_t>(5 * a_step);
      ASSERT_GT(expected.begun.size(), 4 * enough);
      ASSERT_GT(expected.ended.size(), 2 * enough);
      ASSERT_GT(expected.hits.size(), enough);
      EXPECT_TRUE(std::ranges::is_sorted(expected.begun, {}, [](const Touch& t) { return std::get<0>(t); }));
      if (def.simulator != SimulatorKind::device) continue;
      const test::LateDevice late;
      for (def.ahead = 1; def.ahead <= 3; ++def.ahead)
        for (const int every : {1, 3, 100})
          EXPECT_TRUE(told(seed, a_step, def, every) == expected) << "ahead " << def.ahead << ", every " << every;
    }
}

TEST(Streams, EventsNameBodiesThatAreOrWereThere) {
  // A contact begins once, and ends, between bodies that existed when their step began.
  for (const WorldDef& def : worlds())
    for (unsigned seed = 0; seed < 4; ++seed) {
      Stream stream(seed, 2 + static_cast<int>(seed), def);
      std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::uint32_t, std::uint32_t>> touching;
      std::vector<std::uint32_t> generations;
      for (int i = 0; i < 60; ++i) {
        stream.step();
        for (const ContactEvent& e : stream.world.contacts_ended())
          EXPECT_EQ(touching.erase({e.a.index, e.b.index}), 1u) << "seed " << seed << ", step " << i;
        for (const ContactEvent& e : stream.world.contacts_begun()) {
          EXPECT_TRUE(stream.world.contains(e.a) && stream.world.contains(e.b)) << "seed " << seed << ", step " << i;
          touching[{e.a.index, e.b.index}] = {e.a.generation, e.b.generation};
        }
        for (const HitEvent& e : stream.world.hits())
          EXPECT_TRUE(stream.world.contains(e.a) && stream.world.contains(e.b)) << "seed " << seed << ", step " << i;
        std::size_t contacts = 0;
        stream.world.for_each_contact([&](const ContactInfo& c) {
          ++contacts;
          const auto found = touching.find({c.a.index, c.b.index});
          ASSERT_NE(found, touching.end());
          EXPECT_EQ(found->second, std::pair(c.a.generation, c.b.generation));
        });
        EXPECT_EQ(contacts, touching.size());
      }
    }
}

// Against a table of which body had which index in which step.
TEST(BodyIndices, AreGivenByCallsAloneAndRememberTheirOwners) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Generator random(seed);
    device::BodyIndices indices;
    std::map<std::uint32_t, BodyId> owner;                    // by index
    std::vector<std::map<std::uint32_t, BodyId>> owners{{}};  // by step
    std::vector<std::uint32_t> free_slots, generations;
    for (std::uint64_t step = 1; step < 40; ++step) {
      std::map<std::uint32_t, BodyId> had = owner;
      for (auto k = random() % 12; k-- > 0;) {
        if (random() % 2 && !owner.empty()) {
          const auto gone = std::next(owner.begin(), static_cast<std::ptrdiff_t>(random() % owner.size()));
          ++generations[gone->second.index];
          free_slots.push_back(gone->second.index);
          indices.remove(gone->second, step);
          owner.erase(gone);
        } else {
          if (free_slots.empty()) free_slots.push_back(static_cast<std::uint32_t>(generations.size()));
          if (free_slots.back() == generations.size()) generations.push_back(1);
          const BodyId id{free_slots.back(), generations[free_slots.back()]};
          free_slots.pop_back();
          const std::uint32_t index = indices.add(id.index, step);
          EXPECT_FALSE(had.contains(index)) << "its last owner's contacts are still there";
          owner[index] = had[index] = id;
          EXPECT_EQ(indices.of(id.index), index);
        }
      }
      EXPECT_LE(indices.size(), owner.size() + 24);
      owners.push_back(had);
      for (std::uint64_t asked = step - std::min<std::uint64_t>(step - 1, 3); asked <= step; ++asked) {
        for (const auto& [index, id] : owners[asked]) {
          const BodyId* const former = indices.former(index, asked);
          EXPECT_TRUE(former ? *former == id : indices.slot(index) == id.index);
        }
      }
      if (step > 3) indices.forget_before(step - 2);
    }
  }
}

TEST(EventList, KeepsWhatNobodyReadsUpToALimit) {
  EventList<Quarantine> list;
  std::vector<Quarantine> some(1000);
  for (std::size_t i = 0; i < some.size(); ++i) some[i].step = i;
  EXPECT_EQ(list.add(some), 0u);
  EXPECT_EQ(list.read().size(), 1000u);
  EXPECT_EQ(list.add(some), 0u);
  EXPECT_EQ(list.read().size(), 2000u) << "what is read stays until the next step";
  list.begin_step();
  EXPECT_EQ(list.read().size(), 0u);
  std::size_t dropped = 0;
  for (int i = 0; i < 1000; ++i) dropped += list.add(some);
  const std::span<const Quarantine> left = list.read();
  EXPECT_EQ(left.size() + dropped, 1'000'000u);
  EXPECT_LE(left.size(), max_unread_events);
  EXPECT_EQ(left.back().step, 999u);
  EXPECT_EQ(list.of_step(999).size(), (left.size() + 999) / 1000);
}

}  // namespace
}  // namespace fathom::streams_test
