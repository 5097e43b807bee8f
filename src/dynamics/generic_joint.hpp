// The rows of one generic or distance joint, for the device and for single joints, and the definitions behind them.
// Pure.
#pragma once

#include <fathom/joint.hpp>

#include "dynamics/ball_joint.hpp"
#include "dynamics/integrate.hpp"
#include "dynamics/joint_masses.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#define FATHOM_LANE_LAMBDA
#include "dynamics/generic_rows-inl.hpp"
// Depends on the include above.
#include "dynamics/generic_joint-inl.hpp"
// Depends on the include above.
#include "dynamics/coupling-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

using GenericImpulse = GenericImpulseOf<float>;

/// The impulses with which sweeps begin a step (see `max_start`).
FATHOM_HD GenericImpulse started(const GenericImpulse& last, float max_start) {
  const float share = start_share(length_squared({last.hold[0], last.hold[1], last.hold[2]}), max_start);
  GenericImpulse start = last;
  for (int i = 0; i < axis_count; ++i) start.hold[i] *= share, start.drive[i] *= share;
  return start;
}

/// A coupling in the form that its row reads.
struct Coupling {
  CoupledEnds<float> ends{};
  Vec3 from_a, from_b;  ///< m, world
};

/// From a validated definition; `swapped`: A is the definition's B.
inline Coupling make_coupling(const JointDef& def, bool swapped) {
  const auto end = [](const CouplingEnd& e, float share) {
    const Quat q = e.from.rotation;
    return CoupledEnd<float>{{q.w, q.vector()},
                             e.motion == CoupledMotion::turn ? 1.0f : 0.0f,
                             e.motion == CoupledMotion::rope ? 1.0f : 0.0f,
                             share};
  };
  Coupling c;
  const CoupledEnd<float> of_a = end(def.coupled_a, 1), of_b = end(def.coupled_b, def.ratio);
  c.ends = {swapped ? of_b : of_a, swapped ? of_a : of_b, swapped ? 1.0f : 0.0f};
  c.from_a = (swapped ? def.coupled_b : def.coupled_a).from.position;
  c.from_b = (swapped ? def.coupled_a : def.coupled_b).from.position;
  return c;
}

/// Everything that rows read of a joint's definition.
struct GenericJoint : GenericJointDefinition<float> {
  JointSoftness softness;  ///< of locked axes, or of a coupling
  float rigid = 1;         ///< see CouplingRow
  float couples = 0;       ///< 1: it is a coupling, and only the first axis' bounds are used
  Coupling coupling;

  FATHOM_HD JointUse use() const { return {moves != 0, reacts != 0}; }
  /// Whether some axis is locked or has limits.
  bool holds() const {
    for (const GenericAxis<float>& axis : axes)
      if (axis.locked + axis.limited > 0) return true;
    return false;
  }
  /// Whether the bodies move as one, except for drives; those that only springs hold together do not.
  bool is_stiff() const {
    if (!holds()) return false;
    for (const GenericAxis<float>& axis : axes)
      if (!(axis.locked > 0 || axis.most > 0)) return false;
    return distance == 0;
  }
  /// Whether the bodies move as one.
  bool is_weld() const {
    for (const GenericAxis<float>& axis : axes)
      if (!(axis.locked > 0)) return false;
    return distance == 0;
  }
  /// Whether some axis has a drive or an armature.
  bool is_driven() const {
    for (const GenericAxis<float>& axis : axes)
      if (axis.most > 0 || axis.armature > 0) return true;
    return false;
  }
};

/// Copies a definition into a row.
FATHOM_HD void define_coupling(const GenericJoint& joint, CouplingRow<float>& row) {
  row.coupling = joint.coupling.ends;
  row.bias_rate = joint.softness.bias_rate, row.mass_scale = joint.softness.mass_scale;
  row.impulse_scale = joint.softness.impulse_scale, row.compliance = joint.softness.compliance;
  row.rigid = joint.rigid;
  row.lower = joint.axes[0].lower, row.upper = joint.axes[0].upper, row.limited = joint.axes[0].limited;
}

