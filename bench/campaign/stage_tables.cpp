#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "measure/counted.hpp"
#include "page/html.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

using page::escaped;

constexpr std::size_t columns = column_order.size();

/// For each stage, this machine's fastest run over the steps that all runs made, and the fastest published time.
struct Best {
  std::array<const Measurement*, columns> ours{};
  std::array<double, columns> published{};
};

Best best_of(const std::vector<const Measurement*>& runs, const std::vector<const PublishedRow*>& published) {
  Best best;
  const std::uint64_t last = steps_of_all(runs);
  for (std::size_t k = 0; k < columns; ++k) {
    double least = best.published[k] = std::numeric_limits<double>::infinity();
    for (const Measurement* run : runs) {
      const double mean = run->reported() ? mean_of_first_steps(*run, last, stages()[k]) : least;
      if (mean < least) best.ours[k] = run, least = mean;
    }
    for (const PublishedRow* row : published)
      best.published[k] = std::min(best.published[k], stages()[k].published(*row));
  }
  return best;
}

std::string cell(double value, bool best, std::size_t column) {
  return fmt::format("<td class='n{}'><span{}>{}</span></td>", column == whole_step ? " whole" : "",
                     best ? " class='best'" : "", figure(value));
}

std::string row_of(const Measurement& run, const Best& best) {
  std::string html = fmt::format("<tr><td>{}{}</td>", escaped(label_of(run.what)), run.cut_short ? " †" : "");
  if (!run.reported())
    return html + fmt::format("<td colspan='4' class='{}'>{}</td></tr>\n", run.skipped.empty() ? "fail" : "faint",
                              escaped(run.skipped.empty() ? "refused: " + run.refused : "not run: " + run.skipped));
  for (const std::size_t k : column_order)
    html += cell((run.summary.stages.*stages()[k].statistics).mean, &run == best.ours[k], k);
  if (!run.failing.empty()) html += fmt::format("<td class='fail'>{}</td>", escaped(run.failing));
  return html + "</tr>\n";
}

std::string row_of(const PublishedRow& row, const Best& best) {
  std::string html = fmt::format("<tr class='published'><td>published: {}</td>", escaped(row.hardware));
  for (const std::size_t k : column_order) {
    const double mean = stages()[k].published(row);
    html += cell(mean, mean == best.published[k], k);
  }
  return html + "</tr>\n";
}

std::string table_of(const View& view, const std::string& environment) {
  std::string html = fmt::format("<h3>{}</h3>\n<table><tr><th></th>", environment);
  for (const std::size_t k : column_order)
    html += fmt::format("<th class='n{}'>{}</th>", k == whole_step ? " whole" : "", stages()[k].name);
  html += "</tr>\n";
  for (const std::int64_t bodies : view.sizes(environment)) {
    const std::vector<const Measurement*> runs = view.table_runs(environment, bodies);
    const std::vector<const PublishedRow*> published = published_of(environment, bodies);
    if (runs.empty()) continue;
    html += fmt::format("<tr class='group'><td colspan='5'>{} bodies</td></tr>\n",
                        grouped(static_cast<std::int64_t>(runs.front()->bodies)));
    const Best best = best_of(runs, published);
    for (const Measurement* run : runs) html += row_of(*run, best);
    for (const PublishedRow* row : published) html += row_of(*row, best);
  }
  return html + "</table>\n";
}

}  // namespace

std::string stage_tables_section(const View& view) {
  std::string html = fmt::format(
      "<h2 id='tables'>Average step durations</h2>\n<p>Average milliseconds per step, in the form of the "
      "dissertation's tables 4.2 to 4.5, whose figures stand below ours. Underlined: the best of each column on this "
      "machine over the steps that all runs made, and the best published. The native simulator is shown with {}{}. "
      "The dissertation's environments of 1,000 spread bodies and ours of 961 (a square) stand side by side. † cut "
      "short by the limit on a run's time: the average is that of the steps that were made.</p>\n",
      counted(static_cast<std::uint64_t>(view.table_threads()), "thread"),
      view.table_threads() == 8 ? ", as published" : ", all that this machine has");
  for (const std::string& environment : view.environments()) html += table_of(view, environment);
  return html;
}

}  // namespace fathom::campaign
