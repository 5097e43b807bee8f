// Joints of the device simulator: the host's copy of them, colours taken from contacts, and memory that runs out.
#include <gtest/gtest.h>

#include <map>

#include "device/joint_mirror.hpp"
#include "exec/host/faults.hpp"
#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::device_joints_test {
namespace {

using device::ApartEdit;
using device::ApartPairs;
using device::ApartTable;

// The device's table is the result of edits.
TEST(ApartPairs, HoldWhatWasAddedMoreOftenThanRemoved) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Generator random(seed);
    ApartPairs pairs;
    pairs.begin();
    std::vector<std::uint64_t> on_device;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> times;
    const auto bodies = static_cast<std::uint32_t>(2 + random() % 60);
    for (int i = 0; i < 300; ++i) {
      const auto a = static_cast<std::uint32_t>(random() % bodies), b = static_cast<std::uint32_t>(random() % bodies);
      if (a == b) continue;
      int& count = times[{std::min(a, b), std::max(a, b)}];
      if (count > 0 && random() % 2) {
        --count;
        pairs.remove(ApartTable::pair(b, a));
      } else {
        ++count;
        pairs.add(ApartTable::pair(a, b));
      }
      if (random() % 8) continue;
      on_device.resize(pairs.size(), 0);
      for (const ApartEdit& edit : pairs.take_edits()) on_device[edit.slot] = edit.pair;
      const ApartTable table{on_device.data(), static_cast<std::uint32_t>(on_device.size()) - 1, 1};
      for (std::uint32_t x = 0; x < bodies; ++x)
        for (std::uint32_t y = 0; y < x; ++y)
          ASSERT_EQ(table.has(x, y), (times[{y, x}] > 0)) << "seed " << seed << ", pair " << x << ", " << y;
    }
  }
}

constexpr JointWorlds on_device{"device", SimulatorKind::device};

// Boxes lie in a heap, whose contacts have the lowest colours, when they are all tied together; then they are untied.
TEST(DeviceJoints, TakeColoursThatContactsHave) {
  for (const bool sleeps : {false, true}) {
    World world(sleeps ? on_device.sleepy() : on_device.quiet());
    world.add(ground());
    std::vector<BodyId> boxes;
    for (int i = 0; i < 90; ++i)
      boxes.push_back(
          world.add(cube({static_cast<float>(i % 3), static_cast<float>(i / 3 % 5), 1 + static_cast<float>(i / 15)})));
    run(world, sleeps ? 200 : 60);
    const auto contacts = [&] {
      int count = 0;
      world.for_each_contact([&](const ContactInfo&) { ++count; });
      return count;
    };
    const int before = contacts();
    for (std::size_t i = 0; i + 1 < boxes.size(); ++i)
      if (i % 3 < 2) {
        JointDef def = ball_joint(boxes[i], boxes[i + 1], {0.5f, 0, 0}, {-0.5f, 0, 0});
        def.collide_connected = i % 2;
        world.add_joint(def);
      }
    run(world, 60);
    EXPECT_EQ(world.profile().counts.overflow, 0);
    EXPECT_LT(contacts(), before);
    EXPECT_LT(widest_gap(world), 2e-3f);
    while (world.joint_count() > 0) world.remove_joint(world.joints().back());
    run(world, 60);
    EXPECT_NEAR(contacts(), before, 0.05 * before);  // some are about to touch
    for (const BodyId id : boxes) EXPECT_LT(length(world.velocity(id).linear), 0.01f);
  }
}

// As in DeviceFaults: where memory runs out, a step has not been requested.
TEST(DeviceJoints, GoOnWhereMemoryRanOut) {
  const auto add = [](World& world, int i) {
    if (i % 3) return;
    for (int k = 0; k < 40; ++k)
      Chain(world, {}, {static_cast<float>(k % 8), static_cast<float>(k / 8), 1 + static_cast<float>(i)}, {1, 0, 0}, 4);
    for (int k = 0; i > 0 && k < 10; ++k) world.remove_joint(world.joints()[static_cast<std::size_t>(7 * k)]);
  };
  constexpr int steps = 12;
  WorldDef def = on_device.quiet();
  def.device = "host";  // whose memory can be made to run out
  World spared(def);
  spared.add(ground());
  for (int i = 0; i < steps; ++i) add(spared, i), spared.step();
  int failures = 0;
  for (int allowed = 0; allowed < 60; ++allowed) {
    World world(def);
    world.add(ground());
    for (int i = 0; i < steps; ++i) {
      add(world, i);
      if (i == 6) exec::host_faults.allocations = allowed;
      try {
        world.step();
      } catch (const Error&) {
        ++failures;
        exec::host_faults.allocations = -1;
        world.step();
      }
      exec::host_faults.allocations = -1;
    }
    ASSERT_EQ(world.state_hash(), spared.state_hash()) << allowed;
  }
  EXPECT_GT(failures, 0);
}

// Trees of joints are gone when joints come that only sweeps solve, more than there ever were.
TEST(DeviceJoints, SweepsSolveMoreThanThereWereInTrees) {
  World world(on_device.quiet()), plain(JointWorlds{"native", SimulatorKind::native}.quiet());
  for (World* const w : {&world, &plain}) {
    w->add(ground());
    std::vector<BodyId> boxes;
    for (int i = 0; i < 50; ++i)
      boxes.push_back(w->add(dynamic(box({0.2f, 0.2f, 0.2f}), {static_cast<float>(i), 0, 0.7f})));
    const auto joint = [&](std::size_t i) { return ball_joint(boxes[i], boxes[i + 1], {0.5f, 0, 0}, {-0.5f, 0, 0}); };
    for (std::size_t i = 0; i < 4; ++i) w->add_joint(joint(i));
    run(*w, 3);
    while (w->joint_count() > 0) w->remove_joint(w->joints().back());
    run(*w, 3);
    for (std::size_t i = 0; i < 400; ++i) {
      JointDef spring = joint(i % 49);
      spring.hertz = 3;
      w->add_joint(spring);
    }
    run(*w, 30);
  }
  for (const BodyId id : world.bodies()) EXPECT_LT(length(world.pose(id).position - plain.pose(id).position), 1e-3f);
}

}  // namespace
}  // namespace fathom::test::device_joints_test
