// Joints: what holds two bodies together, and the definition one is created from.
//
//   fathom::JointId hinge = world.add_joint(fathom::ball_joint(boom, bucket, {1, 0, 0}, {-0.5f, 0, 0}));
//   fathom::Vec3 pull = world.reaction(hinge).force;
#pragma once

#include <cstdint>
#include <fathom/body.hpp>

namespace fathom {

/// Names a joint; the generation tells a reused index from the joint that had it before.
struct JointId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;

  friend bool operator==(JointId, JointId) = default;
};

enum class JointType : std::uint8_t {
  ball,  ///< holds two anchors together and leaves all rotation free (Box3D: spherical joint, Jolt: point constraint)
};

/// What a joint is created from.
struct JointDef {
  JointType type = JointType::ball;
  BodyId a{}, b{};  ///< two different bodies, at least one of them dynamic
  /// The joint's frame on each body, in body axes from its centre of mass (m); the rotations are normalised. A ball
  /// joint reads the positions alone, its anchors.
  Pose frame_a{}, frame_b{};
  /// False: the two bodies make no contacts with each other.
  bool collide_connected = false;
  /// 0: rigid. Else a spring between the anchors with this frequency (Hz) against the bodies' effective mass, and this
  /// damping ratio. It is integrated implicitly (Catto, "Soft Constraints", GDC 2011), so any value is stable.
  float hertz = 0;
  float damping_ratio = 1;
  std::uint64_t user_data = 0;
};

/// A ball joint between points of two bodies (m, body axes, from their centres of mass).
inline JointDef ball_joint(BodyId a, BodyId b, Vec3 anchor_a, Vec3 anchor_b) {
  JointDef def;
  def.a = a, def.b = b;
  def.frame_a.position = anchor_a, def.frame_b.position = anchor_b;
  return def;
}

/// What a joint did to its body B in the last step, in world axes, as means over the step; to A it did the reverse.
struct JointReaction {
  Vec3 force;   ///< N, at B's anchor
  Vec3 torque;  ///< N·m; a ball joint has none
};

}  // namespace fathom
