#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "crossover.hpp"
#include "measure/counted.hpp"
#include "page/html.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::escaped;

struct Range {
  double least = 1e300, most = -1e300;
  void add(double value) { least = std::min(least, value), most = std::max(most, value); }
  bool empty() const { return least > most; }
  std::string text() const {
    return figure(least) == figure(most) ? figure(least) : fmt::format("{} to {}", figure(least), figure(most));
  }
};

double mean(const Measurement& run) { return run.summary.stages.total.mean; }

std::string tally(const View& view) {
  std::size_t reported = 0, refused = 0, skipped = 0, failing = 0, cut = 0;
  for (const Measurement* run : view.runs()) {
    reported += run->reported(), refused += !run->refused.empty(), skipped += !run->skipped.empty();
    failing += !run->failing.empty(), cut += run->cut_short;
  }
  std::string text = fmt::format("{} {} reported", counted(reported, "run"), reported == 1 ? "is" : "are");
  if (failing > 0) text += fmt::format(", {} of them failing (bodies below the ground)", failing);
  if (cut > 0) text += fmt::format(", {} cut short by the time limit", cut);
  text += refused > 0 ? fmt::format("; {} {} refused because states were not finite or exploded", refused,
                                    refused == 1 ? "is" : "are")
                      : "; none had to be refused";
  if (skipped > 0) text += fmt::format("; {} could not be run here", skipped);
  return text + ".";
}

/// Native with the tables' number of threads and our defaults against the published processor.
std::string against_the_processor(const View& view) {
  Range faster;
  std::string slowest;
  for (const std::string& environment : view.environments())
    for (const std::int64_t bodies : view.sizes(environment))
      for (const Measurement* run : view.native_runs(environment, bodies, "fathom"))
        for (const PublishedRow* row : published_of(environment, bodies))
          if (run->what.threads == view.table_threads() && row->simulator == "native" && !run->cut_short) {
            const double factor = row->total() / mean(*run);
            if (factor < faster.least) slowest = fmt::format("{} {}", environment, grouped(bodies));
            faster.add(factor);
          }
  if (faster.empty()) return {};
  return fmt::format(
      "The native simulator with {} of this machine makes a step {} times as fast as the published native "
      "simulator with 8 threads of a Ryzen 9 3950X (least in {}). Hardware and algorithms both differ.",
      counted(static_cast<std::uint64_t>(view.table_threads()), "thread"), faster.text(), slowest);
}

/// Each set of algorithms on the same simulator and hardware: only the algorithms differ.
std::string against_the_algorithms(const View& view) {
  std::string text;
  std::map<std::string, Range> by_hardware;
  for (const Measurement* run : view.runs()) {
    if (run->what.set != "fathom" || !run->reported()) continue;
    for (const Measurement* other : view.runs()) {
      Case same = other->what;
      same.set = "fathom", same.round = run->what.round;
      if (other->what.set == "dissertation" && other->reported() && same == run->what) {
        const auto [published, ours] = means_of_common_steps(*other, *run, stages().back());
        by_hardware[label_of(run->what)].add(published / ours);
      }
    }
  }
  for (const auto& [label, range] : by_hardware)
    text += fmt::format(
        "<li>On the same hardware the dissertation's algorithms take {} times as long as Fathom's ({}).</li>\n",
        range.text(), escaped(label));
  return text;
}

