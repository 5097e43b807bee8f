#include "report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "page/html.hpp"
#include "peers_section.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::escaped;

std::string circumstances_html(const Circumstances& c) {
  return fmt::format(
      "<p class='faint'>{} campaign of {} steps{}{} · {} · {}, {} hardware threads, {} · {}{}{} · fathom {} ({}), {} "
      "build, "
      "{}</p>\n",
      escaped(c.form), c.steps, c.options.empty() ? "" : ", ", escaped(c.options), escaped(c.date),
      escaped(c.processor), c.threads, escaped(c.memory), escaped(c.system), c.devices.empty() ? "" : " · ",
      escaped(fmt::format("{}", fmt::join(c.devices, ", "))), escaped(c.version), escaped(c.commit),
      escaped(c.build_type), escaped(c.compiler));
}

constexpr const char* contents =
    "<nav><a href='#summary'>In short</a><a href='#tables'>Average step durations, beside the published</a>"
    "<a href='#crossover'>Crossover</a><a href='#quality'>Quality beside speed</a><a href='#pictures'>Pictures</a>"
    "<a href='#durations'>Durations over time</a><a href='#threads'>Threads</a><a href='#peers'>Other engines</a>"
    "<a href='#exclusions'>Not in the tables</a></nav>\n";

std::string campaign_html(const Store& store) {
  const Campaign campaign = store.load();
  const View view(campaign);
  return circumstances_html(campaign.where) + contents + summary_section(view) + stage_tables_section(view) +
         crossover_section(view) + quality_section(view) + pictures_section(view, store) + duration_section(view) +
         threads_section(view) + peers_section(store) + exclusions_section(view);
}

}  // namespace

std::string write_report(const Store& store) {
  const bool peers_alone = !store.exists() && std::filesystem::exists(store.path(peers_file));
  const std::string body = peers_alone ? peers_section(store) : campaign_html(store);
  store.write(
      "report.html",
      page::document(peers_alone ? "Fathom beside other engines" : "Fathom: the published experiment, repeated", body));
  return store.path("report.html");
}

}  // namespace fathom::campaign
