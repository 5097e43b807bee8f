// Generic and distance joints as links of one mechanism (dynamics/joint_link-inl.hpp). Pure, for host and device.
#pragma once

#include <cstddef>
#include <cstdint>

#include "dynamics/generic_joint.hpp"
#include "dynamics/joint_elimination.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// Bodies of which only positions are read.
using PlacedBodies = JointBodies<float>;

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/joint_link-inl.hpp"
#undef FATHOM_LANE_FUNCTION

/// A LinkJoint that also begins and ends a step, for a single joint.
class JointLink : public LinkJoint {
 public:
  /// Begins the step. Frames, arms, gap, pull and rates of `row` are set; `is_b`: the link's body is the joint's B.
  FATHOM_HD void begin(const GenericJoint& joint, bool is_b, const GenericJointRow<float>& row,
                       const GenericImpulse& impulse);
  /// Finds the response of its axes where limits or drives need it (`GenericAxis::response`).
  FATHOM_HD void look_at_masses(const JointBodies<SymMat3>& bodies, float h);
  FATHOM_HD GenericImpulse impulse() const;
};

FATHOM_HD void JointLink::begin(const GenericJoint& joint, bool is_b, const GenericJointRow<float>& row,
                                const GenericImpulse& impulse) {
  *this = {};
  is_b_ = flag(is_b), row_ = row;
  reacts_ = flag(joint.reacts != 0), moves_ = flag(joint.moves != 0);
  row_.distance = joint.distance, row_.cone = joint.cone, row_.min_hit = joint.min_hit;
  for (int i = 0; i < axis_count; ++i) row_.axes[i] = joint.axes[i];
  const LinkMotion unmoved = LinkMotion::at_start({}, {});
  look({unmoved, unmoved});
  for (int i = 0; i < axis_count; ++i) rate_[i] = row.rate[i];
  for (int i = 0; i < axis_count; ++i) {
    const float total = sign() * (impulse.hold[i] + impulse.drive[i]);
    if (i < translations)
      force_ = mul_add(force_, total, along_[i]);
    else
      torque_ = mul_add(torque_, total, about_[i - translations]);
    if (axis(i).limited == 0 || impulse.hold[i] == 0) continue;
    limits_.at_limit[i] = all_set;
    limits_.at_upper[i] = flag(impulse.hold[i] < 0);
  }
}

FATHOM_HD void JointLink::look_at_masses(const JointBodies<SymMat3>& both, float h) {
  JointBodies<SymMat3> bodies = both;
  GenericJointRow<float> row{};
  static_cast<GenericJointPlace<float>&>(row) = row_;
  const GenericJointRows<float, JointBodies<SymMat3>> rows(row, bodies, h);
  GenericSystem<float> system{};
  for (int i = 0; i < axis_count; ++i)
    for (int j = 0; j < axis_count; ++j) system.response[i][j] = rows.response(i, j);
  for (int i = 0; i < axis_count; ++i) system.eliminate(i, axis(i).locked, 0.0f);
  for (int i = 0; i < axis_count; ++i) mass_[i] = system.response[i][i];
}

FATHOM_HD GenericImpulse JointLink::impulse() const {
  const LinkImpulse of_link = LinkJoint::impulse();
  GenericImpulse impulse;
  for (int i = 0; i < axis_count; ++i) impulse.hold[i] = of_link.hold[i], impulse.drive[i] = of_link.drive[i];
  impulse.force = of_link.force, impulse.torque = of_link.torque;
  return impulse;
}

}  // namespace fathom
