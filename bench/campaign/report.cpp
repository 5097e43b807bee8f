#include "report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "measure/counted.hpp"
#include "page/html.hpp"
#include "peers_section.hpp"
#include "scene/environments.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::escaped;

std::string circumstances_html(const Circumstances& c) {
  return fmt::format(
      "<p class='faint'>{} campaign of {}{}{} · {} · {}, {}, {} · {}{}{} · fathom {} ({}), {} "
      "build, "
      "{}</p>\n",
      escaped(c.form), counted(c.steps, "step"), c.options.empty() ? "" : ", ", escaped(c.options), escaped(c.date),
      escaped(c.processor), counted(static_cast<std::uint64_t>(c.threads), "hardware thread"), escaped(c.memory),
      escaped(c.system), c.devices.empty() ? "" : " · ", escaped(fmt::format("{}", fmt::join(c.devices, ", "))),
      escaped(c.version), escaped(c.commit), escaped(c.build_type), escaped(c.compiler));
}

std::string entry(std::string_view word, std::string_view meaning) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", escaped(word), escaped(meaning));
}

/// Background for readers who have only this page.
std::string about_html(const View& view) {
  std::string html = fmt::format(
      "<h2 id='about'>What is measured</h2>\n<p>The experiment of R. J. S. Pereira's dissertation <i>Optimizing "
      "real-time physics simulation using GPGPU techniques</i> (FEUP, Universidade do Porto, 2020): how long a step of "
      "1/60 s takes in four environments of unit cubes, over {:.3g} s here and 30 s there. <b>Published</b> are "
      "figures quoted from its tables "
      "4.2 to 4.5; nothing marked so was measured here. Everything else was.</p>\n<dl>\n",
      static_cast<double>(view.campaign().where.steps) / 60);
  for (const std::string& name : view.environments())
    if (const Environment* environment = find_environment(name)) html += entry(name, environment->summary);
  html += entry("native", "Fathom's simulator for the processor: threads and vector instructions");
  html += entry("device",
                "Fathom's simulator for GPUs, on the device named: a GPU, or host, which is the processor "
                "running the GPU's kernels");
  html += entry("hybrid", "detection on the device, resolution on the processor");
  for (const std::string& device : view.campaign().where.devices) html += entry("device here", device);
  html += entry("dissertation",
                "the algorithms that it describes (sweep, cells, impulses), run by Fathom on this "
                "machine; without this word, Fathom's own algorithms");
  html += entry("whole step",
                "broad phase (which bounding boxes overlap), narrow phase (contact points) and collision "
                "resolution (the solver) together");
  return html + "</dl>\n";
}

constexpr const char* contents =
    "<nav><a href='#about'>What is measured</a><a href='#summary'>In short</a><a href='#tables'>Average step "
    "durations, with the published ones</a>"
    "<a href='#crossover'>Crossover</a><a href='#quality'>Quality and speed</a><a href='#pictures'>Pictures</a>"
    "<a href='#durations'>Durations over time</a><a href='#threads'>Threads</a><a href='#peers'>Other engines</a>"
    "<a href='#exclusions'>Not in the tables</a></nav>\n";

std::string campaign_html(const Store& store) {
  const Campaign campaign = store.load();
  const View view(campaign);
  return circumstances_html(campaign.where) + contents + about_html(view) + summary_section(view) +
         stage_tables_section(view) + crossover_section(view) + quality_section(view) + pictures_section(view, store) +
         duration_section(view) + threads_section(view) + peers_section(store) + exclusions_section(view);
}

}  // namespace

std::string write_report(const Store& store) {
  const bool peers_alone = !store.exists() && std::filesystem::exists(store.path(peers_file));
  const std::string body = peers_alone ? peers_section(store) : campaign_html(store);
  store.write(
      "report.html",
      page::document(peers_alone ? "Fathom and other engines" : "Fathom: the published experiment, repeated", body));
  return store.path("report.html");
}

}  // namespace fathom::campaign
