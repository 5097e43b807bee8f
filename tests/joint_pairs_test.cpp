// Two bodies on one random joint in empty space: nothing acts on them, so their energy never exceeds the initial one.
// Thin rods and plates are joined beside their axes, where their inertia matters least.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fathom/world.hpp>
#include <random>
#include <utility>

#include "joint_worlds.hpp"

namespace fathom::test::joint_pairs_test {
namespace {

enum Kind { ball, rope, limb, hinge, weld, slider };

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  float between(double low, double high) {
    return static_cast<float>(low + (high - low) * static_cast<double>(random_()) / 4294967296.0);
  }
  float log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  Vec3 vector(double size) { return {between(-size, size), between(-size, size), between(-size, size)}; }
  unsigned below(unsigned end) { return static_cast<unsigned>(random_()) % end; }

 private:
  std::mt19937 random_;
};

BodyDef random_body(Draw& draw, Vec3 at, double spin) {
  BodyDef body;
  const float radius = draw.log_between(0.002, 0.1), half = draw.between(0, 0.1);
  body.shape = draw.below(2) == 0 ? box({radius, draw.between(0.002, 0.1), draw.between(0.01, 0.1)})
                                  : capsule(radius, half + radius);
  body.density = draw.log_between(100, 10000);
  body.pose = {at, 0, normalize(Quat{draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1), 0.5f})};
  body.velocity.angular = draw.vector(spin);
  return body;
}

JointDef random_joint(Draw& draw, Kind kind, BodyId a, BodyId b) {
  switch (kind) {
    case ball:
      return ball_joint(a, b, {}, {});
    case rope:
      return distance_joint(a, b, {}, {}, 0, draw.between(0, 0.1));
    case limb: {
      JointDef def = generic_joint(a, b, {}, {});
      for (const auto axis : {JointAxisName::x, JointAxisName::y, JointAxisName::z})
        def.axis(axis).mode = AxisMode::locked;
      const float lower = -draw.between(0.1, 1);
      def.axis(JointAxisName::twist).limit(lower, draw.between(0.1, 1));
      def.cone_angle = draw.between(0.2, 1.2);
      return def;
    }
    case hinge: {
      JointDef def = revolute_joint(a, b, {}, {});
      if (draw.below(2) == 0) return def;
      const float lower = -draw.between(0, 1.5);
      def.axis(JointAxisName::twist).limit(lower, draw.between(0.1, 1.5));
      return def;
    }
    case weld:
      return fixed_joint(a, b, {}, {});
    case slider:
      break;
  }
  JointDef def = prismatic_joint(a, b, {}, {});
  const float lower = -draw.between(0, 0.05);
  def.axis(JointAxisName::x).limit(lower, draw.between(0.005, 0.05));
  return def;
}

double kinetic_energy(const World& world, BodyId id) {
  const Velocity v = world.velocity(id);
  const Vec3 spin = inverse_rotate(world.pose(id).rotation, v.angular);
  return 0.5 * static_cast<double>(world.mass(id) * dot(v.linear, v.linear) +
                                   dot(spin, world.mass_properties(id).inertia * spin));
}

/// The pair's highest energy within two seconds, relative to the initial one.
double gain(WorldDef def, unsigned seed, Kind kind, double spin) {
  Draw draw(seed);
  def.gravity = {};
  def.solver.substeps = 2 + static_cast<int>(draw.below(7));
  World world(def);
  const BodyDef first = random_body(draw, {}, spin), second = random_body(draw, {0.25f, 0, 0}, spin);
  const std::array<BodyId, 2> ids{world.add(first), world.add(second)};
  const Vec3 at{draw.between(0.05, 0.2), draw.between(-0.03, 0.03), draw.between(-0.03, 0.03)};
  JointDef joint = random_joint(draw, kind, ids[0], ids[1]);
  joint.frame_a = relative(first.pose, {at, 0, {}});
  joint.frame_b = relative(second.pose, {at, 0, {}});
  world.add_joint(joint);
  const auto energy = [&] { return kinetic_energy(world, ids[0]) + kinetic_energy(world, ids[1]); };
  const double start = energy();
  double most = start;
  for (int step = 0; step < 120; ++step) {
    world.step();
    EXPECT_TRUE(world.quarantined().empty()) << "seed " << seed;
    most = std::max(most, energy());
  }
  return most / start;
}

/// Bounds on the energy of the worst of a hundred pairs: solved directly, and left to sweeps.
struct KindBound {
  Kind kind;
  const char* name;
  double direct, swept;
};

class JointPairs : public OfJointWorlds {};

// Limits in sweeps still gain energy: a rope by the rotation of its line, a limb if its cone and its twist are hit at
// once.
TEST_P(JointPairs, GainNoEnergy) {
  constexpr KindBound bounds[] = {{ball, "ball", 1.01, 2.5},  {rope, "rope", 4, 8},
                                  {limb, "limb", 1.01, 500},  {hinge, "hinge", 1.5, 8},
                                  {weld, "weld", 1.01, 1.01}, {slider, "slider", 1.01, 1.05}};
  for (const KindBound& bound : bounds) {
    double worst = 0;
    unsigned seed_of_worst = 0;
    for (unsigned seed = 0; seed < 100; ++seed) {
      const double most = gain(GetParam().quiet(), seed, bound.kind, 10);
      if (most > worst) worst = most, seed_of_worst = seed;
    }
    EXPECT_LE(worst, GetParam().simulator == SimulatorKind::device ? bound.swept : bound.direct)
        << bound.name << ", seed " << seed_of_worst;
  }
}

INSTANTIATE_TEST_SUITE_P(Simulators, JointPairs, testing::ValuesIn(joint_worlds), joint_world_name);

}  // namespace
}  // namespace fathom::test::joint_pairs_test
