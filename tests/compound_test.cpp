// Compounds: their mass, how they rest, roll, hit and are hit, and queries of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <set>
#include <string>

#include "test_compounds.hpp"
#include "validate/exact_overlap.hpp"
#include "world_fixture.hpp"

namespace fathom::test::compound_test {
namespace {

WorldDef world_of(int threads = 1, bool sleep = true) {
  WorldDef def = sleepy_world(threads);
  def.sleep.enabled = sleep;
  return def;
}

TEST(Compound, HasTheMassOfItsChildren) {
  const MassProperties eight = mass_properties(cube_of_cubes(), 8), one = mass_properties(box({1, 1, 1}), 8);
  EXPECT_NEAR(eight.inertia.xx, one.inertia.xx, 1e-5f);
  EXPECT_NEAR(eight.inertia.zz, one.inertia.zz, 1e-5f);
  EXPECT_NEAR(eight.inertia.xy, 0, 1e-5f);
  EXPECT_NEAR(volume(cube_of_cubes()), 8, 1e-5f);
  // A heavy and a light ball: the centre of mass divides their distance in the ratio 1 to 4.
  ChildShape light = child(sphere(0.1f), {0, 0, 0}), heavy = child(sphere(0.1f), {1, 0, 0});
  heavy.density = 4;
  const Shape dumbbell = compound(std::vector{light, heavy});
  EXPECT_NEAR(dumbbell.compound->offset().x, 0.8f, 1e-6f);
  EXPECT_NEAR(dumbbell.compound->children()[0].pose.position.x, -0.8f, 1e-6f);
  const float ball = 0.4f * 0.1f * 0.1f;
  EXPECT_NEAR(dumbbell.compound->unit_inertia().xx, ball, 1e-6f);
  EXPECT_NEAR(dumbbell.compound->unit_inertia().zz, ball + 0.2f * 0.64f + 0.8f * 0.04f, 1e-5f);
  EXPECT_NEAR(dumbbell.compound->outer_radius(), 0.9f, 1e-6f);
  EXPECT_NEAR(dumbbell.compound->inner_radius(), 0.1f, 1e-6f);
}

std::string complaint(const std::vector<ChildShape>& children) {
  try {
    compound(children);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(Compound, RefusesWhatItCannotBe) {
  EXPECT_NE(complaint({}).find("no children"), std::string::npos);
  const ChildShape good = child(sphere(1), {});
  EXPECT_NE(complaint({good, child(table(), {})}).find("child 1: the shape is no convex one"), std::string::npos);
  EXPECT_NE(complaint({good, child(flat_mesh(2, 1), {})}).find("child 1"), std::string::npos);
  ChildShape bad = good;
  bad.density = 0;
  EXPECT_NE(complaint({bad}).find("child 0: the density is 0"), std::string::npos);
  bad = good;
  bad.pose.position.x = NAN;
  EXPECT_NE(complaint({good, good, bad}).find("child 2"), std::string::npos);
  bad = good;
  bad.pose.rotation = {0, 0, 0, 0};
  EXPECT_NE(complaint({bad}).find("child 0"), std::string::npos);
  EXPECT_NE(complaint({child(sphere(1e-4f), {}), child(sphere(1), {1e3f, 0, 0})}).find("thinnest"), std::string::npos);
}

TEST(Compound, FallsSlidesAndRestsAsTheSameSolid) {
  for (const float friction : {0.0f, 0.3f}) {
    World world(world_of());
    world.add(ground(friction));
    const BodyId one = world.add(dynamic(box({1, 1, 1}), {0, 0, 1.5f}, 8));
    const BodyId eight = world.add(dynamic(cube_of_cubes(), {0, 10, 1.5f}, 8));
    for (const BodyId id : {one, eight}) {
      world.set_velocity(id, {4, 0, 0}, {});
      world.set_material(id, {friction, 0});
    }
    run(world, 240);
    EXPECT_NEAR(world.pose(eight).position.x, world.pose(one).position.x, 0.02f) << friction;
    EXPECT_NEAR(world.pose(eight).position.z, 1.5f, 1e-3f);
    // The device solves contacts in a random order, so the four corners do not stop quite alike.
    EXPECT_NEAR(world.pose(eight).position.y, 10, world_of().simulator == SimulatorKind::device ? 5e-3f : 1e-3f);
    EXPECT_EQ(world.is_awake(eight), friction == 0);
  }
}

TEST(Compound, TablesStandAndCarry) {
  World world(world_of());
  world.add(ground());
  std::vector<BodyId> tables;
  for (int i = 0; i < 4; ++i) {
    BodyDef def = dynamic(table(), {0, 0, 0.5f + 1.0f * static_cast<float>(i)}, 20);
    def.pose.position += def.shape.compound->offset();
    tables.push_back(world.add(def));
  }
  const BodyId load = world.add(dynamic(box({0.3f, 0.3f, 0.3f}), {0.2f, 0, 4.85f}, 100));
  run(world, 1200);
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const Pose at = world.pose(tables[i]);
    EXPECT_NEAR(at.position.z, 0.5f + static_cast<float>(i) + world.shape(tables[i]).compound->offset().z, 5e-3f) << i;
    EXPECT_NEAR(at.position.x, 0, 0.015f);
  }
  EXPECT_NEAR(world.pose(load).position.z, 4.8f, 0.01f);
  EXPECT_FALSE(world.is_awake(load));
  // There is room under the top.
  const BodyId ball = world.add(dynamic(sphere(0.2f), {3, 0, 0.71f}));
  world.set_velocity(ball, {-3, 0, 0}, {0, -15, 0});
  run(world, 180);
  EXPECT_LT(world.pose(ball).position.x, -3);
}

TEST(Compound, DumbbellsRoll) {
  World world(world_of(1, false));
  BodyDef slope = ground(1);
  slope.pose.rotation = axis_angle({0, 1, 0}, 0.2f);
  world.add(slope);
  const Shape dumbbell = compound(std::vector{child(sphere(0.3f), {0, -1, 0}), child(sphere(0.3f), {0, 1, 0}),
                                              child(capsule(0.1f, 1), {}, axis_angle({1, 0, 0}, 1.5707963f))});
  const float start = 0.8f / std::cos(0.2f);
  const BodyId id = world.add(dynamic(dumbbell, {0, 0, start + 0.01f}, 5));
  world.set_material(id, {1, 0});
  run(world, 120);
  // Without sliding: the acceleration is g sin α / (1 + I/(m r²)).
  const float inertia = mass_properties(dumbbell, 1).inertia.yy;
  const float along = 0.5f * 9.81f * std::sin(0.2f) / (1 + inertia / 0.09f) * 4;
  const Vec3 moved = world.pose(id).position - Vec3{0, 0, start};
  EXPECT_NEAR(length(moved), along, 0.04f * along);
  EXPECT_NEAR(moved.y, 0, 0.01f);
}

TEST(Compound, ChildrenHaveTheirOwnMaterialsAndFilters) {
  ChildShape ice = child(box({0.5f, 0.5f, 0.1f}), {0, 0, -0.4f}), rubber = child(box({0.5f, 0.5f, 0.4f}), {0, 0, 0.1f});
  ice.material = Material{.friction = 0, .friction_rule = CombineRule::minimum};
  rubber.material = Material{.friction = 1, .friction_rule = CombineRule::maximum};
  const Shape sledge = compound(std::vector{ice, rubber});
  World world(world_of());
  world.add(ground());
  BodyDef def = dynamic(sledge, {0, 0, 1.0f});
  def.pose.position += sledge.compound->offset();
  const BodyId upright = world.add(def);
  def.pose = {{0, 5, 1.0f - sledge.compound->offset().z}, 0, axis_angle({1, 0, 0}, 3.14159265f)};
  const BodyId turned = world.add(def);
  for (const BodyId id : {upright, turned}) world.set_velocity(id, {2, 0, 0}, {});
  run(world, 120);
  EXPECT_NEAR(world.pose(upright).position.x, 4, 0.05f);
  EXPECT_LT(world.pose(turned).position.x, 0.5f);

  // A ghost on top of a block: a falling body passes through it and lies on the block.
  ChildShape block = child(box({1, 1, 0.5f}), {0, 0, 0.5f}), ghost = child(box({1, 1, 0.5f}), {0, 0, 1.5f});
  ghost.filter = Filter{.category = 2, .mask = 0};
  BodyDef base = fixed(compound(std::vector{block, ghost}), {20, 0, 0});
  base.pose.position += base.shape.compound->offset();
  world.add(base);
  const BodyId ball = world.add(dynamic(sphere(0.25f), {20, 0, 4}));
  run(world, 240);
  EXPECT_NEAR(world.pose(ball).position.z, 1.25f, 2e-3f);
}

TEST(Compound, ContactsNameChildrenAndEventsPairs) {
  World world(world_of(1, false));
  const BodyId floor = world.add(ground());
  BodyDef def = dynamic(table(), {0, 0, 0.6f}, 20);
  def.pose.position += def.shape.compound->offset();
  const BodyId id = world.add(def);
  int begun = 0, ended = 0;
  for (int i = 0; i < 120; ++i) {
    world.step();
    begun += static_cast<int>(world.contacts_begun().size());
    ended += static_cast<int>(world.contacts_ended().size());
  }
  EXPECT_EQ(begun, ended + 1);
  EXPECT_LE(begun, 3);
  std::set<std::uint32_t> legs;
  world.for_each_contact([&](const ContactInfo& contact) {
    EXPECT_EQ(contact.a, floor);
    EXPECT_EQ(contact.b, id);
    EXPECT_EQ(contact.child_a, 0u);
    legs.insert(contact.child_b);
  });
  EXPECT_EQ(legs, (std::set<std::uint32_t>{1, 2, 3, 4}));
  world.set_velocity(id, {0, 0, 5}, {});
  run(world, 10);
  EXPECT_EQ(world.contacts_begun().size(), 0u);
  std::size_t contacts = 0;
  world.for_each_contact([&](const ContactInfo&) { ++contacts; });
  EXPECT_EQ(contacts, 0u);
}

/// A box of six plates of 2 cm.
std::vector<ChildShape> plates() {
  std::vector<ChildShape> children;
  for (const float side : {-1.0f, 1.0f}) {
    children.push_back(child(box({1, 1, 0.01f}), {0, 0, side}));
    children.push_back(child(box({1, 0.01f, 1}), {0, side, 0}));
    children.push_back(child(box({0.01f, 1, 1}), {side, 0, 0}));
  }
  return children;
}

/// Fires shots inside a box and counts those that get out. They go from wall to wall within a step: nothing predicted
/// where to look.
int shots_out(int shots, float fastest, bool as_compound, bool turning) {
  Generator random(5);
  int out = 0;
  for (int shot = 0; shot < shots; ++shot) {
    WorldDef def = world_of(1, false);
    def.gravity = {};
    World world(def);
    BodyDef shell = fixed(compound(plates()));
    shell.pose.rotation = any_rotation(random);
    if (turning) shell.motion = MotionType::kinematic, shell.velocity.angular = 2 * on_sphere(random);
    BodyDef mark = shell;
    if (as_compound) {
      world.add(shell);
    } else {
      for (const ChildShape& plate : plates()) {
        BodyDef part = fixed(plate.shape);
        part.pose = shell.pose * plate.pose;
        world.add(part);
      }
    }
    mark.shape = sphere(0.01f);
    mark.filter = {0, 0};
    const BodyId frame = world.add(mark);
    BodyDef body = dynamic(shapes_of(0.05f)[random() % 4], 0.5f * in_cube(random));
    body.velocity.linear = uniform(random, 20, fastest) * on_sphere(random);
    body.velocity.angular = uniform(random, 0, 20) * on_sphere(random);
    body.material.restitution = shot % 2 == 0 ? 0.8f : 0.0f;
    const BodyId bullet = world.add(body);
    run(world, 60);
    out += max_component(abs(inverse_transform(world.pose(frame), world.pose(bullet).position))) > 1;
  }
  return out;
}

TEST(Compound, NothingFastGetsThroughItsPlates) {
  EXPECT_EQ(shots_out(200, 100, true, false), 0);
  EXPECT_LE(shots_out(100, 100, true, true), 2);
  EXPECT_LE(shots_out(200, 1000, true, false), 10);
}

TEST(Compound, NothingFastGetsThroughPlatesBesideEachOther) {
  EXPECT_EQ(shots_out(200, 100, false, false), 0);
  EXPECT_LE(shots_out(200, 1000, false, false), 10);
}

struct Heap {
  World world;
  std::vector<BodyId> ids;
  std::vector<Shape> shapes;
};

/// Random compounds and convex bodies in a bin of 4 × 4 m with walls.
Heap heap_of(std::uint32_t seed, const WorldDef& def, int bodies = 40) {
  Heap heap{World(def), {}, {}};
  heap.world.add(ground());
  for (const float side : {-2.5f, 2.5f}) {
    heap.world.add(fixed(box({0.5f, 3, 20}), {side, 0, 0}));
    heap.world.add(fixed(box({3, 0.5f, 20}), {0, side, 0}));
  }
  Generator random(seed);
  for (int i = 0; i < bodies; ++i) {
    const float size = uniform(random, 0.08f, 0.3f);
    const Shape shape = i % 4 == 3 ? shapes_of(size)[random() % 4] : random_compound(random, size);
    BodyDef body = dynamic(
        shape, {1.2f * uniform(random, -1, 1), 1.2f * uniform(random, -1, 1), 1.5f + 0.9f * static_cast<float>(i)});
    body.mass.reset();
    body.material.rolling_resistance = 0.05f;
    body.pose.rotation = any_rotation(random);
    heap.ids.push_back(heap.world.add(body));
    heap.shapes.push_back(shape);
  }
  return heap;
}

std::vector<validate::Solid> solids_of(const Shape& shape, const Pose& pose) {
  std::vector<validate::Solid> solids;
  if (!shape.compound) return {validate::Solid(shape, pose)};
  for (const ChildShape& c : shape.compound->children()) solids.emplace_back(c.shape, pose * c.pose);
  return solids;
}

double deepest_overlap(const Heap& heap) {
  double deepest = 0;
  std::vector<std::vector<validate::Solid>> solids;
  for (std::size_t i = 0; i < heap.ids.size(); ++i)
    solids.push_back(solids_of(heap.shapes[i], heap.world.pose(heap.ids[i])));
  for (std::size_t i = 0; i < solids.size(); ++i)
    for (std::size_t k = i + 1; k < solids.size(); ++k)
      for (const validate::Solid& a : solids[i])
        for (const validate::Solid& b : solids[k]) deepest = std::max(deepest, validate::overlap_depth(a, b));
  return deepest;
}

TEST(Compound, HeapsComeToRestInTheirBin) {
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    Heap heap = heap_of(seed, world_of());
    for (int step = 0; step < 1200; ++step) {
      heap.world.step();
      EXPECT_TRUE(heap.world.quarantined().empty()) << seed;
    }
    double energy = 0;
    for (const BodyId id : heap.ids) {
      const Vec3 at = heap.world.pose(id).position;
      EXPECT_TRUE(std::abs(at.x) < 2 && std::abs(at.y) < 2 && at.z > 0.5f) << seed;
      energy = std::max(energy, double(kinetic_energy(heap.world, id) / heap.world.mass(id)));
    }
    EXPECT_LT(energy, 0.01) << seed;
    EXPECT_LT(deepest_overlap(heap), 0.01) << seed;
  }
}

/// A U, an L, a table or an open crate of about this half size (m).
Shape hollow(int kind, float s) {
  if (kind == 0)
    return compound(std::vector{child(box({0.2f * s, 0.2f * s, s}), {-0.6f * s, 0, 0}),
                                child(box({0.6f * s, 0.2f * s, 0.2f * s}), {0, 0, -0.8f * s}),
                                child(box({0.2f * s, 0.2f * s, s}), {0.6f * s, 0, 0})});
  if (kind == 1)
    return compound(std::vector{child(box({0.15f * s, 0.15f * s, s}), {-0.6f * s, 0, 0}),
                                child(box({0.75f * s, 0.15f * s, 0.15f * s}), {0.15f * s, 0, -s})});
  std::vector<ChildShape> children{child(box({s, 0.6f * s, 0.1f * s}), {0, 0, 0.5f * s})};
  for (const float side : {-0.8f, 0.8f})
    if (kind == 2) {
      for (const float y : {-0.4f, 0.4f})
        children.push_back(child(box({0.1f * s, 0.1f * s, 0.45f * s}), {side * s, y * s, 0}));
    } else {
      children.push_back(child(box({0.05f * s, 0.6f * s, 0.5f * s}), {side * s, 0, 0}));
      children.push_back(child(box({s, 0.05f * s, 0.5f * s}), {0, 0.7f * side * s, 0}));
    }
  return compound(children);
}

// The walls' middles are far above what lies in their corners.
TEST(Compound, HollowOnesStayInTheirBin) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    Generator random(seed);
    WorldDef def = world_of();
    def.dt = seed % 2 ? 1 / 60.0f : 1 / 30.0f;
    World world(def);
    world.add(fixed(box({1.8f, 1.8f, 0.4f}), {0, 0, -0.4f}));
    for (const float side : {-1.4f, 1.4f}) {
      world.add(fixed(box({0.4f, 1.8f, 2}), {side, 0, 1}));
      world.add(fixed(box({1.8f, 0.4f, 2}), {0, side, 1}));
    }
    std::vector<BodyId> ids;
    for (int i = 0; i < 20; ++i) {
      const Shape shape = hollow(i % 4, uniform(random, 0.15f, 0.3f));
      const float radius = shape.compound->outer_radius(), free = 1 - radius;
      BodyDef body = dynamic(
          shape, {uniform(random, -free, free), uniform(random, -free, free), radius + uniform(random, 0, 2.5f)});
      body.mass = 1000 * shape.compound->volume() * (i % 3 ? 1 : std::pow(10.0f, uniform(random, -1, 1.3f)));
      body.pose.rotation = any_rotation(random);
      body.velocity.linear = uniform(random, 0, 4) * on_sphere(random);
      ids.push_back(world.add(body));
    }
    const auto is_outside = [&](BodyId id) {
      const Vec3 at = world.pose(id).position;
      return at.z < -0.05f || (at.z < 3 && std::max(std::abs(at.x), std::abs(at.y)) > 1.05f);
    };
    int outside = 0;
    for (int step = 0; step < 240; ++step) {
      world.step();
      outside = std::max(outside, static_cast<int>(std::ranges::count_if(ids, is_outside)));
    }
    EXPECT_EQ(outside, 0) << "seed " << seed;
  }
}

