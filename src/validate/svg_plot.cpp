#include "validate/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace fathom::validate {
namespace {

constexpr double width = 640, height = 300, left = 78, right = 16, top = 14, bottom = 44;

/// One axis: which values it spans, and where they lie.
struct Axis {
  bool logarithmic = false;
  double low = 0, high = 1, from = 0, to = 1;

  double value(double v) const { return logarithmic ? std::log10(v) : v; }
  bool shows(double v) const { return std::isfinite(v) && (!logarithmic || v > 0); }
  double place(double v) const { return from + (value(v) - low) / (high - low) * (to - from); }
};

Axis make_axis(const Plot& plot, bool x, bool logarithmic, double from, double to) {
  Axis axis{logarithmic, 1e300, -1e300, from, to};
  for (const Curve& curve : plot.curves)
    for (const double v : x ? curve.x : curve.y) {
      if (!axis.shows(v)) continue;
      axis.low = std::min(axis.low, axis.value(v));
      axis.high = std::max(axis.high, axis.value(v));
    }
  if (axis.low > axis.high) axis.low = 0, axis.high = 1;
  if (axis.high - axis.low < 1e-12 * std::max(1.0, std::abs(axis.high))) axis.low -= 0.5, axis.high += 0.5;
  return axis;
}

/// Round values: 1, 2 or 5 times a power of ten apart; powers of ten where the axis is logarithmic.
std::vector<double> ticks(const Axis& axis) {
  const double span = axis.high - axis.low;
  double step = std::pow(10, std::floor(std::log10(span / 4)));
  if (axis.logarithmic)
    step = std::max(1.0, std::round(span / 5));
  else if (span / step > 10)
    step *= span / step > 20 ? 5 : 2;
  std::vector<double> all;
  for (double v = std::ceil(axis.low / step) * step; v <= axis.high + 1e-9 * span; v += step)
    all.push_back(axis.logarithmic ? std::pow(10, v) : std::abs(v) < 1e-9 * span ? 0 : v);
  return all;
}

std::string path_of(const Curve& curve, const Axis& x, const Axis& y) {
  std::string path;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (!x.shows(curve.x[i]) || !y.shows(curve.y[i])) continue;
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x.place(curve.x[i]), y.place(curve.y[i]));
  }
  return path;
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string to_svg(const Plot& plot) {
  const Axis x = make_axis(plot, true, plot.log_x, left, width - right);
  const Axis y = make_axis(plot, false, plot.log_y, height - bottom, top);
  const double legend_height = 16.0 * static_cast<double>((plot.curves.size() + 2) / 3);
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>", width, height + legend_height,
                                escaped(plot.title));
  for (const double v : ticks(x))
    svg += fmt::format(
        "<line class='grid' x1='{0:.1f}' x2='{0:.1f}' y1='{1}' y2='{2}'/><text x='{0:.1f}' y='{3}' "
        "text-anchor='middle'>{4:.4g}</text>",
        x.place(v), top, height - bottom, height - bottom + 16, v);
  for (const double v : ticks(y))
    svg += fmt::format(
        "<line class='grid' x1='{1}' x2='{2}' y1='{0:.1f}' y2='{0:.1f}'/><text x='{3}' y='{4:.1f}' "
        "text-anchor='end'>{5:.4g}</text>",
        y.place(v), left, width - right, left - 6, y.place(v) + 4, v);
  svg += fmt::format("<text x='{}' y='{}' text-anchor='middle'>{}</text>", (left + width - right) / 2,
                     height - bottom + 34, escaped(plot.x_label));
  svg += fmt::format("<text transform='translate(14 {}) rotate(-90)' text-anchor='middle'>{}</text>",
                     (top + height - bottom) / 2, escaped(plot.y_label));
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const std::string path = path_of(plot.curves[i], x, y);
    if (path.empty()) continue;
    svg += fmt::format("<path class='curve c{}' d='{}'/>", i % 8, path);
    const double lx = left + 190.0 * static_cast<double>(i % 3), ly = height + 2 + 16.0 * static_cast<double>(i / 3);
    svg += fmt::format("<line class='curve c{}' x1='{}' x2='{}' y1='{}' y2='{}'/><text x='{}' y='{}'>{}</text>", i % 8,
                       lx, lx + 18, ly, ly, lx + 24, ly + 4, escaped(plot.curves[i].name));
  }
  return svg + "</svg>";
}

}  // namespace fathom::validate
