#include <fmt/format.h>

#include "page/html.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::escaped;

std::string millimetres(double metres) { return figure(1e3 * metres); }

std::string row_of(const Measurement& run, bool ground, bool rests) {
  const Quality& q = run.end();
  const Spikes& s = run.summary.spikes;
  const std::string steps =
      run.cut_short ? fmt::format(" † {} steps", grouped(static_cast<std::int64_t>(run.steps))) : std::string();
  std::string html = fmt::format("<tr><td>{}{}</td><td class='n'>{}</td>", escaped(label_of(run.what)), steps,
                                 figure(run.summary.stages.total.mean));
  html += fmt::format("<td class='n'>{:.2f}</td><td class='n'>{:.2f}</td>", s.p99, s.max);
  html += fmt::format("<td class='n'>{}</td><td class='n'>{}</td>", rests ? millimetres(q.displacement_max) : "–",
                      ground ? millimetres(q.ground_penetration_max) : "–");
  html += fmt::format("<td class='n'>{}</td>", figure(q.kinetic_energy_per_body));
  const std::string trouble = trouble_of(run), creep = creep_of(run);
  return html + fmt::format("<td class='{}'>{}</td></tr>\n",
                            !trouble.empty() ? "fail"
                            : creep.empty()  ? "pass"
                                             : "known",
                            !trouble.empty() ? escaped(trouble)
                            : creep.empty()  ? "good"
                                             : escaped(creep));
}

}  // namespace

std::string quality_section(const View& view) {
  std::string html =
      "<h2 id='quality'>Quality and speed</h2>\n<p>At the end of each run: the largest distance of a "
      "body from where it started (where it should rest), the deepest penetration of the ground, and the kinetic "
      "energy. Spikes: single steps over the median of the 61 steps around them, without the first second. What should "
      "rest gave way if it moved by a tenth of a body's size and creeps if it moved by a hundredth (10 mm); what is a "
      "hundredth in the ground sank in. † cut short: its end is earlier than the others'.</p>\n";
  for (const std::string& environment : view.environments()) {
    const bool ground = environment != "drift", rests = environment == "spread" || environment == "pyramid";
    html += fmt::format(
        "<h3>{}</h3>\n<div class='wide'><table><tr><th></th><th class='n'>Step (ms)</th><th class='n'>p99 / "
        "median</th><th class='n'>max / median</th><th class='n'>Moved (mm)</th><th class='n'>In the ground "
        "(mm)</th><th class='n'>Energy (J per body)</th><th></th></tr>\n",
        environment);
    for (const std::int64_t bodies : view.sizes(environment)) {
      html += fmt::format("<tr class='group'><td colspan='8'>{} bodies</td></tr>\n", grouped(bodies));
      for (const Measurement* run : view.table_runs(environment, bodies))
        if (run->reported()) html += row_of(*run, ground, rests);
    }
    html += "</table></div>\n";
  }
  return html;
}

std::string exclusions_section(const View& view) {
  std::string items;
  const auto add = [&](const Measurement& run, const std::string& why) {
    items += fmt::format("<li>{} {}, {}: {}</li>\n", run.what.environment, grouped(run.what.bodies),
                         escaped(label_of(run.what)), escaped(why));
  };
  for (const Measurement* run : view.runs()) {
    if (!run->skipped.empty()) add(*run, "not run: " + run->skipped);
    if (!run->refused.empty()) add(*run, "refused: " + run->refused);
    if (run->cut_short)
      add(*run, fmt::format("cut short after {} steps by the limit on a run's time",
                            grouped(static_cast<std::int64_t>(run->steps))));
  }
  const Campaign& campaign = view.campaign();
  if (campaign.runs.size() < campaign.planned)
    items += fmt::format("<li>{} of {} runs are still to do: continue with --resume</li>\n",
                         campaign.planned - campaign.runs.size(), campaign.planned);
  return "<h2 id='exclusions'>Not in the tables</h2>\n" +
         (items.empty() ? "<p>Every run finished and is reported.</p>\n" : "<ul>\n" + items + "</ul>\n");
}

}  // namespace fathom::campaign
