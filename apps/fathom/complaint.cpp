#include "complaint.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>
#include <vector>

#include "scene/suggest.hpp"

namespace fathom::cli {
namespace {

/// The innermost parsed subcommand.
const CLI::App& innermost(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands({}))
    if (command->parsed()) return innermost(*command);
  return app;
}

/// The innermost subcommand with words left that it does not know.
const CLI::App& puzzled(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->parsed()) continue;
    if (const CLI::App& inner = puzzled(*command); !inner.remaining().empty()) return inner;
  }
  return app;
}

/// "fathom bench peers".
std::string full_name(const CLI::App& app) {
  return (app.get_parent() ? full_name(*app.get_parent()) + " " : std::string()) + app.get_name();
}

std::string see_help(const CLI::App& app) { return fmt::format("see '{} --help'", full_name(app)); }

/// An option without its dashes, in which every two options are alike.
std::string_view without_dashes(std::string_view option) {
  return option.substr(std::min(option.find_first_not_of('-'), option.size()));
}

std::string or_help(std::string_view word, const std::vector<std::string>& known, const CLI::App& app) {
  std::vector<std::string_view> names;
  for (const std::string& each : known) names.push_back(without_dashes(each));
  const std::string_view guess = nearest(without_dashes(word), names);
  const auto meant = std::ranges::find(known, guess, without_dashes);
  return guess.empty() || meant == known.end() ? see_help(app) : fmt::format("did you mean {}?", *meant);
}

std::string unknown_option(const std::string& word, const CLI::App& app) {
  const std::string option = word.substr(0, word.find('='));
  std::vector<std::string> known;
  for (const CLI::Option* each : app.get_options())
    if (const std::string name = each->get_name(false, false); name.starts_with("-")) known.push_back(name);
  return fmt::format("'{}' has no option {}; {}", full_name(app), option, or_help(option, known, app));
}

std::string unknown_word(const std::string& word, const CLI::App& app) {
  std::vector<std::string> known;
  for (const CLI::App* command : app.get_subcommands({})) known.push_back(command->get_name());
  if (known.empty()) return fmt::format("'{}' is one word too many; {}", word, see_help(app));
  return fmt::format("'{}' has no subcommand {}; {}", full_name(app), word, or_help(word, known, app));
}

}  // namespace

std::string complaint_of(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& where = puzzled(app);
  const std::vector<std::string> words = where.remaining();
  // A word after an unknown option may be its value, but a subcommand comes first.
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with("-"); });
  const bool wants_subcommand = !where.get_subcommands({}).empty();
  if (!words.empty() && !(wants_subcommand && !words.front().starts_with("-")) && option != words.end())
    return unknown_option(*option, where);
  if (!words.empty()) return unknown_word(words.front(), where);
  std::string text = error.what();
  // One line, whatever CLI11's format.
  while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
  return fmt::format("{}; {}", text, see_help(innermost(app)));
}

}  // namespace fathom::cli
