// Small worlds with something of everything, and ways to corrupt their bytes.
#pragma once

#include <algorithm>
#include <fathom/world.hpp>
#include <vector>

#include "input.hpp"

namespace fathom::fuzz {

inline WorldDef definition(SimulatorKind simulator) {
  WorldDef def;
  def.simulator = simulator;
  def.device = "host";
  def.threads = 1;
  def.max_bodies = 64;
  return def;
}

inline BodyDef body(const Shape& shape, Vec3 position, MotionType motion = MotionType::dynamic) {
  BodyDef def;
  def.shape = shape;
  def.pose.position = position;
  def.motion = motion;
  return def;
}

/// Joints of every type between the bodies, one of which is fixed.
inline void add_joints(World& world, const std::vector<BodyId>& ids, BodyId ground) {
  const Pose end{.position = {0.35f, 0, 0}}, start{.position = {-0.35f, 0, 0}};
  world.add_joint(ball_joint(ids[0], ids[1], end.position, start.position));
  JointDef hinge = revolute_joint(ids[1], ids[2], end, start);
  hinge.axis(JointAxisName::twist).limit(-1, 1).drive_velocity(2, 5);
  world.add_joint(hinge);
  JointDef rope = distance_joint(ids[3], ids[4], {}, {}, 0, 2);
  rope.break_force = 1e6f;
  world.add_joint(rope);
  world.add_joint(pulley_joint(ids[6], {}, {0, 0, 8}, ids[7], {}, {1, 0, 8}, 20));
  world.add_joint(target_joint(ground, world.pose(ground), ids[8], {}, {1, 1, 6}, 4, 1, 500));
}

/// A snapshot of a world that has taken some steps.
inline std::vector<std::byte> snapshot(SimulatorKind simulator) {
  World world(definition(simulator));
  const BodyId ground = world.add(body(box({20, 20, 0.5f}), {0, 0, -0.5f}, MotionType::fixed));
  if (simulator == SimulatorKind::native) {  // the device simulator has no surfaces
    const Vec3 vertices[] = {{-5, -5, 0.1f}, {5, -5, 0.2f}, {5, 5, 0.1f}, {-5, 5, 0.3f}};
    const std::uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    world.add(body(mesh(vertices, indices), {0, 0, 0}, MotionType::fixed));
    const float heights[] = {0, 0.2f, 0, 0.1f, 0.3f, 0.1f, 0, 0.1f, 0};
    world.add(body(height_field({3, 3, 3, 3, heights}), {2, -3, 0}, MotionType::fixed));
  }
  const Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const Shape shapes[] = {box({0.4f, 0.5f, 0.3f}), sphere(0.4f), capsule(0.2f, 0.3f), hull(corners)};
  std::vector<BodyId> ids;
  for (int i = 0; i < 12; ++i)
    ids.push_back(world.add(body(shapes[i % 4], {0.7f * static_cast<float>(i % 3), 0, 0.5f * static_cast<float>(i)})));
  add_joints(world, ids, ground);
  for (int i = 0; i < 40; ++i) world.step();
  world.remove(ids[5]);
  world.apply_force(ids[3], {10, 0, 5});
  world.add(body(shapes[1], {3, 3, 1}, MotionType::kinematic));
  std::vector<std::byte> bytes;
  world.save(bytes);
  return bytes;
}

/// One alteration: other values at some position, or bytes removed.
inline void alter(std::vector<std::byte>& bytes, Input& input) {
  const std::size_t at = bytes.empty() ? 0 : (input.byte() << 16 | input.byte() << 8 | input.byte()) % bytes.size();
  const std::uint8_t kind = input.byte();
  const auto left = static_cast<std::ptrdiff_t>(bytes.size() - at);
  const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  if (kind < 64) {
    bytes.erase(from, from + std::min<std::ptrdiff_t>(left, kind));
  } else {
    for (std::ptrdiff_t i = 0; i < std::min<std::ptrdiff_t>(left, kind < 192 ? 1 : kind < 224 ? 4 : 8); ++i)
      from[i] = static_cast<std::byte>(input.byte());
  }
}

}  // namespace fathom::fuzz
