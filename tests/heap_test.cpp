// Random heaps: the seed determines everything, all kinds occur, and the properties that must hold hold in each of
// sixty, and in ten on surfaces.
#include "scene/heap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <string>

#include "scene/heap_bodies.hpp"
#include "scene/quality.hpp"
#include "validate/exact_overlap.hpp"
#include "validate/exact_surface.hpp"
#include "validate/heap_checks.hpp"

namespace fathom::validate::heap_test {
namespace {

std::uint64_t bits_of(const Scene& scene) {
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  const auto mix = [&](float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x100000001b3u;
  };
  const auto mix_vector = [&](Vec3 v) { mix(v.x), mix(v.y), mix(v.z); };
  mix(scene.world.dt);
  for (const BodyDef& body : scene.bodies) {
    mix_vector(body.pose.position), mix_vector(body.pose.rotation.vector());
    mix_vector(body.velocity.linear), mix_vector(body.shape.half_extents);
    mix(body.shape.radius), mix(body.density), mix(body.material.friction), mix(body.material.restitution);
  }
  return hash;
}

TEST(Heap, TheSeedDecidesEverything) {
  for (const std::uint64_t seed : {0u, 1u, 17u})
    EXPECT_EQ(bits_of(make_heap(seed).scene), bits_of(make_heap(seed).scene));
  EXPECT_NE(bits_of(make_heap(1).scene), bits_of(make_heap(2).scene));
}

double extent(const Shape& shape) {
  if (shape.type == ShapeType::box) return 2 * static_cast<double>(max_component(shape.half_extents));
  return 2 * outer_radius(shape);
}

TEST(Heap, AreOfEveryKind) {
  std::set<HeapKind> kinds;
  std::set<ShapeType> shapes;
  std::set<int> substeps;
  std::set<long> rates;
  double smallest = 1e9, largest = 0, max_slender = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    const Heap heap = make_heap(seed);
    kinds.insert(heap.kind);
    substeps.insert(heap.scene.world.solver.substeps);
    rates.insert(std::lround(1 / static_cast<double>(heap.scene.world.dt)));
    EXPECT_GE(dynamic_body_count(heap.scene), 30u);
    EXPECT_LE(dynamic_body_count(heap.scene), 300u);
    for (const BodyDef& body : heap.scene.bodies) {
      if (body.motion != MotionType::dynamic) continue;
      shapes.insert(body.shape.type);
      smallest = std::min(smallest, extent(body.shape));
      largest = std::max(largest, extent(body.shape));
      if (body.shape.type == ShapeType::box)
        max_slender =
            std::max(max_slender, extent(body.shape) / 2 / static_cast<double>(min_component(body.shape.half_extents)));
    }
  }
  EXPECT_EQ(kinds.size(), 5u);
  EXPECT_EQ(shapes.size(), 4u);
  EXPECT_EQ(substeps, (std::set<int>{2, 3, 4, 6, 8}));
  EXPECT_EQ(rates, (std::set<long>{30, 60, 120, 240}));
  EXPECT_GE(smallest, 0.003);  // hulls are within their ellipsoid, and may be shorter than it
  EXPECT_LT(smallest, 0.01);
  EXPECT_GT(largest, 30);
  EXPECT_LT(largest, 60);  // twice the farthest corner
  EXPECT_GT(max_slender, 90);
}

TEST(Heap, BeginsApartAndInTheBin) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Heap heap = make_heap(seed);
    std::vector<Solid> solids;
    for (const BodyDef& body : heap.scene.bodies) solids.emplace_back(body.shape, body.pose);
    for (std::size_t i = 0; i < solids.size(); ++i) {
      if (heap.scene.bodies[i].motion != MotionType::dynamic) continue;
      EXPECT_LT(solids[i].upper.z, static_cast<double>(heap.rim)) << seed;
      for (std::size_t k = 0; k < i; ++k) EXPECT_EQ(overlap_depth(solids[k], solids[i]), 0) << seed << " " << i;
    }
  }
}

