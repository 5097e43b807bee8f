// Rounded boxes and hulls: mass, contacts, rays, and how they lie and roll.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <fathom/mesh.hpp>
#include <fathom/query.hpp>
#include <fathom/saved_shape.hpp>
#include <vector>

#include "collision/collide.hpp"
#include "geometry/ray.hpp"
#include "geometry/separation.hpp"
#include "test_hulls.hpp"
#include "world_fixture.hpp"

namespace fathom::test::rounded_test {
namespace {

Shape tetrahedron(float size) {
  return hull(std::vector<Vec3>{{0, 0, 0}, {size, 0, 0}, {0.2f * size, size, 0}, {0.1f * size, 0.3f * size, size}});
}

/// The shape without its radius.
Geometry core(Geometry g) {
  g.radius = g.hull.radius = 0;
  return g;
}

double distance_of_cores(const Geometry& a, const Geometry& b, const Pose& b_in_a) {
  const PlacedShape first(core(a), {}), second(core(b), b_in_a);
  return separation(first, second).distance;
}

/// Distance (m) of a point from a shape; 0 inside.
double distance_from(const Geometry& shape, const Pose& pose, Vec3 point) {
  const PlacedShape point_shape(Geometry{ShapeType::sphere, 1e-9f}, {point, 0, {}});
  return separation(PlacedShape(shape, pose), point_shape).distance;
}

/// Moments about the centre of mass and volume, by cells of a grid.
void expect_counted_mass(const Shape& shape, float tolerance) {
  constexpr int n = 64;
  const Aabb box = bounds(geometry(shape), {});
  const Vec3 cell = (1.0f / n) * (box.upper - box.lower);
  double count = 0;
  Vec3d first, squares;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        const auto at = [](int number) { return static_cast<float>(number) + 0.5f; };
        const Vec3 p = box.lower + Vec3{at(i) * cell.x, at(j) * cell.y, at(k) * cell.z};
        if (distance_from(geometry(shape), {}, p) > 0) continue;
        ++count;
        const Vec3d d = to_double(p);
        first += d;
        squares += Vec3d{d.x * d.x, d.y * d.y, d.z * d.z};
      }
  const double counted = count * to_double(cell.x) * to_double(cell.y) * to_double(cell.z);
  EXPECT_NEAR(to_double(volume(shape)) / counted, 1, to_double(tolerance));
  const double size = to_double(shape.hull->outer_radius());
  EXPECT_LT(length((1 / count) * first), to_double(tolerance) * size) << "not its centre of mass";
  const SymMat3 inertia = mass_properties(shape, 1).inertia;
  EXPECT_NEAR(to_double(inertia.xx) / ((squares.y + squares.z) / count), 1, to_double(2 * tolerance));
  EXPECT_NEAR(to_double(inertia.yy) / ((squares.x + squares.z) / count), 1, to_double(2 * tolerance));
  EXPECT_NEAR(to_double(inertia.zz) / ((squares.x + squares.y) / count), 1, to_double(2 * tolerance));
}

/// Steiner's formula.
TEST(Rounded, VolumeOfABox) {
  const float a = 0.5f, b = 0.3f, c = 0.2f, r = 0.1f;
  const Shape shape = rounded(box({a, b, c}), r);
  EXPECT_NEAR(
      volume(shape),
      8 * a * b * c + 8 * r * (a * b + b * c + c * a) + 2 * pi * r * r * (a + b + c) + 4.0f / 3 * pi * r * r * r,
      1e-6f);
  EXPECT_EQ(shape.hull->radius(), r);
  EXPECT_NEAR(shape.hull->inner_radius(), c + r, 1e-7f);
  EXPECT_NEAR(bounding_radius(geometry(shape)), length(Vec3{a, b, c}) + r, 1e-6f);
}

TEST(Rounded, MassIsThatOfItsCells) {
  expect_counted_mass(rounded(tetrahedron(1), 0.2f), 4e-3f);
  expect_counted_mass(rounded(tetrahedron(1), 2), 4e-3f);
  expect_counted_mass(rounded(cone(0.5f, 1.5f), 0.1f), 4e-3f);
  expect_counted_mass(rounded(box({0.5f, 0.3f, 0.02f}), 0.1f), 4e-3f);
}

TEST(Rounded, ThinCoresAreSpheresAndCapsules) {
  const Shape ball = rounded(box({1e-5f, 1e-5f, 1e-5f}), 0.5f), rod = rounded(box({1e-5f, 1e-5f, 0.7f}), 0.2f);
  const Shape exact_ball = sphere(0.5f), exact_rod = capsule(0.2f, 0.7f);
  EXPECT_NEAR(volume(ball), volume(exact_ball), 1e-4f);
  EXPECT_NEAR(volume(rod), volume(exact_rod), 1e-4f);
  const SymMat3 i = mass_properties(rod, 1).inertia, exact = mass_properties(exact_rod, 1).inertia;
  EXPECT_NEAR(i.xx, exact.xx, 1e-4f * exact.xx);
  EXPECT_NEAR(i.zz, exact.zz, 1e-3f * exact.zz);
  EXPECT_NEAR(mass_properties(ball, 1).inertia.xx, 0.1f, 1e-4f);
}

TEST(Rounded, OtherShapes) {
  EXPECT_EQ(rounded(sphere(0.5f), 0.25f).radius, 0.75f);
  EXPECT_EQ(rounded(capsule(0.5f, 2), 0.25f).half_extents.z, 2);
  EXPECT_EQ(rounded(box({1, 1, 1}), 0).type, ShapeType::box);
  EXPECT_NEAR(rounded(rounded(box({1, 1, 1}), 0.1f), 0.2f).hull->radius(), 0.3f, 1e-6f);
  const auto refusal = [](const Shape& shape, float radius) -> std::string {
    try {
      rounded(shape, radius);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(box({1, 1, 1}), -1), testing::HasSubstr("fathom::rounded: radius is -1 m; it must be finite"));
  const Shape two = compound(std::vector<ChildShape>{{.shape = sphere(1)}});
  EXPECT_THAT(refusal(two, 1), testing::HasSubstr("the shape is a compound"));
}

std::vector<Shape> shapes_to_collide() {
  return {rounded(box({0.5f, 0.4f, 0.3f}), 0.1f),
          rounded(box({0.5f, 0.5f, 0.01f}), 0.05f),
          rounded(tetrahedron(0.8f), 0.2f),
          rounded(cylinder(0.4f, 0.1f), 0.15f),
          rounded(box({0.01f, 0.02f, 0.5f}), 0.02f),
          rounded(cone(0.3f, 0.6f, 0.1f, 12), 0.03f),
          box({0.6f, 0.3f, 0.4f}),
          tetrahedron(1),
          sphere(0.3f),
          capsule(0.2f, 0.4f)};
}

/// All pairs, at least one of them a rounded hull: the deepest point is as deep as the shapes are near, and lies
/// between the surfaces.
TEST(Rounded, ContactsAreAsDeepAsTheShapesAreNear) {
  Sampler random(1);
  const std::vector<Shape> shapes = shapes_to_collide();
  int contacts = 0, several = 0;
  for (int i = 0; i < 30000; ++i) {
    const auto any = [&] { return geometry(shapes[static_cast<std::size_t>(random.integer(10))]); };
    const Geometry a = any(), b = any();
    if (a.hull.radius + b.hull.radius == 0) continue;
    Pose pose{random.uniform(0, 1.6f) * random.direction(), 0, random.rotation()};
    if (i % 4 == 0) pose.rotation = {};
    if (i % 4 == 1) pose.rotation = random.small_rotation(std::pow(10.0f, random.uniform(-6, -1)));
    const float margin = random.uniform(0, 0.1f), radii = a.radius + b.radius;
    const double cores = distance_of_cores(a, b, pose), exact = cores - to_double(radii);
    AxisCache cache;
    const Manifold m = collide_shapes(a, b, pose, margin, cache);
    const double tolerance = 1e-4 + 0.02 * to_double(radii);
    if (exact > to_double(margin) + 1e-5) {
      EXPECT_EQ(m.count, 0) << i << " gap " << exact << " margin " << margin;
      continue;
    }
    if (cores < 1e-3 || exact > to_double(margin) - tolerance) continue;
    ASSERT_GT(m.count, 0) << i;
    int lowest = 0;
    for (int k = 1; k < m.count; ++k)
      if (m.points[k].separation < m.points[lowest].separation) lowest = k;
    EXPECT_NEAR(to_double(m.points[lowest].separation), exact, tolerance) << i;
    const double from_a = distance_from(core(a), {}, m.points[lowest].position);
    const double between = to_double(a.radius) + 0.5 * exact;  // inside the core if below zero
    if (between > 0) {
      EXPECT_NEAR(from_a, between, tolerance + 0.02 * to_double(radii)) << i;
    }
    ++contacts, several += m.count > 1;
  }
  EXPECT_GT(contacts, 3000);
  EXPECT_GT(several, 800);
}

/// Edges of two boxes along each other: two points, and no turning moment.
TEST(Rounded, ParallelEdgesTouchAlongTheirLength) {
  const Shape shape = rounded(box({1, 0.2f, 0.2f}), 0.1f);
  const Geometry a = geometry(shape);
  const float away = 0.2f + 0.09f / std::sqrt(2.0f);
  const Pose pose{{0.4f, 2 * away, 2 * away}, 0, {}};
  AxisCache cache;
  const Manifold m = collide_shapes(a, a, pose, 0.02f, cache);
  ASSERT_EQ(m.count, 2);
  EXPECT_NEAR(m.normal.y, std::sqrt(0.5f), 1e-4f);
  EXPECT_NEAR(abs(m.points[0].position.x - m.points[1].position.x), 1.6f, 1e-3f);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(m.points[i].separation, -0.02f, 1e-4f);
  EXPECT_NE(m.points[0].feature, m.points[1].feature);
}

TEST(Rounded, RaysEnterAtTheSurface) {
  Sampler random(2);
  const std::vector<Shape> shapes = shapes_to_collide();
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Geometry g = geometry(shapes[static_cast<std::size_t>(random.integer(6))]);
    const Pose pose{random.in_cube(1), 0, random.rotation()};
    const Vec3 from = pose.position + random.uniform(0, 2) * random.direction();
    const Vec3 way = (pose.position + 0.6f * random.in_cube(1)) - from;
    SurfaceHit hit;
    const bool meets = meets_convex({from, 1.5f * way}, g, pose, hit);
    const bool inside = distance_from(g, pose, from) == 0;
    ASSERT_EQ(meets && hit.starts_inside, inside) << i;
    if (inside) continue;
    const float last = meets ? hit.fraction : 1;
    for (int k = 0; k < 20; ++k) {
      const Vec3 at = mul_add(from, last * 1.499f * (static_cast<float>(k) + 0.5f) / 20, way);
      EXPECT_GT(distance_from(g, pose, at), 0) << i << ' ' << meets;
    }
    if (!meets) continue;
    ++hits;
    EXPECT_LT(distance_from(g, pose, hit.point), 1e-6);
    EXPECT_GT(distance_from(g, pose, mul_add(hit.point, 1e-4f, hit.normal)), 0.9e-4);
    EXPECT_LT(dot(hit.normal, way), 0);
  }
  EXPECT_GT(hits, 1000);
}

WorldDef world_of(SimulatorKind simulator) {
  WorldDef def;
  def.simulator = simulator;
  if (simulator == SimulatorKind::device) def.device = test_device();
  return def;
}

class RoundedWorld : public testing::TestWithParam<SimulatorKind> {};
INSTANTIATE_TEST_SUITE_P(All, RoundedWorld, testing::Values(SimulatorKind::native, SimulatorKind::device),
                         [](const auto& simulator) {
                           return simulator.param == SimulatorKind::native ? "native" : "device";
                         });

Shape flat_mesh() {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  constexpr std::uint32_t n = 16;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t k = 0; k <= n; ++k)
      vertices.push_back({-8 + static_cast<float>(i), -8 + static_cast<float>(k), 0});
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
      for (const std::uint32_t index : {a, b, b + 1, a, b + 1, a + 1}) indices.push_back(index);
    }
  return mesh(vertices, indices);
}

