// Findings of a case: checks against limits, and the curves and tables that explain them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "page/plot.hpp"

namespace fathom::validate {

/// A measured value and the limit it must keep to.
struct Check {
  std::string name;
  double value = 0;
  double limit = 0;
  bool at_most = true;  ///< otherwise at least
  std::string unit;
  std::string known;  ///< why it is known to fail; empty if it must hold

  /// False for NaN.
  bool passed() const { return at_most ? value <= limit : value >= limit; }
};

using page::Curve;
using page::Plot;
using page::Table;

struct Record {
  std::vector<Check> checks;
  std::vector<Plot> plots;
  std::vector<Table> tables;
  std::vector<std::string> notes;

  Check& at_most(std::string name, double value, double limit, std::string unit = {}) {
    return checks.emplace_back(Check{std::move(name), value, limit, true, std::move(unit), {}});
  }
  Check& at_least(std::string name, double value, double limit, std::string unit = {}) {
    return checks.emplace_back(Check{std::move(name), value, limit, false, std::move(unit), {}});
  }
  void note(std::string text) { notes.push_back(std::move(text)); }
};

}  // namespace fathom::validate
