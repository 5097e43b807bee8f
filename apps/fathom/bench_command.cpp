// `fathom bench`: repeats the published experiment, measures other engines, compares results.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>

#include "bench/campaign/peers_section.hpp"
#include "bench/campaign/report.hpp"
#include "bench_options.hpp"
#include "commands.hpp"
#include "measure/system.hpp"

namespace fathom::cli {
namespace {

using namespace fathom::campaign;

std::string clock_text(double seconds) {
  const auto s = static_cast<long>(seconds);
  return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                   : fmt::format("{}:{:02}", s / 60, s % 60);
}

/// On a terminal a line that is overwritten ten times per second, elsewhere one line per run.
class ProgressLine {
 public:
  explicit ProgressLine(bool on) : on_(on), terminal_(stderr_is_terminal()) {}
  ~ProgressLine() {
    if (on_ && terminal_) tell("\r\x1b[K");
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& p) {
    if (!on_) return;
    if (!terminal_) {
      if (p.run != run_) tell(fmt::format("{}/{}  {}\n", p.run, p.runs, key_of(*p.what)));
    } else if (const auto now = std::chrono::steady_clock::now(); now - drawn_ > std::chrono::milliseconds(100)) {
      drawn_ = now;
      const std::string text =
          fmt::format("{}/{}  {}  {:.0f} %  about {} left", p.run, p.runs, key_of(*p.what),
                      100.0 * static_cast<double>(p.step) / static_cast<double>(p.steps), clock_text(p.seconds_left));
      tell(fmt::format("\r{}\x1b[K", fit_to_terminal(text)));
      std::fflush(stderr);
    }
    run_ = p.run;
  }

 private:
  bool on_, terminal_;
  std::size_t run_ = 0;
  std::chrono::steady_clock::time_point drawn_{};
};

int campaign_command(CampaignOptions options) {
  if (options.settings.limits.seconds == 0)
    options.settings.limits.seconds = options.settings.form == Form::quick ? 60 : 600;
  const Store store(options.out);
  const InterruptGuard interrupt;
  bool complete = false;
  {
    ProgressLine line(!options.quiet);
    complete = run_campaign(store, options.settings, [&](const campaign::Progress& progress) {
      line.show(progress);
      return !InterruptGuard::requested();
    });
  }
  const Campaign made = store.load();
  fmt::print("{}\n", write_report(store));
  if (!complete) {
    tell(fmt::format("fathom: {} of {} runs are done; continue with --resume\n", made.runs.size(), made.planned));
    return interrupted;
  }
  const auto refused = std::ranges::count_if(made.runs, [](const Measurement& run) { return !run.refused.empty(); });
  if (refused > 0)
    tell(fmt::format("fathom: {} of {} runs were refused; the report says which and why\n", refused, made.runs.size()));
  return refused > 0 ? failed : finished;
}

int report_command(const std::string& folder) {
  const Store store(folder);
  fmt::print("{}\n", write_report(store));
  return finished;
}

int peers_command(PeersOptions options) {
  const bool reports = options.peers.json.empty();  // the report shows the content of its folder
  const Store store(options.out);
  if (reports) {
    peers::check(options.peers);
    store.create();
    options.peers.json = store.path(peers_file);
  }
  const peers::Outcome outcome = peers::run(options.peers);
  if (outcome == peers::Outcome::interrupted) return interrupted;
  if (reports) fmt::print("{}\n", write_report(store));
  return outcome == peers::Outcome::good ? finished : failed;
}

int compare_command(const CompareOptions& options) {
  const Comparison comparison = compare(options.before, options.after, options.settings);
  fmt::print("{}", comparison.text());
  if (comparison.worse()) return failed;
  if (comparison.nothing_compared())
    throw Error(ErrorCode::invalid_argument, options.before + " and " + options.after +
                                                 ": nothing in them can be compared; measure the same scenes, "
                                                 "with as many steps");
  return finished;
}

}  // namespace

int bench(const BenchOptions& options) {
  if (options.report_command->parsed()) return report_command(options.report_folder);
  if (options.peers_command->parsed()) return peers_command(options.peers);
  if (options.compare_command->parsed()) return compare_command(options.compare);
  return campaign_command(options.campaign);
}

}  // namespace fathom::cli