/// On a box and on a mesh: flat, at the height of core and radius.
TEST_P(RoundedWorld, ComesToRestOnAFace) {
  for (const bool on_mesh : {false, true}) {
    World world(world_of(GetParam()));
    BodyDef floor{.motion = MotionType::fixed, .shape = on_mesh ? flat_mesh() : box({8, 8, 0.5f})};
    if (!on_mesh) floor.pose.position.z = -0.5f;
    world.add(floor);
    std::vector<BodyId> bodies;
    const Shape shapes[] = {rounded(box({0.4f, 0.3f, 0.2f}), 0.1f), rounded(cylinder(0.3f, 0.2f), 0.1f),
                            rounded(box({0.4f, 0.4f, 0.001f}), 0.02f)};
    for (int i = 0; i < 3; ++i) {
      BodyDef body = dynamic(shapes[i], {2.0f * static_cast<float>(i) - 2, 0.3f, 0.6f});
      body.pose.rotation = axis_angle(normalize(Vec3{1, 0.3f, 0}), 0.2f);
      bodies.push_back(world.add(body));
    }
    for (int step = 0; step < 300; ++step) world.step();
    const float heights[] = {0.3f, 0.3f, 0.021f};
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(world.pose(bodies[i]).position.z, heights[i], 2e-3f) << i << (on_mesh ? " on a mesh" : "");
      EXPECT_LT(length(world.velocity(bodies[i]).linear), 1e-3f) << i;
    }
  }
}

