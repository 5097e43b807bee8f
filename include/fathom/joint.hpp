// Joints hold two bodies together. A joint is created from a definition.
//
//   const fathom::Vec3 up{0, 0, 1};
//   fathom::JointDef hinge = fathom::revolute_joint(wall, door, fathom::joint_frame({0, 0, 1}, up),
//                                                   fathom::joint_frame({-0.5f, 0, 0}, up));
//   hinge.axis(fathom::JointAxisName::twist).limit(0, 1.5f);
//   const fathom::JointId id = world.add_joint(hinge);
//   fathom::Vec3 pull = world.reaction(id).force;
#pragma once

#include <array>
#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/error.hpp>
#include <string>

namespace fathom {

/// Names a joint; the generation distinguishes joints that reuse an index.
struct JointId {
  std::uint32_t index = 0xffffffffu;  ///< its slot, for life
  std::uint32_t generation = 0;       ///< how often the slot was used before

  friend bool operator==(JointId, JointId) = default;
};

/// What joints constrain.
enum class JointType : std::uint8_t {
  ball,      ///< holds two anchors together, leaves all rotation free (Box3D: spherical joint, Jolt: point constraint)
  generic,   ///< six axes, each free, limited or locked (PhysX: D6, Jolt: six-DOF): hinges, sliders, wheels, welds
  distance,  ///< limits or fixes the distance of two anchors: rods, ropes, springs
  coupling,  ///< couples a motion of one body to one of another: gears, racks, pulleys
};

/// What a joint allows along or about an axis.
enum class AxisMode : std::uint8_t { free, limited, locked };

/// A spring, damper or motor on an axis of a joint. Its force is stiffness (position - x) + damping (velocity - v), at
/// most `max_force`. It is integrated implicitly, so any gain is stable. For a rotation axis read rad, rad/s, N·m,
/// N·m/rad, N·m·s/rad.
struct JointDrive {
  float position = 0;       ///< target (m)
  float velocity = 0;       ///< target (m/s)
  float stiffness = 0;      ///< N/m; in Hz if `by_frequency`
  float damping = 0;        ///< N·s/m; a damping ratio if `by_frequency`
  float max_force = 3e38f;  ///< N
  /// True: stiffness and damping are a frequency f and a damping ratio ζ of the mass m that the axis moves where both
  /// frames coincide, with locked axes held; for a distance joint the reduced mass. The spring then has the stiffness
  /// m (2π f)² and the damping 4π f ζ m wherever the bodies are.
  bool by_frequency = false;

  /// Whether it acts at all.
  bool is_on() const { return stiffness > 0 || damping > 0; }
  friend bool operator==(const JointDrive&, const JointDrive&) = default;
};

/// For `JointDrive::damping`: holds the target velocity as long as `max_force` suffices.
inline constexpr float rigid_damping = 3e38f;
/// For `JointDef::break_force` and `break_torque`: never breaks.
inline constexpr float unbreakable = 3e38f;

/// One axis of a joint.
struct JointAxis {
  AxisMode mode = AxisMode::free;  ///< free, limited or locked
  /// Lower end of a limited axis (m or rad), `lower` <= `upper`. Angles lie within [-pi, pi] about the twist axis,
  /// within (-pi/2, pi/2) about the others. Equal bounds lock the axis there.
  float lower = 0;
  float upper = 0;     ///< upper end
  JointDrive drive{};  ///< spring, damper or motor along the axis
  /// 0 to 1: the fraction of its speed at which an axis rebounds from a limit that it hits faster than
  /// `SolverSettings::restitution_threshold` (m/s or rad/s). The solver `impulse` ignores it.
  float restitution = 0;
  /// Inertia along the axis in addition to the bodies' (kg or kg·m²), such as that of a geared motor's rotor. Only for
  /// axes that are not locked. Velocities and impulses set by the application act on the bodies alone.
  float armature = 0;

