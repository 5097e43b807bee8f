#include "complaint.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>
#include <utility>
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

/// "fathom bench compare A.json B.json".
std::string usage(const CLI::App& app) {
  std::string text = full_name(app);
  for (const CLI::Option* option : app.get_options())
    if (option->get_positional()) text += " " + option->get_type_name();
  return text;
}

/// The option whose name, as CLI11 gives it, the text begins with; null if none.
const CLI::Option* named_by(std::string_view text, const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name();
    if (text.starts_with(name) && (text.size() == name.size() || text.find_first_of(": ") == name.size()))
      return option;
  }
  return nullptr;
}

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
  // What text processors make of two hyphens.
  for (const std::string_view dash : {"–", "—", "−"})
    if (word.starts_with(dash))
      return fmt::format("'{}' begins with a dash; write two hyphens: --{}", word, word.substr(dash.size()));
  if (known.empty()) return fmt::format("'{}' is one word too many; {}", word, see_help(app));
  return fmt::format("'{}' has no subcommand {}; {}", full_name(app), word.empty() ? "''" : word,
                     or_help(word, known, app));
}

/// Too many values, or none.
std::string wrong_number_of_values(const CLI::Option& option) {
  const std::string name = option.get_name();
  const std::size_t given = option.count();
  const int wanted = option.get_expected_max();
  if (given == 0) return fmt::format("{}: the value is missing; write {} {}", name, name, option.get_type_name());
  if (wanted > 1) return fmt::format("{} takes {} values, {}, not {}", name, wanted, option.get_type_name(), given);
  return fmt::format("{} is given {} ({}); keep one of them", name,
                     given == 2 ? "twice" : fmt::format("{} times", given), fmt::join(option.results(), ", "));
}

std::string not_convertible(const CLI::Option& option) {
  const std::string name = option.get_name(), values = fmt::format("{}", fmt::join(option.results(), ", "));
  if (option.get_items_expected_max() == 0) return fmt::format("{} takes no value; leave '={}' out", name, values);
  return fmt::format("{}: '{}' is not {}", name, values, option.get_type_name());
}

std::string missing(const CLI::Option& option, const CLI::App& app) {
  return fmt::format("'{}' is missing; write '{}'", option.get_name(), usage(app));
}

std::string missing_subcommand(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return fmt::format("'{}' needs a subcommand ({})", full_name(app), fmt::join(names, ", "));
}

/// CLI11's words, replaced where they do not say what to do. Whether a look at the help may be of use, too.
std::pair<std::string, bool> reworded(const CLI::ParseError& error, const CLI::App& app) {
  constexpr std::string_view not_converted = "Could not convert: ", excludes = " excludes ";
  const std::string text = error.what();
  const std::string_view rest(text);
  const CLI::Option* option = named_by(rest, app);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) && option) return {wrong_number_of_values(*option), false};
  if (dynamic_cast<const CLI::ConversionError*>(&error) && rest.starts_with(not_converted))
    if (const CLI::Option* named = named_by(rest.substr(not_converted.size()), app))
      return {not_convertible(*named), true};
  if (dynamic_cast<const CLI::RequiredError*>(&error))
    return {option ? missing(*option, app) : missing_subcommand(app), true};
  if (const std::size_t at = text.find(excludes); dynamic_cast<const CLI::ExcludesError*>(&error) && at != text.npos)
    return {fmt::format("{} and {} exclude each other; give one of them", text.substr(0, at),
                        text.substr(at + excludes.size())),
            false};
  return {text, true};
}

}  // namespace

std::string complaint_of(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& where = puzzled(app);
  std::vector<std::string> words = where.remaining();
  std::erase(words, "--");
  // A value that is refused may be why the words behind it are left.
  if (dynamic_cast<const CLI::ValidationError*>(&error)) words.clear();
  // A word after an unknown option may be its value, but a subcommand comes first.
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with("-"); });
  const bool wants_subcommand = !where.get_subcommands({}).empty();
  if (!words.empty() && !(wants_subcommand && !words.front().starts_with("-")) && option != words.end())
    return unknown_option(*option, where);
  if (!words.empty()) return unknown_word(words.front(), where);
  auto [text, help_is_of_use] = reworded(error, innermost(app));
  // One line, whatever CLI11's format.
  while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
  return help_is_of_use ? fmt::format("{}; {}", text, see_help(innermost(app))) : text;
}

std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text)
    if (c == '\n')
      line += "\\n";
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      line += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    else
      line += c;
  return line;
}

}  // namespace fathom::cli
