// Failures of the device: after running out of memory anywhere in a step, a world continues bit for bit once there is
// memory again; a lost device is one error, and affects nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exec/host/faults.hpp"
#include "scene/environments.hpp"
#include "world_fixture.hpp"

namespace fathom::test::device_faults_test {
namespace {

using exec::host_faults;

class DeviceFaults : public testing::Test {
 protected:
  void TearDown() override { host_faults.allocations = host_faults.calls = -1; }
};

template <class Act>
void expect_error(ErrorCode code, const char* text, const Act& act) {
  try {
    act();
    ADD_FAILURE() << "nothing was refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_THAT(error.what(), testing::HasSubstr(text));
  }
}

// Bodies and contacts come in waves, so that every buffer grows in the middle of the run; some bounce, some are hulls.
struct Growing {
  World world;
  explicit Growing(int ahead) : world(definition(ahead)) { world.add(ground()); }

  static WorldDef definition(int ahead) {
    WorldDef def = quiet_world(1);
    def.simulator = SimulatorKind::device;
    def.device = "host";
    def.ahead = ahead;
    return def;
  }
  /// Actions before step i, in parts that a failure must not split.
  void before(int i) {
    if (i % 4 == 0) {
      for (int k = 0; k < 110; ++k)
        world.add(cube({0.9f * static_cast<float>(k % 11), 0.9f * static_cast<float>(k / 11),
                        0.9f + 0.9f * static_cast<float>(i / 4)}));
    }
    if (i == 5) {
      const Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
      world.add(dynamic(hull(corners), {3, 3, 8}));
    }
    if (i == 7) {
      BodyDef ball = dynamic(sphere(0.4f), {6, 6, 9});
      ball.material.restitution = 0.7f;
      world.add(ball);
    }
    if (i == 10) world.set_velocity(world.bodies()[5], {0, 0, 3}, {});
  }
};

constexpr int steps = 14;

std::uint64_t undisturbed(int ahead) {
  Growing run(ahead);
  for (int i = 0; i < steps; ++i) run.before(i), run.world.step();
  run.world.wait();
  return run.world.state_hash();
}

/// The same with one allocation failing, at every position one after the other; returns the number of positions.
int fail_everywhere(int ahead, std::uint64_t expected) {
  for (int failing = 0;; failing += ahead == 0 ? 1 : 3) {
    Growing run(ahead);
    bool failed = false;
    // Calls that only read may be repeated.
    const auto until_it_works = [&](const auto& call) {
      for (;;) {
        try {
          return call();
        } catch (const Error& error) {
          EXPECT_EQ(error.code(), ErrorCode::capacity) << error.what();
          EXPECT_FALSE(failed) << "only one allocation fails";
          failed = true;
        }
      }
    };
    host_faults.allocations = failing;
    for (int i = 0; i < steps; ++i) {
      run.before(i);
      const std::uint64_t before = run.world.step_count();
      until_it_works([&] {
        if (run.world.step_count() == before) run.world.step();
      });
      until_it_works([&] { return run.world.poses().size() + run.world.contacts_begun().size(); });
    }
    until_it_works([&] { run.world.wait(); });
    host_faults.allocations = -1;
    EXPECT_EQ(run.world.state_hash(), expected) << "allocation " << failing << ", " << ahead << " ahead";
    if (!failed || testing::Test::HasFailure()) return failing;
  }
}

TEST_F(DeviceFaults, MemoryMayRunOutAtAnyPlaceOfAStep) {
  for (const int ahead : {0, 2}) {
    const int places = fail_everywhere(ahead, undisturbed(ahead));
    EXPECT_GT(places, 60) << "the run must grow its buffers";
  }
}

TEST_F(DeviceFaults, AWorldThatGetsNoMemoryIsNotMade) {
  host_faults.allocations = 0;
  expect_error(ErrorCode::capacity, "out of", [] { World world(Growing::definition(0)); });
}

TEST_F(DeviceFaults, ALostDeviceIsOneErrorAndTheSnapshotGoesOnElsewhere) {
  for (const int ahead : {0, 2}) {
    Growing lost(ahead), whole(ahead);
    for (int i = 0; i < 6; ++i) lost.before(i), whole.before(i), lost.world.step(), whole.world.step();
    std::vector<std::byte> bytes;
    lost.world.save(bytes);
    for (const int calls : {0, 1, 2, 3, 5, 8}) {
      World doomed(Growing::definition(ahead));
      doomed.restore(bytes);
      host_faults.calls = calls;
      const auto use = [&] {
        for (int i = 0; i < 10; ++i) doomed.step(), (void)doomed.poses();
      };
      expect_error(ErrorCode::unavailable, "the device is lost", use);
      expect_error(ErrorCode::unavailable, "the device is lost", use);
      // Worlds on other devices are not affected.
      World native(quiet_world(1));
      native.add(cube({0, 0, 5}));
      native.step();
      host_faults.calls = -1;
      // `doomed` is lost; its snapshot continues on a working device.
    }
    World again(Growing::definition(ahead));
    again.restore(bytes);
    Growing other(ahead);
    other.world = std::move(again);
    for (int i = 6; i < steps; ++i) whole.before(i), other.before(i), whole.world.step(), other.world.step();
    whole.world.wait(), other.world.wait();
    EXPECT_EQ(other.world.state_hash(), whole.world.state_hash());
  }
}

TEST_F(DeviceFaults, DestroyingAWorldOnALostDeviceIsQuiet) {
  auto world = std::make_unique<World>(Growing::definition(2));
  world->add(cube({0, 0, 5}));
  world->step();
  host_faults.calls = 0;
  world.reset();
}

}  // namespace
}  // namespace fathom::test::device_faults_test
