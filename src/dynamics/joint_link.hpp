// Generic and distance joints as links of one mechanism (dynamics/joint_link-inl.hpp). Pure, for host and device.
#pragma once

#include <cstdint>
#include <new>

#include "dynamics/flatten.hpp"
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

}  // namespace fathom
