#include "report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "build_info.hpp"
#include "measure/counted.hpp"
#include "measure/json.hpp"
#include "measure/system.hpp"

namespace fathom::peers {
namespace {

using Json = nlohmann::ordered_json;

/// Slowest round over fastest: how much the machine's speed varied.
double noise(const Result& r) {
  const auto [fastest, slowest] =
      std::minmax_element(r.rounds.begin(), r.rounds.end(),
                          [](const Measurement& a, const Measurement& b) { return a.step_ms.mean < b.step_ms.mean; });
  return fastest->step_ms.mean > 0 ? slowest->step_ms.mean / fastest->step_ms.mean : 1;
}

void add_row(std::string& text, const Result& r, double ratio) {
  const Quality& q = r.quality();
  text += fmt::format("{:<14}{:>7}{:>7}  {:<8}{:>3}{:>11.4f}{:>7.2f}{:>9}{:>10.4f}", r.scene->name,
                      dynamic_body_count(r.scene->scene), r.rounds.back().steps, r.engine->name, r.threads, r.mean_ms(),
                      noise(r), ratio > 0 ? fmt::format("{:.2f}", ratio) : "-", r.p99_ms());
  const bool ground = r.scene->scene.ground_height.has_value();
  text +=
      fmt::format("{:>10}{:>10.3f}{:>10}{:>11.5f}{:>10.2g}{:>7}{:>8}",
                  ground ? fmt::format("{:.3f}", 1e3 * q.ground_penetration_max) : "-", 1e3 * q.overlap_max,
                  r.scene->scene.joints.empty() ? "-" : fmt::format("{:.3f}", 1e3 * q.joint_gap_max),
                  q.displacement_max, q.kinetic_energy_per_body, ground ? std::to_string(q.bodies_below_ground) : "-",
                  r.scene->scene.container ? std::to_string(q.escaped) : "-");
  const std::string trouble = r.trouble();
  text += fmt::format("{}\n", !trouble.empty()            ? "  FAILED: " + trouble
                              : r.rounds.back().cut_short ? "  cut short"
                                                          : "");
}

Json json_of(const Result& r, double ratio) {
  const Quality& q = r.quality();
  Json means = Json::array();
  for (const Measurement& round : r.rounds) means.push_back(round.step_ms.mean);
  Json json = {{"scene", r.scene->name},
               {"environment", r.scene->scene.name},
               {"bodies", dynamic_body_count(r.scene->scene)},
               {"steps", r.rounds.back().steps},
               {"cut_short", r.rounds.back().cut_short},
               {"engine", r.engine->name},
               {"version", r.engine->version},
               {"threads", r.threads},
               {"step_ms",
                {{"mean", r.mean_ms()},
                 {"median", r.median_ms()},
                 {"p99", r.p99_ms()},
                 {"max", r.max_ms()},
                 {"mean_of_rounds", means}}}};
  json["ratio_to_fathom"] = ratio > 0 ? Json(ratio) : Json();
  json["quality"] = fathom::json_of<Json>(q);
  json["failed"] = !r.trouble().empty();
  json["trouble"] = r.trouble();
  return json;
}

}  // namespace

double ratio_to_fathom(const Result& result, const std::vector<Result>& all) {
  const auto fathom = std::find_if(all.begin(), all.end(), [&](const Result& r) {
    return r.scene == result.scene && r.engine->name == "fathom" &&
           (r.threads == result.threads || !result.engine->threaded);
  });
  return fathom == all.end() ? 0 : result.mean_ms() / fathom->mean_ms();
}

std::string table_of(const std::vector<Result>& results) {
  std::string text = fmt::format("{}; {} build, {}\n", processor_name(), build_info::build_type, build_info::compiler);
  text += fmt::format(
      "Milliseconds per step: the median of {}; noise is the slowest round over the fastest.\n"
      "Ratio: over Fathom's mean with as many threads; above 1 is slower than Fathom.\n\n",
      counted(results.empty() ? 0 : results.front().rounds.size(), "round"));
  text += fmt::format("{:<14}{:>7}{:>7}  {:<8}{:>3}{:>11}{:>7}{:>9}{:>10}{:>10}{:>10}{:>10}{:>11}{:>10}{:>7}{:>8}\n",
                      "scene", "bodies", "steps", "engine", "thr", "mean ms", "noise", "ratio", "p99 ms", "sunk mm",
                      "deep mm", "gap mm", "moved m", "J per body", "below", "escaped");
  const SceneEntry* previous = nullptr;
  for (const Result& result : results) {
    if (previous && previous != result.scene) text += "\n";
    previous = result.scene;
    add_row(text, result, ratio_to_fathom(result, results));
  }
  return text;
}

Json to_json(const std::vector<Result>& results) {
  Json json = {{"kind", "peers"},
               {"device", processor_name()},
               {"rounds", results.empty() ? 0 : results.front().rounds.size()},
               {"build",
                {{"version", build_info::version},
                 {"commit", build_info::commit},
                 {"compiler", build_info::compiler},
                 {"build_type", build_info::build_type}}}};
  json["results"] = Json::array();
  for (const Result& result : results) json["results"].push_back(json_of(result, ratio_to_fathom(result, results)));
  return json;
}

}  // namespace fathom::peers
