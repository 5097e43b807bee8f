#include "validate/report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "page/html.hpp"
#include "page/svg_plot.hpp"

namespace fathom::validate {
namespace {

using page::escaped;

struct Tally {
  std::size_t checks = 0, passed = 0, known = 0;
};

Tally tally(std::span<const Result> results) {
  Tally sum;
  for (const Result& result : results)
    for (const Check& check : result.record.checks) {
      ++sum.checks;
      sum.passed += check.passed();
      sum.known += !check.passed() && !check.known.empty();
    }
  return sum;
}

std::string name_of(const Setup& setup) {
  return setup.simulator == SimulatorKind::native   ? "native"
         : setup.simulator == SimulatorKind::device ? "device " + setup.device
                                                    : "hybrid " + setup.device;
}

const char* verdict(const Check& check) {
  if (check.passed()) return "pass";
  return check.known.empty() ? "fail" : "known";
}

std::string figure(double value, const std::string& unit) {
  return fmt::format("{:.4g}{}{}", value, unit.empty() ? "" : " ", unit);
}

std::string html_case(const Result& result) {
  std::string html =
      fmt::format("<h3 id='{0}'>{0} <span class='faint'>{1:.1f} s</span></h3>\n<p class='faint'>{2}</p>\n",
                  result.test->name, result.seconds, escaped(result.test->about));
  html += "<table><tr><th>check</th><th>measured</th><th>must be</th><th></th></tr>\n";
  for (const Check& check : result.record.checks) {
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{} {}</td><td class='{}'>{}</td></tr>\n", escaped(check.name),
                        escaped(figure(check.value, check.unit)), check.at_most ? "≤" : "≥",
                        escaped(figure(check.limit, check.unit)), verdict(check),
                        check.passed()        ? "pass"
                        : check.known.empty() ? "FAIL"
                                              : "fails: " + escaped(check.known));
  }
  html += "</table>\n";
  for (const std::string& note : result.record.notes) html += "<p>" + escaped(note) + "</p>\n";
  for (const Table& table : result.record.tables) html += page::to_html(table);
  for (const Plot& plot : result.record.plots)
    html += fmt::format("<figure><figcaption class='faint'>{}</figcaption>{}</figure>\n", escaped(plot.title),
                        page::to_svg(plot));
  return html;
}

}  // namespace

std::string to_html(std::span<const Result> results, const Setup& setup, const Circumstances& c) {
  const Tally sum = tally(results);
  std::string html = fmt::format(
      "<p>{} of {} checks pass; {} fail as known, {} fail.</p>\n"
      "<p class='faint'>Simulator {}, {} thread{}, {} suite · fathom {} ({}), {} build, {} · {} · {}</p>\n",
      sum.passed, sum.checks, sum.known, sum.checks - sum.passed - sum.known, escaped(name_of(setup)), setup.threads,
      setup.threads == 1 ? "" : "s", setup.full ? "full" : "short", escaped(c.version), escaped(c.commit),
      escaped(c.build_type), escaped(c.compiler), escaped(c.machine), escaped(c.date));
  if (c.interrupted) html += "<p>The suite was interrupted: these are the cases that ended before.</p>\n";
  std::string group;
  for (const Result& result : results) {
    if (group != result.test->group) html += fmt::format("<h2>{}</h2>\n", escaped(group = result.test->group));
    html += html_case(result);
  }
  return page::document("Fathom validation", html);
}

std::string to_json(std::span<const Result> results, const Setup& setup, const Circumstances& c) {
  using Json = nlohmann::ordered_json;
  const Tally sum = tally(results);
  Json json{{"simulator", name_of(setup)}, {"threads", setup.threads}, {"full", setup.full},
            {"version", c.version},        {"commit", c.commit},       {"build_type", c.build_type},
            {"compiler", c.compiler},      {"machine", c.machine},     {"date", c.date},
            {"finished", !c.interrupted},  {"checks", sum.checks},     {"passed", sum.passed},
            {"known_failures", sum.known}, {"cases", Json::array()}};
  for (const Result& result : results) {
    Json entry{{"group", result.test->group},
               {"name", result.test->name},
               {"seconds", result.seconds},
               {"passed", result.passed()},
               {"checks", Json::array()}};
    for (const Check& check : result.record.checks)
      entry["checks"].push_back({{"name", check.name},
                                 {"value", check.value},
                                 {"bound", check.at_most ? "at most" : "at least"},
                                 {"limit", check.limit},
                                 {"unit", check.unit},
                                 {"passed", check.passed()},
                                 {"known", check.known}});
    for (const Table& table : result.record.tables)
      entry["tables"].push_back({{"title", table.title}, {"head", table.head}, {"rows", table.rows}});
    for (const Plot& plot : result.record.plots) {
      Json curves = Json::array();
      for (const Curve& curve : plot.curves) curves.push_back({{"name", curve.name}, {"x", curve.x}, {"y", curve.y}});
      entry["plots"].push_back({{"title", plot.title}, {"x", plot.x_label}, {"y", plot.y_label}, {"curves", curves}});
    }
    if (!result.record.notes.empty()) entry["notes"] = result.record.notes;
    json["cases"].push_back(std::move(entry));
  }
  return json.dump(1) + "\n";
}

std::string to_text(const Result& result) {
  std::string text;
  for (const Check& check : result.record.checks)
    text += fmt::format("{:5} {:<18} {}: {} ({} {})\n", verdict(check), result.test->name, check.name,
                        figure(check.value, check.unit), check.at_most ? "at most" : "at least",
                        figure(check.limit, check.unit));
  return text;
}

}  // namespace fathom::validate
