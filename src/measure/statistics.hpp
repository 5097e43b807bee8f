// Statistics of a series of measurements.
#pragma once

#include <vector>

namespace fathom {

struct Statistics {
  double mean = 0;
  double median = 0;
  double p99 = 0;  ///< the smallest value that 99 % do not exceed
  double max = 0;
};

/// All zero for an empty series.
Statistics statistics(std::vector<double> values);

}  // namespace fathom