/// The row of a coupling with the state of its last step: hold[0] of `impulse` is the row's impulse, its drive entries
/// hold the angles.
FATHOM_HD CouplingRow<float> prepared_coupling(const GenericJoint& joint, Vec3 anchor_a, Vec3 anchor_b, const Pose& a,
                                               const Pose& b, const GenericImpulse& impulse) {
  const auto unit = [](Quat q) { return UnitQuat<float>{q.w, q.vector()}; };
  CouplingRow<float> row{};
  prepare_coupling<float>(unit(a.rotation), unit(b.rotation), a.position, b.position, joint.on_a, joint.on_b, anchor_a,
                          anchor_b, joint.coupling.from_a, joint.coupling.from_b, row);
  define_coupling(joint, row);
  row.start_a = resumed<float>(row.coupling.a, row.frame_a, row.arm_a, row.way_a, {impulse.drive[0], impulse.drive[1]});
  row.start_b = resumed<float>(row.coupling.b, row.frame_b, row.arm_b, row.way_b, {impulse.drive[2], impulse.drive[3]});
  row.angle_a = row.start_a, row.angle_b = row.start_b;
  row.impulse = impulse.hold[0];
  return row;
}

/// The part of the row that outlasts the step.
FATHOM_HD GenericImpulse impulse_of(const CouplingRow<float>& row) {
  GenericImpulse impulse;
  impulse.hold[0] = row.impulse;
  impulse.drive[0] = row.angle_a.turns, impulse.drive[1] = row.angle_a.angle;
  impulse.drive[2] = row.angle_b.turns, impulse.drive[3] = row.angle_b.angle;
  impulse.force = row.force, impulse.torque = row.torque;
  return impulse;
}

/// Sets the rates of a prepared row's axes for bodies with these velocities at the start of the step.
template <class Side>
FATHOM_HD void begin_rates(GenericJointRow<float>& row, const GenericJoint& joint, const Side& a, const Side& b) {
  row.distance = joint.distance, row.cone = joint.cone;
  for (int i = 0; i < axis_count; ++i) row.axes[i] = joint.axes[i];
  JointBodies<float> bodies{};
  bodies.a.linear = a.linear, bodies.a.angular = a.angular;
  bodies.b.linear = b.linear, bodies.b.angular = b.angular;
  const GenericJointRows<float, JointBodies<float>> rows(row, bodies, 0);
  for (int i = 0; i < axis_count; ++i) row.rate[i] = rows.velocity(i), row.bounce[i] = 0;
}

/// Clears impulses that a joint's new definition has no use for: the hold of an axis that is neither locked nor
/// limited, and the drive of an axis without a drive.
FATHOM_HD void forget_what_ended(const GenericJoint& joint, GenericImpulse& impulse) {
  if (joint.couples != 0) return;
  for (int i = 0; i < axis_count; ++i) {
    if (joint.axes[i].locked == 0 && joint.axes[i].limited == 0) impulse.hold[i] = 0;
    if (!(joint.axes[i].most > 0 || joint.axes[i].armature > 0)) impulse.drive[i] = 0;
  }
}

/// An axis for substeps of h seconds; `sign` is -1 where the bodies' roles are swapped. `mass` (kg or kg·m²) is what a
/// spring by frequency moves; 0: the axis cannot move.
inline GenericAxis<float> generic_axis(const JointAxis& axis, float sign, float mass, float h) {
  GenericAxis<float> a{};
  a.locked = axis.is_locked() ? 1.0f : 0.0f;
  a.limited = axis.mode == AxisMode::limited && a.locked == 0 ? 1.0f : 0.0f;
  if (axis.mode == AxisMode::limited) {
    a.lower = sign > 0 ? axis.lower : -axis.upper;
    a.upper = sign > 0 ? axis.upper : -axis.lower;
  }
  if (a.locked == 0) a.restitution = axis.restitution, a.armature = axis.armature;
  const JointDrive& drive = axis.drive;
  if (a.locked != 0 || !drive.is_on()) return a;
  if (drive.by_frequency && !(mass > 0)) return a;
  a.target = sign * drive.position;
  a.most = drive.max_force * h;
  if (drive.by_frequency) {
    const float omega = 2 * pi * drive.stiffness, sum = fma(h, omega, 2 * drive.damping);
    const JointSoftness spring = spring_softness(drive.stiffness, drive.damping, mass, h);
    a.approach = spring.bias_rate, a.compliance = spring.compliance;
    a.velocity = sign * (2 * drive.damping / sum) * drive.velocity;
  } else if (drive.damping >= rigid_damping) {
    a.velocity = sign * drive.velocity;
  } else {
    const float sum = fma(h, drive.stiffness, drive.damping);
    a.compliance = 1 / (h * sum);
    a.approach = drive.stiffness / sum;
    a.velocity = sign * (drive.damping / sum) * drive.velocity;
  }
  return a;
}

/// What a joint is among its bodies.
struct JointRole {
  bool swapped = false;     ///< A is the definition's B
  bool is_alone = false;    ///< for a coupling: see `alone_coupling_rate`
  JointMasses masses = {};  ///< for springs by frequency
};

