// What physics does not depend on: units of mass, uniform motion, the axes, how a shape is described. And what must
// always balance. On every simulator.
#include <gtest/gtest.h>

#include <cmath>
#include <fathom/compound.hpp>

#include "random.hpp"
#include "shape_fixture.hpp"
#include "world_fixture.hpp"

namespace fathom::symmetry_test {
namespace {

using namespace test;

BodyDef floor_of(Vec3 half, Vec3 centre) {
  BodyDef def = dynamic(box(half), centre);
  def.motion = MotionType::fixed;
  return def;
}

Shape any_shape(int kind, float size) {
  switch (kind % 4) {
    case 0:
      return sphere(size);
    case 1:
      return box({size, 0.6f * size, 0.4f * size});
    case 2:
      return capsule(0.5f * size, size);
    default:
      return cylinder_hull(size, 0.4f * size, 10);
  }
}

/// Bodies that fall one after the other; masses in units of `unit` kg.
std::vector<BodyId> add_heap(World& world, unsigned seed, int count, float unit) {
  Generator random(seed);
  std::vector<BodyId> ids;
  for (int i = 0; i < count; ++i) {
    const float size = uniform(random, 0.2f, 0.6f), mass = unit * uniform(random, 1, 20);
    BodyDef def = dynamic(any_shape(i, size), {0, 0, 1 + 0.8f * static_cast<float>(i)}, mass);
    def.pose.position += in_cube(random);
    def.pose.rotation = any_rotation(random);
    def.material = {0.6f, 0};
    def.linear_damping = 0.2f, def.angular_damping = 0.5f;
    ids.push_back(world.add(def));
  }
  return ids;
}

/// Five shapes that lie on a floor at z = 0 with their centres at `height`.
struct Slider {
  Shape shape;
  float height;
  Quat rotation{};
};
std::vector<Slider> sliders() {
  const Vec3 half{0.5f, 0.4f, 0.3f};
  return {{box(half), 0.3f},
          {box_hull(half), 0.3f},
          {cylinder_hull(0.5f, 0.3f, 24), 0.3f},
          {sphere(0.4f), 0.4f},
          {capsule(0.3f, 0.5f), 0.3f, axis_angle({1, 0, 0}, std::numbers::pi_v<float> / 2)}};
}

}  // namespace

// A power of two as the unit of mass leaves every bit of every pose unchanged.
TEST(Symmetry, MassesHaveNoUnit) {
  const auto poses_with = [](float unit) {
    World world(quiet_world());
    world.add(floor_of({50, 50, 1}, {0, 0, -1}));
    const std::vector<BodyId> ids = add_heap(world, 3, 40, unit);
    run(world, 300);
    std::vector<Vec3> places;
    for (const BodyId id : ids) places.push_back(world.pose(id).position);
    return places;
  };
  const std::vector<Vec3> kilograms = poses_with(1);
  EXPECT_EQ(poses_with(1024), kilograms);
  EXPECT_EQ(poses_with(1.0f / 1024), kilograms);
}

TEST(Symmetry, UniformMotionChangesNothing) {
  for (const Slider& slider : sliders()) {
    Vec3 at_rest;
    for (const float speed : {0.0f, 8.0f, 50.0f}) {
      World world(quiet_world());
      BodyDef ground = floor_of({500, 500, 1}, {0, 0, -1});
      ground.motion = MotionType::kinematic;
      ground.velocity.linear = {speed, 0, 0};
      world.add(ground);
      BodyDef def = dynamic(slider.shape, {0, 0, slider.height}, 2);
      def.pose.rotation = slider.rotation;
      def.velocity.linear = {speed + 3, 1, 0};
      const BodyId id = world.add(def);
      run(world, 120);
      const Vec3 place = world.pose(id).position - Vec3{2 * speed, 0, 0};
      if (speed == 0) at_rest = place;
      EXPECT_LT(distance(place, at_rest), 1e-3f) << speed;
    }
  }
}

TEST(Symmetry, NoAxisIsSpecial) {
  const auto turned_axes = [](Vec3 v, int by) {
    return by == 0 ? v : by == 1 ? Vec3{v.z, v.x, v.y} : Vec3{v.y, v.z, v.x};
  };
  for (const Slider& slider : sliders()) {
    Vec3 upright;
    for (int by = 0; by < 3; ++by) {
      WorldDef world_def = quiet_world();
      world_def.gravity = turned_axes({0, 0, -9.81f}, by);
      World world(world_def);
      world.add(floor_of(turned_axes({100, 100, 1}, by), turned_axes({0, 0, -1}, by)));
      BodyDef def = dynamic(slider.shape, turned_axes({0, 0, slider.height}, by), 2);
      def.pose.rotation =
          axis_angle({1, 1, 1}, static_cast<float>(by) * 2 * std::numbers::pi_v<float> / 3) * slider.rotation;
      def.velocity.linear = turned_axes({3, 1, 0}, by);
      const BodyId id = world.add(def);
      run(world, 120);
      const Vec3 place = turned_axes(world.pose(id).position, (3 - by) % 3);
      if (by == 0) upright = place;
      EXPECT_LT(distance(place, upright), 1e-3f) << by;
    }
  }
}

// Slid, spun while sliding, and dropped on an edge.
TEST(Symmetry, ABoxIsAHullIsACompound) {
  const Vec3 half{0.5f, 0.4f, 0.3f};
  const auto halves = [](Vec3 child, Vec3 off) {
    return compound(
        std::vector<ChildShape>{{.shape = box(child), .pose = {-off}}, {.shape = box(child), .pose = {off}}});
  };
  const Shape shapes[] = {box(half), box_hull(half), halves({0.25f, 0.4f, 0.3f}, {0.25f, 0, 0}),
                          halves({0.5f, 0.4f, 0.15f}, {0, 0, 0.15f})};
  for (int scene = 0; scene < 3; ++scene) {
    Vec3 of_box;
    for (const Shape& shape : shapes) {
      World world(quiet_world());
      world.add(floor_of({100, 100, 1}, {0, 0, -1}));
      BodyDef def = dynamic(shape, {0, 0, 0.3f}, 2);
      if (scene == 0) def.velocity.linear = {3, 1, 0};
      if (scene == 1) def.velocity = {{2, 0, 0}, 0, {0, 0, 4}, 0};
      if (scene == 2) def.pose = {{0, 0, 1}, 0, axis_angle({0, 1, 0}, 0.3f)};
      const BodyId id = world.add(def);
      run(world, 120);
      if (&shape == &shapes[0]) of_box = world.pose(id).position;
      EXPECT_LT(distance(world.pose(id).position, of_box), 0.02f) << "scene " << scene;
    }
  }
}

TEST(Symmetry, TheFloorCarriesTheWeightOfAHeap) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    World world(quiet_world());
    const BodyId ground = world.add(floor_of({50, 50, 1}, {0, 0, -1}));
    float weight = 0;
    for (const BodyId id : add_heap(world, seed, 60, 1)) weight += 9.81f * world.mass(id);
    run(world, 1500);
    float carried = 0;
    for (int i = 0; i < 60; ++i) {
      world.step();
      world.for_each_contact_of(ground, [&](const ContactInfo& c) {
        for (int k = 0; k < c.point_count; ++k) carried += c.points[k].impulse * std::abs(c.normal.z);
      });
    }
    EXPECT_NEAR(carried, weight, 0.002f * weight) << seed;
  }
}

