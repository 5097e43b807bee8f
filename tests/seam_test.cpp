// Seams between shapes that do not move relative to each other (collision/seam.hpp, native/seams.hpp,
// device/seams.hpp).
#include "collision/seam.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::test::seam_test {
namespace {

struct Beside {
  std::vector<NeighbourSolid> solids;

  int moments() const { return 1; }
  const Beside& at(int) const { return *this; }
  template <class Act>
  bool any(const Act& act) const {
    return std::ranges::any_of(solids, act);
  }
};

NeighbourSolid beside(const Shape& shape, Vec3 position) { return {geometry(shape), {.position = position}}; }

Manifold at(Vec3 point, Vec3 normal) {
  Manifold m;
  m.normal = normal;
  m.count = 1;
  m.points[0] = {point, 0, 0};
  return m;
}

const Shape tile = box({1, 1, 0.5f});
const SeamLengths lengths = make_seam_lengths(0.2f, 1);

bool counts(const Beside& neighbours, const Manifold& m) {
  return counts_at_seam(geometry(tile), neighbours, m, m.points[0].position + Vec3{0, 0, 0.2f}, lengths);
}

TEST(Seam, TheSideOfATileBesideAnotherIsHidden) {
  const Manifold side = at({1, 0, 0.4999f}, {1, 0, 0}), edge = at({1, 0, 0.5f}, normalize(Vec3{0.1f, 0, 1}));
  const Manifold top = at({1, 0, 0.5f}, {0, 0, 1});
  for (const Manifold& m : {side, edge, top}) EXPECT_TRUE(counts({}, m));
  const Beside level{{beside(tile, {2, 0, 0})}};
  EXPECT_FALSE(counts(level, side));
  EXPECT_FALSE(counts(level, edge));
  EXPECT_TRUE(counts(level, top));
  // If the neighbour is lower by more than the gap, or too far away, they can be touched.
  for (const Vec3 place : {Vec3{2, 0, -6 * lengths.gap}, Vec3{2 + 6 * lengths.gap, 0, 0}})
    for (const Manifold& m : {side, edge, top}) EXPECT_TRUE(counts({{beside(tile, place)}}, m));
}

TEST(Seam, BothFacesOfACornerCount) {
  // A wall stands on the tile, or beside it.
  for (const Vec3 place : {Vec3{0.9f, 0, 1.5f}, Vec3{1.1f, 0, 0.5f}}) {
    const Beside wall{{beside(box({0.1f, 1, 1}), place)}};
    const Manifold foot = at({place.x - 0.1f, 0, 0.5f}, {0, 0, 1});
    EXPECT_TRUE(counts(wall, foot));
    // So does the floor below a body that has been pressed into the wall.
    const Manifold behind = at({place.x - 0.07f, 0, 0.5f}, {0, 0, 1});
    EXPECT_TRUE(counts_at_seam(geometry(tile), wall, behind, {place.x - 0.2f, 0, 0.7f}, lengths));
  }
  const Beside all_around{{beside(tile, {2, 0, 0}), beside(tile, {-2, 0, 0}), beside(tile, {0, 2, 0}),
                           beside(tile, {0, -2, 0}), beside(tile, {2, 2, 0})}};
  EXPECT_FALSE(counts(all_around, at({1, 1, 0.5f}, normalize(Vec3{-1, 1, 1}))));
  EXPECT_TRUE(counts(all_around, at({1, 1, 0.5f}, {0, 0, 1})));
}

TEST(Seam, NothingIsHiddenFromWhatIsPressedInByHalf) {
  const Beside level{{beside(tile, {2, 0, 0})}};
  const Manifold side = at({1, 0, 0.45f}, {1, 0, 0});
  const Geometry cube = geometry(box({0.2f, 0.2f, 0.2f}));
  const auto is_whole = [&](Vec3 centre) {
    const Pose pose{.position = centre};
    return kept_at_seam(geometry(tile), cube, pose, 0.01f, 0.2f, level, lengths, side).is_whole;
  };
  EXPECT_FALSE(is_whole({1.1f, 0, 0.51f}));
  EXPECT_TRUE(is_whole({1.1f, 0, 0.49f}));
  EXPECT_TRUE(is_whole({0.9f, 0, 0.49f}));
}

TEST(Seam, NormalsOfARidgeCount) {
  // The neighbour falls away from the edge at 45°.
  const std::vector<Vec3> slope{{1, -1, 0.5f}, {1, 1, 0.5f},   {2, -1, -0.5f},
                                {2, 1, -0.5f}, {1, -1, -0.5f}, {1, 1, -0.5f}};
  const Shape wedge = hull(slope);
  const Beside ridge{{{geometry(wedge), {.position = wedge.hull->offset()}}}};
  EXPECT_TRUE(counts(ridge, at({1, 0, 0.5f}, normalize(Vec3{0.5f, 0, 1}))));
  EXPECT_TRUE(counts(ridge, at({1, 0, 0.5f}, {0, 0, 1})));
  EXPECT_FALSE(counts(ridge, at({1, 0, 0.5f}, normalize(Vec3{2, 0, 1})))) << "steeper than the slope";
}

/// A face of the body lies on the edge, but for a degree, and ends before the corner, where the tile is higher.
TEST(Seam, AnEdgeHoldsAFaceThatEndsBeforeItsHighestPoint) {
  const Manifold m = at({1, 0, 0.5f}, normalize(Vec3{0.6f, 0.02f, 0.8f}));
  EXPECT_TRUE(counts({{beside(tile, {5, 5, 0})}}, m));
  EXPECT_TRUE(counts({{beside(tile, {0, -2, 0})}}, m));
  EXPECT_FALSE(counts({{beside(tile, {2, 0, 0})}}, m)) << "hidden by the tile beside it";
}

TEST(Seam, WhatIsHiddenMakesWayForTheFaceThatCanBeSeen) {
  const Beside level{{beside(tile, {2, 0, 0})}};
  const Geometry cube = geometry(box({0.2f, 0.2f, 0.2f}));
  // The cube has moved over the tile by less than it is pressed into it.
  const Pose pose{.position = {1.199f, 0, 0.698f}};
  AxisCache axis;
  const Manifold m = collide(geometry(tile), cube, pose, 0.01f, axis);
  ASSERT_GT(m.normal.x, 0.99f);
  const SeamManifold kept = kept_at_seam(geometry(tile), cube, pose, 0.01f, 0.2f, level, lengths, m);
  EXPECT_FALSE(kept.is_whole);
  ASSERT_GT(kept.manifold.count, 0);
  EXPECT_GT(kept.manifold.normal.z, 0.99f);
  EXPECT_NEAR(kept.manifold.points[0].separation, -0.002f, 1e-4f);
  // Not over it yet: the neighbour holds it.
  const Pose before{.position = {1.203f, 0, 0.698f}};
  axis = {};
  const Manifold ahead = collide(geometry(tile), cube, before, 0.01f, axis);
  ASSERT_GT(ahead.count, 0);
  EXPECT_EQ(kept_at_seam(geometry(tile), cube, before, 0.01f, 0.2f, level, lengths, ahead).manifold.count, 0);
}

// A thin plate in the corner of two walls that meet edge to edge, pressed into the one by more than its thickness: it
// is less deep behind the end of that wall, which the other wall hides.
TEST(Seam, AWallHoldsWhatIsPressedIntoACorner) {
  const Shape wall = box({1, 0.2f, 1});
  const Beside other{{beside(box({0.2f, 2, 1}), {-1.2f, 0, 0})}};
  const Geometry plate = geometry(box({0.1f, 0.1f, 0.005f}));
  const SeamLengths of_plate = make_seam_lengths(0.005f, 1);
  const Quat upright = axis_angle({0, 1, 0}, 0.5f * pi);  // its thickness along x
  for (const float depth : {0.004f, 0.01f, 0.05f}) {
    const Pose pose{.position = {-0.998f, 0.3f - depth, 0}, .rotation = upright};
    AxisCache axis;
    const Manifold m = collide(geometry(wall), plate, pose, 0.01f, axis);
    ASSERT_GT(m.count, 0);
    const SeamManifold kept = kept_at_seam(geometry(wall), plate, pose, 0.01f, 0.005f, other, of_plate, m);
    ASSERT_GT(kept.manifold.count, 0) << depth;
    EXPECT_GT(kept.manifold.normal.y, 0.99f) << depth;
  }
}

// The end of a bar, which the next bar hides, is pressed into a wall whose middle is far above. The wall's lower end is
// far below the bars' upper side: no way out.
TEST(Seam, AWallTurnsNoChildOverItsFarEnd) {
  const Geometry bar = geometry(box({0.06f, 0.02f, 0.02f})), wall = geometry(box({0.13f, 1, 1}));
  const Beside next{{beside(box({0.02f, 0.02f, 0.02f}), {0.08f, 0, 0})}};
  const Pose pose{.position = {0.18f, 0, 0.8f}};
  Manifold end = at({0.06f, 0, 0.0199f}, {1, 0, 0});
  end.points[0].separation = -0.012f;
  SeamLengths of_bar = make_seam_lengths(0.13f, 1);
  ASSERT_LT(nearest_separation(kept_at_seam(bar, wall, pose, 0.01f, 0.02f, next, of_bar, end).manifold), -0.2f);
  of_bar.limit_depth(0.02f);
  const SeamManifold kept = kept_at_seam(bar, wall, pose, 0.01f, 0.02f, next, of_bar, end);
  EXPECT_EQ(kept.manifold.normal, end.normal);
  EXPECT_EQ(nearest_separation(kept.manifold), -0.012f);
}

// --- in worlds ---------------------------------------------------------------------------------------------------

BodyDef fixed(const Shape& shape, Vec3 position) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = shape;
  def.pose.position = position;
  def.material.friction = 0;
  return def;
}