/// The axis of a joint with a frequency: what is locked becomes a spring.
inline JointAxis softened(JointAxis axis, const JointDef& def, float h) {
  if (!(def.hertz > 0) || !axis.is_locked()) return axis;
  JointAxis soft;
  soft.spring(joint_hertz(def.hertz, h), def.damping_ratio, axis.mode == AxisMode::limited ? axis.lower : 0);
  return soft;
}

/// From a validated definition. `h` is the substep (s).
inline GenericJoint make_generic_joint(const JointDef& def, const JointRole& role, float h, float min_hit) {
  const bool swapped = role.swapped;
  GenericJoint joint;
  const auto unit = [](const Pose& frame) { return UnitQuat<float>{frame.rotation.w, frame.rotation.vector()}; };
  joint.on_a = unit(swapped ? def.frame_b : def.frame_a);
  joint.on_b = unit(swapped ? def.frame_a : def.frame_b);
  joint.softness = rigid_joint_softness(h);
  joint.min_hit = min_hit;
  if (def.type == JointType::coupling) {
    joint.couples = 1;
    joint.coupling = make_coupling(def, swapped);
    joint.axes[0] = generic_axis(def.axis(JointAxisName::x), 1, 0, h);
    if (def.hertz > 0 && joint.axes[0].locked != 0)
      joint.softness = joint_softness(def.hertz, def.damping_ratio, role.masses[0], h), joint.rigid = 0;
    else if (role.is_alone)
      joint.softness = {alone_coupling_rate / h, 1, 0, 0};
    return joint;
  }
  joint.distance = def.type == JointType::distance ? 1.0f : 0.0f;
  joint.cone = def.type == JointType::generic && def.cone_angle > 0 ? 1.0f : 0.0f;
  const std::size_t used = def.type == JointType::distance ? 1 : axis_count;
  for (std::size_t i = 0; i < used; ++i)
    joint.axes[i] = generic_axis(softened(def.axes[i], def, h),
                                 swapped && def.type != JointType::distance ? -1.0f : 1.0f, role.masses[i], h);
  joint.is_soft = def.hertz > 0 ? 1.0f : 0.0f;
  if (joint.cone != 0) {
    GenericAxis<float>& cone = joint.axes[static_cast<int>(JointAxisName::swing_y)];
    cone = {};
    cone.limited = 1, cone.lower = -1, cone.upper = def.cone_angle;
  }
  for (const GenericAxis<float>& axis : joint.axes)
    if (axis.limited != 0 || axis.most > 0 || axis.armature > 0) joint.moves = 1;
  for (const GenericAxis<float>& axis : joint.axes)
    if (axis.armature > 0 || (axis.limited != 0 && axis.restitution > 0)) joint.reacts = 1;
  return joint;
}

/// Positions of its axes (see JointPositions) with the definition's bodies at these poses; `swapped` as above.
inline JointPositions joint_axis_positions(const JointDef& def, const Pose& a, const Pose& b, bool swapped) {
  JointPositions positions{};
  if (def.type == JointType::ball) return positions;
  const GenericJoint joint = make_generic_joint(def, {swapped}, 1, 0);
  const auto unit = [](const Pose& pose) { return UnitQuat<float>{pose.rotation.w, pose.rotation.vector()}; };
  const Pose &first = swapped ? b : a, &second = swapped ? a : b;
  if (def.type == JointType::coupling) {
    const CouplingRow<float> row =
        prepared_coupling(joint, swapped ? def.frame_b.position : def.frame_a.position,
                          swapped ? def.frame_a.position : def.frame_b.position, first, second, {});
    positions[swapped] = row.start_a.angle, positions[!swapped] = row.start_b.angle;
    return positions;
  }
  GenericJointRow<float> row{};
  prepare_generic_joint<float>(unit(first), unit(second), second.position - first.position, joint.on_a, joint.on_b,
                               swapped ? def.frame_b.position : def.frame_a.position,
                               swapped ? def.frame_a.position : def.frame_b.position, row);
  row.distance = joint.distance, row.cone = joint.cone;
  for (int i = 0; i < axis_count; ++i) row.axes[i] = joint.axes[i];
  JointBodies<float> bodies{};
  const GenericJointRows<float, JointBodies<float>> rows(row, bodies, 0);
  const int used = def.type == JointType::distance ? 1 : axis_count;
  for (int i = 0; i < used; ++i)
    positions[static_cast<std::size_t>(i)] =
        swapped && def.type != JointType::distance ? -rows.value[i] : rows.value[i];
  return positions;
}

}  // namespace fathom
