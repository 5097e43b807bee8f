#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ostream>

#include "commands.hpp"
#include "csv.hpp"
#include "files/claim.hpp"
#include "measure/counted.hpp"
#include "measure/system.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "run.hpp"
#include "setup.hpp"

namespace fathom::cli {
namespace {

/// The options' files, or else the configuration's.
RunFileSettings run_files(const RunOptions& options, const engine::Config& config) {
  return {options.record.empty() ? config->record.file : options.record,
          options.trace.empty() ? config->trace.file : options.trace,
          {config->record.snapshot_every, config->record.states}};
}

void check_names(const RunOptions& options, const RunFileSettings& files) {
  if (files::is_stdout(options.json) && files::is_stdout(options.csv))
    throw Error(ErrorCode::invalid_argument, "--json and --csv cannot both go to stdout; give one a file");
  files::FileNames names = inputs_of(options);
  names.writes("--json", options.json);
  names.writes("--csv", options.csv);
  names.writes(options.record.empty() ? "record.file" : "--record", files.record);
  names.writes(options.trace.empty() ? "trace.file" : "--trace", files.trace);
}

RunResult simulate_with_outputs(const Setup& setup, std::uint64_t steps, const RunOptions& options,
                                const RunFileSettings& files, Output& csv) {
  Progress progress(steps, !options.quiet && stderr_is_terminal());
  if (csv.wanted()) write_csv_head(csv.stream());
  return simulate(setup.scene, steps, files, [&](const Profile& profile, double step_ms) {
    if (csv.wanted()) write_csv_row(csv.stream(), profile, step_ms);
    progress.update(profile.step);
  });
}

int exit_code(const RunResult& result) {
  if (result.quality.non_finite > 0) return failed;
  return result.interrupted ? interrupted : finished;
}

}  // namespace

int run(const RunOptions& options) {
  // Covers everything: measurements are written, whenever Ctrl-C comes.
  const InterruptGuard interrupt;
  Setup setup = make_setup(options);
  choose_device(setup);
  const RunFileSettings files = run_files(options, setup.config);
  check_names(options, files);
  const Scene& scene = setup.scene;
  const std::uint64_t steps = steps_to_run(options, scene.world);
  Output json(options.json);
  Output csv(options.csv);
  const RunResult result = simulate_with_outputs(setup, steps, options, files, csv);
  csv.finish();
  const Json report = to_json(scene, result);
  if (json.wanted()) json.stream() << report.dump(2) << "\n";
  json.finish();
  // A file on stdout must be the only output there.
  const bool taken =
      std::ranges::any_of(std::array{options.json, options.csv, files.record, files.trace}, files::is_stdout);
  if (!options.quiet && taken)
    tell(to_text(report, setup.size_note));
  else if (!options.quiet)
    fmt::print("{}", to_text(report, setup.size_note));
  if (result.quality.non_finite > 0) {
    tell(fmt::format("fathom: the state of {} was not finite; try a smaller --dt or more --substeps\n",
                     counted(result.quality.non_finite, "body", "bodies")));
  }
  return exit_code(result);
}

}  // namespace fathom::cli