BodyDef slider(const Shape& shape, Vec3 position, float speed = 0) {
  BodyDef def = dynamic(shape, position);
  def.material.friction = 0;
  def.velocity.linear.x = speed;
  return def;
}

/// Tiles with these edge lengths and their tops at 0, along a path from the origin at this angle.
void add_tiles(World& world, float edge_x, float edge_y, float angle, float length) {
  const float c = std::cos(angle), s = std::sin(angle), reach = length + 2;
  const Shape shape = box({0.5f * edge_x, 0.5f * edge_y, 0.5f * edge_x});
  for (int i = static_cast<int>(-reach / edge_x); static_cast<float>(i) * edge_x < reach; ++i)
    for (int j = static_cast<int>(-reach / edge_y); static_cast<float>(j) * edge_y < reach; ++j) {
      const float x = (static_cast<float>(i) + 0.5f) * edge_x, y = (static_cast<float>(j) + 0.5f) * edge_y;
      const float along = c * x + s * y, aside = c * y - s * x;
      if (along < -2 || along > reach || std::abs(aside) > 2) continue;
      world.add(fixed(shape, {x, y, -0.5f * edge_x}));
    }
}

TEST(Seams, NothingCatchesOnRandomTiles) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Generator random(seed);
    const float size = uniform(random, 0.06f, 0.4f), speed = uniform(random, 0.5f, 30), angle = uniform(random, 0, 6);
    const float length = std::min(4 * speed, 16.0f);
    World world(quiet_world());
    add_tiles(world, uniform(random, 0.2f, 2), uniform(random, 0.2f, 2), angle, length);
    const float yaw = uniform(random, 0, 6);
    BodyDef def = slider(sphere(size), {0, 0, size});
    if (seed % 3 == 1) {
      def.shape = box({size * uniform(random, 0.4f, 2), size * uniform(random, 0.4f, 2), size});
      def.pose.rotation = axis_angle({0, 0, 1}, yaw);
    } else if (seed % 3 == 2) {
      def.shape = capsule(size, size * uniform(random, 0.3f, 3));
      def.pose.rotation = axis_angle({std::cos(yaw), std::sin(yaw), 0}, 0.5f * pi);
    }
    const BodyId body = world.add(def);
    run(world, 30);
    const float height = world.pose(body).position.z;
    const Vec3 velocity{speed * std::cos(angle), speed * std::sin(angle), 0};
    world.set_velocity(body, velocity, {});
    for (int i = 0; i < static_cast<int>(60 * length / speed); ++i) {
      world.step();
      ASSERT_NEAR(world.pose(body).position.z, height, 2e-3f) << "seed " << seed << " step " << i;
    }
    EXPECT_LT(fathom::length(world.velocity(body).linear - velocity), 1e-3f * speed) << "seed " << seed;
  }
}

