#include "compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numeric>

#include "view.hpp"

namespace fathom::campaign {
namespace {

/// What one file knows of one thing.
struct Entry {
  std::string name;
  std::vector<std::vector<double>>
      rounds;  ///< ms; a value for every stretch of steps, the same stretches in all rounds
  std::string hash, trouble;
  Json quality;
  bool rests = false;  ///< bodies that should stay where they are
};

struct File {
  std::string path, kind, machine;
  std::vector<Entry> entries;
  double tolerance = 0;  ///< of instruction counts
};

Entry& entry_of(File& file, const std::string& name) {
  const auto found = std::ranges::find(file.entries, name, &Entry::name);
  if (found != file.entries.end()) return *found;
  return file.entries.emplace_back(Entry{name, {}, {}, {}, {}, false});
}

bool should_rest(const std::string& environment) { return environment == "spread" || environment == "pyramid"; }

void read_campaign(File& file, const Json& json) {
  const Json& where = json.at("circumstances");
  file.machine =
      where.at("processor").get<std::string>() + ", " + std::to_string(where.at("threads").get<int>()) + " threads";
  for (const Json& run : json.at("runs")) {
    if (!run.at("skipped").get<std::string>().empty()) continue;
    Case what;
    what.environment = run.at("environment"), what.bodies = run.at("bodies_asked");
    what.simulator = run.at("simulator"), what.device = run.at("device");
    what.threads = run.at("threads"), what.set = run.at("set");
    Entry& entry = entry_of(file, key_of(what));
    entry.trouble = run.at("refused").get<std::string>() + run.at("failing").get<std::string>();
    entry.hash = run.at("state_hash");
    entry.rests = should_rest(what.environment);
    entry.quality = run.at("quality").back();
    if (run.contains("blocks_ms")) entry.rounds.push_back(run.at("blocks_ms").get<std::vector<double>>());
  }
}

void read_peers(File& file, const Json& json) {
  file.machine = json.at("device");
  for (const Json& run : json.at("results")) {
    Entry& entry = entry_of(file, fmt::format("{} {} {}T", run.at("scene").get<std::string>(),
                                              run.at("engine").get<std::string>(), run.at("threads").get<int>()));
    entry.trouble = run.at("trouble");
    entry.rests = should_rest(run.at("environment"));
    entry.quality = run.at("quality");
    for (const Json& mean : run.at("step_ms").at("mean_of_rounds")) entry.rounds.push_back({mean.get<double>()});
  }
}

void read_instructions(File& file, const Json& json) {
  file.machine = json.at("compiler");
  file.tolerance = json.at("tolerance");
  for (const auto& [name, count] : json.at("instructions").items())
    entry_of(file, name).rounds.push_back({count.get<double>()});
}

File read(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw Error(ErrorCode::file, path + ": cannot be read; give files of 'fathom bench' or bench/instructions");
  File file{path, {}, {}, {}, 0};
  try {
    const Json json = Json::parse(in);
    file.kind = json.at("kind");
    if (file.kind == "campaign") read_campaign(file, json);
    if (file.kind == "peers") read_peers(file, json);
    if (file.kind == "instructions") read_instructions(file, json);
  } catch (const Json::exception&) {
    file.entries.clear();
  }
  if (file.entries.empty())
    throw Error(ErrorCode::file,
                path + ": holds no results; give campaign.json, peers.json or what bench/instructions wrote");
  return file;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Of the mean of such values, squared.
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

/// A round as the logarithms of its stretches.
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

/// Times of the same stretches of steps, paired: what the scene does there is the same in both.
void compare_times(Difference& d, const Entry& a, const Entry& b, double noise) {
  if (a.rounds.empty() || b.rounds.empty()) return;
  const std::size_t count = std::min(stretches_of(a), stretches_of(b));
  if (count == 0) return;
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

/// A count is exact but for what the tolerance allows: the compiler's moods, libraries.
void compare_counts(Difference& d, const Entry& a, const Entry& b, double tolerance) {
  d.unit = "instructions";
  d.before = a.rounds.front().front(), d.after = b.rounds.front().front();
  d.ratio = d.low = d.high = d.after / d.before;
  d.slower = d.ratio > 1 + tolerance, d.faster = d.ratio < 1 - tolerance;
}

/// A tenth more, and by more than a margin below which nobody sees it.
std::string grown(const Json& a, const Json& b, const char* name, double margin, const char* what, const char* unit) {
  if (!a.contains(name) || !b.contains(name) || !a.at(name).is_number() || !b.at(name).is_number()) return {};
  const double before = a.at(name), after = b.at(name);
  if (after <= 1.1 * before || after <= before + margin) return {};
  return fmt::format("{} {} -> {} {}", what, figure(before), figure(after), unit);
}

std::string less_stable(const Entry& a, const Entry& b) {
  if (a.trouble.empty() && !b.trouble.empty()) return b.trouble;
  if (a.hash == b.hash && !a.hash.empty()) return {};
  std::string text = grown(a.quality, b.quality, "ground_penetration_max", 1e-4, "in the ground", "m");
  // Where bodies move freely, how far and how fast is the scene's business.
  if (!a.rests) return text;
  for (const std::string& more : {grown(a.quality, b.quality, "displacement_max", 1e-3, "moved", "m"),
                                  grown(a.quality, b.quality, "kinetic_energy_per_body", 1e-4, "energy", "J")})
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

std::string Comparison::text() const {
  std::size_t width = 4;
  for (const Difference& d : differences) width = std::max(width, d.name.size());
  std::string text =
      fmt::format("{:<{}}  {:>12}  {:>12}  {:>6}  {:<15}\n", "", width, "before", "after", "ratio", "95 %");
  for (const Difference& d : differences) {
    const bool count = d.unit == "instructions";
    text += fmt::format("{:<{}}  {:>12}  {:>12}  {:>6.3f}  {:<15}", d.name, width,
                        count ? grouped(std::llround(d.before)) : figure(d.before),
                        count ? grouped(std::llround(d.after)) : figure(d.after), d.ratio,
                        count ? "" : fmt::format("{:.3f} to {:.3f}", d.low, d.high));
    if (d.slower) text += count ? "  MORE" : "  SLOWER";
    if (d.faster) text += count ? "  fewer" : "  faster";
    if (!d.less_stable.empty()) text += "  LESS STABLE: " + d.less_stable;
    text += "\n";
  }
  for (const std::string& note : notes) text += note + "\n";
  const auto count = [&](auto predicate) { return std::ranges::count_if(differences, predicate); };
  return text + fmt::format("{} slower, {} faster, {} less stable, of {}\n",
                            count([](const Difference& d) { return d.slower; }),
                            count([](const Difference& d) { return d.faster; }),
                            count([](const Difference& d) { return !d.less_stable.empty(); }), differences.size());
}

Comparison compare(const std::string& before, const std::string& after, const CompareSettings& settings) {
  const File a = read(before), b = read(after);
  if (a.kind != b.kind)
    throw Error(ErrorCode::file,
                fmt::format("{} holds {}, {} holds {}; only like can be compared", before, a.kind, after, b.kind));
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
    }
    comparison.differences.push_back(std::move(d));
  }
  note_missing(comparison, a, b);
  note_missing(comparison, b, a);
  return comparison;
}

}  // namespace fathom::campaign
