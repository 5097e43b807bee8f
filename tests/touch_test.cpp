// Touches and hits as reported to the application, on every simulator: against shapes' exact distances, falls in closed
// form, and each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dynamics/look_ahead.hpp"
#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::touch_test {
namespace {

using namespace test;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// Every way of solving contacts.
std::vector<std::pair<std::string, WorldDef>> all_kinds() {
  WorldDef plain;
  plain.threads = 1;
  plain.sleep.enabled = false;
  WorldDef cells = plain, impulse = plain, hybrid = plain, device = plain, cells_on_device = plain;
  cells.partition = Partition::cells;
  impulse.solver.method = Solver::impulse;
  hybrid.simulator = SimulatorKind::hybrid;
  device.simulator = cells_on_device.simulator = SimulatorKind::device;
  hybrid.device = device.device = cells_on_device.device = test_device();
  cells_on_device.partition = Partition::cells;
  return {{"native", plain},  {"cells", cells},   {"impulse", impulse},
          {"hybrid", hybrid}, {"device", device}, {"cells on a device", cells_on_device}};
}

/// The rule of include/fathom/contact.hpp.
float touch_distance(float smaller_radius) {
  float distance = 0.001f;
  for (int i = 0; i < 15 && distance > 0.01f * smaller_radius; ++i) distance *= 0.5f;
  return distance;
}

/// 1 cm to 10 m.
float any_size(Generator& random) { return std::pow(10.0f, uniform(random, -2, 1)); }

/// Gap of a box above the ground's surface at z = 0.5.
float gap_over_ground(const Pose& pose, Vec3 half) {
  float lowest = 1e30f;
  for (int i = 0; i < 8; ++i)
    lowest = std::min(
        lowest, transform(pose, Vec3{i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z}).z);
  return lowest - 0.5f;
}

/// The pairs that touch according to the events so far.
struct Touching {
  std::set<Pair> pairs;

