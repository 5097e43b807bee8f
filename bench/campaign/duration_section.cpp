#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "measure/counted.hpp"
#include "page/html.hpp"
#include "page/svg_plot.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::Curve;
using page::Plot;

constexpr std::size_t max_columns = 240;  // of a plot: more would overlap

/// Minimum and maximum of every stretch of steps: spikes stay visible with fewer points.
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

std::string figure_html(const Plot& plot, bool large) {
  return fmt::format("<figure{}><figcaption class='faint'>{}</figcaption>{}</figure>\n", large ? " class='large'" : "",
                     page::escaped(plot.title), page::to_svg(plot));
}

using CurveOf = std::function<Curve(const Measurement&)>;

/// A stage of these runs over time, with the published average if there is one.
Plot over_time(const std::string& title, const std::vector<const Measurement*>& runs, const CurveOf& curve_of,
               const Stage& stage, const PublishedRow* processor) {
  Plot plot;
  plot.title = title + ": " + stage.name;
  plot.x_label = "simulated time (s)", plot.y_label = "ms";
  plot.log_y = true, plot.legend = false;
  double end = 0;
  for (const Measurement* run : runs) {
    Curve curve = curve_of(*run);
    add_samples(curve, run->samples, stage.sample, 1.0 / 60);
    plot.curves.push_back(std::move(curve));
    end = std::max(end, static_cast<double>(run->steps) / 60);
  }
  if (processor) {
    Curve line{"published: " + processor->hardware, {}, {}, 6, true};
    line.add(0, stage.published(*processor));
    line.add(end, stage.published(*processor));
    plot.curves.push_back(std::move(line));
  }
  return plot;
}

/// The whole step, large; its stages smaller and folded.
std::string plots_of(const std::string& title, const std::vector<const Measurement*>& runs, const CurveOf& curve_of,
                     const PublishedRow* processor) {
  if (runs.empty()) return {};
  Plot whole = over_time(title, runs, curve_of, stages().back(), processor);
  whole.width = 900, whole.height = 380, whole.names_at_ends = true;
  std::string html = figure_html(whole, true) + "<details><summary>Stages</summary>" + page::legend_of(whole) +
                     "<div class='panels'>\n";
  for (std::size_t k = 0; k < published_stages; ++k) {
    Plot plot = over_time(title, runs, curve_of, stages()[k], processor);
    plot.width = 480, plot.height = 280;
    html += figure_html(plot, false);
  }
  return html + "</div></details>\n";
}

std::vector<const Measurement*> reported(std::vector<const Measurement*> runs) {
  std::erase_if(runs, [](const Measurement* run) { return !run->reported(); });
  return runs;
}

/// A few runs: for each set of algorithms the native simulator and the fastest device.
std::vector<const Measurement*> drawn_runs(const View& view, const std::string& environment, std::int64_t bodies) {
  std::vector<const Measurement*> drawn;
  const std::vector<const Measurement*> runs = reported(view.table_runs(environment, bodies));
  for (const AlgorithmSet& set : algorithm_sets())
    for (const char* simulator : {"native", "device"}) {
      const Measurement* fastest = nullptr;
      for (const Measurement* run : runs)
        if (run->what.simulator == simulator && run->what.set == set.name &&
            (!fastest || run->summary.stages.total.mean < fastest->summary.stages.total.mean))
          fastest = run;
      if (fastest) drawn.push_back(fastest);
    }
  return drawn;
}

std::string against_bodies(const View& view, const std::string& environment) {
  Plot plot;
  plot.title = environment + ": average step against the number of bodies";
  plot.x_label = "bodies", plot.y_label = "ms";
  plot.log_x = plot.log_y = plot.markers = plot.names_at_ends = true;
  plot.legend = false, plot.width = 900, plot.height = 380;
  const auto curve = [&](const std::string& name, int colour, bool reference) -> Curve& {
    for (Curve& existing : plot.curves)
      if (existing.name == name) return existing;
    return plot.curves.emplace_back(Curve{name, {}, {}, colour, reference});
  };
  for (const std::int64_t bodies : view.sizes(environment)) {
    for (const Measurement* run : drawn_runs(view, environment, bodies))
      curve(label_of(run->what), view.colour(label_of(run->what)), false)
          .add(static_cast<double>(run->bodies), run->summary.stages.total.mean);
    for (const PublishedRow* row : published_of(environment, bodies))
      if (row->hardware.find("2070") != std::string::npos || row->simulator == "native")
        curve("published: " + row->hardware, row->simulator == "native" ? 6 : 7, true)
            .add(static_cast<double>(bodies), row->total());
  }
  return figure_html(plot, true);
}

const PublishedRow* published_processor(const std::string& environment, std::int64_t bodies) {
  for (const PublishedRow* row : published_of(environment, bodies))
    if (row->simulator == "native") return row;
  return nullptr;
}

}  // namespace

std::string duration_section(const View& view) {
  std::string html = fmt::format(
      "<h2 id='durations'>Durations over time</h2>\n<p>Every step of {:.3g} s of simulated time; the dissertation's "
      "figures 4.11 to 4.49 show 30 s. Milliseconds on a logarithmic scale, for the native simulator and the fastest "
      "device with each set of algorithms. Each stretch of steps is drawn from its shortest to its longest, so that no "
      "spike is lost. The tables above have all simulators.</p>\n",
      static_cast<double>(view.campaign().where.steps) / 60);
  for (const std::string& environment : view.environments()) {
    html += fmt::format("<h3>{}</h3>\n", environment) + against_bodies(view, environment);
    for (const std::int64_t bodies : view.sizes(environment))
      html += plots_of(
          fmt::format("{} {}", environment, grouped(bodies)), drawn_runs(view, environment, bodies),
          [&](const Measurement& run) {
            const std::string label = label_of(run.what);
            return Curve{label, {}, {}, view.colour(label), false};
          },
          published_processor(environment, bodies));
  }
  return html;
}

std::string threads_section(const View& view) {
  // The environment of figures 4.1 to 4.9, or else the first that was run.
  const std::vector<std::string> environments = view.environments();
  const bool has_layers = std::ranges::find(environments, "layers") != environments.end();
  const std::string environment = has_layers ? "layers" : environments.empty() ? "" : environments.front();
  std::string rows;
  for (const std::int64_t bodies : view.sizes(environment)) {
    std::vector<const Measurement*> runs = view.native_runs(environment, bodies, "fathom");
    if (runs.size() < 2) continue;
    rows += plots_of(
        fmt::format("{} {}", environment, grouped(bodies)), runs,
        [](const Measurement& run) {
          int colour = 0;
          for (int threads = run.what.threads; threads > 1; threads /= 2) ++colour;
          return Curve{counted(static_cast<std::uint64_t>(run.what.threads), "thread"), {}, {}, colour % 8, false};
        },
        nullptr);
  }
  if (rows.empty()) return {};
  std::string html = fmt::format(
      "<h2 id='threads'>Threads</h2>\n<p>The native simulator with 1, 2, 4, … threads, in the form of the "
      "dissertation's "
      "figures 4.1 to 4.9 ({}).</p>\n{}",
      environment, rows);
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
  for (const std::string& name : environments)
    for (const std::int64_t bodies : view.sizes(name)) {
      const std::vector<const Measurement*> runs = view.native_runs(name, bodies, "fathom");
      if (runs.size() < 2) continue;
      html += fmt::format("<tr><td>{}</td><td class='n'>{}</td>", name, grouped(bodies));
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
