// The suite's report: one self-contained HTML page, and JSON for programs.
#pragma once

#include <span>
#include <string>

#include "validate/suite.hpp"

namespace fathom::validate {

/// Where and on what the suite ran.
struct Circumstances {
  std::string version, commit, build_type, compiler, machine, date;
  bool interrupted = false;  ///< only the cases that had finished have results
};

std::string to_html(std::span<const Result> results, const Setup& setup, const Circumstances& circumstances);
std::string to_json(std::span<const Result> results, const Setup& setup, const Circumstances& circumstances);
/// One line per check, for a terminal.
std::string to_text(const Result& result);

}  // namespace fathom::validate
