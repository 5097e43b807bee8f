// Manifolds of shapes that overlap, however deeply: a contact that shows no overlap does not push it out.
#include <gtest/gtest.h>

#include "collision/manifold.hpp"
#include "collision/tolerance.hpp"
#include "scene/heap.hpp"
#include "scene/heap_bodies.hpp"
#include "validate/exact_overlap.hpp"

namespace fathom::deep_overlap_test {
namespace {

double deepest(const Manifold& manifold) {
  double depth = -1e30;
  for (int i = 0; i < manifold.count; ++i) depth = std::max(depth, -static_cast<double>(manifold.points[i].separation));
  return depth;
}

/// Bounds on the depth of a manifold of these shapes (m).
struct Bounds {
  double least, most;
};
Bounds bounds(const BodyDef& a, const BodyDef& b, const Pose& b_in_a) {
  const double exact = validate::overlap_depth({a.shape, {}}, {b.shape, b_in_a});
  const double radii = outer_radius(a.shape) + outer_radius(b.shape);
  const double tolerance = static_cast<double>(make_tolerance(1, static_cast<float>(2 * radii)).axis);
  return {0.5 * exact - tolerance, 1.5 * exact + tolerance};
}

TEST(DeepOverlap, ShowsInManifoldsOfAnyShapes) {
  Random random(4);
  random.bits();
  int overlapping = 0;
  for (int i = 0; i < 6'000; ++i) {
    const HeapRecipe recipe = HeapRecipe::make(random);
    const BodyDef a = random_body(random, recipe), b = random_body(random, recipe);
    const double radii = outer_radius(a.shape) + outer_radius(b.shape);
    for (int k = 0; k < 8; ++k) {
      Pose pose = random_body(random, recipe).pose;
      const auto coordinate = [&] { return static_cast<float>(random.symmetric(0.5 * radii)); };
      pose.position = {coordinate(), coordinate(), coordinate()};
      const Bounds depth = bounds(a, b, pose);
      if (!(depth.most > 0 && validate::overlap_depth({a.shape, {}}, {b.shape, pose}) > 0)) continue;
      ++overlapping;
      AxisCache cache{};
      if (k % 2 == 1) {  // as found a moment before
        Pose before = pose;
        before.position.x += 0.01f * static_cast<float>(radii);
        collide(geometry(a.shape), geometry(b.shape), before, 0.01f, cache);
      }
      const Manifold manifold = collide(geometry(a.shape), geometry(b.shape), pose, 0.01f, cache);
      EXPECT_GE(deepest(manifold), depth.least) << "pair " << i << ", pose " << k;
      EXPECT_LE(deepest(manifold), depth.most) << "pair " << i << ", pose " << k;
    }
  }
  EXPECT_GT(overlapping, 20'000);
}

// A plate 11 cm thick and 7 m wide whose rim is pressed 25 cm into a box: the plate's face that is the best axis within
// the tolerance shows 0.6 mm, because the box's deepest corner is beside it.
TEST(DeepOverlap, ShowsWhereTheDeepestCornerIsBesideTheFace) {
  const Heap heap = make_heap(172);
  const BodyDef &plate = heap.scene.bodies[15], &box = heap.scene.bodies[42];
  Pose plate_pose, box_pose;
  plate_pose.position = {2.89173985f, -9.10989189f, 2.89017487f};
  plate_pose.rotation = {-0.807950377f, 0.570160985f, -0.0492073856f, 0.140397027f};
  box_pose.position = {2.54801154f, -7.81348467f, 0.66138792f};
  box_pose.rotation = {0.913675427f, -0.3415187f, 0.034565486f, -0.21764046f};
  const Pose pose = relative(plate_pose, box_pose);
  const Geometry of_plate = geometry(plate.shape), of_box = geometry(box.shape);
  for (int face = 0; face < of_plate.hull.face_count; ++face) {
    AxisCache cache{};
    cache.kind = AxisCache::face_a;
    cache.a = static_cast<std::uint8_t>(face);
    EXPECT_GE(deepest(collide(of_plate, of_box, pose, 0.01f, cache)), bounds(plate, box, pose).least) << face;
  }
}

}  // namespace
}  // namespace fathom::deep_overlap_test
