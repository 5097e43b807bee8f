#include "native/quick_bounds.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "random.hpp"

namespace fathom::quick_bounds_test {
namespace {

using test::Generator;
using test::uniform;

TEST(QuickBounds, AreThoseOfTheShape) {
  Generator random(5);
  std::vector<Shape> shapes{sphere(0.3f), capsule(0.1f, 0.4f), box({0.2f, 1, 0.05f})};
  for (int points = 4; points < 64; points += 3) {
    std::vector<Vec3> cloud;
    for (int i = 0; i < points; ++i) cloud.push_back(uniform(random, 0.1f, 3) * test::on_sphere(random));
    shapes.push_back(hull(cloud));
  }
  for (const Shape& shape : shapes)
    for (int i = 0; i < 50; ++i) {
      const Pose pose{uniform(random, 0, 1000) * test::on_sphere(random), 0, test::any_rotation(random)};
      const Aabb quick = native::quick_bounds(geometry(shape), pose), exact = bounds(geometry(shape), pose);
      EXPECT_EQ(quick.lower, exact.lower);
      EXPECT_EQ(quick.upper, exact.upper);
    }
}

}  // namespace
}  // namespace fathom::quick_bounds_test
