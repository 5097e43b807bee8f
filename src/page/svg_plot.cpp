#include "page/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "page/html.hpp"

namespace fathom::page {
namespace {

constexpr double left = 56, top = 14, bottom = 44;
constexpr double name_width = 262, name_height = 13;

double right_of(const Plot& plot) { return plot.names_at_ends ? name_width : 22; }

/// One axis: its range of values, and their positions.
struct Axis {
  bool logarithmic = false;
  double low = 0, high = 1, from = 0, to = 1;

  double value(double v) const { return logarithmic ? std::log10(v) : v; }
  bool shows(double v) const { return std::isfinite(v) && (!logarithmic || v > 0); }
  double position(double v) const { return from + (value(v) - low) / (high - low) * (to - from); }
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

/// Powers of ten; if there are few, also 2 and 5 times each.
std::vector<double> logarithmic_ticks(const Axis& axis) {
  const double span = axis.high - axis.low;
  const int step = std::max(1, static_cast<int>(std::lround(span / 5)));
  std::vector<double> all;
  for (int e = static_cast<int>(std::floor(axis.low)); e <= axis.high + 1e-9; e += step)
    for (const double m : {1.0, 2.0, 5.0}) {
      if (m > 1 && span > 2.2) continue;
      const double v = m * std::pow(10, e);
      if (std::log10(v) >= axis.low - 1e-9 && std::log10(v) <= axis.high + 1e-9) all.push_back(v);
    }
  return all;
}

/// Round values: 1, 2 or 5 times a power of ten apart; powers of ten if the axis is logarithmic.
std::vector<double> ticks(const Axis& axis) {
  if (axis.logarithmic) return logarithmic_ticks(axis);
  const double span = axis.high - axis.low;
  double step = std::pow(10, std::floor(std::log10(span / 4)));
  if (span / step > 10) step *= span / step > 20 ? 5 : 2;
  std::vector<double> all;
  for (double v = std::ceil(axis.low / step) * step; v <= axis.high + 1e-9 * span; v += step)
    all.push_back(std::abs(v) < 1e-9 * span ? 0 : v);
  return all;
}

/// At most four digits; whole numbers up to a million written out.
std::string label_of(double v) {
  return v >= 1e4 && v <= 1e6 && v == std::round(v) ? fmt::format("{:.0f}", v) : fmt::format("{:.4g}", v);
}

std::string path_of(const Curve& curve, const Axis& x, const Axis& y) {
  std::string path;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (!x.shows(curve.x[i]) || !y.shows(curve.y[i])) continue;
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x.position(curve.x[i]), y.position(curve.y[i]));
  }
  return path;
}

std::string classes(const Curve& curve, std::size_t index) {
  const int colour = curve.colour >= 0 ? curve.colour : static_cast<int>(index);
  return fmt::format("curve c{}{}{}", colour % 8, colour >= 8 ? " again" : "", curve.reference ? " reference" : "");
}

/// One shape per curve, to tell curves apart without colour.
std::string mark(int kind, double x, double y, const std::string& classes) {
  switch (kind % 4) {
    case 0:
      return fmt::format("<circle class='{} mark' cx='{:.1f}' cy='{:.1f}' r='3.2'/>", classes, x, y);
    case 1:
      return fmt::format("<rect class='{} mark' x='{:.1f}' y='{:.1f}' width='6' height='6'/>", classes, x - 3, y - 3);
    case 2:
      return fmt::format("<path class='{} mark' d='M{:.1f} {:.1f}l3.6 6.4h-7.2z'/>", classes, x, y - 4);
    default:
      return fmt::format("<path class='{} mark' d='M{:.1f} {:.1f}l4 4l-4 4l-4 -4z'/>", classes, x, y - 4);
  }
}

/// Whether to mark the curve's points. A single point has no visible line.
bool is_marked(const Plot& plot, const Curve& curve) {
  return (plot.markers && !curve.reference) || curve.x.size() == 1;
}

std::string marks_of(const Curve& curve, std::size_t index, const Axis& x, const Axis& y) {
  std::string marks;
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    if (x.shows(curve.x[i]) && y.shows(curve.y[i]))
      marks += mark(static_cast<int>(index), x.position(curve.x[i]), y.position(curve.y[i]), classes(curve, index));
  return marks;
}

std::string axes_of(const Plot& plot, const Axis& x, const Axis& y) {
  std::string svg;
  const double floor = plot.height - bottom;
  for (const double v : ticks(x))
    svg += fmt::format(
        "<line class='grid' x1='{0:.1f}' x2='{0:.1f}' y1='{1}' y2='{2}'/><text x='{0:.1f}' y='{3}' "
        "text-anchor='middle'>{4}</text>",
        x.position(v), top, floor, floor + 16, label_of(v));
  for (const double v : ticks(y))
    svg += fmt::format(
        "<line class='grid' x1='{1}' x2='{2}' y1='{0:.1f}' y2='{0:.1f}'/><text x='{3}' y='{4:.1f}' "
        "text-anchor='end'>{5}</text>",
        y.position(v), left, plot.width - right_of(plot), left - 6, y.position(v) + 4, label_of(v));
  svg += fmt::format("<text x='{}' y='{}' text-anchor='middle'>{}</text>", (left + plot.width - right_of(plot)) / 2,
                     floor + 34, escaped(plot.x_label));
  svg += fmt::format("<text transform='translate(12 {}) rotate(-90)' text-anchor='middle'>{}</text>", (top + floor) / 2,
                     escaped(plot.y_label));
  return svg;
}

std::string legend_inside(const Plot& plot) {
  std::string svg;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const double x = left + 190.0 * static_cast<double>(i % 3), y = plot.height + 2 + 16.0 * static_cast<double>(i / 3);
    svg += fmt::format("<line class='{}' x1='{}' x2='{}' y1='{}' y2='{}'/><text x='{}' y='{}'>{}</text>",
                       classes(plot.curves[i], i), x, x + 18, y, y, x + 24, y + 4, escaped(plot.curves[i].name));
    if (is_marked(plot, plot.curves[i])) svg += mark(static_cast<int>(i), x + 9, y, classes(plot.curves[i], i));
  }
  return svg;
}

