// An arm with four servos stacks cubes. Its gripper is a joint, created to grip and removed to release.
//   stacker [native|device|hybrid]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fathom/world.hpp>

#include "simulator.hpp"

using namespace fathom;

constexpr float segment = 0.9f;   // m, upper arm and forearm
constexpr float hand = 0.2f;      // m
constexpr float shoulder = 0.6f;  // m above the ground
constexpr float cube = 0.1f;      // m, half an edge
constexpr float hover = 0.25f;    // m above where a cube is gripped or put down
constexpr auto twist = JointAxisName::twist;

// Target of the gripper in cylindrical coordinates.
struct Place {
  float angle, radius, height;  // rad, m, m
};

class Arm {
 public:
  explicit Arm(World& world) : world_(world) {
    const Vec3 up{0, 0, 1}, across{0, 1, 0};
    const BodyId base = world.add({.motion = MotionType::fixed, .shape = box({0.2f, 0.2f, 0.45f})});
    const auto add = [&](float bottom, float length, float mass) {
      return world.add({.pose = {.position = {0, 0, bottom + 0.5f * length}},
                        .shape = box({0.06f, 0.06f, 0.5f * length}),
                        .mass = mass});
    };
    const BodyId turntable = add(0.46f, shoulder - 0.46f, 20);
    const BodyId upper = add(shoulder, segment, 12), forearm = add(shoulder + segment, segment, 8);
    hand_ = add(shoulder + 2 * segment, hand, 2);
    const auto join = [&](BodyId a, float at_a, BodyId b, float at_b, Vec3 axis) {
      return world.add_joint(revolute_joint(a, b, joint_frame({0, 0, at_a}, axis), joint_frame({0, 0, at_b}, axis)));
    };
    joints_ = {join(base, 0.46f, turntable, -0.07f, up), join(turntable, 0.07f, upper, -0.5f * segment, across),
               join(upper, 0.5f * segment, forearm, -0.5f * segment, across),
               join(forearm, 0.5f * segment, hand_, -0.5f * hand, across)};
    drive();
  }

  // Moves the gripper, pointing down, to a target and waits until it arrives.
  void go_to(Place place) {
    const float height = place.height + hand - shoulder, reach = std::hypot(place.radius, height);
    const float bend = std::acos(std::clamp(reach * reach / (2 * segment * segment) - 1, -1.0f, 1.0f));
    const float lean = std::atan2(place.radius, height) - 0.5f * bend;
    const std::array<float, 4> goal{place.angle, lean, bend, pi - lean - bend};
    const auto farthest = [&] {
      float most = 0;
      for (std::size_t i = 0; i < 4; ++i) most = std::max(most, std::abs(goal[i] - angles_[i]));
      return most;
    };
    const float dt = world_.definition().dt, speed = 1;  // rad/s
    while (farthest() > 1e-6f) {
      const float part = std::min(1.0f, speed * dt / farthest());
      for (std::size_t i = 0; i < 4; ++i) angles_[i] += part * (goal[i] - angles_[i]);
      drive();
      world_.step();
    }
    for (int i = 0; i < 30; ++i) world_.step();
  }
  void grip(BodyId body) {
    const Pose on_hand{.position = {0, 0, 0.5f * hand}};
    const Pose& pose = world_.pose(body);
    const Pose at = world_.pose(hand_);
    Pose on_body;
    on_body.position = inverse_transform(pose, transform(at, on_hand.position));
    on_body.rotation = conjugate(pose.rotation) * at.rotation;
    grip_ = world_.add_joint(fixed_joint(hand_, body, on_hand, on_body));
  }
  void release() { world_.remove_joint(grip_); }

 private:
  void drive() {
    for (std::size_t i = 0; i < 4; ++i) {
      JointAxis axis = world_.joint(joints_[i]).axis(twist);
      world_.set_joint_axis(joints_[i], twist, axis.drive_position(angles_[i], 200000, 20000, 2000));
    }
  }

  World& world_;
  BodyId hand_;
  std::array<JointId, 4> joints_;
  std::array<float, 4> angles_{};  // rad
  JointId grip_;
};

int main(int argc, char** argv) try {
  World world(world_definition(argc, argv));
  world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({5, 5, 0.5f})});
  Arm arm(world);

  constexpr int count = 5;
  std::array<BodyId, count> cubes;
  std::array<float, count> angles;
  for (std::size_t i = 0; i < count; ++i) {
    const float angle = angles[i] = -1.2f + 0.4f * static_cast<float>(i);
    const Quat turned{std::cos(0.5f * angle), 0, 0, std::sin(0.5f * angle)};
    const Vec3 position{1.1f * std::cos(angle), 1.1f * std::sin(angle), cube};
    cubes[i] =
        world.add({.pose = {.position = position, .rotation = turned}, .shape = box({cube, cube, cube}), .mass = 2});
  }

  for (std::size_t i = 0; i < count; ++i) {
    const Place from{angles[i], 1.1f, 2 * cube}, to{1.6f, 1.1f, 2 * cube * static_cast<float>(i + 1)};
    arm.go_to({from.angle, from.radius, from.height + hover});
    arm.go_to({from.angle, from.radius, from.height + 0.002f});
    arm.grip(cubes[i]);
    // High enough to clear the tower.
    arm.go_to({from.angle, from.radius, to.height + hover});
    arm.go_to({to.angle, to.radius, to.height + hover});
    arm.go_to({to.angle, to.radius, to.height + 0.004f});
    arm.release();
    arm.go_to({to.angle, to.radius, to.height + hover});
  }
  for (int i = 0; i < 120; ++i) world.step();

  const Vec3 bottom = world.pose(cubes.front()).position, top = world.pose(cubes.back()).position;
  std::printf("stacked %d cubes in %.0f s: the tower is %.3f m high, and its top is %.0f mm beside its bottom\n", count,
              world.time(), top.z + cube, 1000 * std::hypot(top.x - bottom.x, top.y - bottom.y));
} catch (const Error& error) {
  std::fprintf(stderr, "stacker: %s\n", error.what());
  return 2;
}
