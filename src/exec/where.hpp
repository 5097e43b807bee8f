// The source location of a submission, for error messages.
#pragma once

namespace fathom::exec {

/// Like std::source_location, which clang 14 lacks. The default argument `Where::current()` is the caller's line.
struct Where {
  const char* file = "";
  const char* function = "";
  unsigned line = 0;

  static constexpr Where current(const char* file = __builtin_FILE(), const char* function = __builtin_FUNCTION(),
                                 unsigned line = __builtin_LINE()) {
    return {file, function, line};
  }
};

}  // namespace fathom::exec
