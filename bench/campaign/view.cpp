#include "view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "plan.hpp"

namespace fathom::campaign {
namespace {

bool same_case(Case a, const Case& b) {
  a.round = b.round;
  return a == b;
}

/// The median round.
const Measurement* median_round(std::vector<const Measurement*> rounds) {
  std::ranges::sort(rounds, {}, [](const Measurement* run) { return run->summary.stages.total.mean; });
  return rounds[rounds.size() / 2];
}

/// A label without its set of algorithms: both sets of a simulator share one colour.
std::string_view simulator_in(std::string_view label) {
  constexpr std::string_view set = ", dissertation";
  return label.ends_with(set) ? label.substr(0, label.size() - set.size()) : label;
}

template <class T>
void add_once(std::vector<T>& list, const T& value) {
  if (std::ranges::find(list, value) == list.end()) list.push_back(value);
}

}  // namespace

const std::vector<Stage>& stages() {
  static const std::vector<Stage> all = {
      {"Broad phase", &Sample::broad_phase, &StageStatistics::broad_phase,
       [](const PublishedRow& row) { return row.broad_phase; }},
      {"Narrow phase", &Sample::narrow_phase, &StageStatistics::narrow_phase,
       [](const PublishedRow& row) { return row.narrow_phase; }},
      {"Collision resolution", &Sample::collision_resolution, &StageStatistics::collision_resolution,
       [](const PublishedRow& row) { return row.collision_resolution; }},
      {"Whole step", &Sample::total, &StageStatistics::total, [](const PublishedRow& row) { return row.total(); }},
  };
  return all;
}

View::View(const Campaign& campaign) : campaign_(campaign) {
  table_threads_ = campaign::table_threads(campaign.where.threads);
  for (const Measurement& run : campaign.runs) {
    if (std::ranges::any_of(runs_, [&](const Measurement* other) { return same_case(other->what, run.what); }))
      continue;
    std::vector<const Measurement*> rounds;
    for (const Measurement& other : campaign.runs)
      if (same_case(other.what, run.what)) rounds.push_back(&other);
    // Show a round that went wrong, if there is one.
    const auto wrong = std::ranges::find_if(rounds, [](const Measurement* r) { return !r->reported(); });
    runs_.push_back(wrong != rounds.end() ? *wrong : median_round(rounds));
  }
  for (const std::string& environment : environments())
    for (const std::int64_t bodies : sizes(environment))
      for (const Measurement* run : table_runs(environment, bodies))
        add_once(simulators_, std::string(simulator_in(label_of(run->what))));
}

std::vector<std::string> View::environments() const {
  std::vector<std::string> names;
  for (const Measurement* run : runs_) add_once(names, run->what.environment);
  return names;
}

std::vector<std::int64_t> View::sizes(const std::string& environment) const {
  std::vector<std::int64_t> sizes;
  for (const Measurement* run : runs_)
    if (run->what.environment == environment) add_once(sizes, run->what.bodies);
  std::ranges::sort(sizes);
  return sizes;
}

std::vector<const Measurement*> View::of(const std::string& environment, std::int64_t bodies) const {
  std::vector<const Measurement*> found;
  for (const Measurement* run : runs_)
    if (run->what.environment == environment && run->what.bodies == bodies) found.push_back(run);
  return found;
}

std::vector<const Measurement*> View::table_runs(const std::string& environment, std::int64_t bodies) const {
  std::vector<const Measurement*> found = of(environment, bodies);
  std::erase_if(
      found, [&](const Measurement* run) { return run->what.device.empty() && run->what.threads != table_threads_; });
  return found;
}

std::vector<const Measurement*> View::native_runs(const std::string& environment, std::int64_t bodies,
                                                  const std::string& set) const {
  std::vector<const Measurement*> found = of(environment, bodies);
  std::erase_if(found, [&](const Measurement* run) {
    return run->what.simulator != "native" || run->what.set != set || !run->reported();
  });
  return found;
}

const Measurement* View::fastest_native(const std::string& environment, std::int64_t bodies,
                                        const std::string& set) const {
  const std::vector<const Measurement*> found = native_runs(environment, bodies, set);
  const std::uint64_t last = steps_of_all(found);
  const auto fastest = std::ranges::min_element(
      found, {}, [&](const Measurement* run) { return mean_of_first_steps(*run, last, stages().back()); });
  return fastest == found.end() ? nullptr : *fastest;
}

int View::colour(const std::string& label) const {
  const std::string_view simulator = simulator_in(label);
  const auto index = static_cast<int>(std::ranges::find(simulators_, simulator) - simulators_.begin());
  return index % 8 + (simulator == label ? 0 : 8);
}

double mean_of_first_steps(const Measurement& run, std::uint64_t last, const Stage& stage) {
  double sum = 0, count = 0;
  for (const Sample& sample : run.samples)
    if (sample.step <= last) sum += sample.*stage.sample, ++count;
  return count > 0 ? sum / count : 0.0;
}

std::uint64_t steps_of_all(const std::vector<const Measurement*>& runs) {
  std::uint64_t steps = std::numeric_limits<std::uint64_t>::max();
  for (const Measurement* run : runs)
    if (run->reported()) steps = std::min(steps, run->steps);
  return steps;
}

std::pair<double, double> means_of_common_steps(const Measurement& a, const Measurement& b, const Stage& stage) {
  const std::uint64_t last = std::min(a.steps, b.steps);
  return {mean_of_first_steps(a, last, stage), mean_of_first_steps(b, last, stage)};
}

namespace {

// A tenth of a body's size is where a stack visibly gives way, a hundredth where a body visibly sinks in or creeps.
constexpr double gives_way = 0.1, creeps = 0.01, sinks = 0.01;

bool should_rest(const Measurement& run) {
  return run.what.environment == "spread" || run.what.environment == "pyramid";
}

}  // namespace

std::string creep_of(const Measurement& run) {
  if (!trouble_of(run).empty() || !should_rest(run) || !(run.end().displacement_max > creeps)) return {};
  return fmt::format("creeps: {} mm", figure(1e3 * run.end().displacement_max));
}

std::string trouble_of(const Measurement& run) {
  if (!run.failing.empty()) return run.failing;
  if (should_rest(run) && run.end().displacement_max > gives_way) return "gave way";
  return run.end().ground_penetration_max > sinks ? "sank in" : "";
}

std::vector<const PublishedRow*> published_of(const std::string& environment, std::int64_t bodies) {
  std::vector<const PublishedRow*> found;
  for (const PublishedRow& row : published_rows())
    if (row.environment == environment && row.bodies == bodies) found.push_back(&row);
  return found;
}

std::string grouped(std::int64_t number) {
  std::string digits = std::to_string(number);
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

std::string figure(double value) {
  if (value == 0) return "0";
  const double size = std::abs(value);
  if (size < 1e-4 || size >= 1e5) return fmt::format("{:.2g}", value);
  const int decimals = std::max(0, 2 - static_cast<int>(std::floor(std::log10(size))));
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace fathom::campaign
