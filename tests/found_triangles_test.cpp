// The indices over thousands of found triangles, against looking at each of them.
#include "terrain/found_triangles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "random.hpp"
#include "terrain/triangle_axes-inl.hpp"
#include "test_surfaces.hpp"

namespace fathom::found_triangles_test {
namespace {

using test::Generator;
using test::uniform;

std::vector<EightTriangles> in_eights(std::span<const SurfaceTriangle> triangles) {
  std::vector<EightTriangles> eights;
  for (const SurfaceTriangle& t : triangles) {
    if (eights.empty() || eights.back().count == 8) eights.emplace_back();
    eights.back().add(t);
  }
  return eights;
}

class FoundTrianglesOfAMesh : public testing::Test {
 protected:
  FoundTrianglesOfAMesh() {
    const Shape mesh = test::wavy_mesh(50);
    std::vector<std::uint32_t> numbers;  // as a search returns them: neighbours are near, but in no simple order
    mesh.surface->find(mesh.surface->bounds(), numbers);
    for (const std::uint32_t number : numbers) triangles_.push_back({mesh.surface->triangle(number), {0, 0, 1}});
    eights_ = in_eights(triangles_);
    for (std::size_t begin = 0; begin < triangles_.size(); begin += 50)
      parts_.push_back(in_eights(std::span(triangles_).subspan(begin, 50)));
  }

  /// Whether any of the small parts, which have no index, says so.
  template <class Ask>
  bool any_part(const Ask& ask) const {
    return std::ranges::any_of(parts_, [&](const std::vector<EightTriangles>& part) {
      FoundIndex unused;
      return ask(FoundTriangles(part, unused));
    });
  }

  Generator random_{3};
  std::vector<SurfaceTriangle> triangles_;
  std::vector<EightTriangles> eights_;
  std::vector<std::vector<EightTriangles>> parts_;
};

TEST_F(FoundTrianglesOfAMesh, RiseWhereOneOfThemDoes) {
  FoundIndex index;
  const FoundTriangles found(eights_, index);
  int rising = 0;
  for (int i = 0; i < 3000; ++i) {
    const SurfaceTriangle& t = triangles_[random_() % triangles_.size()];
    const unsigned tips = 1 + static_cast<unsigned>(random_() % 6);  // one corner or two
    const Vec3 axis = normalize(t.normal + uniform(random_, 0, 0.5f) * test::on_sphere(random_));
    const bool rises = found.rises(t, tips, axis);
    EXPECT_EQ(rises, any_part([&](const FoundTriangles& part) { return part.rises(t, tips, axis); }));
    rising += rises;
  }
  EXPECT_GT(rising, 300);
  EXPECT_LT(rising, 2950);
}

PointByTriangles<OneLane> point_by(const SurfaceTriangle& triangle, Vec3 point) {
  TriangleLanes<OneLane> t = begin_lane(triangle);
  t.complete();
  return {t, point};
}

TEST_F(FoundTrianglesOfAMesh, HaveShorterWaysOutWhereOneOfThemHas) {
  FoundIndex index;
  const FoundTriangles found(eights_, index);
  int nearer = 0;
  for (int i = 0; i < 3000; ++i) {
    const float x = uniform(random_, -5.2f, 5.2f), y = uniform(random_, -5.2f, 5.2f);
    const Vec3 point{x, y, test::wavy_bowl(x, y) - 1 + uniform(random_, -0.5f, 0.1f)};
    const float depth = uniform(random_, 0, 0.7f), tolerance = 1e-3f, way = depth - tolerance;
    const bool is_nearer = found.is_nearer_elsewhere(point, depth, tolerance);
    EXPECT_EQ(is_nearer, way > 0 && std::ranges::any_of(triangles_, [&](const SurfaceTriangle& t) {
                           return point_by(t, point).squares < way * way;
                         }));
    nearer += is_nearer;
  }
  EXPECT_GT(nearer, 300);
  EXPECT_LT(nearer, 2700);
}

TEST_F(FoundTrianglesOfAMesh, EncloseWhatIsBelowTheGroundAndNotBesideIt) {
  FoundIndex index;
  const FoundTriangles found(eights_, index);
  int inside = 0;
  for (int i = 0; i < 3000; ++i) {
    const float x = uniform(random_, -6, 6), y = uniform(random_, -6, 6);
    const float height = uniform(random_, -0.3f, 0.3f);
    const Vec3 point{x, y, test::wavy_bowl(x, y) - 1 + height};
    const bool is_inside = found.is_inside(point, 0.01f);
    // Near the ground and its border it may be either, as triangles are not where the bowl is.
    const float beside = std::max(std::abs(x), std::abs(y)) - 5;
    if (std::abs(height) > 0.1f && std::abs(beside) > 0.3f) {
      EXPECT_EQ(is_inside, height < 0 && beside < 0) << x << ' ' << y << ' ' << height;
    }
    inside += is_inside;
  }
  EXPECT_GT(inside, 300);
}

}  // namespace
}  // namespace fathom::found_triangles_test
