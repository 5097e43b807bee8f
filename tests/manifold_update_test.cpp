// How a rebuilt manifold keeps the old one's load: all of it, spread where it lay, whatever the patch.
#include "dynamics/manifold_update.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "scene/random.hpp"

namespace fathom::test::manifold_update_test {
namespace {

float between(Random& random, float low, float high) { return low + (high - low) * static_cast<float>(random.unit()); }

ContactManifold patch(Random& random, int count, float size, bool coincident) {
  ContactManifold m{};
  m.normal = {0, 0, 1};
  m.tangent = {1, 0, 0};
  for (int i = 0; i < count; ++i)
    m.points[i].anchor_a =
        coincident ? Vec3{size, size, 0} : size * Vec3{between(random, -1, 1), between(random, -1, 1), 0};
  m.set_build({}, count);
  return m;
}

TEST(ManifoldUpdate, ALoadSharedOutIsWholeAndPushesOnly) {
  Random random(7);
  for (int trial = 0; trial < 20000; ++trial) {
    const int count = 1 + trial % 4;
    const float size = std::pow(10.0f, between(random, -7, 3)), sum = std::pow(10.0f, between(random, -20, 20));
    ContactManifold m = patch(random, count, size, trial % 5 == 0);
    const float reach = std::pow(10.0f, between(random, -3, 6)) * size;
    share_out(m, reach * Vec3{between(random, -1, 1), between(random, -1, 1), 0}, sum);
    float total = 0;
    for (int i = 0; i < count; ++i) {
      EXPECT_GE(m.impulses[i], 0);
      total += m.impulses[i];
    }
    ASSERT_NEAR(total / sum, 1, 1e-4f) << "patch " << trial;
  }
}

// As for an elastic bed: the centre of a load inside a square is where the load acts.
TEST(ManifoldUpdate, ASharedOutLoadActsWhereItDid) {
  ContactManifold m{};
  m.normal = {0, 0, 1};
  m.tangent = {1, 0, 0};
  const Vec3 corners[] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  for (int i = 0; i < 4; ++i) m.points[i].anchor_a = corners[i];
  m.set_build({}, 4);
  share_out(m, {0.3f, -0.2f, 0}, 8);
  const PatchLoad load = load_of(m);
  ASSERT_TRUE(load.is_known);
  EXPECT_NEAR(load.at.x, 0.3f, 1e-3f);
  EXPECT_NEAR(load.at.y, -0.2f, 1e-3f);
}

TEST(ManifoldUpdate, ALoadTooSmallToDivideByIsNotKnown) {
  ContactManifold m{};
  m.set_build({}, 1);
  m.impulses[0] = 1e-40f;
  EXPECT_FALSE(load_of(m).is_known);
}

}  // namespace
}  // namespace fathom::test::manifold_update_test