TEST(Heap, BodiesOfAStreamLeaveAndComeBack) {
  std::uint64_t seed = 0;
  while (make_heap(seed).kind != HeapKind::stream) ++seed;
  Heap heap = make_heap(seed);
  heap.scene.world.threads = 1;
  const Stream stream = *heap.scene.stream;
  World world(heap.scene.world);
  SceneInstance instance(heap.scene, world);
  const BodyId before = instance.ids()[stream.first];
  for (int i = 0; i < stream.interval; ++i) instance.prepare_step(), world.step();
  EXPECT_TRUE(world.contains(before));
  EXPECT_LT(world.pose(before).position.z, heap.scene.bodies[stream.first].pose.position.z);
  instance.prepare_step();
  EXPECT_FALSE(world.contains(before));
  EXPECT_TRUE(world.pose(instance.ids()[stream.first]).position == stream.sources[0].position);
  EXPECT_EQ(world.body_count(), heap.scene.bodies.size());
  EXPECT_FALSE(stream.due(0).has_value());
  const auto turns = static_cast<std::uint64_t>(stream.interval);
  EXPECT_EQ(stream.due(turns * stream.sources.size()), stream.first + stream.sources.size() - 1);
  EXPECT_EQ(stream.due(turns * (stream.sources.size() + 1)), stream.first);
}

/// A few seeds one after the other, so that several instances of the test run at the same time.
class Heaps : public testing::TestWithParam<std::uint64_t> {};

void expect_sound(const Heap& heap, std::uint64_t seed, const Setup& setup) {
  const Record record = judge_heap(heap, setup);
  for (const Check& check : record.checks)
    EXPECT_TRUE(check.passed() || !check.known.empty())
        << "seed " << seed << ": " << check.name << ": " << check.value << " " << check.unit << ", must be at most "
        << check.limit << "; " << view_command(heap.scene.name, seed, setup);
}

void expect_sound(std::uint64_t seed, const Setup& setup) { expect_sound(make_heap(seed), seed, setup); }

constexpr std::uint64_t native_seeds = 5, device_seeds = 3;

TEST_P(Heaps, AreSound) {
  for (std::uint64_t seed = GetParam(); seed < GetParam() + native_seeds; ++seed) expect_sound(seed, {.threads = 1});
}
INSTANTIATE_TEST_SUITE_P(Native, Heaps, testing::Range(std::uint64_t{1}, std::uint64_t{61}, native_seeds));

// A speck of 29 g between drums of up to 16 t: a patch whose points differ by hardly more than rounding.
TEST(Heap, SharesOutLoadsOfPatchesThatAreNearlyPoints) { expect_sound(3079, {.threads = 1}); }

// Fast bodies in the ground's surface with a load on them: held back from going deeper, but not from getting out.
TEST(Heap, LetsNobodyStayWhereItIsAgainstItsVelocity) {
  for (const std::uint64_t seed : {13, 119, 136}) expect_sound(seed, {.threads = 1});
}

// Hits throw bodies off their line, into walls that they are no pairs with.
TEST(Heap, HoldsBackOnTheDeviceWhatAHitThrowsAside) {
  for (const std::uint64_t seed : {352, 477})
    expect_sound(seed, {.simulator = SimulatorKind::device, .device = "host", .threads = 1});
}