// Elastic, without friction and gravity, in a closed room: nothing escapes, and energy neither rises nor falls.
TEST(Symmetry, AnElasticGasKeepsItsEnergy) {
  for (int kind = 0; kind < 5; ++kind)
    for (unsigned seed = 1; seed <= 3; ++seed) {
      WorldDef world_def = quiet_world();
      world_def.gravity = {};
      world_def.solver.restitution_threshold = 0;
      World world(world_def);
      for (int side = 0; side < 6; ++side) {
        const Vec3 axis{side / 2 == 0 ? 1.0f : 0.0f, side / 2 == 1 ? 1.0f : 0.0f, side / 2 == 2 ? 1.0f : 0.0f};
        BodyDef wall = floor_of(Vec3{6, 6, 6} - 5 * axis, (side % 2 ? 5.0f : -5.0f) * axis);
        wall.material = {0, 1};
        world.add(wall);
      }
      Generator random(seed);
      std::vector<BodyId> ids;
      for (int i = 0; i < 64; ++i) {
        const Vec3 cell{static_cast<float>(i % 4), static_cast<float>(i / 4 % 4), static_cast<float>(i / 16)};
        BodyDef def =
            dynamic(any_shape(kind < 4 ? kind : i, 0.4f), 2 * cell - Vec3{3, 3, 3}, uniform(random, 0.2f, 1.8f));
        def.pose.rotation = any_rotation(random);
        def.velocity = {3 * in_cube(random), 0, 3 * in_cube(random), 0};
        def.material = {0, 1};
        ids.push_back(world.add(def));
      }
      const auto energy = [&] {
        float sum = 0;
        for (const BodyId id : ids) sum += kinetic_energy(world, id);
        return sum;
      };
      const float first = energy();
      run(world, 600);
      EXPECT_LT(energy(), 1.02f * first) << kind << ", seed " << seed;
      EXPECT_GT(energy(), (kind == 0 ? 0.999f : 0.9f) * first) << kind << ", seed " << seed;
      for (const BodyId id : ids) {
        const Vec3 p = world.pose(id).position;
        EXPECT_LT(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 4.0f) << kind << ", seed " << seed;
      }
    }
}

}  // namespace fathom::symmetry_test