/// Names at the curves' ends, from the top down and without overlaps.
std::string names_of(const Plot& plot, const Axis& x, const Axis& y) {
  struct Name {
    double y;
    std::size_t curve;
  };
  std::vector<Name> names;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const Curve& curve = plot.curves[i];
    for (std::size_t k = curve.x.size(); k-- > 0;)
      if (x.shows(curve.x[k]) && y.shows(curve.y[k])) {
        names.push_back({y.position(curve.y[k]), i});
        break;
      }
  }
  std::ranges::sort(names, {}, &Name::y);
  const double lowest = plot.height - bottom;
  for (std::size_t i = 1; i < names.size(); ++i) names[i].y = std::max(names[i].y, names[i - 1].y + name_height);
  // Names pushed below the plot move up again, and push the others.
  for (std::size_t i = names.size(); i-- > 0;)
    names[i].y = std::min(names[i].y, i + 1 < names.size() ? names[i + 1].y - name_height : lowest);
  std::string svg;
  for (const Name& name : names)
    svg +=
        fmt::format("<text class='name {}' x='{}' y='{:.1f}'>{}</text>", classes(plot.curves[name.curve], name.curve),
                    plot.width - right_of(plot) + 6, name.y + 4, escaped(plot.curves[name.curve].name));
  return svg;
}

}  // namespace

std::string to_svg(const Plot& plot) {
  const Axis x = make_axis(plot, true, plot.log_x, left, plot.width - right_of(plot));
  const Axis y = make_axis(plot, false, plot.log_y, plot.height - bottom, top);
  const double legend_height = plot.legend ? 16.0 * static_cast<double>((plot.curves.size() + 2) / 3) : 0;
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>", plot.width,
                                plot.height + legend_height, escaped(plot.title));
  svg += axes_of(plot, x, y);
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const Curve& curve = plot.curves[i];
    if (const std::string path = path_of(curve, x, y); !path.empty())
      svg += fmt::format("<path class='{}' d='{}'/>", classes(curve, i), path);
    if (is_marked(plot, curve)) svg += marks_of(curve, i, x, y);
  }
  if (plot.names_at_ends) svg += names_of(plot, x, y);
  if (plot.legend) svg += legend_inside(plot);
  return svg + "</svg>";
}

std::string legend_of(const Plot& plot) {
  std::string html = "<div class='legend'>";
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const std::string look = classes(plot.curves[i], i);
    html += fmt::format(
        "<span><svg viewBox='0 0 26 10'><line class='{}' x1='1' x2='25' y1='5' y2='5'/>{}</svg>{}</span>", look,
        is_marked(plot, plot.curves[i]) ? mark(static_cast<int>(i), 13, 5, look) : "", escaped(plot.curves[i].name));
  }
  return html + "</div>\n";
}

}  // namespace fathom::page
