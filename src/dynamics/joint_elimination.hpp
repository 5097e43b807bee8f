// The direct solution across joints that leave some coordinates free (dynamics/joint_elimination-inl.hpp), for one
// tree. Pure, for host and device.
#pragma once

#include "dynamics/joint_tree.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#include "dynamics/joint_elimination-inl.hpp"
#undef FATHOM_LANE_FUNCTION

}  // namespace fathom
