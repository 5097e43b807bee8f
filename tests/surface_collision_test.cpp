// Surfaces as devices collide them (terrain/surface_collision.hpp), against the search in lanes and the surfaces' own
// searches.
#include "terrain/surface_collision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "random.hpp"
#include "terrain/surface_contact.hpp"
#include "test_surfaces.hpp"

namespace fathom::test::surface_collision_test {
namespace {

/// Without copying: it views the surface's own arrays.
struct Viewed {
  explicit Viewed(const Shape& shape) : surface(shape.surface) {
    view.bounds = surface->bounds();
    if (const auto* const mesh = dynamic_cast<const TriangleMesh*>(surface.get())) {
      view.vertices = mesh->vertices().data(), view.indices = mesh->indices().data(), view.nodes = mesh->nodes().data();
      return;
    }
    const auto& field = dynamic_cast<const HeightField&>(*surface);
    view.columns = field.columns(), view.rows = field.rows();
    view.cell_x = field.cell_x(), view.cell_y = field.cell_y();
    view.heights = field.heights().data();
    const std::uint32_t cells = (view.columns - 1) * (view.rows - 1);
    holes.resize((cells + 63) / 64);
    for (std::uint32_t cell = 0; cell < cells; ++cell)
      holes[cell / 64] |= std::uint64_t{field.is_hole(cell)} << cell % 64;
    view.holes = holes.data();
  }

