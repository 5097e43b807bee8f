// The direct solution of trees of ball joints (dynamics/joint_tree-inl.hpp), for one tree. Pure, for host and device.
#pragma once

#include <fathom/math.hpp>

#include "dynamics/lane_scalar.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/joint_tree-inl.hpp"
#undef FATHOM_LANE_FUNCTION

}  // namespace fathom
