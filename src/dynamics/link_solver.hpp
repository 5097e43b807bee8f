// The links of mechanisms, one at a time (dynamics/link_solver-inl.hpp). Pure, for host and device.
#pragma once

#include <cstdint>

#include "dynamics/flatten.hpp"
#include "dynamics/mechanism_link.hpp"
#include "dynamics/speed_limits.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#define FATHOM_LANE_LAMBDA
#include "dynamics/link_solver-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

}  // namespace fathom
