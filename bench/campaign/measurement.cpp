#include "measurement.hpp"

#include <algorithm>

namespace fathom::campaign {
namespace {

constexpr std::size_t start_up_steps = 60, half_window = 30;
constexpr std::size_t block_steps = 60;

std::vector<double> series(const std::vector<Sample>& samples, double Sample::*figure) {
  std::vector<double> values;
  values.reserve(samples.size());
  for (const Sample& sample : samples) values.push_back(sample.*figure);
  return values;
}

Spikes spikes(const std::vector<Sample>& samples) {
  std::vector<double> ratios, window;
  for (std::size_t i = std::min(start_up_steps, samples.size() / 2); i < samples.size(); ++i) {
    const std::size_t begin = i < half_window ? 0 : i - half_window;
    const std::size_t end = std::min(samples.size(), i + half_window + 1);
    window.clear();
    for (std::size_t k = begin; k < end; ++k) window.push_back(samples[k].total);
    const double median = statistics(window).median;
    if (median > 0) ratios.push_back(samples[i].total / median);
  }
  if (ratios.empty()) return {};
  const Statistics s = statistics(ratios);
  return {s.p99, s.max};
}

std::vector<double> block_medians(const std::vector<double>& total) {
  std::vector<double> medians;
  for (std::size_t begin = 0; begin + block_steps <= total.size(); begin += block_steps) {
    const auto first = total.begin() + static_cast<std::ptrdiff_t>(begin);
    medians.push_back(statistics({first, first + static_cast<std::ptrdiff_t>(block_steps)}).median);
  }
  return medians;
}

}  // namespace

Summary summarise(const std::vector<Sample>& samples) {
  const std::vector<double> total = series(samples, &Sample::total);
  return {
      {statistics(total), statistics(series(samples, &Sample::broad_phase)),
       statistics(series(samples, &Sample::narrow_phase)), statistics(series(samples, &Sample::collision_resolution))},
      spikes(samples),
      block_medians(total)};
}

}  // namespace fathom::campaign
