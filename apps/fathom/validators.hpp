// Validators shared by the options of several subcommands.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <system_error>

namespace fathom::cli {

/// A positive, finite number; the message names `most`, if given. CLI11's own check accepts nan and inf.
inline CLI::Validator positive_number(std::optional<double> most = {}) {
  return CLI::Validator(
      [most](std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value > 0 && value <= most.value_or(1e30)) return {};
        return fmt::format("must be a finite number greater than 0{}, not {}",
                           most ? fmt::format(" and at most {}", *most) : std::string(), text);
      },
      "");
}

/// A number between two limits that the message names. CLI11's own check accepts nan.
inline CLI::Validator number_between(double least, double most, std::string unit = {}) {
  if (!unit.empty()) unit.insert(0, " ");
  return CLI::Validator(
      [least, most, unit](std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return {};
        return fmt::format("must be a number from {} to {}{}, not {}", least, most, unit, text);
      },
      "");
}

/// Digits alone. CLI11 reads 010 as 8.
inline std::optional<std::int64_t> decimal(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::size_t first = text.starts_with('-') ? 1 : 0;
  const bool has_zero_first = text.size() > first + 1 && text[first] == '0';
  if (failure != std::errc() || end != text.data() + text.size() || has_zero_first) return std::nullopt;
  return value;
}

/// A whole number of at least `least`. The message names both limits.
inline CLI::Validator whole_number(std::int64_t least, std::int64_t most = std::numeric_limits<std::int64_t>::max()) {
  return CLI::Validator(
      [least, most](std::string& text) -> std::string {
        if (const auto value = decimal(text); value && *value >= least && *value <= most) return {};
        const bool limited = most < std::numeric_limits<std::int64_t>::max();
        return fmt::format("must be a whole number from {}{}, not {}", least,
                           limited ? fmt::format(" to {}", most) : std::string(), text);
      },
      "");
}

/// One of a few words. CLI11's own message for a wrong one lists numbers.
template <class T, class Value>
void declare_choice(CLI::App& command, const std::string& flag, Value& value, std::map<std::string, T> words,
                    const std::string& help) {
  std::string list;
  for (const auto& word : words) list += (list.empty() ? "" : "|") + word.first;
  command
      .add_option_function<std::string>(
          flag, [&value, words](const std::string& word) { value = words.at(word); }, help)
      ->type_name(list)
      ->check(CLI::Validator(
          [words, list](std::string& word) -> std::string {
            return words.contains(word) ? std::string() : "must be " + list + ", not " + word;
          },
          ""));
}

}  // namespace fathom::cli
