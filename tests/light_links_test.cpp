// Mechanisms of light links on long arms and heavy bodies: they come to rest, and a body that spins too fast for a
// substep loses energy until its joints meet again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/world.hpp>
#include <vector>

#include "joint_worlds.hpp"
#include "scene/heap.hpp"
#include "scene/scene.hpp"
#include "world_fixture.hpp"

namespace fathom::test::light_links_test {
namespace {

class LightLinks : public OfJointWorlds {};
INSTANTIATE_TEST_SUITE_P(Simulators, LightLinks, testing::ValuesIn(joint_worlds), joint_world_name);

BodyDef on_floor(const Shape& shape, float mass, Vec3 at) {
  BodyDef def;
  def.shape = shape, def.mass = mass, def.pose.position = at;
  return def;
}

void add_floor(World& world) {
  BodyDef floor;
  floor.motion = MotionType::fixed, floor.shape = box({20, 20, 0.5f}), floor.pose.position = {0, 0, -0.5f};
  world.add(floor);
}

float widest_gap(const World& world) {
  float widest = 0;
  for (const JointId id : world.joints()) {
    const JointDef& joint = world.joint(id);
    widest = std::max(widest, distance(transform(world.pose(joint.a), joint.frame_a.position),
                                       transform(world.pose(joint.b), joint.frame_b.position)));
  }
  return widest;
}

/// A top of 100 kg welded to legs of `leg_mass` (kg), 5 s after being released `height` (m) above the floor.
void expect_table_stands(const JointWorlds& worlds, float leg_mass, float height) {
  SCOPED_TRACE(testing::Message() << "legs of " << leg_mass << " kg from " << height << " m");
  World world(worlds.quiet());
  add_floor(world);
  const BodyId top = world.add(on_floor(box({1, 0.6f, 0.05f}), 100, {0, 0, 0.85f + height}));
  for (const float x : {-0.9f, 0.9f})
    for (const float y : {-0.5f, 0.5f}) {
      const BodyId leg = world.add(on_floor(box({0.04f, 0.04f, 0.4f}), leg_mass, {x, y, 0.4f + height}));
      world.add_joint(fixed_joint(top, leg, {{x, y, -0.05f}, 0, {}}, {{0, 0, 0.4f}, 0, {}}));
    }
  for (int step = 0; step < 300; ++step) world.step();
  EXPECT_NEAR(world.pose(top).position.z, 0.85f, 1e-3f);
  for (const BodyId id : world.bodies()) EXPECT_LT(length(world.velocity(id).linear), 1e-3f);
  EXPECT_LT(widest_gap(world), 1e-5f);
}

// Its top touches nothing, so judged body by body it would swing, and end steps at 1.7 cm/s.
TEST_P(LightLinks, AWeldedTableComesToRest) { expect_table_stands(GetParam(), 10, 0.05f); }
// Contacts of light legs do not see what the legs carry. With the legs' own inertia the table would hop and fall over.
TEST_P(LightLinks, AWeldedTableStandsOnLightLegs) {
  for (const float leg_mass : {3.0f, 1.0f, 0.3f, 0.1f, 0.03f})
    for (const float height : {0.05f, 0.55f}) expect_table_stands(GetParam(), leg_mass, height);
}

// Bodies that touch something, whose links are splinters or much lighter than what hangs on them: badly held, they are
// thrown at up to 28 times the speed of their fall.
TEST_P(LightLinks, HeapsThrowNobody) {
  for (const std::uint64_t seed : {10, 39, 53, 79, 92, 267, 299}) {
    Heap heap = make_joint_heap(seed);
    heap.scene.world.simulator = GetParam().simulator;
    heap.scene.world.device = test_device();
    World world(heap.scene.world);
    SceneInstance instance(heap.scene, world);
    float top = heap.lowest;
    for (const BodyId id : instance.ids())
      if (world.motion(id) == MotionType::dynamic) top = std::max(top, world.pose(id).position.z);
    const float fall = std::sqrt(2 * 9.81f * (top - heap.lowest));
    float fastest = 0;
    for (int step = 0; step < 240; ++step) {
      instance.prepare_step();
      world.step();
      for (const BodyId id : instance.ids())
        if (world.motion(id) == MotionType::dynamic) fastest = std::max(fastest, length(world.velocity(id).linear));
    }
    EXPECT_LT(fastest, 3 * fall) << "seed " << seed;
  }
}

// A rod of 3 cm is joined to both at points half a metre off its axis. Sweeps alone would let it fly about endlessly.
TEST_P(LightLinks, ARodOnLongArmsBetweenHeavyBodiesComesToRest) {
  World world(GetParam().quiet());
  add_floor(world);
  const BodyId first = world.add(on_floor(box({0.3f, 0.3f, 0.3f}), 300, {-1, 0, 2}));
  const BodyId rod = world.add(on_floor(box({0.5f, 0.015f, 0.015f}), 0.7f, {0, 0.5f, 2.2f}));
  const BodyId last = world.add(on_floor(box({0.2f, 0.3f, 0.25f}), 20, {1, 0, 2.5f}));
  world.add_joint(ball_joint(first, rod, {0.5f, 0, 0.2f}, {-0.5f, -0.5f, 0}));
  world.add_joint(ball_joint(rod, last, {0.5f, -0.5f, 0.1f}, {-0.5f, 0, -0.2f}));
  for (int step = 0; step < 900; ++step) world.step();
  for (const BodyId id : world.bodies()) EXPECT_LT(length(world.velocity(id).linear), 0.05f);
  EXPECT_LT(widest_gap(world), 1e-3f);
}

// Rotation by some radians per substep, in free flight: linear rows cannot predict where its anchors go.
TEST_P(LightLinks, WhatSpinsTooFastLosesEnergyUntilItMeets) {
  for (const float spin : {300.0f, 1000.0f, 3000.0f}) {
    WorldDef def = GetParam().quiet();
    def.gravity = {};
    World world(def);
    const Vec3 spins[] = {{spin, 0, 0.5f * spin}, {0, -spin, spin}, {-spin, 0.3f * spin, 0}};
    std::vector<BodyId> ids;
    for (int i = 0; i < 3; ++i) {
      BodyDef needle =
          on_floor(box({0.01f, 0.0008f, 0.0005f}), i == 1 ? 1e-5f : 1e-3f, {0.03f * static_cast<float>(i), 0, 5});
      needle.velocity.angular = spins[i];
      needle.filter = {2, 0};
      ids.push_back(world.add(needle));
      if (i > 0) world.add_joint(ball_joint(ids[ids.size() - 2], ids.back(), {0.015f, 0.01f, 0}, {-0.015f, 0.01f, 0}));
    }
    const auto energy = [&] {
      float sum = 0;
      for (const BodyId id : ids) sum += kinetic_energy(world, id);
      return sum;
    };
    const float start = energy();
    for (int step = 0; step < 600; ++step) {
      world.step();
      EXPECT_LE(energy(), 1.01f * start) << "spin " << spin << ", step " << step;
    }
    EXPECT_TRUE(world.quarantined().empty());
    EXPECT_LT(widest_gap(world), 1e-3f) << "spin " << spin;
  }
}

// A crane's hook block: a light box between two ropes, with a load on the lower one, swings. The ropes' pull turns it
// faster than a substep can follow; it was thrown at the limit of speed, and the ropes ended 1,000 times as long.
TEST_P(LightLinks, AHookBlockSwingsQuietly) {
  for (const float size : {0.1f, 1.0f})
    for (const float load : {10.0f, 30.0f, 100.0f})
      for (int i = 0; i < 5; ++i) {
        World world(GetParam().quiet());
        const auto add = [&](Vec3 half, float mass, Vec3 at) {
          BodyDef def = on_floor(box(half), mass, at);
          def.filter.mask = 0;
          return world.add(def);
        };
        const float length_1 = (1 + 0.7f * static_cast<float>(i)) * size, about = 1.3f * static_cast<float>(i);
        const Vec3 hook = length_1 * normalize(Vec3{std::cos(about), std::sin(about), -0.6f});
        const float half = 0.1f * size;
        const BodyId top = add_anchor(world, {});
        const BodyId block = add({half, half, half}, 1, hook);
        const BodyId weight = add({half, 2 * half, half}, load, hook + Vec3{0.3f * size, 0, -0.45f * length_1});
        const JointId upper = world.add_joint(distance_joint(top, block, {}, {-half, 0, 0}, 0, length_1));
        const JointId lower =
            world.add_joint(distance_joint(block, weight, {half, 0, 0}, {0, 2 * half, 0}, 0, 0.5f * length_1));
        float fastest = 0;
        for (int step = 0; step < 300; ++step) {
          world.step();
          fastest = std::max(fastest, length(world.velocity(weight).linear));
        }
        EXPECT_LT(fastest, 2 * std::sqrt(9.81f * 1.6f * length_1)) << size << " m, " << load << " kg, " << i;
        EXPECT_LT(world.joint_positions(upper)[0], 1.01f * length_1) << size << " m, " << load << " kg, " << i;
        EXPECT_LT(world.joint_positions(lower)[0], 0.51f * length_1) << size << " m, " << load << " kg, " << i;
      }
}

// A load on four ropes that meet in a light hook: loops of bodies that collide with nothing. The hook was thrown at up
// to the limit of speed.
TEST_P(LightLinks, ASlingSwingsQuietly) {
  for (const float size : {0.05f, 0.15f, 0.5f})
    for (const float speed : {0.2f, 0.5f, 0.9f}) {  // in √(g s)
      World world(GetParam().quiet());
      const BodyId top = add_anchor(world, {});
      const auto add = [&](float half, float mass, float z) {
        BodyDef def = dynamic(box({half, half, half}), {0, 0, z}, mass);
        def.filter.mask = 0;
        return world.add(def);
      };
      const float half = 0.1f * size, unit = std::sqrt(9.81f * size);
      const BodyId hook = add(half, 0.01f, -2 * size), load = add(0.5f * size, 10, -3.5f * size);
      world.add_joint(distance_joint(top, hook, {}, {0, 0, half}, 0, 2 * size - half));
      for (int i = 0; i < 4; ++i) {
        const Vec3 corner{(i & 1 ? 0.5f : -0.5f) * size, (i & 2 ? 0.5f : -0.5f) * size, 0.5f * size};
        const Vec3 rope = corner + Vec3{0, 0, -1.5f * size + half};
        world.add_joint(distance_joint(hook, load, {0, 0, -half}, corner, 0, length(rope)));
      }
      world.set_velocity(load, {speed * unit, 0.3f * speed, 0}, {0, 0, speed});
      float fastest = 0;
      for (int step = 0; step < 300; ++step) {
        world.step();
        for (const BodyId id : {hook, load}) fastest = std::max(fastest, length(world.velocity(id).linear));
      }
      EXPECT_LT(fastest, 3 * unit) << size << " m, " << speed;
    }
}

// A tether of light links that a vehicle of 10 t pulls to and fro. Its links whip, and it opened by 21 m.
TEST_P(LightLinks, ATetherHoldsAHeavyVehicle) {
  World world(GetParam().quiet());
  const float reach = 0.095f;
  const auto add = [&](const Shape& shape, float mass, Vec3 at) {
    BodyDef def = on_floor(shape, mass, at);
    def.filter.mask = 0, def.gravity_scale = 0;
    return world.add(def);
  };
  BodyId last = add_anchor(world, {});
  for (int i = 0; i < 30; ++i) {
    const BodyId link = add(capsule(0.025f, reach), 0.45f, {0, 0, -reach * static_cast<float>(1 + 2 * i)});
    world.add_joint(ball_joint(last, link, {0, 0, i > 0 ? -reach : 0}, {0, 0, reach}));
    last = link;
  }
  const BodyId vehicle = add(box({1.4f, 1, 0.8f}), 1e4f, {0, 0, -60 * reach - 0.8f});
  world.add_joint(ball_joint(last, vehicle, {0, 0, -reach}, {0, 0, 0.8f}));
  float widest = 0;
  for (int step = 0; step < 1800; ++step) {
    const float time = static_cast<float>(step) / 60;
    world.apply_force(vehicle, 5e3f * Vec3{std::cos(0.1f * time), std::sin(0.13f * time), 0.3f});
    world.step();
    widest = std::max(widest, widest_gap(world));
  }
  EXPECT_LT(widest, 0.1f);
}

}  // namespace
}  // namespace fathom::test::light_links_test
