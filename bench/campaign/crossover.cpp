#include "crossover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "page/html.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

/// Where log(native/device) passes 0 on a line through two sizes.
double interpolate(const Duel& a, const Duel& b) {
  const double at_a = std::log(a.native / a.device), at_b = std::log(b.native / b.device);
  const double share = at_a / (at_a - at_b);
  return std::exp(std::log(a.bodies) + share * (std::log(b.bodies) - std::log(a.bodies)));
}

std::string rounded(double bodies) {
  const double step = std::pow(10, std::floor(std::log10(bodies)) - 1);
  return grouped(std::llround(std::round(bodies / step) * step));
}

std::string row(const std::string& name, const std::string& css,
                const std::function<std::optional<Crossover>(const Stage&)>& of) {
  std::string html = fmt::format("<tr class='{}'><td>{}</td>", css, page::escaped(name));
  for (const std::size_t k : column_order) {
    const std::optional<Crossover> found = of(stages()[k]);
    html += fmt::format("<td class='n{}'>{}</td>", k == whole_step ? " whole" : "", found ? found->text() : "–");
  }
  return html + "</tr>\n";
}

}  // namespace

std::string Crossover::text() const {
  if (always) return fmt::format("{} and fewer", grouped(std::llround(below)));
  if (never) return fmt::format("none up to {}", grouped(std::llround(above)));
  return fmt::format("≈ {}", rounded(bodies));
}

std::optional<Crossover> crossover(const std::vector<Duel>& duels) {
  if (duels.empty()) return std::nullopt;
  const auto wins = [](const Duel& d) { return d.device < d.native; };
  Crossover result{false, false, 0, duels.front().bodies, duels.back().bodies};
  result.always = std::ranges::all_of(duels, wins);
  result.never = !wins(duels.back());
  if (result.always || result.never) return result;
  std::size_t first = duels.size() - 1;  // of the sizes from which the device wins
  while (wins(duels[first - 1])) --first;
  result.below = duels[first - 1].bodies, result.above = duels[first].bodies;
  result.bodies = interpolate(duels[first - 1], duels[first]);
  return result;
}

std::vector<Duel> duels(const View& view, const std::string& environment, const std::string& device_label,
                        const Stage& stage) {
  std::vector<Duel> all;
  for (const std::int64_t bodies : view.sizes(environment))
    for (const Measurement* run : view.of(environment, bodies)) {
      if (run->what.device.empty() || label_of(run->what) != device_label || !run->reported()) continue;
      const Measurement* native = view.fastest_native(environment, bodies, run->what.set);
      if (!native) continue;
      const auto [native_ms, device_ms] = means_of_common_steps(*native, *run, stage);
      all.push_back({static_cast<double>(run->bodies), native_ms, device_ms});
    }
  return all;
}

std::vector<Duel> published_duels(const std::string& environment, const std::string& hardware, const Stage& stage) {
  std::vector<Duel> all;
  for (const PublishedRow& device : published_rows())
    for (const PublishedRow& native : published_rows())
      if (device.environment == environment && device.hardware == hardware && native.environment == environment &&
          native.bodies == device.bodies && native.simulator == "native")
        all.push_back({static_cast<double>(device.bodies), stage.published(native), stage.published(device)});
  return all;
}

std::vector<std::string> device_labels(const View& view) {
  std::vector<std::string> labels;
  for (const Measurement* run : view.runs())
    if (!run->what.device.empty() && std::ranges::find(labels, label_of(run->what)) == labels.end())
      labels.push_back(label_of(run->what));
  return labels;
}

std::string crossover_section(const View& view) {
  std::string html =
      "<h2 id='crossover'>Crossover</h2>\n<p>From how many bodies on each device beats the native simulator, on "
      "the whole step and stage by stage: against the fastest number of threads measured, with the same set of "
      "algorithms, interpolated between the sizes measured. Published devices are compared with the published "
      "processor.</p>\n";
  for (const std::string& environment : view.environments()) {
    html += fmt::format("<h3>{}</h3>\n<table><tr><th></th>", environment);
    for (const std::size_t k : column_order)
      html += fmt::format("<th class='n{}'>{}</th>", k == whole_step ? " whole" : "", stages()[k].name);
    html += "</tr>\n";
    for (const std::string& label : device_labels(view))
      html += row(label, "", [&](const Stage& stage) { return crossover(duels(view, environment, label, stage)); });
    std::vector<std::string> seen;
    for (const PublishedRow& published : published_rows()) {
      if (published.simulator != "device" || std::ranges::find(seen, published.hardware) != seen.end()) continue;
      seen.push_back(published.hardware);
      html += row("published: " + published.hardware, "published", [&](const Stage& stage) {
        return crossover(published_duels(environment, published.hardware, stage));
      });
    }
    html += "</table>\n";
  }
  return html;
}

}  // namespace fathom::campaign
