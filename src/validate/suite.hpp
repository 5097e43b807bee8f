// The validation suite: physical laws and published tests with their acceptance figures (docs/validation.md).
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
  const char* about;  ///< what is simulated and where the figure comes from
  void (*run)(const Setup&, Record&);
};

struct Result {
  const Case* test = nullptr;
  Record record;
  double seconds = 0;  ///< of wall time

  bool passed() const;
  /// Every check that fails is known to.
  bool as_expected() const;
};

std::span<const Case> cases();

/// Runs one case. An `Error` thrown by the engine becomes a failed check.
Result run_case(const Case& test, const Setup& setup);

}  // namespace fathom::validate
