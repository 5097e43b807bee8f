// Numbers in messages: std::to_string would show a radius of −1e-9 as zero.
#pragma once

#include <charconv>
#include <string>

namespace fathom {

/// Shortest text with at most four significant digits.
inline std::string text(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 4).ptr;
  return {buffer, end};
}

}  // namespace fathom
