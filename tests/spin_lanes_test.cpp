// Bodies that turn side by side (native/spin_lanes.hpp): each gets the same bits as alone.
#include "native/spin_lanes.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

#include "dynamics/rotation.hpp"
#include "native/body_state.hpp"
#include "random.hpp"

namespace fathom::test::spin_lanes_test {
namespace {

/// Random bodies: from thin rods to near-cubes, from rest to several turns per substep, some with joints.
struct Bodies {
  static constexpr std::uint32_t count = 64;
  BodyTable table;
  std::vector<SolverBody> solver{count};
  std::vector<WarmStart> warm{count};
  std::vector<WorldInertia> inertia{count};
  std::vector<Pose> poses;
  std::vector<std::uint8_t> flags;

  explicit Bodies(unsigned seed) {
    Generator random(seed);
    for (std::uint32_t i = 0; i < count; ++i) {
      BodyDef def;
      const auto extent = [&] { return std::exp(uniform(random, -5, 2)); };
      def.shape = box({extent(), extent(), extent()});
      table.add(def);
      poses.push_back(any_pose(random, 3));
      flags.push_back(i % 3 == 0 ? native::jointed : 0);
      const float fast = std::exp(uniform(random, -6, 9));
      solver[i].linear = in_cube(random), solver[i].angular = fast * in_cube(random);
      solver[i].moved = in_cube(random), solver[i].turned = 0.2f * in_cube(random);
      solver[i].inverse_mass = table[i].inverse_mass;
      warm[i].angular_reference = in_cube(random);
      inertia[i].rotation = any_rotation(random);
    }
    solver[5].angular = {};
    solver[6].angular = {INFINITY, 1, 0};
  }
  void turn(std::span<const std::uint32_t> slots) {
    native::spin_in_contact({table, solver.data(), warm.data(), inertia.data(), poses.data(), flags.data()}, slots,
                            1.0f / 240);
  }
};

void expect_same(Vec3 a, Vec3 b) {
  for (int i = 0; i < 3; ++i) {
    if (std::isnan(a[i]) && std::isnan(b[i])) continue;
    EXPECT_EQ(std::bit_cast<std::uint32_t>(a[i]), std::bit_cast<std::uint32_t>(b[i]));
  }
}

TEST(SpinLanes, HaveTheBitsThatEachHasAlone) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Bodies alone(seed), beside(seed);
    const auto size = static_cast<std::uint32_t>(3 + seed % 6);
    for (std::uint32_t first = 0; first < Bodies::count; first += size) {
      std::vector<std::uint32_t> slots;
      for (std::uint32_t slot = first; slot < std::min(first + size, Bodies::count); ++slot) {
        slots.push_back(slot);
        alone.turn({&slot, 1});
      }
      beside.turn(slots);
    }
    for (std::uint32_t i = 0; i < Bodies::count; ++i) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", body " + std::to_string(i));
      expect_same(alone.solver[i].linear, beside.solver[i].linear);
      expect_same(alone.solver[i].angular, beside.solver[i].angular);
      expect_same(alone.solver[i].moved, beside.solver[i].moved);
      expect_same(alone.solver[i].turned, beside.solver[i].turned);
      expect_same(alone.warm[i].angular_reference, beside.warm[i].angular_reference);
      const Quat p = alone.inertia[i].rotation, q = beside.inertia[i].rotation;
      expect_same(p.vector(), q.vector());
      expect_same({p.w, 0, 0}, {q.w, 0, 0});
    }
  }
}

}  // namespace
}  // namespace fathom::test::spin_lanes_test
