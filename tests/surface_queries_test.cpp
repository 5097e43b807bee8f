// Rays, casts, overlaps and closest points of meshes and height fields, against all triangles asked one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <limits>

#include "geometry/placed_shape.hpp"
#include "geometry/surface_query.hpp"
#include "random.hpp"
#include "test_surfaces.hpp"

namespace fathom::test::surface_queries_test {
namespace {

Vec3 random_vector(Generator& random, float size) {
  return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

Pose random_pose(Generator& random, float reach) {
  Pose pose;
  pose.position = random_vector(random, reach);
  pose.rotation =
      normalize(Quat{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1f, 1)});
  return pose;
}

/// Möller and Trumbore's algorithm, in double precision, for hits from outside.
double fraction_at(const Triangle& t, Vec3d origin, Vec3d way) {
  const Vec3d a = to_double(t.corners[0]), ab = to_double(t.corners[1]) - a, ac = to_double(t.corners[2]) - a;
  const Vec3d p = cross(way, ac);
  const double det = dot(ab, p);
  constexpr double none = std::numeric_limits<double>::infinity();
  if (!(det > 0)) return none;
  const Vec3d s = origin - a, q = cross(s, ab);
  const double u = dot(s, p) / det, v = dot(way, q) / det, f = dot(ac, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && f >= 0 && f <= 1 ? f : none;
}

std::vector<Shape> surfaces() {
  return {wavy_mesh(40), wavy_field(31, 5), wavy_field(31, 5, {100, 101, 131, 450}),
          grid_mesh(3, 5, [](float x, float) { return 0.5f * x; })};
}

TEST(SurfaceQueries, RaysMeetWhatAllTrianglesSay) {
  Generator random(1);
  int hits = 0;
  for (const Shape& shape : surfaces())
    for (int i = 0; i < 2000; ++i) {
      const Pose pose = i % 4 == 0 ? Pose{} : random_pose(random, i % 4 == 1 ? 2 : 1000);
      const PlacedShape frame(geometry(shape), pose);
      const Vec3 local{uniform(random, -6, 12), uniform(random, -6, 12), uniform(random, -4, 8)};
      const Vec3 origin = to_float(frame.position + frame.to_world(to_double(local)));
      Vec3 way = random_vector(random, 12);
      if (i % 7 == 0) way = to_float(frame.to_world({0, 0, -20}));
      if (i % 11 == 0) way.x = 0;
      const Vec3d from = frame.to_local(to_double(origin) - frame.position), along = frame.to_local(to_double(way));
      double expected = std::numeric_limits<double>::infinity();
      for (std::uint32_t t = 0; t < shape.surface->triangle_count(); ++t)
        if (shape.surface->has(t)) expected = std::min(expected, fraction_at(shape.surface->triangle(t), from, along));
      const auto hit = ray_cast(geometry(shape), pose, {origin, way});
      ASSERT_EQ(hit.has_value(), expected <= 1) << i;
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->fraction, expected, 1e-6);
      EXPECT_LT(dot(hit->normal, way), 0);
      EXPECT_NEAR(length(hit->normal), 1, 1e-5f);
      EXPECT_LT(length(hit->point - (origin + hit->fraction * way)), 1e-5f * (1 + length(origin)));
      const Vec3d again = frame.to_local(to_double(hit->normal));
      const Triangle t = shape.surface->triangle(hit->triangle);
      const Vec3d a = to_double(t.corners[0]);
      const Vec3d n = cross(to_double(t.corners[1]) - a, to_double(t.corners[2]) - a);
      EXPECT_GT(dot(again, n), 0.9999 * length(n));
    }
  EXPECT_GT(hits, 500);
}

TEST(SurfaceQueries, NoRayPassesBetweenTriangles) {
  Generator random(2);
  const Shape flat = grid_mesh(64, 5, [](float, float) { return 0.0f; }), bent = wavy_mesh(50);
  for (int i = 0; i < 100000; ++i) {
    const Shape& shape = i % 2 == 0 ? flat : bent;
    const auto& net = static_cast<const TriangleMesh&>(*shape.surface);
    // At a vertex, on an edge, or inside.
    const Triangle t = net.triangle(static_cast<std::uint32_t>(random() % net.triangle_count()));
    const float s = i % 3 == 0 ? 0.0f : uniform(random, 0, 1);
    const Vec3 target = t.corners[0] + s * (t.corners[1] - t.corners[0]);
    if (std::max(std::abs(target.x), std::abs(target.y)) > 4.9f) continue;
    const Vec3 origin = target + Vec3{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 8, 30)};
    EXPECT_TRUE(ray_cast(geometry(shape), Pose{}, {origin, 1.5f * (target - origin)}).has_value()) << i;
  }
}

TEST(SurfaceQueries, RaysFromBehindPassAndThoseOnTheSurfaceBeginThere) {
  const Shape flat = grid_mesh(4, 5, [](float, float) { return 0.0f; });
  EXPECT_FALSE(ray_cast(geometry(flat), Pose{}, {{0.3f, 0.2f, -1}, {0, 0, 3}}));
  const auto on = ray_cast(geometry(flat), Pose{}, {{0.3f, 0.2f, 0}, {0, 0, -3}});
  ASSERT_TRUE(on);
  EXPECT_TRUE(on->starts_inside);
  EXPECT_EQ(on->fraction, 0);
}

std::vector<Shape> convex_shapes(Generator& random) {
  std::vector<Vec3> points;
  for (int i = 0; i < 12; ++i) points.push_back(random_vector(random, 0.6f));
  return {sphere(0.4f), capsule(0.2f, 0.5f), box({0.5f, 0.3f, 0.2f}), hull(points)};
}

/// One triangle as a hull, without a tree.
PlacedShape alone(const PlacedShape& frame, const Triangle& triangle, double thinnest) {
  PlacedShape shape = frame;
  shape.hull.vertices = triangle.corners;
  shape.hull.vertex_count = 3;
  shape.thinnest = thinnest;
  return shape;
}

TEST(SurfaceQueries, CastsOverlapsAndDistancesAreThoseOfAllTriangles) {
  Generator random(3);
  int hits = 0, touches = 0, casts = 0;
  for (const Shape& shape : surfaces())
    for (int i = 0; i < 50; ++i)
      for (const Shape& moving_shape : convex_shapes(random)) {
        const Pose pose = i % 3 == 0 ? Pose{} : random_pose(random, 50);
        const PlacedShape frame(geometry(shape), pose);
        const Vec3 local{uniform(random, -4, 8), uniform(random, -4, 8), uniform(random, -0.5f, 5)};
        Pose at = random_pose(random, 1);
        at.position = to_float(frame.position + frame.to_world(to_double(local)));
        const Vec3 way = random_vector(random, 6);
        const PlacedShape moving(geometry(moving_shape), at);
        double first = std::numeric_limits<double>::infinity(), nearest = first;
        for (std::uint32_t t = 0; t < shape.surface->triangle_count(); ++t) {
          if (!shape.surface->has(t)) continue;
          const Triangle triangle = shape.surface->triangle(t);
          const PlacedShape still = alone(frame, triangle, moving.thinnest);
          const Separation s = separation(still, moving);
          nearest = std::min(nearest, s.distance);
          if (s.touch()) first = 0;
          const Vec3d a = to_double(triangle.corners[0]);
          const Vec3d n = cross(to_double(triangle.corners[1]) - a, to_double(triangle.corners[2]) - a);
          if (dot(n, frame.to_local(to_double(way))) > 0) continue;
          if (const auto hit = shape_cast(moving, way, still))
            first = std::min(first, static_cast<double>(hit->fraction));
        }
        ++casts;
        const auto hit = shape_cast_at_surface(moving, way, geometry(shape), pose, 1);
        ASSERT_EQ(hit.has_value(), first <= 1) << casts;
        if (hit) {
          ++hits;
          EXPECT_EQ(static_cast<double>(hit->fraction), first);
          EXPECT_EQ(hit->starts_inside, first == 0);
        }
        const bool touch = touches_surface(moving, geometry(shape), pose);
        touches += touch;
        EXPECT_EQ(touch, nearest == 0);
        const Separation found = separation_from_surface(geometry(shape), pose, moving);
        EXPECT_EQ(found.distance, nearest);
        EXPECT_NEAR(nearest > 0 ? length(found.on_b - found.on_a) : 0, nearest, 1e-9 * (1 + nearest));
      }
  EXPECT_GT(hits, casts / 8);
  EXPECT_GT(touches, casts / 40);
}

TEST(SurfaceQueries, WorldsAnswer) {
  for (const SimulatorKind kind : {SimulatorKind::native, SimulatorKind::hybrid}) {
    WorldDef def;
    def.simulator = kind;
    World world(def);
    const BodyId ground = world.add(fixed(wavy_field(), {-5, -5, 0}));
    const BodyId net = world.add(fixed(grid_mesh(10, 2, [](float, float) { return 0.0f; }), {20, 0, 1}));
    BodyDef ball;
    ball.shape = sphere(0.5f);
    ball.pose.position = {20, 0.1f, 3};
    const BodyId id = world.add(ball);
    const auto down = world.cast_ray({0.2f, 0.3f, 10}, {0, 0, -20});
    ASSERT_TRUE(down);
    EXPECT_EQ(down->body, ground);
    EXPECT_NE(down->triangle, no_triangle);
    EXPECT_NEAR(down->point.z, wavy_bowl(0.2f, 0.3f), 0.03f);
    const auto all = world.cast_ray_all({20, 0.1f, 9}, {0, 0, -20});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].body, id);
    EXPECT_EQ(all[0].triangle, no_triangle);
    EXPECT_EQ(all[1].body, net);
    const auto fall = world.cast_shape(ball.shape, ball.pose, {0, 0, -4}, {.ignored = {id}});
    ASSERT_TRUE(fall);
    EXPECT_EQ(fall->body, net);
    EXPECT_NEAR(fall->fraction, 1.5f / 4, 1e-5f);
    EXPECT_NEAR(fall->normal.z, 1, 1e-5f);
    Pose low = ball.pose;
    low.position.z = 1.4f;
    const auto touched = world.overlap_shape(ball.shape, low);
    ASSERT_EQ(touched.size(), 1u);
    EXPECT_EQ(touched[0], net);
    const ClosestPoints from_ball = world.closest_points(id, net), from_net = world.closest_points(net, id);
    EXPECT_NEAR(from_ball.distance, 1.5f, 1e-5f);
    EXPECT_NEAR(from_ball.normal.z, -1, 1e-5f);
    EXPECT_NEAR(from_ball.on_a.z, 2.5f, 1e-5f);
    EXPECT_NEAR(from_ball.on_b.z, 1, 1e-5f);
    EXPECT_TRUE(from_net.on_a == from_ball.on_b && from_net.normal == -from_ball.normal);
    const auto refused = [](auto&& call) {
      try {
        call();
      } catch (const Error& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    EXPECT_NE(refused([&] { world.closest_points(ground, net); }).find("one of them must be convex"),
              std::string::npos);
    EXPECT_NE(refused([&] { world.cast_shape(wavy_mesh(2), {}, {1, 0, 0}); }).find("convex"), std::string::npos);
    EXPECT_NE(refused([&] { world.overlap_shape(wavy_mesh(2), {}); }).find("convex"), std::string::npos);
  }
}

}  // namespace
}  // namespace fathom::test::surface_queries_test