TEST(Compound, HeapsAreTheSameOnAnyThreads) {
  std::set<std::uint64_t> hashes;
  for (const int threads : {1, 2, 4}) {
    Heap heap = heap_of(7, world_of(threads));
    run(heap.world, 400);
    hashes.insert(heap.world.state_hash());
  }
  EXPECT_EQ(hashes.size(), 1u);
}

TEST(Compound, HeapsGoOnFromSnapshots) {
  Heap heap = heap_of(8, world_of());
  run(heap.world, 150);
  const std::vector<std::byte> bytes = saved(heap.world);
  World copy(world_of());
  copy.restore(bytes);
  if (world_of().simulator != SimulatorKind::device) {  // there hulls get new numbers
    EXPECT_EQ(saved(copy), bytes);
  }
  for (int i = 0; i < 200; ++i) {
    heap.world.step();
    copy.step();
    ASSERT_EQ(heap.world.state_hash(), copy.state_hash()) << i;
  }
  // Any corruption is either detected or harmless.
  Generator random(1);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> altered = bytes;
    altered[random() % altered.size()] ^= static_cast<std::byte>(1 + random() % 255);
    World other(world_of());
    EXPECT_THROW(other.restore(altered), Error);
  }
}

TEST(Compound, EverySolverAndPartitionHoldsThem) {
  struct Variant {
    SimulatorKind simulator;
    Partition partition;
    Solver method;
    BroadPhase broad_phase;
  };
  for (const Variant& v : {Variant{SimulatorKind::hybrid, Partition::colours, Solver::soft, BroadPhase::tree},
                           Variant{SimulatorKind::native, Partition::cells, Solver::soft, BroadPhase::tree},
                           Variant{SimulatorKind::native, Partition::colours, Solver::impulse, BroadPhase::tree},
                           Variant{SimulatorKind::native, Partition::colours, Solver::soft, BroadPhase::sweep},
                           Variant{SimulatorKind::device, Partition::colours, Solver::soft, BroadPhase::tree},
                           Variant{SimulatorKind::device, Partition::cells, Solver::soft, BroadPhase::tree},
                           Variant{SimulatorKind::device, Partition::colours, Solver::impulse, BroadPhase::tree},
                           Variant{SimulatorKind::device, Partition::colours, Solver::soft, BroadPhase::sweep}}) {
    WorldDef def = world_of(2);
    def.simulator = v.simulator;
    def.device = "host";
    def.partition = v.partition;
    def.solver.method = v.method;
    def.broad_phase = v.broad_phase;
    Heap heap = heap_of(9, def, 24);
    run(heap.world, 600);
    for (const BodyId id : heap.ids) {
      const Vec3 at = heap.world.pose(id).position;
      EXPECT_TRUE(std::abs(at.x) < 2 && std::abs(at.y) < 2 && at.z > 0.5f);
    }
    EXPECT_LT(deepest_overlap(heap), 0.03);
  }
}