// Bodies fall on junctions of tiles with gaps that count as none. A ball over a gap touches only edges, and each of
// them is hidden by the other tile.
TEST(Seams, NothingFallsIntoAGap) {
  for (unsigned seed = 1; seed <= 140; ++seed) {
    Generator random(seed);
    const float size = uniform(random, 0.02f, 0.4f),
                gap = uniform(random, 0.05f, 0.95f) * std::min(1e-3f, 0.02f * size);
    const float edge_x = size * uniform(random, 1, 6), edge_y = size * uniform(random, 1, 6);
    const bool in_bond = seed % 2 == 0, of_meshes = seed % 4 < 2;
    World world(quiet_world());
    for (int i = -4; i < 4; ++i)
      for (int j = -4; j < 4; ++j) {
        const float shift = in_bond && (j & 1) != 0 ? 1.0f : 0.5f;
        const Vec3 top{(static_cast<float>(i) + shift) * (edge_x + gap),
                       (static_cast<float>(j) + 0.5f) * (edge_y + gap), 0};
        const float x = 0.5f * edge_x, y = 0.5f * edge_y;
        const std::vector<Vec3> corners{{-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}};
        const std::vector<std::uint32_t> triangles{0, 1, 2, 0, 2, 3};
        world.add(of_meshes ? fixed(mesh(corners, triangles), top) : fixed(box({x, y, x}), top - Vec3{0, 0, x}));
      }
    // Shapes whose lowest point is over the gap.
    const Quat lying = axis_angle({1, 0, 0}, 0.5f * pi), upside_down = axis_angle({1, 0, 0}, pi);
    const std::vector<std::pair<Shape, Quat>> shapes{
        {sphere(size), {}}, {capsule(size, size), {}}, {capsule(size, size), lying}, {cone(size, size), upside_down}};
    const auto& [shape, rotation] = shapes[seed % 7 % shapes.size()];
    BodyDef def = dynamic(shape, {uniform(random, 0, 0.5f) * gap, uniform(random, 0, 0.5f) * gap, 0});
    def.pose.rotation = rotation;
    const BodyId body = world.add(def);
    def.pose.position.z = uniform(random, 0, 1) * size - world.bounds(body).lower.z;
    world.set_pose(body, def.pose);
    float lowest = size;
    for (int i = 0; i < 60; ++i) {
      world.step();
      lowest = std::min(lowest, world.bounds(body).lower.z);
    }
    EXPECT_GT(lowest, -std::max(3e-3f, 0.1f * size)) << "seed " << seed;
  }
}

