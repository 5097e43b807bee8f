// Validators shared by the options of several subcommands.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>

namespace fathom::cli {

/// A positive, finite number. CLI11's own check accepts nan and inf.
inline CLI::Validator positive_number() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        double value = 0;
        const bool good = CLI::detail::lexical_cast(text, value) && value > 0 && value <= 1e30;
        return good ? std::string() : "must be a finite number greater than 0, not " + text;
      },
      "");
}

/// A number between two limits that the message names. CLI11's own check accepts nan.
inline CLI::Validator number_between(double least, double most) {
  return CLI::Validator(
      [least, most](std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return {};
        return fmt::format("must be a number from {} to {}, not {}", least, most, text);
      },
      "");
}

/// Any whole number; its limits are checked where it is used.
inline CLI::Validator any_whole_number() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        std::int64_t value = 0;
        return CLI::detail::lexical_cast(text, value) ? std::string() : "must be a whole number, not " + text;
      },
      "");
}

/// A whole number of at least `least`. The message names both limits.
inline CLI::Validator whole_number(std::int64_t least, std::int64_t most = std::numeric_limits<std::int64_t>::max()) {
  return CLI::Validator(
      [least, most](std::string& text) -> std::string {
        std::int64_t value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return {};
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