TEST(Compound, LiesOnSurfaces) {
  for (const bool field : {false, true}) {
    World world(world_of());
    world.add(field ? fixed(wavy_field(61), {-5, -5, 0}) : fixed(wavy_mesh(60)));
    Generator random(3);
    std::vector<BodyId> ids;
    for (int i = 0; i < 30; ++i) {
      BodyDef body =
          dynamic(random_compound(random, uniform(random, 0.15f, 0.35f)),
                  {2 * uniform(random, -1, 1), 2 * uniform(random, -1, 1), 2 + 0.7f * static_cast<float>(i)});
      body.pose.rotation = any_rotation(random);
      ids.push_back(world.add(body));
    }
    run(world, 1200);
    for (const BodyId id : ids) {
      const Vec3 at = world.pose(id).position;
      EXPECT_GT(at.z, wavy_bowl(at.x, at.y) - 0.05f);
      EXPECT_LT(length(at), 5);
      EXPECT_LT(length(world.velocity(id).linear), 0.5f);
    }
  }
}

TEST(Compound, IsFoundByQueriesAsItsChildrenAre) {
  Generator random(11);
  for (int round = 0; round < 60; ++round) {
    const Shape shape = random_compound(random, 0.5f);
    World whole(world_of()), parts(world_of());
    const Pose pose = any_pose(random, 3);
    BodyDef body = fixed(shape);
    body.pose = pose;
    const BodyId id = whole.add(body);
    std::vector<BodyId> ids;
    for (const ChildShape& c : shape.compound->children()) {
      BodyDef part = fixed(c.shape);
      part.pose = pose * c.pose;
      ids.push_back(parts.add(part));
    }
    const Shape probe = shapes_of(0.3f)[random() % 4];
    for (int i = 0; i < 40; ++i) {
      const Vec3 from = pose.position + 3 * in_cube(random);
      const Vec3 way = pose.position + in_cube(random) - from;
      const Quat turn = any_rotation(random);
      const auto a = whole.cast_ray(from, way), b = parts.cast_ray(from, way);
      ASSERT_EQ(a.has_value(), b.has_value());
      if (a) {
        EXPECT_NEAR(a->fraction, b->fraction, 1e-6f);
        EXPECT_EQ(a->body, id);
        EXPECT_EQ(ids[a->child], b->body);
      }
      const auto c = whole.cast_shape(probe, {from, 0, turn}, way), d = parts.cast_shape(probe, {from, 0, turn}, way);
      ASSERT_EQ(c.has_value(), d.has_value());
      if (c) {
        EXPECT_NEAR(c->fraction, d->fraction, 1e-6f);
      }
      const Pose near{pose.position + in_cube(random), 0, turn};
      EXPECT_EQ(whole.overlap_shape(probe, near).empty(), parts.overlap_shape(probe, near).empty());
      float nearest = 1e9f;
      for (const BodyId part : ids) nearest = std::min(nearest, parts.closest_points(probe, near, part).distance);
      EXPECT_NEAR(whole.closest_points(probe, near, id).distance, nearest, 1e-6f);
    }
    const Aabb box = whole.bounds(id);
    Aabb sum = parts.bounds(ids[0]);
    for (const BodyId part : ids) sum = merged(sum, parts.bounds(part));
    EXPECT_NEAR(length(box.lower - sum.lower) + length(box.upper - sum.upper), 0, 1e-5f);
  }
}

TEST(Compound, CostsWhatItsTouchedPartsCost) {
  // 1,000 children in a ring of 60 m; a ball rolls on a few of them.
  std::vector<ChildShape> children;
  for (int i = 0; i < 1000; ++i) {
    const float angle = 6.2831853f * static_cast<float>(i) / 1000;
    children.push_back(child(box({0.2f, 0.5f, 0.1f}), {10 * std::cos(angle), 10 * std::sin(angle), 0},
                             axis_angle({0, 0, 1}, angle + 1.5707963f)));
  }
  World world(world_of(1, false));
  world.add(fixed(compound(children)));
  const BodyId ball = world.add(dynamic(sphere(0.2f), {10, 0, 0.31f}));
  run(world, 120);
  EXPECT_NEAR(world.pose(ball).position.z, 0.3f, 2e-3f);
  // The device counts every child whose box is near; there, as well, they are few of a thousand.
  EXPECT_LE(world.profile().counts.pairs, world_of().simulator == SimulatorKind::device ? 16u : 12u);
}

}  // namespace
}  // namespace fathom::test::compound_test