// A body that slept under a load keeps the inertia that the load added: otherwise heaps throw bodies at up to 100 m/s
// when they wake.
TEST(Heap, WakesWithoutAJolt) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
    int asleep = 0;
    for (const std::uint64_t seed : {4, 10, 24, 43, 49, 72, 80, 102, 155, 161, 190}) {
      const Heap heap = make_heap(seed);
      WorldDef def = heap.scene.world;
      def.simulator = simulator, def.device = "host", def.threads = 1;
      World world(def);
      SceneInstance instance(heap.scene, world);
      const auto is_awake = [&](BodyId id) { return world.motion(id) == MotionType::dynamic && world.is_awake(id); };
      const int most = static_cast<int>(30 * heap.time_unit / static_cast<double>(def.dt));
      for (int i = 1; i <= most && (i % 64 > 0 || std::ranges::any_of(instance.ids(), is_awake)); ++i) world.step();
      if (std::ranges::any_of(instance.ids(), is_awake)) continue;
      ++asleep;
      for (int i = 0; i < 64; ++i) world.step();
      for (const BodyId id : instance.ids())
        if (world.motion(id) == MotionType::dynamic) world.set_velocity(id, {}, {});
      // What stands on an edge may fall over, as fast as its weight makes it.
      const float by_weight = length(def.gravity) * def.dt;
      float jolt = 0;
      std::vector<float> speeds(instance.ids().size(), 0.0f);
      for (int i = 0; i < 30; ++i) {
        world.step();
        for (std::size_t k = 0; k < speeds.size(); ++k) {
          const float speed = length(world.velocity(instance.ids()[k]).linear);
          jolt = std::max(jolt, speed - speeds[k] - by_weight);
          speeds[k] = speed;
        }
      }
      EXPECT_LT(jolt, 0.3f) << "seed " << seed << (simulator == SimulatorKind::native ? "" : " on the device");
    }
    EXPECT_GE(asleep, 8);
  }
}

// On surfaces -----------------------------------------------------------------------------------------------------

TEST(SurfaceHeap, TheSeedDecidesEverything) {
  std::set<ShapeType> surfaces;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const Heap heap = make_surface_heap(seed), again = make_surface_heap(seed);
    EXPECT_EQ(bits_of(heap.scene), bits_of(again.scene));
    const Shape &shape = heap.scene.bodies.back().shape, &same = again.scene.bodies.back().shape;
    ASSERT_EQ(shape.type, same.type);
    surfaces.insert(shape.type);
    ASSERT_EQ(shape.surface->triangle_count(), same.surface->triangle_count());
    for (std::uint32_t i = 0; i < shape.surface->triangle_count(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_TRUE(shape.surface->triangle(i).corners[k] == same.surface->triangle(i).corners[k]) << seed << " " << i;
  }
  EXPECT_EQ(surfaces, (std::set<ShapeType>{ShapeType::mesh, ShapeType::height_field}));
}

/// Only the floor is replaced by the ground.
TEST(SurfaceHeap, HasTheBodiesOfTheHeapOfItsSeed) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Heap plain = make_heap(seed), heap = make_surface_heap(seed);
    ASSERT_TRUE(heap.surface.has_value());
    EXPECT_EQ(heap.scene.name, "surface_heap");
    ASSERT_EQ(heap.scene.bodies.size(), plain.scene.bodies.size() + 1);
    EXPECT_EQ(heap.surface->body, plain.scene.bodies.size());
    const BodyDef& ground = heap.scene.bodies.back();
    EXPECT_TRUE(ground.shape.is_surface());
    EXPECT_NE(ground.motion, MotionType::dynamic);
    EXPECT_NE(heap.kind, HeapKind::sliding_floor);
    heap.scene.bodies.pop_back();
    heap.scene.bodies.erase(heap.scene.bodies.begin());
    plain.scene.bodies.erase(plain.scene.bodies.begin());
    EXPECT_EQ(bits_of(heap.scene), bits_of(plain.scene)) << seed;
  }
}

TEST(SurfaceHeap, BeginsAboveTheGround) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Heap heap = make_surface_heap(seed);
    const BodyDef& ground = heap.scene.bodies.back();
    std::vector<Solid> solids;
    for (const BodyDef& body : heap.scene.bodies)
      if (body.motion == MotionType::dynamic) solids.emplace_back(body.shape, body.pose);
    for (const double depth : depths_in(*ground.shape.surface, ground.pose, solids)) EXPECT_EQ(depth, 0) << seed;
    const Ground heights(*ground.shape.surface);
    for (const BodyDef& body : heap.scene.bodies) {
      if (body.motion != MotionType::dynamic) continue;
      // A body that starts high above a slope is beside it in the slope's frame.
      EXPECT_GT(heights.height_over(ground.pose, to_double(body.pose.position)).value_or(1), 0) << seed;
    }
  }
}