std::string stacks(const View& view) {
  const std::vector<std::int64_t> sizes = view.sizes("pyramid");
  std::string text;
  for (const std::int64_t bodies : {std::int64_t{1'240}, std::int64_t{385}, std::int64_t{55}}) {
    if (std::ranges::find(sizes, bodies) == sizes.end()) continue;
    for (const Measurement* run : view.table_runs("pyramid", bodies)) {
      if (!run->reported() || run->steps < view.campaign().where.steps) continue;
      const double moved = run->end().displacement_max;
      text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", escaped(label_of(run->what)),
                          trouble_of(*run).empty()
                              ? fmt::format("stands, {} {} mm", creep_of(*run).empty() ? "moved" : "but <b>crept</b>",
                                            figure(1e3 * moved))
                              : fmt::format("<b>{}</b>, moved {} m", escaped(trouble_of(*run)), figure(moved)));
    }
    if (!text.empty())
      return fmt::format("After {:.3g} s the pyramid of {} bodies on {}.",
                         static_cast<double>(view.campaign().where.steps) / 60, grouped(bodies), text);
  }
  return {};
}

std::string crossovers(const View& view) {
  std::string text;
  for (const std::string& label : device_labels(view)) {
    if (label.find(" on host") != std::string::npos) continue;  // the same processor again
    std::string parts;
    for (const std::string& environment : view.environments())
      if (const auto found = crossover(duels(view, environment, label, stages().back())))
        parts += fmt::format("{}{}: {}", parts.empty() ? "" : ", ", environment, found->text());
    if (!parts.empty())
      text += fmt::format("<li>{} beats the native simulator on the whole step from this many bodies on: {}.</li>\n",
                          escaped(label), parts);
  }
  return text;
}

std::string spikes_text(const View& view) {
  std::vector<double> p99, max;
  std::string worst;
  for (const Measurement* run : view.runs()) {
    if (!run->reported() || run->what.set != "fathom") continue;
    if (max.empty() || run->summary.spikes.max > *std::ranges::max_element(max))
      worst = fmt::format("{} {}, {}", run->what.environment, grouped(run->what.bodies), escaped(label_of(run->what)));
    p99.push_back(run->summary.spikes.p99), max.push_back(run->summary.spikes.max);
  }
  if (p99.empty()) return {};
  const Statistics usual = statistics(p99), longest = statistics(max);
  return fmt::format(
      "Spikes with Fathom's algorithms: in the median run, 1 step in 100 takes more than {} times the median of the "
      "steps around it, and the longest takes {} times; the longest of all {} times ({}). Where other programs share "
      "the processor, some of these are due to them. The dissertation's device steps had spikes of 150 to 300 ms.",
      figure(usual.median), figure(longest.median), figure(longest.max), worst);
}

/// Whether the machine had other work, which affects the figures.
std::string company(const View& view) {
  std::vector<double> per_hundred;
  for (const Measurement* run : view.runs())
    if (run->reported() && run->steps > 0)
      per_hundred.push_back(100 * static_cast<double>(run->interruptions) / static_cast<double>(run->steps));
  if (per_hundred.empty()) return {};
  const Statistics s = statistics(per_hundred);
  return fmt::format("Other programs interrupted the median run {} times per 100 steps, the worst {} times{}.",
                     figure(s.median), figure(s.max),
                     s.median > 1 ? ": <b>the machine was not quiet</b>, and times are longer than they need be" : "");
}

std::string threads_text(const View& view) {
  std::string best;
  double gain = 1;
  bool compared = false;
  for (const std::string& environment : view.environments())
    for (const std::int64_t bodies : view.sizes(environment)) {
      const std::vector<const Measurement*> runs = view.native_runs(environment, bodies, "fathom");
      if (runs.size() < 2 || runs.front()->what.threads != 1) continue;
      const Measurement* fastest = view.fastest_native(environment, bodies, "fathom");
      compared = true;
      const auto [one, best_ms] = means_of_common_steps(*runs.front(), *fastest, stages().back());
      if (one / best_ms <= gain) continue;
      gain = one / best_ms;
      best = fmt::format("{} {} with {}", environment, grouped(bodies),
                         counted(static_cast<std::uint64_t>(fastest->what.threads), "thread"));
    }
  if (best.empty()) return compared ? "More threads than one gained nothing." : "";
  return fmt::format("More threads gain most in {}: {} times one thread's speed.", best, figure(gain));
}

/// Whether all threads and devices ended in the same state for the same scene and algorithms.
std::string determinism(const View& view) {
  std::map<std::string, std::set<std::string>> native, device;
  for (const Measurement* run : view.runs()) {
    if (!run->reported() || run->cut_short) continue;
    const std::string scene = fmt::format("{} {} {}", run->what.environment, run->what.bodies, run->what.set);
    if (run->what.simulator == "native") native[scene].insert(run->hash);
    if (run->what.simulator == "device") device[scene].insert(run->hash);
  }
  const auto differing = [](const auto& hashes) {
    return std::ranges::count_if(hashes, [](const auto& entry) { return entry.second.size() > 1; });
  };
  if (native.empty() && device.empty()) return {};
  std::string text = "State hashes after the last step: ";
  const auto say = [&](const char* name, const auto& hashes) {
    if (hashes.empty()) return std::string();
    if (differing(hashes) > 0)
      return fmt::format("{} <b>differ in {} of {}</b>", name, differing(hashes), counted(hashes.size(), "scene"));
    return hashes.size() == 1 ? fmt::format("{} agree in the one scene", name)
                              : fmt::format("{} agree in all {} scenes", name, hashes.size());
  };
  text += say("all numbers of threads", native);
  if (!native.empty() && !device.empty()) text += "; ";
  return text + say("all devices", device) + ".";
}

}  // namespace

std::string summary_section(const View& view) {
  std::string items;
  const auto item = [&](const std::string& text) {
    if (!text.empty()) items += "<li>" + text + "</li>\n";
  };
  item(tally(view));
  item(against_the_processor(view));
  items += against_the_algorithms(view);
  items += crossovers(view);
  item(stacks(view));
  item(spikes_text(view));
  item(company(view));
  item(threads_text(view));
  item(determinism(view));
  return "<h2 id='summary'>In short</h2>\n<ul>\n" + items + "</ul>\n";
}

}  // namespace fathom::campaign
