#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "page/html.hpp"
#include "page/svg_plot.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::Curve;
using page::Plot;

constexpr std::size_t max_columns = 240;  // of a plot: more would draw over each other

/// Least and largest of every stretch of steps, so that spikes stay visible in fewer points.
void add_samples(Curve& curve, const std::vector<Sample>& samples, double Sample::*stage, double dt) {
  const std::size_t stretch = std::max<std::size_t>(1, samples.size() / max_columns);
  for (std::size_t begin = 0; begin < samples.size(); begin += stretch) {
    const std::size_t end = std::min(samples.size(), begin + stretch);
    std::size_t least = begin, most = begin;
    for (std::size_t i = begin; i < end; ++i) {
      if (samples[i].*stage < samples[least].*stage) least = i;
      if (samples[i].*stage > samples[most].*stage) most = i;
    }
    for (const std::size_t i : {std::min(least, most), std::max(least, most)})
      curve.add(dt * static_cast<double>(samples[i].step), samples[i].*stage);
  }
}

Plot panel(std::string title) {
  Plot plot;
  plot.title = std::move(title), plot.x_label = "s", plot.y_label = "ms";
  plot.log_y = true, plot.legend = false;
  plot.width = 340, plot.height = 220;
  return plot;
}

std::string panel_html(const Plot& plot) {
  return fmt::format("<figure><figcaption class='faint'>{}</figcaption>{}</figure>\n", page::escaped(plot.title),
                     page::to_svg(plot));
}

/// A panel a stage for these runs; their legend goes to `legend`.
std::string panels(const std::string& title, const std::vector<const Measurement*>& runs,
                   const std::function<Curve(const Measurement&)>& curve_of, Plot& legend,
                   const PublishedRow* processor) {
  std::string html;
  double end = 1;
  for (const Measurement* run : runs) end = std::max(end, static_cast<double>(run->steps) / 60);
  for (std::size_t k = 0; k < published_stages; ++k) {
    Plot plot = panel(fmt::format("{}: {}", title, stages()[k].name));
    for (const Measurement* run : runs) {
      Curve curve = curve_of(*run);
      if (std::ranges::none_of(legend.curves, [&](const Curve& c) { return c.name == curve.name; }))
        legend.curves.push_back(curve);
      add_samples(curve, run->samples, stages()[k].sample, 1.0 / 60);
      plot.curves.push_back(std::move(curve));
    }
    if (processor) {
      Curve line{"published average, " + processor->hardware, {}, {}, 6, true};
      if (std::ranges::none_of(legend.curves, [&](const Curve& c) { return c.name == line.name; }))
        legend.curves.push_back(line);
      line.add(0, stages()[k].published(*processor));
      line.add(end, stages()[k].published(*processor));
      plot.curves.push_back(std::move(line));
    }
    html += panel_html(plot);
  }
  return html;
}

std::vector<const Measurement*> reported(std::vector<const Measurement*> runs) {
  std::erase_if(runs, [](const Measurement* run) { return !run->reported(); });
  return runs;
}

std::string against_bodies(const View& view, const std::string& environment) {
  Plot plot;
  plot.title = environment + ": average step against the number of bodies";
  plot.x_label = "bodies", plot.y_label = "ms";
  plot.log_x = plot.log_y = plot.markers = true;
  plot.legend = false;
  const auto curve = [&](const std::string& name, int colour, bool reference) -> Curve& {
    for (Curve& existing : plot.curves)
      if (existing.name == name) return existing;
    return plot.curves.emplace_back(Curve{name, {}, {}, colour, reference});
  };
  for (const std::int64_t bodies : view.sizes(environment)) {
    for (const Measurement* run : reported(view.table_runs(environment, bodies)))
      curve(label_of(run->what), view.colour(label_of(run->what)), false)
          .add(static_cast<double>(run->bodies), run->summary.stages.total.mean);
    for (const PublishedRow* row : published_of(environment, bodies))
      if (row->hardware.find("2070") != std::string::npos || row->simulator == "native")
        curve("published: " + row->hardware, row->simulator == "native" ? 6 : 7, true)
            .add(static_cast<double>(bodies), row->total());
  }
  return fmt::format("<figure><figcaption class='faint'>{}</figcaption>{}</figure>\n{}", page::escaped(plot.title),
                     page::to_svg(plot), page::legend_of(plot));
}