  std::shared_ptr<const Surface> surface;
  std::vector<std::uint64_t> holes;
  SurfaceView view;
};

std::vector<Viewed> surfaces() {
  std::vector<Viewed> all;
  all.emplace_back(wavy_mesh(40));
  all.emplace_back(wavy_field(41, 5, {7, 300, 301, 1599}));
  all.emplace_back(flat_mesh(30, 3));
  for (Viewed& viewed : all)
    if (viewed.view.holes) viewed.view.holes = viewed.holes.data();
  return all;
}

TEST(SurfaceView, HasTheTrianglesOfItsSurface) {
  for (const Viewed& ground : surfaces())
    for (std::uint32_t number = 0; number < ground.surface->triangle_count(); ++number) {
      const Triangle seen = ground.view.triangle(number), own = ground.surface->triangle(number);
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(seen.corners[k], own.corners[k]);
        EXPECT_EQ(seen.vertices[k], own.vertices[k]);
        EXPECT_EQ(ground.view.vertex(seen.vertices[k]), own.corners[k]);
      }
    }
}

TEST(SurfaceView, FindsWhatItsSurfaceFinds) {
  Generator random(1);
  for (const Viewed& ground : surfaces())
    for (int i = 0; i < 400; ++i) {
      const Vec3 middle = 6 * in_cube(random);
      const Vec3 half = uniform(random, 0, 1.5f) * abs(in_cube(random));
      const Aabb box{middle - half, middle + half};
      std::vector<std::uint32_t> own, seen;
      ground.surface->find(box, own);
      ground.view.for_each_in(box, [&](std::uint32_t number) { seen.push_back(number); });
      std::ranges::sort(own), std::ranges::sort(seen);
      EXPECT_EQ(own, seen);
      EXPECT_EQ(ground.view.any_in(box, [](std::uint32_t) { return true; }), !own.empty());
    }
}

float deepest(const SurfaceContact& contact) {
  float nearest = 1;
  for (int g = 0; g < contact.count; ++g) nearest = std::min(nearest, nearest_separation(contact.manifolds[g]));
  return nearest;
}

/// As a device does it.
void collide_one_by_one(const SurfaceView& surface, const Geometry& b, const Pose& pose, float margin,
                        const std::vector<SurfacePush>& pushes, SurfaceContact& contact) {
  const ShapeInOwnAxes<ShapeKind::any> shape(b);
  const Tolerance tolerance = make_tolerance(shape.inner(), shape.outer());
  const TrianglesAround around{surface, pose, grown(bounds(b, pose), margin)};
  const int push_count = static_cast<int>(pushes.size());
  std::vector<Vec3> pushed;
  for (const SurfacePush& push : pushes) pushed.push_back(inverse_rotate(pose.rotation, push.normal));
  JoinOfTouches join(around, tolerance, shape.is_round(), pushes.data(), push_count, {}, contact);
  do {
    surface.for_each_in(around.box, [&](std::uint32_t number) {
      const SurfaceTouch touch = touch_of(number, around, shape, margin, pushed.data(), push_count, tolerance);
      if (touch.touches) join.take(touch);
    });
  } while (join.next());
}

TEST(SurfaceCollision, IsThatOfTheSearchInLanes) {
  Generator random(2);
  int touching = 0, same_directions = 0, same_depths = 0, many = 0;
  for (const Viewed& ground : surfaces())
    for (int i = 0; i < 1500; ++i) {
      const float size = uniform(random, 0.05f, 0.6f), x = uniform(random, -4, 4), y = uniform(random, -4, 4);
      const Shape shape = shapes_of(size)[random() % 4];
      const bool is_field = ground.view.columns > 0, is_flat = ground.view.bounds.upper.z == 0;
      const float floor = is_flat ? 0 : wavy_bowl(x, y);
      const Pose pose{
          {x + (is_field ? 5.0f : 0.0f), y + (is_field ? 5.0f : 0.0f), floor + uniform(random, 0.2f, 1.2f) * size},
          0,
          any_rotation(random)};
      std::vector<SurfacePush> pushes;
      if (random() % 2 == 0) pushes.push_back({normalize(Vec3{0, 0, 1} + 0.3f * in_cube(random)), {}});
      SurfaceScratch scratch;
      SurfaceContact lanes, one;
      const float margin = 0.02f * size;
      collide_surface(*ground.surface, geometry(shape), pose, margin, pushes, scratch, lanes);
      collide_one_by_one(ground.view, geometry(shape), pose, margin, pushes, one);
      ASSERT_EQ(lanes.count > 0, one.count > 0) << i;
      if (lanes.count == 0) continue;
      ++touching;
      // Rounding may decide between two axes whose separations differ by less than the tolerance; deep inside, by more.
      const float apart = std::abs(deepest(lanes) - deepest(one));
      same_depths += apart <= 2e-5f * (1 + length(pose.position));
      EXPECT_TRUE(apart < max_axis_tolerance || deepest(lanes) < -0.1f * size) << i << ": " << deepest(lanes);
      // Directions within 5° of each other may form other patches; the deepest one is the same.
      same_directions += dot(lanes.manifolds[0].normal, one.manifolds[0].normal) > 0.99f;
      many += lanes.count > 2;
      EXPECT_LE(std::abs(lanes.count - one.count), 4) << i;
    }
  EXPECT_GT(touching, 2000);
  EXPECT_GT(many, 200);
  EXPECT_GT(same_depths, 0.99 * touching);
  EXPECT_GT(same_directions, 0.99 * touching);
}

TEST(SurfaceCollision, GroupsBeyondTheEighthReplaceTheShallowest) {
  SurfaceGroups groups;
  Generator random(3);
  std::vector<float> depths, kept(max_surface_manifolds);
  for (int i = 0; i < 12; ++i) {
    Manifold m;
    const float angle = 6.2831853f * static_cast<float>(i) / 12;
    m.normal = {std::cos(angle), std::sin(angle), 0};
    m.count = 1;
    m.points[0] = {{}, uniform(random, -1, 0), 0};
    depths.push_back(m.points[0].separation);
    const SurfaceGroups::Change change = groups.join({m, 1, 0});
    if (change.group < 0) continue;
    EXPECT_TRUE(change.begins);
    kept[static_cast<std::size_t>(change.group)] = depths.back();
  }
  ASSERT_EQ(groups.count(), max_surface_manifolds);
  EXPECT_EQ(kept[static_cast<std::size_t>(groups.deepest(0))], *std::ranges::min_element(depths));
  std::ranges::sort(depths);
  std::ranges::sort(kept);
  EXPECT_EQ(kept, std::vector<float>(depths.begin(), depths.begin() + max_surface_manifolds));
}

TEST(SurfaceCollision, SearchAroundAVertexFindsItsTriangles) {
  Generator random(4);
  for (const Viewed& ground : surfaces())
    for (int i = 0; i < 300; ++i) {
      const std::uint32_t vertices =
          ground.view.heights
              ? ground.view.columns * ground.view.rows
              : static_cast<std::uint32_t>(dynamic_cast<const TriangleMesh&>(*ground.surface).vertices().size());
      const auto vertex = static_cast<std::uint32_t>(random() % vertices);
      std::vector<std::uint32_t> found, expected;
      const auto note = [&](std::vector<std::uint32_t>& numbers, std::uint32_t number) {
        std::uint32_t names[3];
        ground.view.name_vertices(number, names);
        if (std::ranges::count(names, vertex) > 0) numbers.push_back(number);
      };
      ground.view.any_around(vertex, [&](std::uint32_t number) { return note(found, number), false; });
      const Vec3 at = ground.view.vertex(vertex);
      ground.view.for_each_in({at, at}, [&](std::uint32_t number) { note(expected, number); });
      EXPECT_EQ(found, expected) << vertex;
    }
}

}  // namespace
}  // namespace fathom::test::surface_collision_test
