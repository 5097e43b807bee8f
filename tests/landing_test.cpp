// Bodies that fall flat on the ground, or nearly flat.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/world.hpp>

#include "random.hpp"
#include "simulator_fixture.hpp"

namespace fathom::landing_test {
namespace {

using namespace test;

class Landing : public OnSimulator {};
INSTANTIATE_TEST_SUITE_P(Simulators, Landing, testing::Values(SimulatorKind::native, SimulatorKind::device),
                         simulator_name);

struct Outcome {
  float upright;  ///< cosine of the tilt at the end
  float spin;     ///< largest speed that the body's spin gave it, as a share of its largest speed
};

Outcome land(const WorldDef& def, const Shape& shape, float size, float height, float yaw, float drop) {
  World world(def);
  world.add(fixed_body(box({20, 20, 0.5f}), {0, 0, -0.5f}, 0.6f));
  BodyDef body;
  body.shape = shape, body.material.friction = 0.6f, body.material.restitution = 0;
  body.pose = {{0, 0, height + drop}, 0, {std::cos(0.5f * yaw), 0, 0, std::sin(0.5f * yaw)}};
  const BodyId id = world.add(body);
  float spin = 0, fastest = 0;
  for (int step = 0; step < 180; ++step) {
    world.step();
    const Velocity v = world.velocity(id);
    fastest = std::max(fastest, length(v.linear)), spin = std::max(spin, size * length(v.angular));
  }
  return {rotate(world.pose(id).rotation, {0, 0, 1}).z, spin / fastest};
}

// The first point must not take the whole impact: of tall boxes and cylinders up to half would tip over.
TEST_P(Landing, WhatFallsFlatStaysUpright) {
  WorldDef def = world_def();
  def.sleep.enabled = false;
  Generator random(1);
  for (int i = 0; i < 12; ++i) {
    const float size = uniform(random, 0.03f, 0.5f), yaw = uniform(random, 0, 3), drop = uniform(random, 1, 12) * size;
    const auto expect_flat = [&](const Shape& shape, float height, const char* what) {
      const Outcome end = land(def, shape, size, height, yaw, drop);
      EXPECT_GT(end.upright, 0.9999f) << what << ' ' << i;
      EXPECT_LT(end.spin, 0.05f) << what << ' ' << i;
    };
    expect_flat(box({size, size, size}), size, "cube");
    expect_flat(box({size, size, 3 * size}), 3 * size, "box 1:3");
    expect_flat(box({size, size, 6 * size}), 6 * size, "box 1:6");
    expect_flat(box({size, 2 * size, 3 * size}), 3 * size, "box 1:2:3");
    expect_flat(cylinder(size, 3 * size), 3 * size, "cylinder 1:3");
  }
}

}  // namespace
}  // namespace fathom::landing_test
