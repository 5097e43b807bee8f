// Small helpers shared by most tests of the world.
#pragma once

#include <cmath>
#include <cstdlib>
#include <fathom/world.hpp>
#include <string_view>
#include <vector>

namespace fathom::test {

/// Where tests run the device simulator: FATHOM_TEST_DEVICE (host, cuda, sycl), or the host back end.
inline const char* test_device() {
  const char* device = std::getenv("FATHOM_TEST_DEVICE");
  return device ? device : "host";
}

/// Tests of the world apply to every simulator: FATHOM_TEST_DEVICE in the environment (host, cuda, sycl) selects the
/// device simulator; FATHOM_TEST_VARIANT selects a variant: `hybrid`, or `sweep`, `cells` on a device.
inline WorldDef sleepy_world(int threads = 1) {
  WorldDef def;
  def.threads = threads;
  if (const char* device = std::getenv("FATHOM_TEST_DEVICE")) {
    def.simulator = SimulatorKind::device;
    def.device = device;
  }
  const char* variant = std::getenv("FATHOM_TEST_VARIANT");
  const std::string_view name = variant ? variant : "";
  if (!name.empty()) {
    def.simulator = name == "hybrid" ? SimulatorKind::hybrid : SimulatorKind::device;
    def.device = test_device();
  }
  if (name == "sweep") def.broad_phase = BroadPhase::sweep;
  if (name == "cells") def.partition = Partition::cells;
  return def;
}

inline WorldDef quiet_world(int threads = 1) {
  WorldDef def = sleepy_world(threads);
  def.sleep.enabled = false;
  return def;
}

/// The ground of the fixed scenes: its surface is at z = 0.5.
inline BodyDef ground(float friction = 0.5f, float restitution = 0.0f) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({500, 500, 0.5f});
  def.material = {friction, restitution};
  return def;
}

inline BodyDef dynamic(const Shape& shape, Vec3 position, float mass = 1.0f) {
  BodyDef def;
  def.shape = shape;
  def.mass = mass;
  def.pose.position = position;
  return def;
}

inline BodyDef cube(Vec3 position) { return dynamic(box({0.5f, 0.5f, 0.5f}), position); }

inline Quat axis_angle(Vec3 axis, float angle) {
  const Vec3 n = normalize(axis);
  const float s = std::sin(0.5f * angle);
  return {std::cos(0.5f * angle), s * n.x, s * n.y, s * n.z};
}

inline void run(World& world, int steps) {
  for (int i = 0; i < steps; ++i) world.step();
}

inline std::vector<std::byte> saved(const World& world) {
  std::vector<std::byte> bytes;
  world.save(bytes);
  return bytes;
}

/// Whether a world from make(threads) goes on alike once it is restored, and on several threads.
template <class Make>
bool goes_on_alike(const Make& make) {
  World one = make(1);
  run(one, 40);
  World restored(quiet_world());
  restored.restore(saved(one));
  run(one, 80);
  run(restored, 80);
  World more = make(3);
  run(more, 120);
  return one.state_hash() == restored.state_hash() && one.state_hash() == more.state_hash();
}

inline float kinetic_energy(const World& world, BodyId id) {
  const Velocity v = world.velocity(id);
  const Vec3 local = inverse_rotate(world.pose(id).rotation, v.angular);
  return 0.5f * world.mass(id) * length_squared(v.linear) +
         0.5f * dot(local, world.mass_properties(id).inertia * local);
}

inline Vec3 angular_momentum(const World& world, BodyId id) {
  const Quat q = world.pose(id).rotation;
  return rotate(q, world.mass_properties(id).inertia * inverse_rotate(q, world.velocity(id).angular));
}

inline void add_pyramid(World& world, int layers) {
  for (int l = 0; l < layers; ++l) {
    const int side = layers - l;
    for (int i = 0; i < side * side; ++i)
      world.add(cube({(static_cast<float>(i % side) - static_cast<float>(side - 1) * 0.5f) * 1.05f,
                      (static_cast<float>(i / side) - static_cast<float>(side - 1) * 0.5f) * 1.05f,
                      1.0f + static_cast<float>(l)}));
  }
}

}  // namespace fathom::test
