// A vehicle with four wheel joints drives through gates over hills.
//   vehicle [native|device|hybrid]      on level ground with device, which has no height fields
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fathom/mesh.hpp>
#include <fathom/world.hpp>
#include <vector>

#include "simulator.hpp"

using namespace fathom;

constexpr float max_steering = 0.6f;  // rad

// Waves up to 1.2 m high and 12 m long, with level ground at the start.
Shape hills() {
  constexpr std::uint32_t samples = 121;
  std::vector<float> heights;
  for (std::uint32_t j = 0; j < samples; ++j)
    for (std::uint32_t i = 0; i < samples; ++i) {
      const float x = static_cast<float>(i) - 60, y = static_cast<float>(j) - 60;
      const float rise = std::clamp((std::hypot(x, y) - 5) / 10, 0.0f, 1.0f);
      heights.push_back(0.3f * rise * (2 + std::sin(0.52f * x) + std::cos(0.52f * y)));
    }
  return height_field({.columns = samples, .rows = samples, .heights = heights});
}

class Vehicle {
 public:
  explicit Vehicle(World& world) : world_(world) {
    const Vec3 start{0, 0, 0.8f};
    chassis_ = world.add({.pose = {.position = start}, .shape = box({1.1f, 0.45f, 0.15f}), .mass = 300.0f});
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
      const Vec3 hub{i < 2 ? 0.8f : -0.8f, i % 2 == 0 ? 0.75f : -0.75f, -0.2f};
      const Vec3 axle{0, 1, 0};
      const BodyId wheel = world.add({.pose = {.position = start + hub},
                                      .shape = hull(rim(0.35f, 0.1f)),
                                      .material = {.friction = 1.0f},
                                      .mass = 15.0f});
      JointDef def = wheel_joint(chassis_, wheel, joint_frame(hub, axle), joint_frame({}, axle), 6, 0.7f);
      def.axis(JointAxisName::z).limit(-0.2f, 0.2f);
      if (i < 2) def.axis(JointAxisName::swing_z).limit(-max_steering, max_steering);
      wheels_[i] = world.add_joint(def);
    }
  }

  // Steers the front wheels towards the point and drives all four.
  void drive_to(Vec3 point, float speed) {
    const Vec3 ahead = inverse_transform(world_.pose(chassis_), point);
    const float angle = std::clamp(std::atan2(ahead.y, ahead.x), -max_steering, max_steering);
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
      JointAxis twist = world_.joint(wheels_[i]).axis(JointAxisName::twist);
      world_.set_joint_axis(wheels_[i], JointAxisName::twist, twist.drive_velocity(speed / 0.35f, 80));
      if (i >= 2) continue;
      JointAxis steering = world_.joint(wheels_[i]).axis(JointAxisName::swing_z);
      world_.set_joint_axis(wheels_[i], JointAxisName::swing_z, steering.drive_position(angle, 3000, 300));
    }
  }

  Vec3 position() const { return world_.pose(chassis_).position; }
  // Largest deflection of the wheels' springs (m).
  float travel() const {
    float most = 0;
    for (const JointId wheel : wheels_)
      most = std::max(most, std::abs(world_.joint_positions(wheel)[static_cast<std::size_t>(JointAxisName::z)]));
    return most;
  }

 private:
  static std::vector<Vec3> rim(float radius, float half_width) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 24; ++i)
      for (const float y : {-half_width, half_width})
        corners.push_back({radius * std::cos(pi / 12 * i), y, radius * std::sin(pi / 12 * i)});
    return corners;
  }

  World& world_;
  BodyId chassis_;
  std::array<JointId, 4> wheels_;  // front left and right, then rear
};

int main(int argc, char** argv) try {
  World world(world_definition(argc, argv));
  if (world.definition().simulator == SimulatorKind::device)
    world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({60, 60, 0.5f})});
  else
    world.add({.motion = MotionType::fixed, .pose = {.position = {-60, -60, 0}}, .shape = hills()});
  Vehicle vehicle(world);

  const std::array<Vec3, 4> gates{{{25, 0, 0}, {30, 25, 0}, {-10, 30, 0}, {-20, -10, 0}}};
  float travel = 0;
  std::size_t passed = 0;
  while (passed < gates.size() && world.time() < 60) {
    vehicle.drive_to(gates[passed], 5);
    world.step();
    travel = std::max(travel, vehicle.travel());
    const Vec3 way = gates[passed] - vehicle.position();
    if (std::hypot(way.x, way.y) < 2) ++passed;
  }
  std::printf("passed %zu of %zu gates in %.1f s; springs were %.2f m from rest at most\n", passed, gates.size(),
              world.time(), travel);
} catch (const Error& error) {
  std::fprintf(stderr, "vehicle: %s\n", error.what());
  return 2;
}
