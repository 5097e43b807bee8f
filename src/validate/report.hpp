// The suite's report: one HTML page that needs nothing else, and JSON for programs.
#pragma once

#include <span>
#include <string>

#include "validate/suite.hpp"

namespace fathom::validate {

/// Where and with what the suite ran.
struct Circumstances {
  std::string version, commit, build_type, compiler, machine, date;
  bool interrupted = false;  ///< the results are those of cases that ended before
};

std::string to_html(std::span<const Result> results, const Setup& setup, const Circumstances& circumstances);
std::string to_json(std::span<const Result> results, const Setup& setup, const Circumstances& circumstances);
/// One line a check, for a terminal.
std::string to_text(const Result& result);

}  // namespace fathom::validate