/// A rounded box slides over the seams of a mesh without friction.
TEST_P(RoundedWorld, SlidesOverAMesh) {
  World world(world_of(GetParam()));
  BodyDef floor{.motion = MotionType::fixed, .shape = flat_mesh()};
  floor.material.friction = 0;
  world.add(floor);
  BodyDef body = dynamic(rounded(box({0.2f, 0.2f, 0.1f}), 0.05f), {-6, 0.37f, 0.15f});
  body.material.friction = 0;
  body.velocity.linear = {6, 0.5f, 0};
  const BodyId slider = world.add(body);
  for (int step = 0; step < 110; ++step) world.step();
  EXPECT_NEAR(world.velocity(slider).linear.x, 6, 6e-3f);
  EXPECT_NEAR(world.velocity(slider).linear.y, 0.5f, 1e-3f);
  EXPECT_NEAR(world.pose(slider).position.z, 0.15f, 2e-3f);
}

/// A heap of 60 bodies that fell into a shaft: the speed of its fastest body (m/s) after 15 s.
float fastest_of_heap(const WorldDef& def, const Shape& ground, float height, std::uint32_t seed) {
  World world(def);
  BodyDef floor{.motion = MotionType::fixed, .shape = ground};
  floor.pose.position.z = height;
  world.add(floor);
  for (int side = 0; side < 4; ++side) {
    BodyDef wall{.motion = MotionType::fixed, .shape = box({1.5f, 0.2f, 20})};
    wall.pose.rotation = axis_angle({0, 0, 1}, 0.5f * pi * static_cast<float>(side));
    wall.pose.position = rotate(wall.pose.rotation, {0, 1.5f, 20});
    world.add(wall);
  }
  Sampler random(seed);
  const std::vector<Shape> shapes = shapes_to_collide();
  std::vector<BodyId> bodies;
  for (int i = 0; i < 60; ++i) {
    BodyDef body;
    body.shape = shapes[static_cast<std::size_t>(i % 10)];
    body.pose = {{random.uniform(-0.7f, 0.7f), random.uniform(-0.7f, 0.7f), 1 + 0.5f * static_cast<float>(i)},
                 0,
                 random.rotation()};
    bodies.push_back(world.add(body));
  }
  for (int step = 0; step < 900; ++step) world.step();
  float fastest = 0;
  for (const BodyId body : bodies) {
    const Vec3 at = world.pose(body).position;
    EXPECT_TRUE(at.z > 0 && abs(at.x) < 1.4f && abs(at.y) < 1.4f) << at.x << ' ' << at.y << ' ' << at.z;
    fastest = std::max(fastest, length(world.velocity(body).linear));
  }
  return fastest;
}

