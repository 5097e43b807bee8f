// The validation suite: physical laws and published tests with their acceptance limits (docs/validation.md).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "validate/record.hpp"
#include "validate/setup.hpp"

namespace fathom::validate {

struct Case {
  const char* group;
  const char* name;   ///< unique
  const char* about;  ///< what is simulated, and the source of the limit
  void (*run)(const Setup&, Record&);
};

struct Result {
  const Case* test = nullptr;
  Record record;
  double seconds = 0;  ///< wall time

  bool passed() const;
  /// Whether every failing check is known to fail.
  bool as_expected() const;
};

std::span<const Case> cases();

/// Runs one case. An `Error` thrown by the engine becomes a failed check.
Result run_case(const Case& test, const Setup& setup);

}  // namespace fathom::validate
