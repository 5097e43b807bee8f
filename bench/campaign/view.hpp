// The report's view of a campaign: one run per case, found by scene and simulator.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "published.hpp"
#include "store.hpp"

namespace fathom::campaign {

/// A published stage, or the whole step.
struct Stage {
  const char* name;
  double Sample::*sample;
  Statistics StageStatistics::*statistics;
  double (*published)(const PublishedRow& row);
};
/// Broad phase, narrow phase, collision resolution; then the whole step.
const std::vector<Stage>& stages();
inline constexpr std::size_t published_stages = 3;
/// Of `stages`, the whole step.
inline constexpr std::size_t whole_step = published_stages;
/// The columns of tables as indices of `stages`. The whole step comes first: it matters most.
inline constexpr std::array<std::size_t, published_stages + 1> column_order{whole_step, 0, 1, 2};

class View {
 public:
  explicit View(const Campaign& campaign);

  const Campaign& campaign() const { return campaign_; }
  /// For each case the round with the median of the mean steps, in the plan's order.
  const std::vector<const Measurement*>& runs() const { return runs_; }
  std::vector<std::string> environments() const;
  std::vector<std::int64_t> sizes(const std::string& environment) const;
  std::vector<const Measurement*> of(const std::string& environment, std::int64_t bodies) const;
  /// The runs in tables and plots: devices, and the native simulator with `table_threads` threads.
  std::vector<const Measurement*> table_runs(const std::string& environment, std::int64_t bodies) const;
  /// Reported runs of the native simulator with any number of threads.
  std::vector<const Measurement*> native_runs(const std::string& environment, std::int64_t bodies,
                                              const std::string& set) const;
  /// The fastest of them for the whole step, over the steps that all of them made, or null.
  const Measurement* fastest_native(const std::string& environment, std::int64_t bodies, const std::string& set) const;
  int table_threads() const { return table_threads_; }
  /// The same for a simulator throughout the report.
  int colour(const std::string& label) const;

 private:
  const Campaign& campaign_;
  std::vector<const Measurement*> runs_;
  std::vector<std::string> simulators_;  ///< in order of appearance, by their labels
  int table_threads_ = 1;
};

/// Mean (ms) of a stage over steps 1 to `last`.
double mean_of_first_steps(const Measurement& run, std::uint64_t last, const Stage& stage);

/// The number of steps that every reported run made: a run that was cut short can be compared over these.
std::uint64_t steps_of_all(const std::vector<const Measurement*>& runs);

/// Means (ms) of a stage over the steps that both runs made.
std::pair<double, double> means_of_common_steps(const Measurement& a, const Measurement& b, const Stage& stage);

/// What is wrong with the final state of a reported run, in a few words; empty if nothing is.
std::string trouble_of(const Measurement& run);
/// For a run without trouble whose bodies should rest: that they moved, and how far; otherwise empty.
std::string creep_of(const Measurement& run);

/// Published rows for that scene.
std::vector<const PublishedRow*> published_of(const std::string& environment, std::int64_t bodies);

/// "1,240"
std::string grouped(std::int64_t number);
/// Milliseconds or other figures with three significant digits, without exponents between 0.0001 and 100,000.
std::string figure(double value);

}  // namespace fathom::campaign
