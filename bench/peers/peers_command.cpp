#include "peers_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>

#include "files/output_file.hpp"
#include "measure/system.hpp"
#include "report.hpp"

namespace fathom::peers {
namespace {

const std::vector<std::string> published_scenes = {
    "drift:100",   "drift:1000",   "drift:10000", "layers:100", "layers:1000", "layers:10000",  "spread:100",
    "spread:1000", "spread:10000", "pyramid:5",   "pyramid:10", "pyramid:15",  "pyramid:30@200"};
const std::vector<std::string> quick_scenes = {"drift:1000", "layers:1000", "spread:1000", "pyramid:15"};
constexpr int published_steps = 600, quick_steps = 200;

std::vector<SceneEntry> chosen_scenes(const Options& options) {
  const int steps = options.steps > 0 ? options.steps : options.quick ? quick_steps : published_steps;
  const std::vector<std::string>& names = !options.scenes.empty() ? options.scenes
                                          : options.quick         ? quick_scenes
                                                                  : published_scenes;
  std::vector<SceneEntry> scenes;
  for (const std::string& name : names) scenes.push_back(parse_scene_entry(name, steps));
  return scenes;
}

std::vector<const EngineKind*> chosen_engines(const Options& options) {
  std::vector<const EngineKind*> chosen;
  for (const std::string& name : options.engines) chosen.push_back(&find_engine(name));
  if (chosen.empty())
    for (const EngineKind& engine : engines()) chosen.push_back(&engine);
  return chosen;
}

/// On a terminal, overwrites one line; elsewhere prints only a word per round.
void show_progress(int round, int rounds, const Result& next) {
  static int last_round = 0;
  if (stderr_is_terminal())
    tell(fmt::format("\r\x1b[K{}", fit_to_terminal(fmt::format("round {}/{}: {} {} {}", round, rounds, next.scene->name,
                                                               next.engine->name, next.threads))));
  else if (round != last_round)
    tell(fmt::format("round {}/{}\n", round, rounds));
  last_round = round;
}

/// CLI11's own check would show its limits in the help, unlike every other option.
CLI::Validator whole_number_between(int least, int most) {
  return CLI::Validator(
      [least, most](std::string& text) -> std::string {
        int value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return {};
        return fmt::format("must be a whole number from {} to {}, not {}", least, most, text);
      },
      "");
}

}  // namespace

void declare(CLI::App& app, Options& options) {
  app.add_option("--scenes", options.scenes,
                 "Environments with sizes, as in drift:1000,pyramid:15@200: of pyramid in layers, else in\n"
                 "bodies; after @ the steps (all four of 100, 1,000 and 10,000 bodies)")
      ->delimiter(',')
      ->type_name("LIST");
  app.add_option("--engines", options.engines, "Which engines, as in fathom,bullet (all of this build)")
      ->delimiter(',')
      ->type_name("LIST");
  app.add_option("--threads", options.threads, "Numbers of threads to run with (1,2)")
      ->delimiter(',')
      ->type_name("LIST")
      ->check(whole_number_between(1, WorldDef::max_threads));
  app.add_option("--steps", options.steps, "Steps per run (600; quick: 200)")
      ->type_name("N")
      ->check(whole_number_between(1, 1'000'000));
  app.add_option("--rounds", options.rounds, "How many times everything runs (3)")
      ->type_name("N")
      ->check(whole_number_between(1, 1000));
  app.add_flag("--quick", options.quick, "A minute's worth: about 1,000 bodies of each environment");
  app.add_option("--limit", options.limit, "Time of a run's steps after which it is cut short (s; 60)")->type_name("S");
  app.add_option("--json", options.json, "Write the figures as JSON")->type_name("FILE");
  // Evaluated only when shown: listing engines queries drivers.
  app.footer([] {
    std::string built;
    for (const EngineKind& engine : engines()) built += fmt::format(" {} ({})", engine.name, engine.version);
    return "Engines here:" + built;
  });
  app.footer(
      "Others are built in where CMake finds them. Each runs with its own defaults, sleeping and damping off.\n"
      "Exit code: 0 all is well; 1 an engine lost a body or a state was not finite; 2 the request is wrong;\n"
      "130 Ctrl-C, earlier results are unchanged.");
}

void check(const Options& options) {
  if (!(options.limit > 0 && options.limit <= 1e9))
    throw Error(ErrorCode::invalid_argument,
                fmt::format("--limit must be a number of seconds from 0 to 1e9, not {}", options.limit));
  chosen_scenes(options);
  chosen_engines(options);
}

Outcome run(const Options& options) {
  check(options);
  const std::vector<SceneEntry> scenes = chosen_scenes(options);
  const std::vector<const EngineKind*> engines = chosen_engines(options);
  std::optional<files::OutputFile> file;
  if (!options.json.empty()) file.emplace(options.json);  // before the work, not after it
  const InterruptGuard interrupt;
  const std::vector<Result> results =
      run_campaign(scenes, engines, options.threads, options.rounds, options.limit,
                   [&](int round, const Result& next) { show_progress(round, options.rounds, next); });
  if (stderr_is_terminal()) tell("\r\x1b[K");
  // With figures on stdout, nothing else may be printed there.
  if (files::is_stdout(options.json))
    tell(table_of(results));
  else
    fmt::print("{}", table_of(results));
  if (InterruptGuard::requested()) {
    tell(fmt::format("fathom: interrupted{}\n", file ? "; " + options.json + " stays as it was" : ""));
    return Outcome::interrupted;
  }
  if (file) {
    file->write(to_json(results).dump(2) + "\n");
    file->finish();
  }
  const bool trouble =
      std::any_of(results.begin(), results.end(), [](const Result& r) { return !r.trouble().empty(); });
  return trouble ? Outcome::failed : Outcome::good;
}

}  // namespace fathom::peers
