// Which points of a patch on uneven ground are kept (terrain/resting_points.hpp).
#include "terrain/resting_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "random.hpp"

namespace fathom::test::resting_points_test {
namespace {

std::vector<FacePoint> chosen(std::vector<FacePoint> points, float x = 0, float y = 0) {
  for (std::uint32_t i = 0; i < points.size(); ++i) points[i].feature = i;
  const RestingPoints kept = choose_resting_points(points.data(), static_cast<int>(points.size()), 1e-4f, {x, y, true});
  points.resize(static_cast<std::size_t>(kept.under_load));
  return points;
}

bool has(const std::vector<FacePoint>& points, std::uint32_t feature) {
  return std::ranges::find(points, feature, &FacePoint::feature) != points.end();
}

TEST(RestingPoints, OfAFlatPatchItsCornersStay) {
  std::vector<FacePoint> grid;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j)
      grid.push_back({0.1f * static_cast<float>(i - 2), 0.1f * static_cast<float>(j - 2), 0, 0});
  const std::vector<FacePoint> kept = chosen(grid);
  ASSERT_EQ(kept.size(), 4u);
  for (const std::uint32_t corner : {0u, 4u, 20u, 24u}) EXPECT_TRUE(has(kept, corner)) << corner;
}

TEST(RestingPoints, PeaksUnderTheLoadStayAndNotFarPointsThatAreHigher) {
  // Three low ones around the load, the lowest of them 0; four far corners, high above the ground.
  const std::vector<FacePoint> kept = chosen({{1, 1, 0.02f, 0},
                                              {-1, 1, 0.02f, 0},
                                              {-1, -1, 0.02f, 0},
                                              {1, -1, 0.02f, 0},
                                              {0.1f, 0, 0, 0},
                                              {-0.1f, 0.1f, 0.001f, 0},
                                              {-0.1f, -0.1f, 0.001f, 0}});
  ASSERT_EQ(kept.size(), 4u);
  for (const std::uint32_t peak : {4u, 5u, 6u}) EXPECT_TRUE(has(kept, peak)) << peak;
}

TEST(RestingPoints, ALoadBesideAllOfThemTipsOverThePatchesOwnSide) {
  const std::vector<FacePoint> kept =
      chosen({{1, 1, 0, 0}, {2, 1, 0, 0}, {2, -1, 0, 0}, {1, -1, 0, 0}, {1.5f, 0, 0, 0}});
  ASSERT_EQ(kept.size(), 4u);
  EXPECT_TRUE(has(kept, 0) && has(kept, 3));
}

/// No random point is below the plane in which the body rests, whatever the load.
TEST(RestingPoints, NothingIsLowerThanWhatTheLoadIsOn) {
  Generator random(7);
  for (int round = 0; round < 2000; ++round) {
    std::vector<FacePoint> points;
    const int count = 5 + static_cast<int>(random() % 60);
    for (int i = 0; i < count; ++i)
      points.push_back({uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0, 0.1f), 0});
    const float x = uniform(random, -0.5f, 0.5f), y = uniform(random, -0.5f, 0.5f);
    const std::vector<FacePoint> kept = chosen(points, x, y);
    ASSERT_GE(kept.size(), 3u);
    // Some triangle of the kept points is under the load and has no point below its plane.
    bool is_found = false;
    for (std::size_t without = 0; without < kept.size() && !is_found; ++without) {
      std::vector<FacePoint> t;
      for (std::size_t i = 0; i < kept.size(); ++i)
        if (kept.size() == 3 || i != without) t.push_back(kept[i]);
      const FacePoint at{x, y, 0, 0};
      const float whole = area(t[0], t[1], t[2]), u = area(t[1], t[2], at) / whole, v = area(t[2], t[0], at) / whole;
      if (!(u > -1e-3f && v > -1e-3f && u + v < 1.001f)) continue;
      is_found = std::ranges::all_of(points, [&](const FacePoint& p) {
        const float pu = area(t[1], t[2], p) / whole, pv = area(t[2], t[0], p) / whole;
        return p.z > pu * t[0].z + pv * t[1].z + (1 - pu - pv) * t[2].z - 1e-3f;
      });
    }
    bool is_beside = false;
    for (int tenths = 0; tenths < 3600 && !is_found; ++tenths) {
      const float angle = static_cast<float>(tenths) * pi / 1800;
      is_beside |= std::ranges::all_of(
          points, [&](const FacePoint& p) { return (p.x - x) * std::cos(angle) + (p.y - y) * std::sin(angle) > 0; });
    }
    EXPECT_TRUE(is_found || is_beside) << round;
  }
}

}  // namespace
}  // namespace fathom::test::resting_points_test
