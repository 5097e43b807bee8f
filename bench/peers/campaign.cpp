#include "campaign.hpp"

#include <algorithm>
#include <charconv>

#include "measure/system.hpp"
#include "scene/environments.hpp"
#include "scene/suggest.hpp"

namespace fathom::peers {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw Error(ErrorCode::invalid_argument,
              "scene '" + text + "': " + why + "; write environment:size or environment:size@steps, as in pyramid:15");
}

std::int64_t whole_number(const std::string& text, std::string_view digits) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size() || number < 1 || number > 1'000'000'000) {
    refuse(text, "'" + std::string(digits) + "' is not a whole number from 1");
  }
  return number;
}

const Environment& environment_of(const std::string& text, std::string_view name) {
  if (const Environment* found = find_environment(name)) return *found;
  std::vector<std::string_view> known;
  for (const Environment& environment : environments()) known.push_back(environment.name);
  refuse(text, "unknown environment" + suggestion(name, known));
}

double median_over_rounds(const std::vector<Measurement>& rounds, double Statistics::*figure) {
  std::vector<double> values;
  for (const Measurement& round : rounds) values.push_back(round.step_ms.*figure);
  return statistics(values).median;
}

std::vector<Result> results_to_come(const std::vector<SceneEntry>& scenes,
                                    const std::vector<const EngineKind*>& engines, const std::vector<int>& threads) {
  std::vector<Result> results;
  for (const SceneEntry& scene : scenes) {
    for (const int count : threads) {
      for (const EngineKind* engine : engines) {
        if (engine->threaded)
          results.push_back({&scene, engine, count, {}});
        else if (count == threads.front())
          results.push_back({&scene, engine, 1, {}});
      }
    }
  }
  return results;
}

}  // namespace

SceneEntry parse_scene_entry(const std::string& text, int default_steps) {
  const std::string_view view = text;
  const std::size_t at = view.find('@');
  const std::string_view name = view.substr(0, at);
  const std::size_t colon = name.find(':');
  if (colon == std::string_view::npos) refuse(text, "has no size");
  const Environment& environment = environment_of(text, name.substr(0, colon));
  const std::int64_t size = whole_number(text, name.substr(colon + 1));
  SceneEntry entry;
  entry.name = name;
  entry.scene = environment.name == "pyramid" ? pyramid(size) : environment.make(size);
  entry.steps =
      at == std::string_view::npos ? default_steps : static_cast<int>(whole_number(text, view.substr(at + 1)));
  return entry;
}

double Result::mean_ms() const { return median_over_rounds(rounds, &Statistics::mean); }
double Result::median_ms() const { return median_over_rounds(rounds, &Statistics::median); }
double Result::p99_ms() const { return median_over_rounds(rounds, &Statistics::p99); }
double Result::max_ms() const { return median_over_rounds(rounds, &Statistics::max); }

std::string Result::trouble() const {
  const auto failed =
      std::find_if(rounds.begin(), rounds.end(), [](const Measurement& round) { return !round.trouble.empty(); });
  return failed == rounds.end() ? std::string() : failed->trouble;
}

std::vector<Result> run_campaign(const std::vector<SceneEntry>& scenes, const std::vector<const EngineKind*>& engines,
                                 const std::vector<int>& threads, int rounds, double limit, const Progress& progress) {
  std::vector<Result> results = results_to_come(scenes, engines, threads);
  for (int round = 1; round <= rounds && !InterruptGuard::requested(); ++round) {
    for (Result& result : results) {
      if (!result.rounds.empty() && result.rounds.front().steps == 0) continue;
      progress(round, result);
      Measurement measured = measure(*result.engine, result.scene->scene, result.threads, result.scene->steps, limit);
      if (InterruptGuard::requested()) break;
      result.rounds.push_back(std::move(measured));
    }
  }
  std::erase_if(results, [](const Result& result) { return result.rounds.empty(); });
  return results;
}

}  // namespace fathom::peers