  /// Whether it is locked, by its mode or by equal bounds.
  bool is_locked() const { return mode == AxisMode::locked || (mode == AxisMode::limited && lower == upper); }
  /// Limits the axis (m or rad).
  JointAxis& limit(float from, float to) {
    mode = AxisMode::limited, lower = from, upper = to;
    return *this;
  }
  /// A motor: drives to a velocity (m/s or rad/s) with at most `max` (N or N·m).
  JointAxis& drive_velocity(float target, float max) {
    drive = {0, target, 0, rigid_damping, max, false};
    return *this;
  }
  /// A servo: drives to a position (m or rad) with this stiffness and damping and at most `max` (N or N·m).
  JointAxis& drive_position(float target, float stiffness, float damping, float max = 3e38f) {
    drive = {target, 0, stiffness, damping, max, false};
    return *this;
  }
  /// A spring with this frequency (Hz) and damping ratio, at rest at `rest` (m or rad).
  JointAxis& spring(float hertz, float damping_ratio, float rest = 0) {
    drive = {rest, 0, hertz, damping_ratio, 3e38f, true};
    return *this;
  }
  /// Dry friction: resists motion with at most `max` (N or N·m).
  JointAxis& friction(float max) { return drive_velocity(0, max); }

  friend bool operator==(const JointAxis&, const JointAxis&) = default;
};

/// Axes of a generic joint, in A's frame. A distance joint has one, `x`: the distance.
enum class JointAxisName : std::uint8_t {
  x,        ///< translation (m) along A's axis x
  y,        ///< ... y
  z,        ///< ... z
  twist,    ///< rotation (rad) about B's axis x, after the swing
  swing_y,  ///< how far B's axis x is turned about A's y, out of A's x-y plane
  swing_z,  ///< ... about A's z, out of A's x-z plane
};
/// How many axes a generic joint has.
inline constexpr std::size_t joint_axis_count = 6;

/// Which motion of a body is coupled.
enum class CoupledMotion : std::uint8_t {
  turn,   ///< angle (rad, over any number of turns) of the joint's frame on the body about the axis x of `from`
  slide,  ///< displacement (m) of the body's anchor from the position of `from` along its axis x
  rope,   ///< distance (m) of the body's anchor from the position of `from`
};
/// One side of a coupling.
struct CouplingEnd {
  CoupledMotion motion = CoupledMotion::turn;  ///< which motion of the body
  Pose from{};                                 ///< in the world, does not move
};

/// The definition of a joint.
struct JointDef {
  JointType type = JointType::ball;  ///< what it constrains
  BodyId a{};                        ///< an existing body
  BodyId b{};                        ///< another one; at least one of the two is dynamic
  /// The joint's frame on each body, in body axes from its centre of mass (m); the rotations are normalised. Ball and
  /// distance joints use only the positions, as anchors. If B is fixed or kinematic, the axes are those of B's frame
  /// instead of A's.
  Pose frame_a{};
  Pose frame_b{};  ///< see `frame_a`
  /// By JointAxisName, for generic and distance joints. For a coupling, `x` limits its sum (see `ratio`) and has no
  /// drive.
  std::array<JointAxis, joint_axis_count> axes{};
  /// Generic joint, if above 0: the maximum angle (rad, below pi) between the axes x of A and B. The two swings must
  /// then be free.
  float cone_angle = 0;
  /// Coupling: keeps the motion of A + ratio times the motion of B within the bounds of axis x.
  CouplingEnd coupled_a{};
  CouplingEnd coupled_b{};  ///< see `coupled_a`
  float ratio = 1;          ///< see `coupled_a`
  /// The joint is removed at the end of a step in which its mean reaction exceeds this (N, N·m; for a coupling its
  /// reaction on B), and `World::joints_broken` lists it. Infinity means `unbreakable` too.
  float break_force = unbreakable;
  float break_torque = unbreakable;  ///< see `break_force`
  /// False: the two bodies do not collide with each other.
  bool collide_connected = false;
  /// 0: rigid. Otherwise everything locked is a spring with this frequency (Hz) and `damping_ratio`, axis by axis, for
  /// the mass described at `JointDrive::by_frequency`; a ball joint has the reduced mass 1 / (1 / m_a + 1 / m_b) in all
  /// directions (Box2D's b2LinearStiffness). It is integrated implicitly (Catto, "Soft Constraints", GDC 2011), so any
  /// value is stable.
  float hertz = 0;
  float damping_ratio = 1;  ///< of that spring; 1 is critical
  /// Ball joint with `hertz`: its maximum force in any direction (N).
  float max_force = 3e38f;
  std::uint64_t user_data = 0;  ///< belongs to the application

