#include "compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "results_file.hpp"
#include "view.hpp"

namespace fathom::campaign {
namespace {

using Entry = ResultEntry;
using File = ResultsFile;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Squared standard error of the mean of these values.
double standard_error_squared(const std::vector<double>& values) {
  if (values.size() < 2) return 0;
  const double mean = mean_of(values);
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum / static_cast<double>(values.size() - 1) / static_cast<double>(values.size());
}

/// 97.5 % quantile of Student's t.
double student(std::size_t degrees) {
  constexpr std::array<double, 10> table{12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  return degrees == 0 ? table[0] : degrees <= table.size() ? table[degrees - 1] : 2.0;
}

/// The logarithms of the times of a round's stretches.
std::vector<double> logarithms(const std::vector<double>& stretches, std::size_t count) {
  std::vector<double> logs;
  for (std::size_t i = 0; i < count; ++i) logs.push_back(std::log(std::max(stretches[i], 1e-9)));
  return logs;
}

std::size_t stretches_of(const Entry& entry) {
  std::size_t least = entry.rounds.front().size();
  for (const auto& round : entry.rounds) least = std::min(least, round.size());
  return least;
}

/// Why the times of two entries cannot be compared; "" if they can.
std::string incomparable(const Entry& a, const Entry& b) {
  if (a.rounds.empty() || b.rounds.empty()) return "no times";
  if (a.in_stretches && b.in_stretches) return {};
  if (a.in_stretches == b.in_stretches && a.steps == b.steps) return {};
  return fmt::format("{} and {} steps", a.steps, b.steps);
}

/// Compares times of the same stretches of steps in pairs: the scene does the same in both.
void compare_times(Difference& d, const Entry& a, const Entry& b, double noise) {
  d.not_compared = incomparable(a, b);
  if (!d.not_compared.empty()) return;
  const std::size_t count = std::min(stretches_of(a), stretches_of(b));
  std::vector<double> rounds[2], sums[2];
  for (const int side : {0, 1}) {
    const Entry& entry = side == 0 ? a : b;
    sums[side].assign(count, 0);
    for (const auto& round : entry.rounds) {
      const std::vector<double> logs = logarithms(round, count);
      rounds[side].push_back(mean_of(logs));
      for (std::size_t i = 0; i < count; ++i) sums[side][i] += logs[i] / static_cast<double>(entry.rounds.size());
    }
  }
  std::vector<double> differences;
  for (std::size_t i = 0; i < count; ++i) differences.push_back(sums[1][i] - sums[0][i]);
  const double change = mean_of(rounds[1]) - mean_of(rounds[0]);
  const double within = student(differences.size() - 1) * std::sqrt(standard_error_squared(differences));
  const std::size_t fewest = std::min(rounds[0].size(), rounds[1].size());
  const double between =
      fewest < 2
          ? std::log1p(noise)
          : student(fewest - 1) * std::sqrt(standard_error_squared(rounds[0]) + standard_error_squared(rounds[1]));
  const double half = std::hypot(count > 1 ? within : 0, between);
  d.before = std::exp(mean_of(rounds[0])), d.after = std::exp(mean_of(rounds[1]));
  d.ratio = std::exp(change), d.low = std::exp(change - half), d.high = std::exp(change + half);
  d.slower = d.low > 1, d.faster = d.high < 1;
}

/// A count is exact up to the tolerance, which covers variations of the compiler and of libraries.
void compare_counts(Difference& d, const Entry& a, const Entry& b, double tolerance) {
  d.unit = "instructions";
  d.before = a.rounds.front().front(), d.after = b.rounds.front().front();
  d.ratio = d.low = d.high = d.after / d.before;
  d.slower = d.ratio > 1 + tolerance, d.faster = d.ratio < 1 - tolerance;
}

/// A figure that grew by more than a tenth, and by more than `margin`, below which nobody notices; else empty.
std::string grown(const Json& a, const Json& b, const char* name, double margin, const char* what, const char* unit) {
  if (!a.contains(name) || !b.contains(name) || !a.at(name).is_number() || !b.at(name).is_number()) return {};
  const double before = a.at(name), after = b.at(name);
  if (after <= 1.1 * before || after <= before + margin) return {};
  return fmt::format("{} {} -> {} {}", what, figure(before), figure(after), unit);
}

/// The latest quality that both measured after the same number of steps.
std::pair<const Json*, const Json*> at_last_common_step(const Entry& a, const Entry& b) {
  for (auto last = a.quality.rbegin(); last != a.quality.rend(); ++last)
    for (const auto& [step, quality] : b.quality)
      if (step == last->first) return {&last->second, &quality};
  return {};
}

/// Which of the two ended early.
std::string cut_short(const Entry& a, const Entry& b) {
  std::string text;
  for (const auto& [name, entry] : {std::pair("before", &a), std::pair("after", &b)})
    if (entry->cut_short)
      text += fmt::format("{}{} cut short at {} steps", text.empty() ? "" : ", ", name, entry->steps);
  return text;
}

std::string less_stable(const Entry& a, const Entry& b) {
  if (a.trouble.empty() && !b.trouble.empty()) return b.trouble;
  if (a.hash == b.hash && !a.hash.empty()) return {};
  const auto [before, after] = at_last_common_step(a, b);
  if (!before || !after) return {};
  std::string text = grown(*before, *after, "ground_penetration_max", 1e-4, "in the ground", "m");
  // If bodies move freely, the scene alone determines how far and how fast.
  if (!a.rests) return text;
  for (const std::string& more : {grown(*before, *after, "displacement_max", 1e-3, "moved", "m"),
                                  grown(*before, *after, "kinetic_energy_per_body", 1e-4, "energy", "J")})
    if (!more.empty()) text += (text.empty() ? "" : ", ") + more;
  return text;
}

void note_missing(Comparison& comparison, const File& in, const File& from) {
  for (const Entry& entry : in.entries)
    if (std::ranges::find(from.entries, entry.name, &Entry::name) == from.entries.end())
      comparison.notes.push_back(entry.name + ": only in " + in.path);
}

}  // namespace

bool Comparison::worse() const {
  return std::ranges::any_of(differences, [](const Difference& d) { return d.slower || !d.less_stable.empty(); });
}

bool Comparison::nothing_compared() const {
  return std::ranges::all_of(differences, [](const Difference& d) { return !d.not_compared.empty(); });
}

std::string Difference::text(std::size_t width) const {
  const bool count = unit == "instructions";
  std::string row = fmt::format("{:<{}}  ", name, width);
  if (!not_compared.empty())
    row += fmt::format("{:>12}  {:>12}  {:>6}  {:<15}  not compared: {}", "-", "-", "-", "", not_compared);
  else
    row += fmt::format("{:>12}  {:>12}  {:>6.3f}  {:<15}", count ? grouped(std::llround(before)) : figure(before),
                       count ? grouped(std::llround(after)) : figure(after), ratio,
                       count ? "" : fmt::format("{:.3f} to {:.3f}", low, high));
  if (slower) row += count ? "  MORE" : "  SLOWER";
  if (faster) row += count ? "  fewer" : "  faster";
  if (!less_stable.empty()) row += "  LESS STABLE: " + less_stable;
  if (!cut_short.empty()) row += "  (" + cut_short + ")";
  return row + "\n";
}

std::string Comparison::text() const {
  std::size_t width = 4;
  for (const Difference& d : differences) width = std::max(width, d.name.size());
  std::string text =
      fmt::format("{:<{}}  {:>12}  {:>12}  {:>6}  {:<15}\n", "", width, "before", "after", "ratio", "95 %");
  for (const Difference& d : differences) text += d.text(width);
  for (const std::string& note : notes) text += note + "\n";
  const auto count = [&](auto predicate) { return std::ranges::count_if(differences, predicate); };
  const auto missing = count([](const Difference& d) { return !d.not_compared.empty(); });
  return text + fmt::format("{} slower, {} faster, {} less stable, of {}{}\n",
                            count([](const Difference& d) { return d.slower; }),
                            count([](const Difference& d) { return d.faster; }),
                            count([](const Difference& d) { return !d.less_stable.empty(); }), differences.size(),
                            missing > 0 ? fmt::format("; the times of {} are not compared", missing) : std::string());
}

Comparison compare(const std::string& before, const std::string& after, const CompareSettings& settings) {
  const File a = read_results(before), b = read_results(after);
  if (a.kind != b.kind)
    throw Error(ErrorCode::file, fmt::format("{} contains {}, {} contains {}; only results of one kind can be compared",
                                             before, a.kind, after, b.kind));
  Comparison comparison;
  if (a.machine != b.machine)
    comparison.notes.push_back(fmt::format("beware: before {}, after {}", a.machine, b.machine));
  for (const Entry& entry : a.entries) {
    const auto other = std::ranges::find(b.entries, entry.name, &Entry::name);
    if (other == b.entries.end()) continue;
    Difference d;
    d.name = entry.name, d.unit = "ms";
    if (a.kind == "instructions") {
      compare_counts(d, entry, *other, a.tolerance);
    } else {
      compare_times(d, entry, *other, settings.noise);
      d.less_stable = less_stable(entry, *other);
      d.cut_short = cut_short(entry, *other);
    }
    comparison.differences.push_back(std::move(d));
  }
  note_missing(comparison, a, b);
  note_missing(comparison, b, a);
  return comparison;
}

}  // namespace fathom::campaign
