// Unrelated bodies share vectors of lanes, blocks and groups. What happens to one must not change a bit of another;
// otherwise results would depend on the order, and with it on the number of threads.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "world_fixture.hpp"

namespace fathom::test::isolation_test {
namespace {

constexpr int stations = 24;  // of a few bodies each, of any shape, on the ground or in flight
constexpr std::size_t steps = 60;
constexpr float apart = 40;  // m

float within(std::mt19937& random, float least, float most) {
  return std::uniform_real_distribution<float>(least, most)(random);
}

BodyDef any_body(std::mt19937& random, float x, int i) {
  const Vec3 corners[] = {{0, 0, 0}, {0.8f, 0, 0.1f}, {0, 0.7f, 0}, {0.1f, 0, 0.6f}, {0.5f, 0.5f, 0.5f}};
  const Shape shapes[] = {box({within(random, 0.1f, 0.5f), within(random, 0.1f, 0.5f), within(random, 0.1f, 0.5f)}),
                          sphere(within(random, 0.1f, 0.4f)),
                          capsule(within(random, 0.1f, 0.3f), within(random, 0.1f, 0.5f)), hull(corners)};
  BodyDef def = dynamic(shapes[random() % 4],
                        {x + within(random, -0.3f, 0.3f), within(random, -0.3f, 0.3f), 1.1f + static_cast<float>(i)},
                        within(random, 0.5f, 4));
  def.pose.rotation = axis_angle({within(random, 0.1f, 1), within(random, -1, 1), 1}, within(random, 0, 3));
  def.velocity.linear = {within(random, -1, 1), within(random, -1, 1), 0},
  def.velocity.angular = {within(random, -3, 3), within(random, -3, 3), 1};
  return def;
}

/// Changes bodies of a station as they are defined, and acts on them before every step.
struct Disturbance {
  const char* name;
  std::function<void(BodyDef&)> define = [](BodyDef&) {};
  std::function<void(World&, BodyId)> act = [](World&, BodyId) {};
};

const Disturbance disturbances[] = {
    {"force", [](BodyDef&) {},
     [](World& w, BodyId id) {
       w.apply_force(id, {3, 1, 20});
     }},
    {"torque", [](BodyDef&) {},
     [](World& w, BodyId id) {
       w.apply_torque(id, {1, -2, 3});
     }},
    {"too fast",
     [](BodyDef& def) {
       def.velocity.linear = {0, 0, 900};
     }},
    {"spins",
     [](BodyDef& def) {
       def.velocity.angular = {150, 20, 300};
     }},
    {"shot down",
     [](BodyDef& def) {
       def.velocity.linear = {1, 2, -150};
     }},
    {"bounces", [](BodyDef& def) { def.material.restitution = 0.7f; }},
    {"rolls heavily", [](BodyDef& def) { def.material.rolling_resistance = 0.1f; }},
    {"is damped", [](BodyDef& def) { def.linear_damping = 0.5f, def.angular_damping = 0.3f; }},
    {"is heavy", [](BodyDef& def) { def.mass = 900; }},
    {"is not finite", [](BodyDef&) {},
     [](World& w, BodyId id) {
       w.apply_force(id, {3e38f, 3e38f, 0});
     }},
    {"is kinematic",
     [](BodyDef& def) {
       def.motion = MotionType::kinematic, def.velocity.linear = {0, 0.1f, 0}, def.velocity.angular = {0, 0, 2};
     }},
};

struct State {
  Pose pose;
  Velocity velocity;
};

/// The states of all bodies outside the disturbed station, after each of some steps.
std::vector<State> states_beside(const WorldDef& def, unsigned seed, int disturbed, const Disturbance* d) {
  World world(def);
  world.add(ground(0.6f));
  std::mt19937 random(seed);
  std::vector<BodyId> watched, acted_on;
  for (int s = 0; s < stations; ++s)
    for (int i = 0; i < 1 + s % 3; ++i) {
      BodyDef body = any_body(random, apart * static_cast<float>(s - stations / 2), i);
      if (s == disturbed && d) d->define(body);
      (s == disturbed ? acted_on : watched).push_back(world.add(body));
    }
  std::vector<State> states;
  for (std::size_t step = 0; step < steps; ++step) {
    if (d)
      for (const BodyId id : acted_on) d->act(world, id);
    world.step();
    for (const BodyId id : watched) states.push_back({world.pose(id), world.velocity(id)});
  }
  return states;
}

std::string first_difference(const std::vector<State>& a, const std::vector<State>& b) {
  const std::size_t bodies = a.size() / steps;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::memcmp(&a[i], &b[i], sizeof(State)) != 0)
      return "step " + std::to_string(i / bodies) + ", body " + std::to_string(i % bodies) + " of " +
             std::to_string(bodies) + ", x = " + std::to_string(b[i].pose.position.x);
  return "";
}

// Not with cells: their size is that of the largest body, and so the order of contacts depends on all bodies.
class Isolation : public testing::TestWithParam<const char*> {
 protected:
  WorldDef definition() const {
    WorldDef def = quiet_world();
    const std::string_view name = GetParam();
    if (name == "impulse") def.solver.method = Solver::impulse;
    if (name == "device" || name == "hybrid") {
      def.simulator = name == "device" ? SimulatorKind::device : SimulatorKind::hybrid;
      def.device = test_device();
    }
    return def;
  }
};

TEST_P(Isolation, NoBodyIsChangedByWhatHappensElsewhere) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const int disturbed = static_cast<int>(7 * seed + 1) % stations;
    const std::vector<State> expected = states_beside(definition(), seed, disturbed, nullptr);
    for (const Disturbance& d : disturbances) {
      const std::vector<State> got = states_beside(definition(), seed, disturbed, &d);
      ASSERT_EQ(got.size(), expected.size());
      EXPECT_EQ(first_difference(got, expected), "") << d.name << ", seed " << seed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Simulators, Isolation, testing::Values("soft", "impulse", "hybrid", "device"),
                         [](const auto& of) { return std::string(of.param); });

}  // namespace
}  // namespace fathom::test::isolation_test
