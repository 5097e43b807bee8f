// The rows of one generic or distance joint, for the device and for single joints, and what they are made of. Pure.
#pragma once

#include <fathom/joint.hpp>

#include "dynamics/ball_joint.hpp"

namespace fathom {

// What the law asks of L besides, for one lane.
FATHOM_HD float smaller(float a, float b) { return min(a, b); }
FATHOM_HD float is_less(float a, float b) { return a < b ? 1.0f : 0.0f; }
FATHOM_HD float choose(float condition, float a, float b) { return condition != 0 ? a : b; }

#define FATHOM_LANE_FUNCTION FATHOM_HD
#define FATHOM_LANE_LAMBDA
#include "dynamics/generic_joint-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// What outlasts a step, on B, in the axes' order.
struct GenericImpulse {
  float hold[axis_count] = {}, drive[axis_count] = {};  ///< N·s and N·m·s of the last substep, to start from
  Vec3 force, torque;                                   ///< N·s and N·m·s of the whole step, world axes
};

/// A definition as the rows read it. A is the body that cannot be pushed, where there is one.
struct GenericJoint {
  UnitQuat<float> on_a{1, {}}, on_b{1, {}};  ///< the joint's frames on the bodies
  Softness softness;                         ///< of what is locked
  float rigid = 1, distance = 0, cone = 0;   ///< see GenericJointRow
  float moves = 0;                           ///< 1: some axis has a limit or a drive
  GenericAxis<float> axes[axis_count] = {};

  bool is_driven() const {
    for (const GenericAxis<float>& axis : axes)
      if (axis.most > 0) return true;
    return false;
  }
};

/// What a joint with a new definition begins with of its impulses: an axis that is neither locked nor limited any more
/// holds nothing, and one without a drive drives nothing.
FATHOM_HD void forget_what_ended(const GenericJoint& joint, GenericImpulse& impulse) {
  for (int i = 0; i < axis_count; ++i) {
    if (joint.axes[i].locked == 0 && joint.axes[i].limited == 0) impulse.hold[i] = 0;
    if (!(joint.axes[i].most > 0)) impulse.drive[i] = 0;
  }
}

/// An axis in substeps of h seconds; `sign` is -1 where the bodies' roles are exchanged.
inline GenericAxis<float> generic_axis(const JointAxis& axis, float sign, float h) {
  GenericAxis<float> a{};
  a.locked =
      axis.mode == AxisMode::locked || (axis.mode == AxisMode::limited && axis.lower == axis.upper) ? 1.0f : 0.0f;
  a.limited = axis.mode == AxisMode::limited && a.locked == 0 ? 1.0f : 0.0f;
  if (axis.mode == AxisMode::limited) {
    a.lower = sign > 0 ? axis.lower : -axis.upper;
    a.upper = sign > 0 ? axis.upper : -axis.lower;
  }
  const JointDrive& drive = axis.drive;
  if (a.locked != 0 || !drive.is_on()) return a;
  a.target = sign * drive.position;
  a.most = drive.max_force * h;
  if (drive.by_frequency) {
    const float omega = 2 * pi * drive.stiffness, sum = fma(h, omega, 2 * drive.damping);
    a.response = 1 / (h * omega * sum);
    a.approach = omega / sum;
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

/// Of a checked definition; `swapped`: A is its B. `h` is a substep (s).
inline GenericJoint make_generic_joint(const JointDef& def, bool swapped, float h) {
  GenericJoint joint;
  const auto unit = [](const Pose& frame) { return UnitQuat<float>{frame.rotation.w, frame.rotation.vector()}; };
  joint.on_a = unit(swapped ? def.frame_b : def.frame_a);
  joint.on_b = unit(swapped ? def.frame_a : def.frame_b);
  joint.softness = joint_softness(def.hertz, def.damping_ratio, h);
  joint.rigid = def.hertz > 0 ? 0.0f : 1.0f;
  joint.distance = def.type == JointType::distance ? 1.0f : 0.0f;
  joint.cone = def.type == JointType::generic && def.cone_angle > 0 ? 1.0f : 0.0f;
  const int used = def.type == JointType::distance ? 1 : axis_count;
  for (int i = 0; i < used; ++i)
    joint.axes[i] = generic_axis(def.axes[static_cast<std::size_t>(i)],
                                 swapped && def.type != JointType::distance ? -1.0f : 1.0f, h);
  if (joint.cone != 0) {
    GenericAxis<float>& cone = joint.axes[static_cast<int>(JointAxisName::swing_y)];
    cone = {};
    cone.limited = 1, cone.lower = -1, cone.upper = def.cone_angle;
  }
  for (const GenericAxis<float>& axis : joint.axes)
    if (axis.limited != 0 || axis.most > 0) joint.moves = 1;
  return joint;
}

/// Where its axes stand (see JointPositions) with the definition's bodies at these poses; `swapped` as above.
inline JointPositions joint_axis_positions(const JointDef& def, const Pose& a, const Pose& b, bool swapped) {
  JointPositions positions{};
  if (def.type == JointType::ball) return positions;
  const GenericJoint joint = make_generic_joint(def, swapped, 1);
  const auto unit = [](const Pose& pose) { return UnitQuat<float>{pose.rotation.w, pose.rotation.vector()}; };
  const Pose &first = swapped ? b : a, &second = swapped ? a : b;
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
