// Counted nouns for messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace fathom {

/// "1 step", "2 steps"; `plural` is for irregular nouns.
inline std::string counted(std::uint64_t number, std::string_view noun, std::string_view plural = {}) {
  const std::string word(number != 1 && !plural.empty() ? plural : noun);
  return std::to_string(number) + " " + word + (number != 1 && plural.empty() ? "s" : "");
}

}  // namespace fathom
