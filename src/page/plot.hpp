// Curves and tables as data, for pages and for programs.
#pragma once

#include <deque>
#include <string>
#include <vector>

namespace fathom::page {

struct Curve {
  std::string name;
  std::vector<double> x, y;
  int colour = -1;  ///< in the page's palette of eight, for curves of several plots that belong together; from 8 on the
                    ///< same again, dotted
  bool reference = false;  ///< a line for comparison, drawn thin and dashed

  void add(double px, double py) { x.push_back(px), y.push_back(py); }
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;
  std::deque<Curve> curves;  // a deque: references to its elements stay valid
  double width = 640, height = 300;
  bool legend = true;
  bool markers = false;        ///< a mark at every point, for curves with few points
  bool names_at_ends = false;  ///< each curve's name beside its last point: readable without colours; for few curves
};

struct Table {
  std::string title;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};

}  // namespace fathom::page
