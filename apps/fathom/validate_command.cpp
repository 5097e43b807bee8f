#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <ostream>
#include <string_view>
#include <thread>

#include "build_info.hpp"
#include "case_thread.hpp"
#include "commands.hpp"
#include "files/file_names.hpp"
#include "measure/system.hpp"
#include "output.hpp"
#include "setup.hpp"
#include "validate/report.hpp"

namespace fathom::cli {
namespace {

using namespace fathom::validate;

bool asked_for(const Case& test, const std::vector<std::string>& only) {
  const std::string_view name = test.name, group = test.group;
  return only.empty() || std::ranges::any_of(only, [&](const std::string& text) {
           return name.find(text) != name.npos || group.find(text) != group.npos;
         });
}

std::vector<const Case*> chosen(const std::vector<std::string>& only) {
  std::vector<const Case*> list;
  for (const Case& test : cases())
    if (asked_for(test, only)) list.push_back(&test);
  if (list.empty())
    throw Error(ErrorCode::invalid_argument, "no case has '" + fmt::format("{}", fmt::join(only, "' or '")) +
                                                 "' in its name; see 'fathom validate --list'");
  return list;
}

/// Options that no chosen case reads would only seem to work.
void check_heap_options(const ValidateOptions& options, const std::vector<const Case*>& list) {
  const auto is_heaps = [](const Case* test) { return test->group == std::string_view("heaps"); };
  if ((options.seeds || options.first) && std::ranges::none_of(list, is_heaps))
    throw Error(ErrorCode::invalid_argument, "--seeds and --first are those of the cases heaps; add --only heaps");
}

/// A report on stdout must be the only output there.
void say(const Output& html, const Output& json, const std::string& text) {
  if (html.is_stdout() || json.is_stdout()) return tell(text);
  fmt::print("{}", text);
  std::fflush(stdout);
}

Circumstances circumstances() {
  const std::time_t now = std::time(nullptr);
  return {build_info::version,
          build_info::commit,
          build_info::build_type,
          build_info::compiler,
          processor_name(),
          fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(now)),
          false};
}

}  // namespace

int validate(const ValidateOptions& options) {
  const std::vector<const Case*> list = chosen(options.only);
  if (options.list) {
    for (const Case* test : list) fmt::print("{:<14} {:<18} {}\n", test->group, test->name, test->about);
    return finished;
  }
  engine::Config config;
  cli::give_simulator(config, options.simulator);
  const engine::Settings::Simulator& simulator = config->simulator;
  // The report states the number of threads.
  const int threads =
      simulator.threads > 0 ? simulator.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  validate::Setup setup{simulator.kind, simulator.device, threads, !options.brief};
  check_heap_options(options, list);
  setup.heap_seeds = options.seeds.value_or(0);
  setup.first_heap = options.first.value_or(setup.first_heap);
  World probe(world_def(setup));  // rejects a missing device before anything runs
  files::FileNames names;
  names.writes("--html", options.html);
  names.writes("--json", options.json);
  const InterruptGuard interrupt;
  Output html(options.html), json(options.json);
  if (!options.quiet) setup.say = [&](const std::string& line) { say(html, json, line + "\n"); };
  CaseThread thread(list, setup, [&](const Result& result) {
    if (!options.quiet) say(html, json, to_text(result));
  });
  const bool complete = thread.wait();
  const std::vector<Result> results = thread.results();
  Circumstances where = circumstances();
  where.interrupted = !complete;
  if (html.wanted()) html.stream() << to_html(results, setup, where);
  html.finish();
  if (json.wanted()) json.stream() << to_json(results, setup, where);
  json.finish();
  if (!complete) {
    tell(fmt::format("fathom: interrupted after {} of {} cases\n", results.size(), list.size()));
    CaseThread::leave(interrupted);
  }
  return std::ranges::all_of(results, &Result::as_expected) ? finished : failed;
}

}  // namespace fathom::cli
