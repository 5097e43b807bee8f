// The list of overloaded bodies (native/overloads.hpp) equals the result of checking all bodies.
#include "native/overloads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fathom/world.hpp>
#include <random>
#include <thread>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::test::overloads_test {
namespace {

/// By slot, as simply as possible.
struct Plain {
  struct Load {
    float now = 0, before = 0, inertia_scale = 1;
  };
  std::vector<Load> loads;
  std::vector<Velocity> velocities;
  std::vector<bool> carried;  ///< settled, whatever the velocity
  std::vector<bool> awake;
  bool any = false, had_any = false, any_scaled = false, any_asleep = false;

  void advance() {
    if (!any && !had_any && !any_scaled && !any_asleep) return;
    had_any = any;
    any = any_scaled = any_asleep = false;
    for (std::size_t i = 0; i < loads.size(); ++i) {
      Load& l = loads[i];
      const bool settled = carried[i] || is_settled(velocities[i].linear);
      if (awake[i]) l = {0, l.now, next_inertia_scale(l.inertia_scale, std::min(l.now, l.before), settled)};
      (awake[i] ? any_scaled : any_asleep) |= l.inertia_scale > 1;
    }
  }
};

void expect_same(const native::Overloads& overloads, const Plain& plain, int step) {
  ASSERT_EQ(overloads.any(), plain.any) << step;
  ASSERT_EQ(overloads.any_scaled(), plain.any_scaled) << step;
  for (std::uint32_t i = 0; i < plain.loads.size(); ++i) {
    const Plain::Load& l = plain.loads[i];
    ASSERT_EQ(overloads.lasts(i), std::min(l.now, l.before) > 0) << "step " << step << ", slot " << i;
    ASSERT_EQ(overloads.inertia_scale(i), l.inertia_scale) << "step " << step << ", slot " << i;
  }
}

/// Makes `copy` the same through the bytes of a snapshot.
void restore(native::Overloads& copy, const native::Overloads& overloads, std::size_t slots) {
  std::vector<std::byte> bytes;
  ByteWriter out(bytes);
  native::Overloads::archive(overloads, out);
  ByteReader in(bytes, "loads");
  native::Overloads::archive(copy, in);
  copy.restored(in, slots);
}

}  // namespace

TEST(Overloads, AreThoseThatALookAtAllBodiesFinds) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
    native::Overloads first, second;  // alternately, each made from the other one's bytes
    Plain plain;
    for (int step = 0; step < 150; ++step) {
      native::Overloads& overloads = step % 2 ? second : first;
      if (step > 0) restore(overloads, step % 2 ? first : second, plain.loads.size());
      if (step % 40 == 0) {
        plain.loads.resize(plain.loads.size() + 1 + below(50)), plain.awake.resize(plain.loads.size(), true);
        plain.velocities.resize(plain.loads.size());
        overloads.resize(plain.loads.size());
      }
      const auto slots = static_cast<std::uint32_t>(plain.loads.size());
      if (below(4) == 0) plain.awake[below(slots)] = below(2) == 0;
      plain.velocities[below(slots)].linear.x = below(2) == 0 ? 0 : 1;
      plain.carried.assign(slots, false);
      for (std::uint32_t k = below(8); k > 0; --k) {
        const std::uint32_t slot = below(slots);
        overloads.settle(slot), plain.carried[slot] = true;
      }
      overloads.advance([&](std::uint32_t slot) { return plain.awake[slot]; }, plain.velocities);
      plain.advance();
      if (below(5) == 0) {
        const std::uint32_t slot = below(slots);
        overloads.forget(slot), plain.loads[slot] = {};
      }
      for (std::uint32_t k = step % 50 < 25 ? below(8) : 0; k > 0; --k) {
        const std::uint32_t slot = below(slots);
        const float wanted = static_cast<float>(1 + below(30));
        if (below(6) == 0) {
          overloads.require(slot, wanted);
          plain.loads[slot].inertia_scale = std::max(plain.loads[slot].inertia_scale, wanted);
          plain.any_scaled = true;
        } else {
          overloads.note(slot, wanted);
          plain.loads[slot].now = std::max(plain.loads[slot].now, wanted);
          plain.any = true;
        }
      }
      expect_same(overloads, plain, step);
    }
  }
}

TEST(Overloads, AreListedOnceHoweverManyThreadsNoteThem) {
  constexpr std::uint32_t slots = 500;
  native::Overloads overloads;
  overloads.resize(slots);
  for (int step = 0; step < 50; ++step) {
    overloads.advance([](std::uint32_t) { return true; }, std::vector<Velocity>(slots));
    std::vector<std::thread> threads;
    for (std::uint32_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (std::uint32_t i = 0; i < slots; ++i) overloads.note(i, static_cast<float>(2 + (i + t) % 4));
      });
    for (std::thread& thread : threads) thread.join();
    for (std::uint32_t i = 0; i < slots; ++i) ASSERT_EQ(overloads.lasts(i), step > 0) << step;
  }
  // A body listed twice would be taken as not overloaded in the last step.
  for (std::uint32_t i = 0; i < slots; ++i) ASSERT_EQ(overloads.inertia_scale(i), 5) << i;
}

// Bodies are found by their index among those in contact, whatever slots they have.
TEST(Overloads, AndSupportsDoNotDependOnBodiesElsewhere) {
  const auto tower = [](int others) {
    World world(quiet_world());
    world.add(ground());
    std::vector<BodyId> far;
    for (int i = 0; i < others; ++i) {
      BodyDef def = cube({static_cast<float>(100 + 3 * (i % 70)), static_cast<float>(3 * (i / 70)), 1});
      def.motion = i % 7 == 0 ? MotionType::dynamic : MotionType::fixed;
      far.push_back(world.add(def));
    }
    std::vector<BodyId> ids;
    for (int i = 0; i < 4; ++i)
      ids.push_back(world.add(dynamic(box({0.3f, 0.3f, 0.1f}), {0, 0, 0.6f + 0.2f * static_cast<float>(i)})));
    ids.push_back(world.add(dynamic(box({0.3f, 0.3f, 0.3f}), {0, 0, 1.6f}, 2000)));
    for (int step = 0; step < 240; ++step) {
      if (step % 20 == 10 && !far.empty()) world.remove(far.back()), far.pop_back();
      world.step();
    }
    std::vector<Pose> poses;
    for (const BodyId id : ids) poses.push_back(world.pose(id));
    return poses;
  };
  const std::vector<Pose> alone = tower(0), among = tower(3000);
  for (std::size_t i = 0; i < alone.size(); ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(alone[i].position[k], among[i].position[k]) << i;
    EXPECT_EQ(alone[i].rotation.w, among[i].rotation.w) << i;
  }
  EXPECT_NEAR(alone.back().position.z, 1.6f, 0.003f);
}

}  // namespace fathom::test::overloads_test
