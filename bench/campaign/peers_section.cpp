#include "peers_section.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "measure/counted.hpp"
#include "page/html.hpp"
#include "view.hpp"

namespace fathom::campaign {
namespace {

using page::escaped;

std::string row_of(const Json& r, bool ground) {
  const Json &time = r.at("step_ms"), &q = r.at("quality");
  const auto number = [](const Json& value, double factor = 1) {
    return value.is_number() ? figure(factor * value.get<double>()) : std::string("–");
  };
  const int steps = r.at("steps");
  const bool cut_short = r.value("cut_short", false);
  std::string html =
      fmt::format("<tr><td>{} <span class='faint'>{}</span></td><td class='n'>{}</td><td class='n'>{}{}</td>",
                  escaped(r.at("engine").get<std::string>()), escaped(r.at("version").get<std::string>()),
                  r.at("threads").get<int>(), steps, cut_short ? " †" : "");
  if (steps == 0)
    return html +
           fmt::format("<td colspan='8' class='fail'>{}</td></tr>\n", escaped(r.at("trouble").get<std::string>()));
  for (const char* name : {"mean", "p99", "max"}) html += fmt::format("<td class='n'>{}</td>", number(time.at(name)));
  html += fmt::format("<td class='n'>{}</td>", number(r.at("ratio_to_fathom")));
  html += fmt::format("<td class='n'>{}</td><td class='n'>{}</td><td class='n'>{}</td>",
                      number(q.at("displacement_max"), 1e3), ground ? number(q.at("ground_penetration_max"), 1e3) : "–",
                      number(q.at("kinetic_energy_per_body")));
  const bool failed = r.at("failed");
  return html + fmt::format("<td class='{}'>{}</td></tr>\n", failed ? "fail" : "pass",
                            failed ? escaped(r.at("trouble").get<std::string>()) : "good");
}

std::string html_of(const Json& peers) {
  std::string html = fmt::format(
      "<h2 id='peers'>Other engines</h2>\n<p>The same scenes through every engine of this build, each with its own "
      "defaults; the engines alternate on each scene, round by round (medians of {}), so that noise of the machine "
      "affects all of them. Ratio: over Fathom's mean with as many threads; above 1 is slower. † cut short by the "
      "limit on a run's time: mean and quality are those of fewer steps than the others', so the ratio is not a fair "
      "comparison. Quality is measured alike, after the last step.</p>\n"
      "<p class='faint'>{} · {}</p>\n",
      counted(peers.at("rounds").get<std::uint64_t>(), "round"), escaped(peers.at("device").get<std::string>()),
      escaped(peers.at("build").at("commit").get<std::string>()));
  std::string scene;
  for (const Json& r : peers.at("results")) {
    if (scene != r.at("scene").get<std::string>()) {
      if (!scene.empty()) html += "</table></div>\n";
      scene = r.at("scene").get<std::string>();
      html += fmt::format(
          "<h3>{}, {} bodies</h3>\n<div class='wide'><table><tr><th></th><th class='n'>Threads</th><th "
          "class='n'>Steps</th><th class='n'>Step (ms)</th><th class='n'>p99</th><th class='n'>max</th><th "
          "class='n'>Ratio</th><th "
          "class='n'>Moved (mm)</th><th class='n'>In the ground (mm)</th><th class='n'>Energy (J per body)</th>"
          "<th></th></tr>\n",
          escaped(r.at("environment").get<std::string>()), grouped(r.at("bodies")));
    }
    html += row_of(r, r.at("environment") != "drift");
  }
  return html + (scene.empty() ? "" : "</table></div>\n");
}

}  // namespace

std::string peers_section(const Store& store) {
  if (!std::filesystem::exists(store.path(peers_file)))
    return "<h2 id='peers'>Other engines</h2>\n<p>Not measured here; 'fathom bench peers --out' with this folder adds "
           "them.</p>\n";
  try {
    return html_of(Json::parse(store.read(peers_file)));
  } catch (const Json::exception&) {
    throw Error(ErrorCode::file, store.path(peers_file) + ": is not what 'fathom bench peers' wrote; measure it again");
  }
}

}  // namespace fathom::campaign