  void follow(const World& world) {
    for (const ContactEvent& e : world.contacts_ended()) EXPECT_EQ(pairs.erase({e.a.index, e.b.index}), 1u);
    for (const ContactEvent& e : world.contacts_begun())
      EXPECT_TRUE(pairs.insert({e.a.index, e.b.index}).second) << e.a.index << ' ' << e.b.index;
  }
};

std::set<Pair> listed(const World& world) {
  std::set<Pair> pairs;
  world.for_each_contact([&](const ContactInfo& c) { pairs.insert({c.a.index, c.b.index}); });
  return pairs;
}

TEST(Touch, ABouncingBallHitsOnceABounce) {
  Generator random(1);
  for (int seed = 0; seed < 20; ++seed) {
    const float radius = any_size(random), height = radius * uniform(random, 2, 20) + 0.5f;
    const float e = uniform(random, 0.5f, 0.9f);
    for (const auto& [name, def] : all_kinds()) {
      SCOPED_TRACE(name + ", radius " + std::to_string(radius) + ", height " + std::to_string(height));
      World world(def);
      world.add(ground(0.5f, e));
      BodyDef ball = dynamic(sphere(radius), {0, 0, 0.5f + radius + height});
      ball.material.restitution = e;
      world.add(ball);
      float expected = std::sqrt(2 * 9.81f * height);
      int bounces = 0;
      std::size_t begun = 0, ended = 0;
      for (int i = 0; i < 600 && expected > 2; ++i) {
        world.step();
        begun += world.contacts_begun().size(), ended += world.contacts_ended().size();
        EXPECT_LE(begun - ended, 1u);
        ASSERT_LE(world.hits().size(), 1u);
        if (world.hits().empty()) continue;
        const HitEvent& hit = world.hits()[0];
        EXPECT_NEAR(hit.approach_speed, expected, 0.17f + 0.02f * expected) << "bounce " << bounces;
        EXPECT_GT(hit.normal.z, 0.999f);
        EXPECT_NEAR(hit.point.z, 0.5f, 0.004f + 0.01f * radius);
        EXPECT_NEAR(hit.point.x, 0, 1e-3f);
        expected *= e;
        ++bounces;
        EXPECT_EQ(begun, static_cast<std::size_t>(bounces));
      }
      EXPECT_GT(bounces, 0);
      EXPECT_LE(begun - ended, 1u);
    }
  }
}

/// Its foot touches from the start.
TEST(Touch, AFallingPostHitsWithItsHead) {
  Generator random(2);
  for (int seed = 0; seed < 20; ++seed) {
    const float length_of_it = std::pow(10.0f, uniform(random, -0.3f, 1)), half = 0.5f * length_of_it;
    const float thickness = half * uniform(random, 0.05f, 0.15f), lean = uniform(random, 0.25f, 0.4f);
    const float turn = uniform(random, -3, 3);
    for (const auto& [name, def] : all_kinds()) {
      SCOPED_TRACE(name + ", length " + std::to_string(length_of_it) + ", lean " + std::to_string(lean));
      World world(def);
      world.add(ground(1.0f));
      const Vec3 size{thickness, thickness, half};
      BodyDef post = dynamic(box(size), {});
      post.material.friction = 1;
      post.pose.rotation = axis_angle({0, 0, 1}, turn) * axis_angle({0, 1, 0}, lean);
      post.pose.position.z = 0.5f - gap_over_ground({{0, 0, 0.5f}, 0, post.pose.rotation}, size);
      const BodyId id = world.add(post);
      float expected = 0;
      int hits = 0;
      for (int i = 0; i < 400 && hits == 0; ++i) {
        const Pose pose = world.pose(id);
        const Velocity v = world.velocity(id);
        expected = 0;
        for (int k = 0; k < 8; ++k) {
          const Vec3 arm =
              rotate(pose.rotation, {k & 1 ? size.x : -size.x, k & 2 ? size.y : -size.y, k & 4 ? size.z : -size.z});
          expected = std::max(expected, -(v.linear + cross(v.angular, arm)).z);
        }
        world.step();
        for (const HitEvent& hit : world.hits()) {
          // The foot may slip and land again.
          if (!(inverse_transform(world.pose(id), hit.point).z > 0.5f * half)) continue;
          ++hits;
          EXPECT_NEAR(hit.approach_speed, expected, 0.1f * expected);
          // As a rod falling about its end; less by its thickness, and if the foot slips.
          EXPECT_NEAR(hit.approach_speed, std::sqrt(3 * 9.81f * length_of_it * std::cos(lean)),
                      0.2f * hit.approach_speed);
          EXPECT_NEAR(hit.point.z, 0.5f, 0.02f * length_of_it);
          EXPECT_GT(hit.normal.z, 0.99f);
        }
      }
      EXPECT_EQ(hits, 1);
    }
  }
}

/// A box that lands at any attitude touches when its lowest corner does, not before.
TEST(Touch, BeginsWhereShapesMeet) {
  Generator random(3);
  for (int seed = 0; seed < 40; ++seed) {
    const float size = any_size(random);
    const Vec3 half = size * Vec3{uniform(random, 0.2f, 1), uniform(random, 0.2f, 1), uniform(random, 0.2f, 1)};
    BodyDef def_of_box = dynamic(box(half), {uniform(random, -3, 3), uniform(random, -3, 3), 0.5f + 4 * size});
    def_of_box.pose.rotation = any_rotation(random);
    def_of_box.velocity.linear = {uniform(random, -1, 1), 0, uniform(random, -3, 0)};
    def_of_box.velocity.angular = uniform(random, 0, 3) * on_sphere(random);
    const float near = touch_distance(length(half));
    for (const auto& [name, def] : all_kinds()) {
      SCOPED_TRACE(name + ", size " + std::to_string(size) + ", seed " + std::to_string(seed));
      World world(def);
      world.add(ground());
      const BodyId id = world.add(def_of_box);
      float before = 1, speed = 0, turning = 0;
      int i = 0;
      for (; i < 600 && world.contacts_begun().empty(); ++i) {
        before = gap_over_ground(world.pose(id), half);
        turning = length(world.velocity(id).angular);
        speed = -world.velocity(id).linear.z + turning * length(half);
        EXPECT_TRUE(listed(world).empty());
        world.step();
      }
      ASSERT_EQ(world.contacts_begun().size(), 1u);
      // A body that lands so late in a step that it gets no deeper than this shows no side yet
      // (dynamics/look_ahead.hpp).
      const float entry = entry_of(std::min({half.x, half.y, half.z}));
      EXPECT_GT(before, -2 * entry - 1e-3f * size) << "not late";
      // A fast-turning body also approaches by its rotation, to second order; a body that will land in the next substep
      // is already slowed.
      const float turned = std::max(turning, length(world.velocity(id).angular)) / 60 * length(half);
      EXPECT_LT(gap_over_ground(world.pose(id), half),
                near + 0.3f * turned + 0.02f * size + std::max(speed, 0.0f) / 240)
          << "not early";
      EXPECT_LT(before, near + (speed + 0.2f) / 60);
      EXPECT_EQ(listed(world).size(), 1u);
      if (speed < 1) {
        EXPECT_TRUE(world.hits().empty());
      }
    }
  }
}

/// Weightless bodies side by side.
TEST(Touch, WhatIsApartDoesNotTouch) {
  Generator random(4);
  for (int seed = 0; seed < 60; ++seed) {
    const float size = any_size(random), near = touch_distance(size * std::sqrt(3.0f));
    // From just inside the distance to just outside, and to where a contact begins.
    const float gap = near * (seed % 3 == 0   ? uniform(random, 0, 0.9f)
                              : seed % 3 == 1 ? uniform(random, 1.2f, 3)
                                              : uniform(random, 3, 15));
    for (auto [name, def] : all_kinds()) {
      SCOPED_TRACE(name + ", size " + std::to_string(size) + ", gap " + std::to_string(gap));
      def.gravity = {};
      World world(def);
      world.add(dynamic(box({size, size, size}), {}));
      const BodyId other = world.add(dynamic(box({size, size, size}), {2 * size + gap, 0.3f * size, 0}));
      Touching touching;
      for (int i = 0; i < 5; ++i) world.step(), touching.follow(world);
      EXPECT_EQ(touching.pairs.size(), gap < near ? 1u : 0u);
      EXPECT_EQ(listed(world), touching.pairs);
      if (gap >= near) continue;
      // Touching bodies keep touching until they are twice as far apart.
      world.set_velocity(other, {0.3f * near / world.definition().dt, 0, 0}, {});
      float apart = gap;
      for (int i = 0; i < 12; ++i) {
        const float begin = world.pose(other).position.x - world.poses()[0].position.x - 2 * size;
        world.step(), touching.follow(world);
        if (!touching.pairs.empty()) apart = begin;
      }
      EXPECT_TRUE(touching.pairs.empty());
      EXPECT_NEAR(apart, 1.85f * near, 0.17f * near + 2e-6f * size);
    }
  }
}

TEST(Touch, AFastBallHitsWhereItsPathEnds) {
  Generator random(5);
  for (int seed = 0; seed < 30; ++seed) {
    const float radius = std::pow(10.0f, uniform(random, -2, 0)), speed = std::pow(10.0f, uniform(random, 0.5f, 2.3f));
    const float angle = uniform(random, 0, 1.2f), away = uniform(random, 1, 3);
    const Vec3 direction{std::sin(angle), 0, -std::cos(angle)};
    for (auto [name, def] : all_kinds()) {
      SCOPED_TRACE(name + ", radius " + std::to_string(radius) + ", speed " + std::to_string(speed) + ", angle " +
                   std::to_string(angle));
      def.gravity = {};
      World world(def);
      world.add(ground());
      const Vec3 end{0, 0, 0.5f + radius};
      BodyDef ball = dynamic(sphere(radius), mul_add(end, -away, direction));
      ball.velocity.linear = speed * direction;
      world.add(ball);
      int hits = 0;
      for (int i = 0; i < 120; ++i) {
        world.step();
        for (const HitEvent& hit : world.hits()) {
          ++hits;
          EXPECT_NEAR(hit.approach_speed, speed * std::cos(angle), 1e-3f * speed);
          EXPECT_LT(distance(hit.point, {0, 0, 0.5f}), 0.005f + 0.05f * radius) << hit.point.x << ' ' << hit.point.z;
        }
      }
      EXPECT_EQ(hits, speed * std::cos(angle) > 1.001f ? 1 : 0);
    }
  }
}

Shape any_shape(Generator& random, float size) {
  switch (random() % 4) {
    case 0:
      return sphere(size);
    case 1:
      return capsule(0.5f * size, 0.5f * size);
    case 2: {
      std::vector<Vec3> corners;
      for (int i = 0; i < 12; ++i) corners.push_back(size * on_sphere(random));
      return hull(corners);
    }
    default:
      return box(size * Vec3{uniform(random, 0.2f, 1), uniform(random, 0.2f, 1), uniform(random, 0.2f, 1)});
  }
}

/// Heaps with edits of every kind: the pairs that touch by events are those that `for_each_contact` visits; pairs that
/// press touch, and pairs that hit touch.
TEST(Touch, EventsAndContactsAgree) {
  for (int seed = 0; seed < 6; ++seed)
    for (auto [name, def] : all_kinds()) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      Generator random(100u + static_cast<unsigned>(seed));
      def.sleep.enabled = seed % 2 == 0;
      def.threads = 1 + seed % 3;
      World world(def);
      world.add(ground(0.5f, seed % 3 == 0 ? 0.6f : 0.0f));
      const float size = any_size(random) * 0.3f;
      std::vector<BodyId> ids;
      const auto add = [&] {
        BodyDef one = dynamic(any_shape(random, size * uniform(random, 0.3f, 1)),
                              size * Vec3{uniform(random, -4, 4), uniform(random, -4, 4), uniform(random, 1, 12)});
        one.pose.position.z += 0.5f;
        one.pose.rotation = any_rotation(random);
        ids.push_back(world.add(one));
      };
      for (int i = 0; i < 60; ++i) add();
      std::set<Pair> touching;
      for (int i = 0; i < 150; ++i) {
        if (i % 7 == 3) {
          const std::size_t k = random() % ids.size();
          world.remove(ids[k]), ids.erase(ids.begin() + static_cast<std::ptrdiff_t>(k)), add();
        }
        if (i % 11 == 5) world.set_pose(ids[random() % ids.size()], {{0, 0, 0.5f + 5 * size}, 0, any_rotation(random)});
        if (i % 13 == 5) world.set_filter(ids[random() % ids.size()], {2, i % 2 ? 0xffffffffu : 0xfffffffdu});
        world.step();
        // An index may belong to another body by then: ends come first.
        for (const ContactEvent& e : world.contacts_ended()) ASSERT_EQ(touching.erase({e.a.index, e.b.index}), 1u) << i;
        for (const ContactEvent& e : world.contacts_begun())
          ASSERT_TRUE(touching.insert({e.a.index, e.b.index}).second) << i;
        ASSERT_EQ(listed(world), touching) << "step " << i;
        for (const HitEvent& h : world.hits()) {
          EXPECT_TRUE(touching.contains({h.a.index, h.b.index})) << "step " << i;
          EXPECT_GT(h.approach_speed, world.definition().solver.restitution_threshold);
          EXPECT_NEAR(length(h.normal), 1, 1e-4f);
          EXPECT_TRUE(is_finite(h.point));
        }
      }
      EXPECT_GT(touching.size(), 30u);
    }
}

