#include "measure/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fathom {
namespace {

/// Nearest-rank percentile: the smallest of the sorted values that at least `share` of them do not exceed.
double quantile(const std::vector<double>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

}  // namespace

Statistics statistics(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {sum / static_cast<double>(values.size()), quantile(values, 0.5), quantile(values, 0.99), values.back()};
}

}  // namespace fathom