  /// The axis of this name.
  JointAxis& axis(JointAxisName name) { return axes[static_cast<std::size_t>(name)]; }
  /// The axis of this name.
  const JointAxis& axis(JointAxisName name) const { return axes[static_cast<std::size_t>(name)]; }
  /// Whether a force or a torque can break it.
  bool can_break() const { return break_force < unbreakable || break_torque < unbreakable; }
};

namespace joint_parts {

/// Why `axis` has no direction; null if it has one.
inline const char* direction_fault(Vec3 axis) {
  return length_squared(axis) > 1e-12f ? nullptr : "has no length; give it one of more than 1e-6";
}

}  // namespace joint_parts

/// A frame at `position` (m) with its axis x along `axis`, by the shortest rotation; y and z are otherwise unspecified.
/// Throws `Error{invalid_argument}` if `axis` has no length; so do the functions for gears and racks.
inline Pose joint_frame(Vec3 position, Vec3 axis) {
  if (const char* const fault = joint_parts::direction_fault(axis))
    throw Error(ErrorCode::invalid_argument, std::string("joint frame: the axis ") + fault);
  const Vec3 x = normalize(axis);
  const Quat half = x.x > -0.9999f ? Quat{1 + x.x, 0, -x.z, x.y} : Quat{0, 0, 0, 1};
  Pose frame;
  frame.position = position, frame.rotation = normalize(half);
  return frame;
}

/// A ball joint between a point on each body (m, body axes, from the centre of mass).
inline JointDef ball_joint(BodyId a, BodyId b, Vec3 anchor_a, Vec3 anchor_b) {
  JointDef def;
  def.a = a, def.b = b;
  def.frame_a.position = anchor_a, def.frame_b.position = anchor_b;
  return def;
}

/// Pulls a point of a body (m, body axes, from its centre of mass) towards a point in the world, by a spring with this
/// frequency (Hz) and damping ratio and at most `max_force` (N), whatever the gain (Box2D: mouse joint). The target is
/// the position of `frame_a` on `holder`, a fixed or kinematic body; `World::set_joint_target` moves it. The two bodies
/// still collide.
inline JointDef target_joint(BodyId holder, const Pose& holder_pose, BodyId body, Vec3 point, Vec3 target, float hertz,
                             float damping_ratio, float max_force) {
  JointDef def = ball_joint(holder, body, inverse_transform(holder_pose, target), point);
  def.hertz = hertz, def.damping_ratio = damping_ratio, def.max_force = max_force;
  def.collide_connected = true;
  return def;
}

/// A joint of six axes, all of them free.
inline JointDef generic_joint(BodyId a, BodyId b, const Pose& frame_a, const Pose& frame_b) {
  JointDef def;
  def.type = JointType::generic;
  def.a = a, def.b = b, def.frame_a = frame_a, def.frame_b = frame_b;
  return def;
}

/// All axes locked: the two frames coincide (Box3D: weld joint).
inline JointDef fixed_joint(BodyId a, BodyId b, const Pose& frame_a, const Pose& frame_b) {
  JointDef def = generic_joint(a, b, frame_a, frame_b);
  for (JointAxis& axis : def.axes) axis.mode = AxisMode::locked;
  return def;
}

/// A hinge about the frames' axis x: all axes locked but the twist.
inline JointDef revolute_joint(BodyId a, BodyId b, const Pose& frame_a, const Pose& frame_b) {
  JointDef def = fixed_joint(a, b, frame_a, frame_b);
  def.axis(JointAxisName::twist).mode = AxisMode::free;
  return def;
}

/// A slider along the frames' axis x.
inline JointDef prismatic_joint(BodyId a, BodyId b, const Pose& frame_a, const Pose& frame_b) {
  JointDef def = fixed_joint(a, b, frame_a, frame_b);
  def.axis(JointAxisName::x).mode = AxisMode::free;
  return def;
}

/// Two hinges at right angles: the axes x may swing against each other, but not twist (PhysX: locked twist).
inline JointDef universal_joint(BodyId a, BodyId b, const Pose& frame_a, const Pose& frame_b) {
  JointDef def = fixed_joint(a, b, frame_a, frame_b);
  def.axis(JointAxisName::swing_y).mode = def.axis(JointAxisName::swing_z).mode = AxisMode::free;
  return def;
}

/// A wheel B on a chassis A: it spins about the frames' axis x, its suspension acts along A's z, and it steers about z
/// once that swing is limited or free. The suspension's parameters are the drive and the limits of axis z.
inline JointDef wheel_joint(BodyId chassis, BodyId wheel, const Pose& frame_a, const Pose& frame_b, float hertz,
                            float damping_ratio) {
  JointDef def = revolute_joint(chassis, wheel, frame_a, frame_b);
  def.axis(JointAxisName::z).mode = AxisMode::free;
  def.axis(JointAxisName::z).spring(hertz, damping_ratio);
  return def;
}

/// A rod if `lower` equals `upper` (m), a rope if `lower` is 0.
inline JointDef distance_joint(BodyId a, BodyId b, Vec3 anchor_a, Vec3 anchor_b, float lower, float upper) {
  JointDef def = ball_joint(a, b, anchor_a, anchor_b);
  def.type = JointType::distance;
  def.axis(JointAxisName::x).limit(lower, upper);
  return def;
}

namespace joint_parts {

/// The frame on a body at `pose` that coincides with `from`.
inline Pose frame_on(const Pose& pose, const Pose& from) {
  Pose frame;
  frame.position = inverse_transform(pose, from.position);
  frame.rotation = normalize(conjugate(pose.rotation) * from.rotation);
  return frame;
}

inline JointDef coupling(BodyId a, BodyId b, CouplingEnd end_a, CouplingEnd end_b, float ratio) {
  JointDef def;
  def.type = JointType::coupling;
  def.a = a, def.b = b, def.coupled_a = end_a, def.coupled_b = end_b, def.ratio = ratio;
  def.axis(JointAxisName::x).limit(0, 0);
  return def;
}

}  // namespace joint_parts

// Couplings measure both motions in the world: the bearing of a wheel may move, but not turn about the wheel's axis.

/// Two gears at their current poses `pose_a` and `pose_b`: A turns by -`ratio` times the angle of B, each about its
/// axis through its centre (world). The ratio is r_b / r_a for external gears of these radii whose axes point the same
/// way.
inline JointDef gear_joint(BodyId a, const Pose& pose_a, Vec3 axis_a, BodyId b, const Pose& pose_b, Vec3 axis_b,
                           float ratio) {
  JointDef def = joint_parts::coupling(a, b, {CoupledMotion::turn, joint_frame(pose_a.position, axis_a)},
                                       {CoupledMotion::turn, joint_frame(pose_b.position, axis_b)}, ratio);
  def.frame_a = joint_parts::frame_on(pose_a, def.coupled_a.from);
  def.frame_b = joint_parts::frame_on(pose_b, def.coupled_b.from);
  return def;
}

/// A pinion A and a rack B at these current poses: B moves along `direction` by `radius` (m) times the angle (rad) of A
/// about `axis`, 2 pi radius per turn; backwards if the radius is negative. Axes in the world.
inline JointDef rack_joint(BodyId pinion, const Pose& pose_a, Vec3 axis, BodyId rack, const Pose& pose_b,
                           Vec3 direction, float radius) {
  JointDef def = joint_parts::coupling(pinion, rack, {CoupledMotion::turn, joint_frame(pose_a.position, axis)},
                                       {CoupledMotion::slide, joint_frame(pose_b.position, direction)}, -1 / radius);
  def.frame_a = joint_parts::frame_on(pose_a, def.coupled_a.from);
  return def;
}

/// A rope from an anchor of A over two fixed wheels (m, world) to an anchor of B: the length at A + ratio times the
/// length at B is at most `length` (m). A block and tackle at B that divides its force by n has the ratio n.
inline JointDef pulley_joint(BodyId a, Vec3 anchor_a, Vec3 wheel_a, BodyId b, Vec3 anchor_b, Vec3 wheel_b, float length,
                             float ratio = 1) {
  CouplingEnd end_a{CoupledMotion::rope, {}}, end_b{CoupledMotion::rope, {}};
  end_a.from.position = wheel_a, end_b.from.position = wheel_b;
  JointDef def = joint_parts::coupling(a, b, end_a, end_b, ratio);
  def.frame_a.position = anchor_a, def.frame_b.position = anchor_b;
  def.axis(JointAxisName::x).limit(0, length);
  def.collide_connected = true;
  return def;
}

/// Mean reaction of a joint on its body B over the last step, in world axes. A gets the opposite, except from
/// couplings.
struct JointReaction {
  Vec3 force;   ///< N, at B's anchor
  Vec3 torque;  ///< N·m; ball and distance joints have none
};

/// The positions of a joint's axes, by JointAxisName (m and rad; for a distance joint x alone). For a coupling: the
/// motions of A and B, angles within a turn.
using JointPositions = std::array<float, joint_axis_count>;

}  // namespace fathom