const PublishedRow* published_processor(const std::string& environment, std::int64_t bodies) {
  for (const PublishedRow* row : published_of(environment, bodies))
    if (row->simulator == "native") return row;
  return nullptr;
}

}  // namespace

std::string duration_section(const View& view) {
  std::string html =
      "<h2 id='durations'>Durations over time</h2>\n<p>Every step of 30 s of simulated time, in the form of the "
      "dissertation's figures 4.11 to 4.49: a row a size, a column a stage, milliseconds on a logarithmic scale. Each "
      "stretch of steps is drawn from its shortest to its longest, so that no spike is lost.</p>\n";
  for (const std::string& environment : view.environments()) {
    Plot legend;
    std::string rows;
    for (const std::int64_t bodies : view.sizes(environment))
      rows += panels(
          fmt::format("{} {}", environment, grouped(bodies)), reported(view.table_runs(environment, bodies)),
          [&](const Measurement& run) {
            const std::string label = label_of(run.what);
            return Curve{label, {}, {}, view.colour(label), false};
          },
          legend, published_processor(environment, bodies));
    html += fmt::format("<h3>{}</h3>\n{}<div class='panels'>\n{}</div>\n", environment, page::legend_of(legend), rows);
    html += against_bodies(view, environment);
  }
  return html;
}

std::string threads_section(const View& view) {
  // The environment of figures 4.1 to 4.9, or the first where it was not run.
  const std::vector<std::string> environments = view.environments();
  const bool has_layers = std::ranges::find(environments, "layers") != environments.end();
  const std::string over_time = has_layers ? "layers" : environments.empty() ? "" : environments.front();
  Plot legend;
  std::string rows;
  for (const std::int64_t bodies : view.sizes(over_time)) {
    std::vector<const Measurement*> runs = view.native_runs(over_time, bodies, "fathom");
    if (runs.size() < 2) continue;
    rows += panels(
        fmt::format("{} {}", over_time, grouped(bodies)), runs,
        [](const Measurement& run) {
          int colour = 0;
          for (int threads = run.what.threads; threads > 1; threads /= 2) ++colour;
          return Curve{fmt::format("{} thread{}", run.what.threads, run.what.threads == 1 ? "" : "s"),
                       {},
                       {},
                       colour % 8,
                       false};
        },
        legend, nullptr);
  }
  if (rows.empty()) return {};
  std::string html = fmt::format(
      "<h2 id='threads'>Threads</h2>\n<p>The native simulator with 1, 2, 4, … threads, in the form of the "
      "dissertation's "
      "figures 4.1 to 4.9 ({}).</p>\n{}<div class='panels'>\n{}</div>\n",
      over_time, page::legend_of(legend), rows);
  html +=
      "<table><caption>Average step (ms), and its share of one thread's over the steps that both "
      "made</caption><tr><th></th><th "
      "class='n'>Bodies</th>";
  std::vector<int> counts;
  for (const Measurement* run : view.runs())
    if (run->what.simulator == "native" && std::ranges::find(counts, run->what.threads) == counts.end())
      counts.push_back(run->what.threads);
  std::ranges::sort(counts);
  for (const int count : counts) html += fmt::format("<th class='n'>{} T</th>", count);
  html += "</tr>\n";
  for (const std::string& environment : environments)
    for (const std::int64_t bodies : view.sizes(environment)) {
      const std::vector<const Measurement*> runs = view.native_runs(environment, bodies, "fathom");
      if (runs.size() < 2) continue;
      html += fmt::format("<tr><td>{}</td><td class='n'>{}</td>", environment, grouped(bodies));
      for (const int count : counts) {
        const auto run = std::ranges::find(runs, count, [](const Measurement* r) { return r->what.threads; });
        if (run == runs.end()) {
          html += "<td></td>";
          continue;
        }
        const auto [one, ours] = means_of_common_steps(*runs.front(), **run, stages().back());
        html += fmt::format("<td class='n'>{}{} <span class='faint'>{:.2f}</span></td>",
                            figure((*run)->summary.stages.total.mean), (*run)->cut_short ? " †" : "", ours / one);
      }
      html += "</tr>\n";
    }
  return html + "</table>\n";
}

}  // namespace fathom::campaign
