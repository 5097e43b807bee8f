// Generic and distance joints as links of one mechanism (dynamics/joint_link-inl.hpp). Pure, for host and device.
#pragma once

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

/// A LinkJoint of a single mechanism, where drives may be springs against masses.
class JointLink : public LinkJoint {
 public:
  /// Finds the response of its axes where limits or drives need it (`GenericAxis::response`).
  FATHOM_HD void look_at_masses(const JointBodies<SymMat3>& bodies, float h);
};

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

}  // namespace fathom