TEST(Heap, JointsHoldNeighboursTogether) {
  std::set<JointType> types;
  std::size_t joints = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Heap plain = make_heap(seed), heap = make_joint_heap(seed);
    const Scene& scene = heap.scene;
    EXPECT_EQ(bits_of(scene), bits_of(plain.scene)) << seed;
    EXPECT_FALSE(scene.stream);
    std::vector<Pose> poses;
    for (const BodyDef& body : scene.bodies) poses.push_back(body.pose);
    for (const SceneJoint& joint : scene.joints) {
      types.insert(joint.def.type);
      EXPECT_EQ(scene.bodies[joint.a].motion, MotionType::dynamic);
      EXPECT_EQ(scene.bodies[joint.b].motion, MotionType::dynamic);
      const double radii = outer_radius(scene.bodies[joint.a].shape) + outer_radius(scene.bodies[joint.b].shape);
      const Vec3 a = poses[joint.a].position, b = poses[joint.b].position;
      EXPECT_LE(static_cast<double>(distance(a, b)), 1.4 * radii);
      EXPECT_LE(static_cast<double>(joint_gap(scene, joint, poses)), 1e-4 * radii) << seed;
      for (const JointAxis& axis : joint.def.axes) EXPECT_TRUE(!axis.drive.is_on());
    }
    joints += scene.joints.size();
  }
  EXPECT_EQ(types, (std::set{JointType::ball, JointType::generic, JointType::distance}));
  EXPECT_GE(joints, 1000u);
}

class HeapsWithJoints : public testing::TestWithParam<std::uint64_t> {};

// Checks known to fail in some (docs/joints.md) are skipped; hashes must be equal.
TEST_P(HeapsWithJoints, AreSound) { expect_sound(make_joint_heap(GetParam()), GetParam(), {.threads = 1}); }
INSTANTIATE_TEST_SUITE_P(Native, HeapsWithJoints, testing::Values(2, 3, 4, 5));

class HeapsOnSurfaces : public testing::TestWithParam<std::uint64_t> {};

// Ten that take a second or two each; docs/validation.md counts the others.
TEST_P(HeapsOnSurfaces, AreSound) { expect_sound(make_surface_heap(GetParam()), GetParam(), {.threads = 1}); }
INSTANTIATE_TEST_SUITE_P(Native, HeapsOnSurfaces, testing::Values(2, 3, 4, 5, 7, 8, 9, 11, 12, 14));

// Thin bodies that are pressed behind a triangle, run an end into a slope or are held back over a turning floor.
TEST(SurfaceHeap, LosesNobodyThroughTheGround) {
  for (const std::uint64_t seed : {1, 47, 56, 96}) expect_sound(make_surface_heap(seed), seed, {.threads = 1});
}

TEST(SurfaceHeap, AreSoundOnTheDevice) {
  for (const std::uint64_t seed : {2, 5, 8, 11})
    expect_sound(make_surface_heap(seed), seed, {SimulatorKind::device, "host", 1});
}

double outside(const Heap& heap, const Setup& setup) {
  const Record record = judge_heap(heap, setup);
  const auto check = std::ranges::find(record.checks, "bodies outside the bin or under the floor", &Check::name);
  return check != record.checks.end() ? check->value : -1;
}

// Thin bodies that joints pull through walls and floors.
TEST(JointHeap, LosesNobodyThroughWhatIsFixed) {
  for (const std::uint64_t seed : {162, 250, 419, 468})
    EXPECT_EQ(outside(make_joint_heap(seed), {.threads = 1}), 0) << seed;
  for (const std::uint64_t seed : {264, 273})
    EXPECT_EQ(outside(make_joint_heap(seed), {SimulatorKind::device, "host", 1}), 0) << seed;
}

class HeapsOnTheDevice : public testing::TestWithParam<std::uint64_t> {};

TEST_P(HeapsOnTheDevice, AreSound) {
  for (std::uint64_t seed = GetParam(); seed < GetParam() + device_seeds; ++seed)
    expect_sound(seed, {SimulatorKind::device, "host", 1});
}
INSTANTIATE_TEST_SUITE_P(Host, HeapsOnTheDevice, testing::Range(std::uint64_t{1}, std::uint64_t{13}, device_seeds));

}  // namespace
}  // namespace fathom::validate::heap_test
