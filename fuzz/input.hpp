// Reads values from a fuzzer's bytes; beyond their end everything is zero.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fathom/compound.hpp>
#include <fathom/error.hpp>
#include <fathom/joint.hpp>
#include <fathom/mesh.hpp>
#include <fathom/shape.hpp>
#include <vector>

namespace fathom::fuzz {

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  bool empty() const { return left_ == 0; }
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  /// Any bits: NaN, infinities and denormals too.
  float any_float() {
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i) bits = bits << 8 | byte();
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  /// Mostly numbers of everyday size on a coarse grid, so shapes touch and coincide; sometimes any bits.
  float number() {
    const std::uint8_t kind = byte();
    if (kind == 255) return any_float();
    const float grid = static_cast<float>(static_cast<std::int8_t>(byte())) / 16.0f;
    if (kind < 224) return grid;
    return grid * std::ldexp(1.0f, static_cast<int>(byte()) - 128);  // 1e-38 … 1e39
  }
  Vec3 vector() {
    const float x = number(), y = number(), z = number();
    return {x, y, z};
  }
  Quat rotation() {
    const float w = number();
    const Vec3 v = vector();
    return {w, v.x, v.y, v.z};
  }
  /// Throws `Error` if the bytes define no shape.
  Shape shape() {
    switch (byte() % 4) {
      case 0:
        return sphere(std::abs(number()));
      case 1: {
        const float radius = std::abs(number());
        return capsule(radius, std::abs(number()));
      }
      case 2:
        return box(abs(vector()));
      default:
        return hull(points(4 + byte() % 16));
    }
  }
  /// Up to four of the above.
  Shape compound() {
    std::vector<ChildShape> children(1 + byte() % 4);
    for (ChildShape& child : children) {
      child.shape = shape();
      child.pose = {vector(), 0, rotation()};
      if (byte() % 4 == 0) child.filter = Filter{byte(), byte()};
    }
    return fathom::compound(children);
  }
  /// A mesh of arbitrary triangles, or a height field; for fixed and kinematic bodies. Throws as `shape` does.
  Shape surface() {
    const std::uint8_t kind = byte();
    if (kind % 2 == 0) {
      const std::vector<Vec3> vertices = points(3 + byte() % 14);
      std::vector<std::uint32_t> indices;
      for (int i = 3 * (1 + byte() % 16); i > 0; --i)
        indices.push_back(byte() % (static_cast<std::uint32_t>(vertices.size()) + (kind > 250 ? 1 : 0)));
      return mesh(vertices, indices);
    }
    HeightFieldDef field;
    field.columns = 2 + byte() % 6, field.rows = 2 + byte() % 6;
    field.cell_x = number(), field.cell_y = number();
    std::vector<float> heights(static_cast<std::size_t>(field.columns) * field.rows);
    for (float& height : heights) height = number();
    field.heights = heights;
    return height_field(field);
  }
  Pose frame() {
    Pose pose;
    pose.position = vector();
    if (byte() % 2 == 0) pose.rotation = rotation();
    return pose;
  }
  JointAxis axis() {
    JointAxis axis;
    const std::uint8_t bits = byte();
    axis.mode = static_cast<AxisMode>(bits % 4 % 3);
    axis.lower = number(), axis.upper = axis.lower + std::abs(number());
    if (bits & 16)
      axis.drive = {number(), number(), std::abs(number()), std::abs(number()), number(), (bits & 32) != 0};
    if (bits & 64) axis.restitution = static_cast<float>(byte()) / 255.0f;
    if (bits & 128) axis.armature = number();
    return axis;
  }
  /// Of any type, with arbitrary parameters; worlds refuse most that make no sense.
  JointDef joint(BodyId a, BodyId b) {
    JointDef def;
    const std::uint8_t kind = byte();
    if (kind % 8 == 0) def = generic_joint(a, b, frame(), frame());
    if (kind % 8 == 1) def = fixed_joint(a, b, frame(), frame());
    if (kind % 8 == 2) def = revolute_joint(a, b, frame(), frame());
    if (kind % 8 == 3) def = universal_joint(a, b, frame(), frame());
    if (kind % 8 == 4) def = distance_joint(a, b, vector(), vector(), std::abs(number()), std::abs(number()));
    if (kind % 8 == 5) def = pulley_joint(a, vector(), vector(), b, vector(), vector(), std::abs(number()), number());
    if (kind % 8 == 6) def = gear_joint(a, frame(), vector(), b, frame(), vector(), number());
    if (kind % 8 == 7) def = ball_joint(a, b, vector(), vector());
    const std::uint8_t more = byte();
    if (more & 1) def.hertz = std::abs(number()), def.damping_ratio = std::abs(number());
    if (more & 2) def.axes[byte() % joint_axis_count] = axis();
    if (more & 4) def.cone_angle = number();
    if (more & 8) def.break_force = std::abs(number()), def.break_torque = std::abs(number());
    if (more & 16) def.max_force = number();
    def.collide_connected = (more & 32) != 0;
    return def;
  }
  std::vector<Vec3> points(int count) {
    std::vector<Vec3> list;
    for (int i = 0; i < count; ++i) list.push_back(vector());
    return list;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

/// Ends the program if a promise is broken: this is what a fuzzer looks for.
inline void require(bool promise) {
  if (!promise) std::abort();
}

}  // namespace fathom::fuzz
