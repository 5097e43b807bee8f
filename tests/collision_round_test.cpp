#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "collision/manifold.hpp"
#include "collision_oracle.hpp"

namespace fathom::test::collision_round_test {
namespace {

Geometry sphere_geometry(float r) { return {ShapeType::sphere, r, {0, 0, 0}, {}}; }
Geometry capsule_geometry(float r, float l) { return {ShapeType::capsule, r, {0, 0, l}, {}}; }
Geometry box_geometry(Vec3 h) { return {ShapeType::box, 0, h, {}}; }

/// Distance of a point from a convex solid by alternating projections onto its half spaces (Dykstra): slow but sure.
double distance_to(const Solid& solid, Vec3d point) {
  if (height_over(solid, point) <= 0) return 0;
  std::vector<Vec3d> corrections(solid.planes.size());
  Vec3d x = point;
  for (int sweep = 0; sweep < 4000; ++sweep) {
    Vec3d before = x;
    for (std::size_t i = 0; i < solid.planes.size(); ++i) {
      const Vec3d y = x + corrections[i];
      const double h = dot(solid.planes[i].normal, y) - solid.planes[i].offset;
      x = h > 0 ? y - h * solid.planes[i].normal : y;
      corrections[i] = y - x;
    }
    if (sweep > 20 && length(x - before) < 1e-12) break;
  }
  return length(point - x);
}

/// Minimum distance from points of the segment by golden-section search: the distance is convex along it.
double distance_to(const Solid& solid, Vec3d from, Vec3d to) {
  double lo = 0, hi = 1;
  const double g = 0.6180339887498949;
  const auto at = [&](double t) { return distance_to(solid, from + t * (to - from)); };
  double t1 = hi - g, t2 = lo + g, d1 = at(t1), d2 = at(t2);
  for (int i = 0; i < 40; ++i) {
    if (d1 < d2) {
      hi = t2, t2 = t1, d2 = d1, t1 = hi - g * (hi - lo), d1 = at(t1);
    } else {
      lo = t1, t1 = t2, d1 = d2, t2 = lo + g * (hi - lo), d2 = at(t2);
    }
  }
  return std::min(d1, d2);
}

/// The core of a capsule as a solid without planes, for separating axes.
double core_overlap(const Solid& solid, Vec3d from, Vec3d to) {
  double best = -1e300;
  const auto low = [&](Vec3d n) { return std::min(dot(n, from), dot(n, to)); };
  const auto high = [&](Vec3d n) {
    double h = -1e300;
    for (Vec3d v : solid.vertices) h = std::max(h, dot(n, v));
    return h;
  };
  for (const auto& p : solid.planes) best = std::max(best, low(p.normal) - p.offset);
  for (Vec3d e : solid.edges) {
    Vec3d n = cross(e, to - from);
    if (length(n) < 1e-6) continue;
    n = (1 / length(n)) * n;
    best = std::max(best, std::max(low(n) - high(n), low(-1.0 * n) - high(-1.0 * n)));
  }
  return best;
}

struct Ends {
  Vec3d from, to;
};
Ends ends(const Geometry& g, const Pose& pose) {
  const Vec3d h{0, 0, double(g.half_extents.z)};
  return {rotate(pose.rotation, -1.0 * h) + to_double(pose.position),
          rotate(pose.rotation, h) + to_double(pose.position)};
}

void expect_sound(const Manifold& m, float margin) {
  EXPECT_NEAR(length(m.normal), 1, 1e-5);
  for (int i = 0; i < m.count; ++i) {
    EXPECT_LE(m.points[i].separation, margin + 1e-5f);
    for (int j = 0; j < i; ++j) EXPECT_NE(m.points[i].feature, m.points[j].feature);
  }
}

TEST(CollisionRound, SphereSphere) {
  Sampler random(1);
  for (int i = 0; i < 2000; ++i) {
    const float ra = random.uniform(0.1f, 1), rb = random.uniform(0.1f, 1), margin = 0.05f;
    const Pose pose{random.in_cube(1.2f), 0, random.rotation()};
    AxisCache cache;
    const Manifold m = collide(sphere_geometry(ra), sphere_geometry(rb), pose, margin, cache);
    const float exact = length(pose.position) - ra - rb;
    if (exact > margin + 1e-5f) {
      EXPECT_EQ(m.count, 0);
    }
    if (exact < margin - 1e-5f) {
      ASSERT_EQ(m.count, 1);
      EXPECT_NEAR(m.points[0].separation, exact, 1e-5);
      EXPECT_GT(dot(m.normal, pose.position), 0);
      EXPECT_NEAR(length(m.points[0].position), std::abs(ra + 0.5f * exact), 1e-5);
    }
  }
  AxisCache cache;
  const Manifold same = collide(sphere_geometry(1), sphere_geometry(1), {}, 0, cache);
  ASSERT_EQ(same.count, 1);
  EXPECT_NEAR(same.points[0].separation, -2, 1e-5);
  EXPECT_NEAR(length(same.normal), 1, 1e-6);
}

TEST(CollisionRound, CapsulesMatchSampledDistance) {
  Sampler random(2);
  int two = 0;
  for (int i = 0; i < 2000; ++i) {
    const Geometry a = capsule_geometry(0.3f, random.uniform(0, 1)), b = capsule_geometry(0.2f, random.uniform(0, 1));
    Pose pose{random.in_cube(1), 0, random.rotation()};
    if (i % 4 == 0) pose.rotation = random.small_rotation(std::pow(10.0f, random.uniform(-6, -1)));
    if (i % 40 == 0) pose.position = {0, 0, 0.3f};
    AxisCache cache;
    const Manifold m = collide(a, b, pose, 0.05f, cache);
    const Ends ea = ends(a, {}), eb = ends(b, pose);
    double exact = 1e300;
    for (int k = 0; k <= 1000; ++k) {
      const Vec3d p = ea.from + (k / 1000.0) * (ea.to - ea.from), d = eb.to - eb.from;
      const double t = dot(d, d) > 0 ? std::clamp(dot(d, p - eb.from) / dot(d, d), 0.0, 1.0) : 0;
      exact = std::min(exact, length(p - eb.from - t * d));
    }
    exact -= 0.5;
    if (m.count == 0) {
      EXPECT_GT(exact, 0.049);
      continue;
    }
    two += m.count == 2;
    expect_sound(m, 0.05f);
    EXPECT_NEAR(lowest_separation(m), exact, 3e-3);
  }
  EXPECT_GT(two, 50);
}

TEST(CollisionRound, ParallelCapsulesTouchInTwoPoints) {
  AxisCache cache;
  const Manifold m =
      collide(capsule_geometry(0.5f, 1), capsule_geometry(0.5f, 0.6f), {{0.99f, 0, 0.2f}, 0, {}}, 0.02f, cache);
  ASSERT_EQ(m.count, 2);
  EXPECT_NEAR(m.normal.x, 1, 1e-6);
  EXPECT_NEAR(m.points[0].separation, -0.01f, 1e-6);
  EXPECT_NEAR(m.points[1].separation, -0.01f, 1e-6);
  EXPECT_NEAR(std::abs(m.points[0].position.z - m.points[1].position.z), 1.2f, 1e-5);
  // End to end they touch at one point.
  const Manifold end =
      collide(capsule_geometry(0.5f, 1), capsule_geometry(0.5f, 1), {{0, 0, 2.99f}, 0, {}}, 0.02f, cache);
  ASSERT_EQ(end.count, 1);
  EXPECT_NEAR(end.normal.z, 1, 1e-5);
}

struct Polyhedron {
  TestHull hull;
  Geometry geometry;
};
std::vector<Polyhedron> polyhedra(Sampler& random) {
  std::vector<Polyhedron> all;
  for (Vec3 h : {Vec3{0.5f, 0.6f, 0.7f}, Vec3{1, 1, 0.01f}}) all.push_back({make_hull(box_points(h)), box_geometry(h)});
  for (const auto& points :
       {box_points({0.5f, 0.4f, 0.3f}), prism_points(6, 0.6f, 0.4f), prism_points(3, 0.8f, 0.2f),
        ellipsoid_points(random, 6, {0.6f, 0.6f, 0.6f}), ellipsoid_points(random, 20, {0.8f, 0.5f, 0.5f})}) {
    all.push_back({make_hull(points), {}});
    all.back().geometry = {};
  }
  for (Polyhedron& p : all) {
    if (p.geometry.type != ShapeType::box || p.geometry.half_extents.x <= 0) p.geometry = p.hull.geometry();
  }
  return all;
}

TEST(CollisionRound, SpheresAndCapsulesOnPolyhedraMatchTheOracle) {
  Sampler random(3);
  const std::vector<Polyhedron> all = polyhedra(random);
  int outside = 0, inside = 0;
  for (int i = 0; i < 3000; ++i) {
    const Polyhedron& p = all[static_cast<std::size_t>(random.integer(static_cast<int>(all.size())))];
    const float r = random.uniform(0.05f, 0.5f), margin = 0.05f;
    const Geometry round = i % 2 == 0 ? sphere_geometry(r) : capsule_geometry(r, random.uniform(0, 0.8f));
    Pose pose{random.uniform(0, 1.3f) * random.direction(), 0, random.rotation()};
    if (i % 5 == 1) pose.rotation = random.small_rotation(std::pow(10.0f, random.uniform(-6, -1)));
    if (i % 50 == 3) pose.position = {};
    AxisCache cache;
    const Manifold m = collide(p.geometry, round, pose, margin, cache);
    const Solid solid = place(p.hull, {});
    const Ends e = ends(round, pose);
    const double overlap = core_overlap(solid, e.from, e.to);
    const bool is_sphere = round.type == ShapeType::sphere;
    const double exact =
        overlap > 0 ? (is_sphere ? distance_to(solid, e.from) : distance_to(solid, e.from, e.to)) : overlap;
    const double tolerance = 3e-3;
    if (m.count == 0) {
      EXPECT_GT(exact - double(r), double(margin) - 1e-4);
      continue;
    }
    (overlap > 0 ? outside : inside) += 1;
    expect_sound(m, margin);
    EXPECT_LE(exact - double(r), double(margin) + 1e-4);
    EXPECT_LE(m.count, is_sphere ? 1 : 2);
    EXPECT_GE(lowest_separation(m), exact - double(r) - tolerance);
    if (overlap > 0) {
      EXPECT_NEAR(lowest_separation(m), exact - double(r), is_sphere ? 1e-4 : tolerance);
    }
    // Moved apart along the normal by the overlap, the shapes are separate.
    const Vec3d out = (-std::min(overlap, 0.0) + 2 * tolerance) * to_double(m.normal);
    if (overlap <= 0) {
      EXPECT_GT(core_overlap(solid, e.from + out, e.to + out), 0) << "the normal must point from A to B";
    }
    for (int k = 0; k < m.count; ++k) {
      const double allowed = 0.5 * std::max(std::abs(double(m.points[k].separation)), double(margin)) + tolerance;
      EXPECT_LE(height_over(solid, to_double(m.points[k].position)), allowed);
    }

    AxisCache other;
    const Manifold s = collide(round, p.geometry, inverse(pose), margin, other);
    ASSERT_EQ(s.count, m.count);
    EXPECT_NEAR(lowest_separation(s), lowest_separation(m), 1e-4);
    EXPECT_NEAR(dot(rotate(pose.rotation, s.normal), m.normal), -1, 1e-3);
  }
  EXPECT_GT(outside, 500);
  EXPECT_GT(inside, 300);
}

TEST(CollisionRound, CapsuleLyingOnAFaceTouchesInTwoPoints) {
  Sampler random(4);
  const Quat lying{std::sqrt(0.5f), 0, std::sqrt(0.5f), 0};
  const TestHull slab = make_hull(prism_points(6, 2, 0.5f));
  for (int i = 0; i < 500; ++i) {
    const Pose pose{
        {random.uniform(-0.3f, 0.3f), random.uniform(-0.3f, 0.3f), 0.5f + 0.3f + random.uniform(-0.005f, 0.01f)},
        0,
        normalize(random.small_rotation(0.002f) * lying)};
    for (const Geometry& ground : {box_geometry({2, 2, 0.5f}), slab.geometry()}) {
      AxisCache cache;
      const Manifold m = collide(ground, capsule_geometry(0.3f, 0.7f), pose, 0.02f, cache);
      ASSERT_EQ(m.count, 2);
      EXPECT_NEAR(m.normal.z, 1, 1e-6);
      EXPECT_NEAR(std::abs(m.points[0].position.x - m.points[1].position.x), 1.4f, 1e-2);
    }
  }
  // Half over the edge: one end and the cut at the edge.
  AxisCache cache;
  const Manifold m =
      collide(box_geometry({2, 2, 0.5f}), capsule_geometry(0.3f, 0.7f), {{1.8f, 0, 0.79f}, 0, lying}, 0.02f, cache);
  ASSERT_EQ(m.count, 2);
  EXPECT_NEAR(std::max(m.points[0].position.x, m.points[1].position.x), 2, 2e-3);
}

TEST(CollisionRound, BoxAndHullAgreeOnSpheres) {
  Sampler random(5);
  const Vec3 h{0.5f, 0.6f, 0.7f};
  const TestHull hull = make_hull(box_points(h));
  for (int i = 0; i < 2000; ++i) {
    const Pose pose{random.in_cube(1.1f), 0, {}};
    AxisCache first, second;
    const Manifold box = collide(box_geometry(h), sphere_geometry(0.3f), pose, 0.05f, first);
    const Manifold same = collide(hull.geometry(), sphere_geometry(0.3f), pose, 0.05f, second);
    ASSERT_EQ(box.count, same.count);
    if (box.count == 0) continue;
    EXPECT_NEAR(box.points[0].separation, same.points[0].separation, 1e-5);
    EXPECT_LT(distance(box.points[0].position, same.points[0].position),
              box.points[0].separation > -0.29f ? 1e-4f : 0.5f);
  }
}

// The cross product of its edges with the capsule is so short that its square underflows.
TEST(CollisionRound, ABoxWithoutThicknessGivesUnitNormals) {
  const Geometry plate = box_geometry({6.6875f, 2.5243549e-29f, 6.6875f});
  const Geometry needle = capsule_geometry(6.6875f, 11665408);
  Pose pose{{3.625f, -0.1875f, 0.625f}};
  pose.rotation = {-0.752867997f, 0.189976037f, 0.070361495f, 0.626217306f};
  AxisCache cache;
  const Manifold m = collide(plate, needle, pose, 6.3125f, cache);
  ASSERT_GT(m.count, 0);
  EXPECT_NEAR(length(m.normal), 1.0f, 1e-5f);
}

TEST(CollisionRound, DISABLED_Timing) {
  const auto time = [](const char* name, const Geometry& a, const Geometry& b, Pose pose) {
    AxisCache cache;
    int points = 0;
    const int calls = 1'000'000;
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) {
      pose.position.x += 1e-9f;
      points += collide(a, b, pose, 0.02f, cache).count;
    }
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    std::printf("%-28s %8.1f ns  %.2f points\n", name, elapsed.count() / calls, double(points) / calls);
  };
  const Quat lying{std::sqrt(0.5f), 0, std::sqrt(0.5f), 0};
  time("sphere on sphere", sphere_geometry(0.5f), sphere_geometry(0.5f), {{0.1f, 0, 0.98f}, 0, {}});
  time("capsule on capsule", capsule_geometry(0.5f, 0.5f), capsule_geometry(0.5f, 0.5f), {{0.98f, 0, 0.1f}, 0, {}});
  time("sphere on box", box_geometry({2, 2, 0.5f}), sphere_geometry(0.5f), {{0.1f, 0, 0.99f}, 0, {}});
  time("capsule on box", box_geometry({2, 2, 0.5f}), capsule_geometry(0.5f, 0.5f), {{0.1f, 0, 0.99f}, 0, lying});
}

}  // namespace
}  // namespace fathom::test::collision_round_test