TEST(Touch, SleepAndWakeTellNothing) {
  for (auto [name, def] : all_kinds()) {
    SCOPED_TRACE(name);
    def.sleep.enabled = true;
    World world(def);
    world.add(ground());
    std::vector<BodyId> ids;
    for (int i = 0; i < 4; ++i) ids.push_back(world.add(cube({0, 0, 1.0f + static_cast<float>(i)})));
    run(world, 60);
    const std::set<Pair> before = listed(world);
    EXPECT_EQ(before.size(), 4u);
    for (int i = 0; i < 120; ++i) {
      world.step();
      EXPECT_EQ(world.contacts_begun().size() + world.contacts_ended().size() + world.hits().size(), 0u);
    }
    if (name != "impulse") {
      EXPECT_FALSE(world.is_awake(ids[0])) << "whose stacks never come quite to rest";
    }
    EXPECT_EQ(listed(world), before);
    for (int i = 0; i < 60; ++i) {
      if (i == 10) world.wake(ids[2]);
      world.step();
      EXPECT_EQ(world.contacts_begun().size() + world.contacts_ended().size() + world.hits().size(), 0u);
    }
    EXPECT_EQ(listed(world), before);
  }
}

TEST(Touch, HitsDoNotDependOnThreads) {
  std::vector<HitEvent> first;
  for (const int threads : {1, 2, 4}) {
    Generator random(9);
    WorldDef def = quiet_world(threads);
    World world(def);
    world.add(ground());
    for (int i = 0; i < 3000; ++i) {
      BodyDef one = cube({1.2f * static_cast<float>(i % 10), 1.2f * static_cast<float>(i / 10 % 10),
                          1.2f + 1.2f * static_cast<float>(i / 100)});
      one.pose.rotation = any_rotation(random);
      world.add(one);
    }
    std::vector<HitEvent> hits;
    for (int i = 0; i < 60; ++i) {
      world.step();
      hits.insert(hits.end(), world.hits().begin(), world.hits().end());
    }
    EXPECT_GT(hits.size(), 500u);
    if (threads == 1) first = hits;
    ASSERT_EQ(hits.size(), first.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
      ASSERT_EQ(hits[i].a, first[i].a);
      ASSERT_EQ(hits[i].b, first[i].b);
      ASSERT_EQ(hits[i].point, first[i].point);
      ASSERT_EQ(hits[i].approach_speed, first[i].approach_speed);
    }
  }
}

}  // namespace
}  // namespace fathom::touch_test
