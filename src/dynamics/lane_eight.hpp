// The eight-lane types and functions for the instruction set that files are compiled for.
#pragma once

#include <type_traits>

#include "dynamics/tuning.hpp"
#include "math/eight.hpp"

namespace fathom::wide {

#define FATHOM_LANE_LAMBDA
#include "dynamics/lane_eight-inl.hpp"
#undef FATHOM_LANE_LAMBDA

}  // namespace fathom::wide