// Four contacts of each body begin in the first step, all of them at seams: lists have room for them.
TEST(Seams, ManyBeginAtOnce) {
  World world(quiet_world());
  add_tiles(world, 0.5f, 0.5f, 0, 10);
  std::vector<BodyId> bodies;
  for (int i = 0; i < 20; ++i)
    for (int j = -3; j <= 3; ++j) {
      const Shape shape = (i + j) % 2 == 0 ? box({0.1f, 0.1f, 0.1f}) : cylinder(0.1f, 0.1f);
      bodies.push_back(world.add(slider(shape, {0.5f * static_cast<float>(i), 0.5f * static_cast<float>(j), 0.1f})));
    }
  run(world, 30);
  for (const BodyId body : bodies) EXPECT_NEAR(world.bounds(body).lower.z, 0, 1e-3f);
}

TEST(Seams, WhatDoesNotHoldABodyHidesNothingFromIt) {
  for (const bool excluded : {false, true}) {
    World world(quiet_world());
    world.add(fixed(box({10, 10, 0.5f}), {0, 0, -0.5f}));
    world.add(fixed(box({1, 1, 0.2f}), {3, 0, 0.2f}));
    BodyDef ghost = fixed(box({1, 1, 0.2f}), {1, 0, 0.2f});
    if (!excluded) ghost.filter.category = 2;
    const BodyId before_it = world.add(ghost);
    BodyDef def = slider(box({0.15f, 0.15f, 0.15f}), {0, 0, 0.15f}, 1.5f);
    if (!excluded) def.filter.mask = 1;
    const BodyId body = world.add(def);
    if (excluded) world.exclude(body, before_it);
    run(world, 120);
    EXPECT_NEAR(world.pose(body).position.x, 1.85f, 0.2f);
    EXPECT_LT(world.velocity(body).linear.x, 0.01f);
  }
}

