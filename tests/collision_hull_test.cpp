#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <set>

#include "collision/manifold.hpp"
#include "collision/polyhedra.hpp"
#include "collision_oracle.hpp"

namespace fathom::test::collision_hull_test {
namespace {

std::vector<TestHull> some_hulls(Sampler& random) {
  std::vector<TestHull> hulls;
  hulls.push_back(make_hull(box_points({0.5f, 0.4f, 0.3f})));
  hulls.push_back(make_hull(box_points({1, 1, 0.005f})));
  hulls.push_back(make_hull(box_points({0.02f, 0.02f, 1})));
  hulls.push_back(make_hull(box_points({0.03f, 0.02f, 0.025f})));
  hulls.push_back(make_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  hulls.push_back(make_hull({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}));
  for (int sides : {3, 5, 6, 16}) hulls.push_back(make_hull(prism_points(sides, 0.6f, 0.4f)));
  for (int corners : {5, 8, 12, 20, 30}) {
    hulls.push_back(make_hull(ellipsoid_points(random, corners, {0.8f, 0.6f, 0.5f})));
  }
  hulls.push_back(make_hull(ellipsoid_points(random, 12, {1, 0.5f, 0.02f})));
  return hulls;
}

struct HullCase {
  const TestHull* a;
  const TestHull* b;
  Pose pose;
  float margin;
};

std::vector<HullCase> hull_cases(const std::vector<TestHull>& hulls, Sampler& random, int count) {
  std::vector<HullCase> cases;
  for (int i = 0; i < count; ++i) {
    const auto any = [&] { return &hulls[static_cast<std::size_t>(random.integer(static_cast<int>(hulls.size())))]; };
    HullCase c{any(), any(), {}, random.uniform(0, 0.1f)};
    c.pose.rotation = random.rotation();
    c.pose.position = random.uniform(0, 1.5f) * random.direction();
    switch (i % 8) {
      case 0:  // identical pose
        c.b = c.a;
        c.pose = {};
        break;
      case 1:  // coincident centres
        c.pose.position = {};
        break;
      case 2:  // parallel axes
        c.pose.rotation = {};
        break;
      case 3:  // nearly parallel axes
        c.pose.rotation = random.small_rotation(std::pow(10.0f, random.uniform(-7, -1)));
        break;
      case 4:  // deep
        c.pose.position = 0.1f * c.pose.position;
        break;
      default: {  // brought almost into touch along a random direction
        const Solid a = place(*c.a, {});
        Solid b = place(*c.b, c.pose);
        const double s = sat_separation(a, b);
        const float step = static_cast<float>(s) - random.uniform(-0.05f, 0.05f);
        c.pose.position = c.pose.position - step * normalize(c.pose.position);
        break;
      }
    }
    cases.push_back(c);
  }
  return cases;
}

double axis_tolerance(const HullCase& c) {
  return double(make_hull_pair(c.a->geometry().hull, c.b->geometry().hull, c.pose).tolerance.axis);
}

TEST(CollisionHull, MatchesExactSeparation) {
  Sampler random(17);
  const std::vector<TestHull> hulls = some_hulls(random);
  int touching = 0;
  for (const HullCase& c : hull_cases(hulls, random, 8000)) {
    AxisCache cache;
    const Manifold m = collide(c.a->geometry(), c.b->geometry(), c.pose, c.margin, cache);
    const Solid a = place(*c.a, {}), b = place(*c.b, c.pose);
    const double exact = sat_separation(a, b), tolerance = 2.1 * axis_tolerance(c);  // preference: A, B, edges
    if (m.count == 0) {
      EXPECT_GT(exact, 0) << "overlapping hulls must touch";
      continue;
    }
    ++touching;
    EXPECT_LE(exact, double(c.margin) + tolerance);
    EXPECT_NEAR(length(m.normal), 1, 1e-5);
    // If they are apart, cross products of edges that do not face each other may separate more than any that do.
    const double along_normal = gap(a, b, to_double(m.normal));
    EXPECT_GE(along_normal, std::min(exact, 0.0) - tolerance) << "the normal must point from A to B";
    if (exact <= 0) {
      EXPECT_NEAR(along_normal, exact, tolerance);
      EXPECT_NEAR(lowest_separation(m), exact, tolerance) << int{cache.kind} << " points " << m.count;
    }
    std::set<std::uint32_t> features;
    for (int i = 0; i < m.count; ++i) {
      const ManifoldPoint& p = m.points[i];
      features.insert(p.feature);
      EXPECT_LE(p.separation, c.margin);
      const double allowed = 0.5 * std::max(std::abs(double(p.separation)), double(c.margin)) + tolerance;
      EXPECT_LE(height_over(a, to_double(p.position)), allowed);
      EXPECT_LE(height_over(b, to_double(p.position)), allowed);
    }
    EXPECT_EQ(features.size(), static_cast<std::size_t>(m.count)) << "ids tell the points apart";
  }
  EXPECT_GT(touching, 4000);
}

/// The face of `ref` that `other` is highest above, by trying all.
FaceAxis best_face_of_all(const HullView& ref, const HullView& other, const Frame& other_in_ref) {
  FaceAxis best;
  for (int f = 0; f < ref.face_count; ++f) {
    const float separation = face_separation(ref, f, other, other_in_ref);
    if (separation > best.separation) best = {f, separation};
  }
  return best;
}

EdgesAxis best_edges_of_all(const HullPair& p) {
  EdgesAxis best;
  for (int j = 0; 2 * j < p.b.edge_count; ++j) {
    const EdgeView edge_b = transform(p.b_in_a, edge_view(p.b, j));
    for (int i = 0; 2 * i < p.a.edge_count; ++i) {
      const EdgeView edge_a = edge_view(p.a, i);
      if (!makes_minkowski_face(edge_a, edge_b)) continue;
      const EdgesAxis axis = edges_axis(edge_a, edge_b, p.tolerance.noise);
      if (axis.separation > best.separation) best = {i, j, axis.separation, axis.normal};
    }
  }
  return best;
}

TEST(CollisionHull, WhatBoundsLeaveOutIsNeverTheBest) {
  Sampler random(27);
  const std::vector<TestHull> hulls = some_hulls(random);
  constexpr float no_margin = 3e38f;
  for (const HullCase& c : hull_cases(hulls, random, 8000)) {
    const HullPair p = make_hull_pair(c.a->geometry().hull, c.b->geometry().hull, c.pose);
    Witnesses of_a, of_b;
    const FaceAxis all_a = best_face_of_all(p.a, p.b, p.b_in_a), all_b = best_face_of_all(p.b, p.a, p.a_in_b);
    const FaceAxis face_a = best_face(p.a, p.b, p.b_in_a, random.integer(p.a.face_count), p.slack, no_margin, of_b);
    const FaceAxis face_b = best_face(p.b, p.a, p.a_in_b, random.integer(p.b.face_count), p.slack, no_margin, of_a);
    ASSERT_EQ(face_a.face, all_a.face);
    ASSERT_EQ(face_a.separation, all_a.separation);
    ASSERT_EQ(face_b.face, all_b.face);
    ASSERT_EQ(face_b.separation, all_b.separation);
    const EdgesAxis all = best_edges_of_all(p);
    const float threshold = std::max(face_a.separation, face_b.separation);
    const EdgesAxis edges = best_edges(p, of_a, of_b, threshold, no_margin);
    if (all.separation > threshold) {
      ASSERT_EQ(edges.a, all.a);
      ASSERT_EQ(edges.b, all.b);
      ASSERT_EQ(edges.separation, all.separation);
    } else {
      ASSERT_LT(edges.a, 0);
    }
  }
}

/// The hull as devices see it: without the data arranged for vector instructions.
Geometry plain(Geometry g) {
  g.hull.vertex_edges = nullptr;
  g.hull.vertex_eights = g.hull.plane_eights = nullptr;
  return g;
}

void expect_same_bits(const Manifold& m, const Manifold& s) {
  ASSERT_EQ(m.count, s.count);
  if (m.count == 0) return;
  EXPECT_EQ(std::memcmp(&m.normal, &s.normal, sizeof(Vec3)), 0);
  const std::size_t bytes = sizeof(ManifoldPoint) * static_cast<std::size_t>(m.count);
  EXPECT_EQ(std::memcmp(m.points, s.points, bytes), 0);
}

TEST(CollisionHull, VectorInstructionsGiveTheBitsOfSingleNumbers) {
  Sampler random(31);
  std::vector<Shape> shapes{sphere(0.4f), capsule(0.2f, 0.4f), box({0.5f, 0.4f, 0.3f})};
  for (int corners : {4, 5, 8, 9, 16, 17, 32, 100})
    shapes.push_back(hull(ellipsoid_points(random, corners, {0.8f, 0.6f, 0.5f})));
  shapes.push_back(hull(prism_points(16, 0.6f, 0.4f)));
  shapes.push_back(hull(box_points({1, 1, 0.01f})));
  int touching = 0;
  for (int i = 0; i < 6000; ++i) {
    const auto any = [&] {
      return geometry(shapes[static_cast<std::size_t>(random.integer(static_cast<int>(shapes.size())))]);
    };
    const Geometry a = any(), b = any();
    Pose pose{random.uniform(0, 1.3f) * random.direction(), 0, i % 4 == 0 ? Quat{} : random.rotation()};
    AxisCache in_lanes, one_by_one;
    for (int step = 0; step < 3; ++step) {  // including cached axes
      const Manifold m = collide(a, b, pose, 0.02f, in_lanes);
      expect_same_bits(m, collide(plain(a), plain(b), pose, 0.02f, one_by_one));
      ASSERT_EQ(std::memcmp(&in_lanes, &one_by_one, sizeof(AxisCache)), 0);
      touching += m.count > 0;
      pose.position = pose.position + 0.01f * random.direction();
      pose.rotation = normalize(pose.rotation * random.small_rotation(0.02f));
    }
  }
  EXPECT_GT(touching, 6000);
}

TEST(CollisionHull, SymmetricUnderSwap) {
  Sampler random(19);
  const std::vector<TestHull> hulls = some_hulls(random);
  for (const HullCase& c : hull_cases(hulls, random, 4000)) {
    AxisCache forward, backward;
    const Manifold m = collide(c.a->geometry(), c.b->geometry(), c.pose, c.margin, forward);
    const Manifold s = collide(c.b->geometry(), c.a->geometry(), inverse(c.pose), c.margin, backward);
    const double tolerance = 2.5 * axis_tolerance(c);
    if (m.count != 0 && s.count != 0) {
      if (lowest_separation(m) <= 0) {
        EXPECT_NEAR(lowest_separation(m), lowest_separation(s), tolerance);
      }
    } else if (m.count + s.count != 0) {
      EXPECT_GE(lowest_separation(m.count != 0 ? m : s), -tolerance);
    }
  }
}

TEST(CollisionHull, BoxesAsHullsGiveWhatBoxesGive) {
  Sampler random(23);
  const auto half = [&] { return Vec3{random.uniform(0.2f, 1), random.uniform(0.2f, 1), random.uniform(0.2f, 1)}; };
  int same_count = 0, compared = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 ha = half(), hb = half();
    const TestHull a = make_hull(box_points(ha)), b = make_hull(box_points(hb));
    const Geometry box_a{ShapeType::box, 0, ha, {}}, box_b{ShapeType::box, 0, hb, {}};
    const Pose pose{random.in_cube(1.3f), 0, i % 3 == 0 ? random.small_rotation(0.01f) : random.rotation()};
    AxisCache caches[4];
    const Manifold boxes = collide(box_a, box_b, pose, 0.02f, caches[0]);
    const Manifold others[] = {collide(a.geometry(), b.geometry(), pose, 0.02f, caches[1]),
                               collide(box_a, b.geometry(), pose, 0.02f, caches[2]),
                               collide(a.geometry(), box_b, pose, 0.02f, caches[3])};
    for (const Manifold& m : others) {
      if (boxes.count == 0 || m.count == 0) {
        EXPECT_EQ(boxes.count, m.count);
        continue;
      }
      ++compared;
      same_count += boxes.count == m.count;
      EXPECT_NEAR(lowest_separation(boxes), lowest_separation(m), 1e-5);
      EXPECT_GT(dot(boxes.normal, m.normal), 0.99f);
    }
  }
  EXPECT_GT(same_count, 0.99 * compared);
}

TEST(CollisionHull, ReductionKeepsTheDeepestAndTheArea) {
  Sampler random(29);
  for (int n = 5; n <= 16; ++n) {
    for (int trial = 0; trial < 200; ++trial) {
      std::vector<FacePoint> points;
      for (int i = 0; i < n; ++i) {
        const float angle = 2 * pi * (static_cast<float>(i) + random.uniform(0, 0.9f)) / static_cast<float>(n);
        points.push_back(
            {2 * std::cos(angle), std::sin(angle), random.uniform(-level_height, 0), static_cast<std::uint32_t>(i)});
      }
      std::shuffle(points.begin(), points.end(), std::mt19937(static_cast<unsigned>(trial)));
      const auto deeper = [](const FacePoint& p, const FacePoint& q) { return p.z < q.z; };
      const FacePoint deepest = *std::min_element(points.begin(), points.end(), deeper);
      // Corners in angular order, so that the shoelace formula gives the area.
      const auto area = [](std::vector<FacePoint> q) {
        std::sort(q.begin(), q.end(), [](auto& p, auto& r) { return p.feature < r.feature; });
        double twice = 0;
        for (std::size_t i = 0; i < q.size(); ++i) {
          const FacePoint &p = q[i], &r = q[(i + 1) % q.size()];
          twice += double(p.x) * double(r.y) - double(p.y) * double(r.x);
        }
        return 0.5 * twice;
      };
      double largest = 0;
      for (const auto& p : points) {
        for (const auto& q : points) {
          for (const auto& r : points) {
            if (p.feature < q.feature && q.feature < r.feature) largest = std::max(largest, area({deepest, p, q, r}));
          }
        }
      }
      std::vector<FacePoint> reduced = points;
      ASSERT_EQ(reduce(reduced.data(), n, 0), 4);
      reduced.resize(4);
      EXPECT_EQ(std::min_element(reduced.begin(), reduced.end(), deeper)->feature, deepest.feature);
      EXPECT_GE(area(reduced), 0.999 * largest);
    }
  }
}

TEST(CollisionHull, ReductionOfALeaningFaceKeepsTheNextCorners) {
  for (int n = 5; n <= 60; ++n) {
    for (const float slope : {0.05f, 0.3f}) {
      std::vector<FacePoint> points;
      for (int i = 0; i < n; ++i) {
        const float angle = 2 * pi * static_cast<float>(i) / static_cast<float>(n);
        points.push_back({std::cos(angle), std::sin(angle), -slope * std::cos(angle), static_cast<std::uint32_t>(i)});
      }
      ASSERT_EQ(reduce(points.data(), n, 0.00025f), 4);
      points.resize(4);
      const auto has = [&](int i) {
        return std::ranges::any_of(points, [&](const FacePoint& p) { return p.feature == static_cast<unsigned>(i); });
      };
      EXPECT_TRUE(has(0)) << n;
      // Corners next to the deepest one that it may come down on within a few steps.
      const bool has_next = has(1) && has(n - 1), has_second = has(2) && has(n - 2);
      EXPECT_TRUE(has_next || (n > 20 && has_second)) << n << " corners, slope " << slope;
    }
  }
}

TEST(CollisionHull, ManySidedFacesFitTheBuffers) {
  // More corners than the clipping buffer holds, on both sides.
  const TestHull drum = make_hull(prism_points(50, 0.6f, 0.2f)), plate = make_hull(box_points({0.55f, 0.5f, 0.1f}));
  for (float turn : {0.0f, 0.03f, 0.4f}) {
    const Pose pose{{0.05f, 0.02f, 0.399f}, 0, normalize(Quat{1, 0, 0, turn})};
    AxisCache cache;
    const Manifold m = collide(drum.geometry(), drum.geometry(), pose, 0.02f, cache);
    ASSERT_EQ(m.count, 4);
    EXPECT_NEAR(m.normal.z, 1, 1e-4);
    for (const ManifoldPoint& p : m.points) EXPECT_NEAR(p.separation, -0.001f, 1e-4f);
    AxisCache other;
    const Manifold on_plate =
        collide(plate.geometry(), drum.geometry(), {{0, 0, 0.299f}, 0, pose.rotation}, 0.02f, other);
    ASSERT_EQ(on_plate.count, 4);
  }
}

TEST(CollisionHull, FeaturesSurviveSmallMotion) {
  Sampler random(31);
  const TestHull a = make_hull(prism_points(6, 0.6f, 0.4f)), b = make_hull(prism_points(5, 0.5f, 0.3f));
  int points = 0, matched = 0;
  for (int i = 0; i < 500; ++i) {
    const Pose start{
        {random.uniform(-0.3f, 0.3f), random.uniform(-0.3f, 0.3f), 0.698f},
        0,
        normalize(random.small_rotation(0.01f) * Quat{random.uniform(-1, 1), 0, 0, random.uniform(0.1f, 1)})};
    AxisCache cache;
    const Manifold first = collide(a.geometry(), b.geometry(), start, 0.02f, cache);
    for (int step = 0; step < 10; ++step) {
      Pose moved = start;
      moved.position += 1e-4f * random.direction();
      moved.rotation = normalize(random.small_rotation(1e-4f) * moved.rotation);
      const Manifold m = collide(a.geometry(), b.geometry(), moved, 0.02f, cache);
      EXPECT_GT(dot(m.normal, first.normal), 0.999f);
      for (int k = 0; k < m.count; ++k) {
        ++points;
        for (int l = 0; l < first.count; ++l) matched += m.points[k].feature == first.points[l].feature;
      }
    }
  }
  EXPECT_GT(matched, 0.95 * points) << matched << " of " << points;
}

TEST(CollisionHull, CacheChangesNothingWhereSeparated) {
  Sampler random(37);
  const std::vector<TestHull> hulls = some_hulls(random);
  int separated = 0;
  for (HullCase c : hull_cases(hulls, random, 4000)) {
    c.pose.position = 1.3f * c.pose.position;
    AxisCache cache;
    const Geometry a = c.a->geometry(), b = c.b->geometry();
    collide(a, b, c.pose, c.margin, cache);
    if (cache.separated == 0) continue;
    ++separated;
    EXPECT_EQ(collide(a, b, c.pose, c.margin, cache).count, 0);
    Pose closer = c.pose;
    closer.position = 0.7f * closer.position;
    AxisCache none;
    const Manifold with = collide(a, b, closer, c.margin, cache), without = collide(a, b, closer, c.margin, none);
    if (with.count == 0 || without.count == 0) {
      EXPECT_EQ(with.count, without.count);
    }
  }
  EXPECT_GT(separated, 500);
}

TEST(CollisionHull, DISABLED_Timing) {
  Sampler random(41);
  const auto time = [](const char* name, const TestHull& a, const TestHull& b, Pose pose, bool keep_cache) {
    AxisCache cache;
    int points = 0;
    const int calls = 200'000;
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) {
      if (!keep_cache) cache = {};
      pose.position.x += 1e-9f;
      points += collide(a.geometry(), b.geometry(), pose, 0.02f, cache).count;
    }
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    std::printf("%-36s %8.1f ns  %.2f points\n", name, elapsed.count() / calls, double(points) / calls);
  };
  const TestHull box = make_hull(box_points({0.5f, 0.5f, 0.5f})), prism = make_hull(prism_points(6, 0.5f, 0.5f));
  const TestHull stone = make_hull(ellipsoid_points(random, 24, {0.5f, 0.5f, 0.5f}));
  const Quat turned = normalize(Quat{1, 1e-3f, 1e-3f, 0.2f});
  time("box on box as hulls", box, box, {{0.1f, 0.2f, 0.999f}, 0, turned}, true);
  time("prism on prism", prism, prism, {{0.1f, 0.2f, 0.999f}, 0, turned}, true);
  time("24 corners on 24 corners", stone, stone, {{0.1f, 0.2f, 0.9f}, 0, turned}, true);
  time("24 corners apart, cached", stone, stone, {{0.1f, 0.2f, 1.2f}, 0, turned}, true);
  time("24 corners apart", stone, stone, {{0.1f, 0.2f, 1.2f}, 0, turned}, false);
}

}  // namespace
}  // namespace fathom::test::collision_hull_test
