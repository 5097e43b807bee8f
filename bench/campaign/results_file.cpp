#include "results_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "files/input_file.hpp"

namespace fathom::campaign {
namespace {

using Entry = ResultEntry;
using File = ResultsFile;

Entry& entry_of(File& file, const std::string& name) {
  const auto found = std::ranges::find(file.entries, name, &Entry::name);
  if (found != file.entries.end()) return *found;
  file.entries.emplace_back().name = name;
  return file.entries.back();
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
    entry.cut_short |= run.value("cut_short", false);
    entry.steps = run.value("steps", std::uint64_t{0});
    entry.quality.clear();
    for (const Json& sample : run.at("quality")) entry.quality.emplace_back(sample.value("step", entry.steps), sample);
    if (!run.contains("blocks_ms")) continue;
    const auto blocks = run.at("blocks_ms").get<std::vector<double>>();
    entry.in_stretches = !blocks.empty();
    entry.rounds.push_back(entry.in_stretches ? blocks : std::vector{run.at("step_ms").at("median").get<double>()});
  }
}

void read_peers(File& file, const Json& json) {
  file.machine = json.at("device");
  for (const Json& run : json.at("results")) {
    Entry& entry = entry_of(file, fmt::format("{} {} {}T", run.at("scene").get<std::string>(),
                                              run.at("engine").get<std::string>(), run.at("threads").get<int>()));
    entry.trouble = run.at("trouble");
    entry.rests = should_rest(run.at("environment"));
    entry.steps = run.at("steps");
    entry.cut_short = run.at("cut_short");
    entry.quality.emplace_back(entry.steps, run.at("quality"));
    for (const Json& mean : run.at("step_ms").at("mean_of_rounds")) entry.rounds.push_back({mean.get<double>()});
  }
}

void read_instructions(File& file, const Json& json) {
  file.machine = json.at("compiler");
  file.tolerance = json.at("tolerance");
  for (const auto& [name, count] : json.at("instructions").items())
    entry_of(file, name).rounds.push_back({count.get<double>()});
}

}  // namespace

ResultsFile read_results(const std::string& path) {
  const std::string text = files::read_file(path, "give files of 'fathom bench' or bench/instructions");
  File file;
  file.path = path;
  try {
    const Json json = Json::parse(text);
    file.kind = json.at("kind");
    if (file.kind == "campaign") read_campaign(file, json);
    if (file.kind == "peers") read_peers(file, json);
    if (file.kind == "instructions") read_instructions(file, json);
  } catch (const Json::exception&) {
    file.entries.clear();
  }
  if (file.entries.empty())
    throw Error(ErrorCode::file,
                path + ": contains no results; give campaign.json, peers.json or what bench/instructions wrote");
  return file;
}

}  // namespace fathom::campaign