TEST(Seams, ASideIsFoundOnceItsNeighbourHasGone) {
  World world(quiet_world());
  world.add(fixed(box({10, 10, 0.5f}), {0, 0, -0.5f}));
  const BodyId first = world.add(fixed(box({1, 1, 0.2f}), {1, 0, 0.2f}));
  world.add(fixed(box({1, 1, 0.2f}), {3, 0, 0.2f}));
  const BodyId above = world.add(slider(box({0.15f, 0.15f, 0.15f}), {0.5f, 0, 0.55f}, 1));
  run(world, 90);
  EXPECT_NEAR(world.velocity(above).linear.x, 1, 1e-3f);
  world.remove(first);
  const BodyId below = world.add(slider(box({0.15f, 0.15f, 0.15f}), {0.5f, 0, 0.15f}, 1));
  run(world, 120);
  EXPECT_LT(world.velocity(below).linear.x, 0.01f);
}

TEST(Seams, ACornerHoldsWhatLeansInIt) {
  for (const bool wall_on_floor : {false, true}) {
    World world(quiet_world());
    world.add(fixed(box({2, 2, 0.5f}), {-2, 0, -0.5f}));
    world.add(fixed(box({0.25f, 2, 2}), {wall_on_floor ? -0.25f : 0.25f, 0, wall_on_floor ? 2.0f : 0.0f}));
    const float corner = wall_on_floor ? -0.5f : 0;
    for (const float tilt : {0.2f, 0.7f, 1.2f}) {
      BodyDef def = dynamic(box({0.5f, 0.2f, 0.02f}), {}, 1);
      def.material.friction = 0.3f;
      def.pose.rotation = axis_angle({0, 1, 0}, tilt);
      const Vec3 end = rotate(def.pose.rotation, {0.5f, 0, -0.02f});  // its lower edge is in the corner
      def.pose.position = Vec3{corner, 1.5f * (tilt - 0.7f), 0} - end;
      const BodyId body = world.add(def);
      run(world, 1);
      EXPECT_LT(fathom::length(world.pose(body).position - def.pose.position), 0.02f) << tilt;
    }
    run(world, 200);
    for (const BodyId id : world.bodies()) {
      if (world.motion(id) == MotionType::fixed) continue;
      EXPECT_GT(world.bounds(id).lower.z, -5e-3f);
      EXPECT_LT(world.bounds(id).upper.x, corner + 5e-3f);
    }
  }
}

TEST(Seams, GoOnAlikeFromASnapshotAndOnMoreThreads) {
  const auto make = [](int threads) {
    World world(quiet_world(threads));
    add_tiles(world, 0.5f, 0.7f, 0, 6);
    for (int i = 0; i < 30; ++i) {
      const float x = 0.3f * static_cast<float>(i % 6), y = 0.3f * static_cast<float>(i / 6) - 0.6f;
      const Shape shapes[] = {box({0.1f, 0.1f, 0.1f}), sphere(0.1f), capsule(0.05f, 0.05f), cylinder(0.1f, 0.1f)};
      world.add(slider(shapes[i % 4], {x, y, 0.15f}, 2));
    }
    return world;
  };
  EXPECT_TRUE(goes_on_alike(make));
}

}  // namespace
}  // namespace fathom::test::seam_test