// So many, because the share of the first few dozen scatters (docs/log/2026-12-01-owed-momentum.md).
TEST_P(RoundedWorld, HeapsAreNotLostAndMostlyAtRest) {
  int at_rest = 0;
  for (std::uint32_t seed = 1; seed <= 100; ++seed) {
    at_rest += fastest_of_heap(world_of(GetParam()), box({8, 8, 0.5f}), -0.5f, seed) < 0.05f;
    at_rest += fastest_of_heap(world_of(GetParam()), flat_mesh(), 0, seed) < 0.05f;
  }
  EXPECT_GE(at_rest, 150);
}

TEST(Rounded, SavedShapesAndSnapshotsKeepTheRadius) {
  const Shape shape = rounded(tetrahedron(1), 0.2f);
  std::vector<std::byte> bytes;
  save_shape(shape, bytes);
  const Shape again = load_shape(bytes);
  EXPECT_EQ(again.radius, shape.radius);
  EXPECT_EQ(again.hull->radius(), 0.2f);
  World world;
  const BodyId body = world.add(dynamic(shape, {0, 0, 5}));
  World copy;
  world.save(bytes);
  copy.restore(bytes);
  EXPECT_EQ(copy.shape(body).hull->radius(), 0.2f);
}

}  // namespace
}  // namespace fathom::test::rounded_test
