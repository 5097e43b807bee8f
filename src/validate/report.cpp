#include "validate/report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "validate/svg_plot.hpp"

namespace fathom::validate {
namespace {

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

constexpr const char* style = R"(
:root{--text:#1d2127;--faint:#626b78;--line:#d9dee5;--page:#fff;--card:#f6f8fa;--pass:#1a7f37;--fail:#c62828;--known:#9a6700;
--c0:#0b6bcb;--c1:#d9480f;--c2:#2b8a3e;--c3:#862e9c;--c4:#c2255c;--c5:#0c8599;--c6:#5f6b00;--c7:#555}
@media(prefers-color-scheme:dark){:root{--text:#e6e9ee;--faint:#9aa4b2;--line:#323a45;--page:#14181d;--card:#1b2027;
--pass:#57c274;--fail:#ff7b72;--known:#e0b04a;--c0:#6cb2ff;--c1:#ff9b6b;--c2:#69d084;--c3:#d08ce6;--c4:#f783ac;--c5:#4fd1dd;--c6:#cbd36b;--c7:#aaa}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--text);background:var(--page);margin:2rem auto;max-width:62rem;padding:0 1rem}
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.2rem;border-bottom:1px solid var(--line)}h3{font-size:1rem;margin:1.6rem 0 .2rem}
p{margin:.3rem 0}.faint{color:var(--faint)}table{border-collapse:collapse;margin:.6rem 0;width:100%}
th,td{text-align:left;padding:.2rem .6rem;border-bottom:1px solid var(--line);font-variant-numeric:tabular-nums}
th{font-weight:600;color:var(--faint)}caption{text-align:left;color:var(--faint);padding:.2rem 0}
.pass{color:var(--pass)}.fail{color:var(--fail);font-weight:600}.known{color:var(--known)}
svg{width:100%;max-width:42rem;background:var(--card);border-radius:6px;margin:.4rem 0}
svg text{font:11px system-ui,sans-serif;fill:var(--faint)}.grid{stroke:var(--line)}.curve{fill:none;stroke-width:1.8}
.c0{stroke:var(--c0)}.c1{stroke:var(--c1)}.c2{stroke:var(--c2)}.c3{stroke:var(--c3)}.c4{stroke:var(--c4)}.c5{stroke:var(--c5)}.c6{stroke:var(--c6)}.c7{stroke:var(--c7)}
)";

std::string html_table(const Table& table) {
  std::string html = fmt::format("<table><caption>{}</caption><tr>", escaped(table.title));
  for (const std::string& cell : table.head) html += "<th>" + escaped(cell) + "</th>";
  html += "</tr>";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escaped(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table>\n";
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
  for (const Table& table : result.record.tables) html += html_table(table);
  for (const Plot& plot : result.record.plots)
    html += fmt::format("<figure><figcaption class='faint'>{}</figcaption>{}</figure>\n", escaped(plot.title),
                        to_svg(plot));
  return html;
}

}  // namespace

std::string to_html(std::span<const Result> results, const Setup& setup, const Circumstances& c) {
  const Tally sum = tally(results);
  std::string html = fmt::format(
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
      "<title>Fathom validation</title><style>{}</style></head><body>\n<h1>Fathom validation</h1>\n"
      "<p>{} of {} checks pass; {} fail as known, {} fail.</p>\n"
      "<p class='faint'>Simulator {}, {} threads, {} suite · fathom {} ({}), {} build, {} · {} · {}</p>\n",
      style, sum.passed, sum.checks, sum.known, sum.checks - sum.passed - sum.known, escaped(name_of(setup)),
      setup.threads, setup.full ? "full" : "short", escaped(c.version), escaped(c.commit), escaped(c.build_type),
      escaped(c.compiler), escaped(c.machine), escaped(c.date));
  std::string group;
  for (const Result& result : results) {
    if (group != result.test->group) html += fmt::format("<h2>{}</h2>\n", escaped(group = result.test->group));
    html += html_case(result);
  }
  return html + "</body></html>\n";
}

std::string to_json(std::span<const Result> results, const Setup& setup, const Circumstances& c) {
  using Json = nlohmann::ordered_json;
  const Tally sum = tally(results);
  Json json{{"simulator", name_of(setup)}, {"threads", setup.threads}, {"full", setup.full},
            {"version", c.version},        {"commit", c.commit},       {"build_type", c.build_type},
            {"compiler", c.compiler},      {"machine", c.machine},     {"date", c.date},
            {"checks", sum.checks},        {"passed", sum.passed},     {"known_failures", sum.known},
            {"cases", Json::array()}};
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
