#include "engine/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "engine/config_keys.hpp"
#include "files/input_file.hpp"
#include "files/output_file.hpp"
#include "scene/suggest.hpp"
#include "scene/toml_reader.hpp"

namespace fathom::engine {
namespace {

const ConfigKey* find_key(std::string_view name) {
  const auto keys = config_keys();
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const ConfigKey& key) { return key.name == name; });
  return found == keys.end() ? nullptr : &*found;
}

/// What scene files call differently.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> names_in_scenes{
    {{"solver.method", "simulator.solver"},
     {"sleep.enabled", "simulator.sleep"},
     {"sleep.linear_speed", "simulator.sleep_linear_speed"},
     {"sleep.time", "simulator.sleep_time"}}};

/// Sections that only scene files have.
constexpr std::array<std::string_view, 6> scene_sections{"body", "joint", "exclude", "materials", "shapes", "kicks"};

std::string_view section_of(std::string_view name) { return name.substr(0, std::min(name.rfind('.'), name.size())); }
std::string_view last_part_of(std::string_view name) { return name.substr(name.rfind('.') + 1); }

/// The key that the name may mean, or empty. Its last part counts most: 'world.dt' means 'simulator.dt'.
std::string_view nearest_key(std::string_view name) {
  for (const auto& [in_scene, key] : names_in_scenes)
    if (name == in_scene) return key;
  std::vector<std::string_view> known{action_prefix}, parts, of_part;
  for (const ConfigKey& key : config_keys()) {
    known.push_back(key.name);
    parts.push_back(last_part_of(key.name));
  }
  const std::string_view part = nearest(last_part_of(name), parts);
  if (part.empty()) {
    const std::string_view guess = nearest(name, known);
    // The same section alone says nothing.
    return section_of(guess) == section_of(name) ? std::string_view() : guess;
  }
  for (const std::string_view key : known)
    if (last_part_of(key) == part) of_part.push_back(key);
  const std::string_view guess = nearest(name, of_part);
  return guess.empty() ? of_part.front() : guess;
}

std::string unknown_key(std::string_view name) {
  const std::string unknown = fmt::format("unknown key '{}'", name);
  for (const ConfigKey& key : config_keys())
    if (section_of(key.name) == name)
      return fmt::format("{}: it is a section; name a key in it, such as '{}'", unknown, key.name);
  if (std::ranges::find(scene_sections, name.substr(0, name.find('.'))) != scene_sections.end())
    return unknown + ": only scene files have it; 'fathom config' lists the keys of a configuration";
  const std::string_view guess = nearest_key(name);
  return guess.empty() ? unknown + "; 'fathom config' lists the keys"
                       : fmt::format("{}; did you mean '{}'?", unknown, guess);
}

/// Without blanks at its ends.
std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

/// Sets one value. Throws `std::string`.
void assign(Settings& settings, const std::string& name, const toml::node& value) {
  if (name.starts_with(action_prefix) && name.size() > action_prefix.size()) {
    try {
      set_action(settings, name.substr(action_prefix.size()), value);
    } catch (const std::string& complaint) {
      throw "'" + name + "' " + complaint;
    }
    return;
  }
  const ConfigKey* key = find_key(name);
  if (!key) throw unknown_key(name);
  try {
    key->set(settings, value);
  } catch (const std::string& complaint) {
    throw "'" + name + "' " + complaint;
  }
}

struct Leaf {
  std::string name;
  const toml::node* value;
  toml::source_region where;  // of the key
};

void collect_leaves(const toml::table& table, const std::string& prefix, std::vector<Leaf>& leaves) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(key.str());
    if (node.is_table() && !find_key(name))
      collect_leaves(*node.as_table(), name + ".", leaves);
    else
      leaves.push_back({name, &node, key.source()});
  }
}

/// A value parsed as TOML; none if it is not TOML.
std::optional<toml::table> parse_value(const std::string& value) {
  if (value.find('\n') != std::string::npos) return std::nullopt;
  try {
    toml::table table = toml::parse("v = " + value);
    if (table.size() == 1) return table;
  } catch (const toml::parse_error&) {
  }
  return std::nullopt;
}

}  // namespace

Config::Config() = default;

void Config::load(const std::string& path) {
  parse(files::read_file(path, "'fathom config --write FILE' writes one"), path);
}

void Config::parse(std::string_view text, std::string_view file) {
  const toml::table root = parse_toml(text, file);
  std::vector<Leaf> leaves;
  collect_leaves(root, "", leaves);
  // Tables are sorted by key; errors are reported in file order.
  std::sort(leaves.begin(), leaves.end(), [](const Leaf& a, const Leaf& b) { return a.where.begin < b.where.begin; });
  note_edits();
  Settings values = values_;
  auto origins = origins_;
  for (const Leaf& leaf : leaves) {
    try {
      assign(values, leaf.name, *leaf.value);
    } catch (const std::string& complaint) {
      fail_at(file, leaf.where, complaint);
    }
    origins[leaf.name] = {Setter::file, fmt::format("{}:{}", file, leaf.where.begin.line)};
  }
  values_ = std::move(values);
  origins_ = std::move(origins);
  settle();
}

void Config::set(std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || trimmed(assignment.substr(0, equals)).empty())
    throw Error(ErrorCode::invalid_argument,
                fmt::format("--set {}: write it as key=value, e.g. --set simulator.threads=4", assignment));
  // Values that TOML cannot express could not be saved.
  if (!parse_value(quoted_toml(assignment)))
    throw Error(ErrorCode::invalid_argument, "--set key=value: the text is not UTF-8; write it in UTF-8");
  const std::string name(trimmed(assignment.substr(0, equals)));
  // Blanks beside the '=' are no part of either, as in a file.
  const bool spaced = name.size() < equals;
  const std::string value(spaced ? trimmed(assignment.substr(equals + 1)) : assignment.substr(equals + 1));
  const ConfigKey* key = find_key(name);
  std::optional<toml::table> parsed = parse_value(value);
  const bool wants_text = (key && key->is_text) || name.starts_with(action_prefix);
  if (!parsed || (wants_text && !parsed->get("v")->is_string() && !parsed->get("v")->is_array()))
    parsed = toml::table{{"v", value}};
  note_edits();
  Settings values = values_;
  try {
    assign(values, name, *parsed->get("v"));
  } catch (const std::string& complaint) {
    throw Error(ErrorCode::invalid_argument, fmt::format("--set {}: {}", assignment, complaint));
  }
  values_ = std::move(values);
  origins_[name] = {Setter::assignment, "--set"};
  settle();
}

std::string Config::text(bool origins) const {
  const Config now = settled();
  std::string out, table;
  const auto line = [&](const std::string& name, const std::string& key, const std::string& value,
                        const std::string& help) {
    const std::string head = name.substr(0, name.rfind('.', action_prefix.size() - 1));
    if (head != table) out += fmt::format("{}[{}]\n", out.empty() ? "" : "\n", table = head);
    const std::string comment = origins ? now.origin_of(name) : help;
    // Unset values are written as comments, so they stay unset when read again.
    out += fmt::format("{:<36}{}\n", (now.counts(name) ? "" : "# ") + key + " = " + value,
                       comment.empty() ? "" : "  # " + comment);
  };
  for (const ConfigKey& key : config_keys())
    line(key.name, key.name.substr(key.name.rfind('.') + 1), key.get(now.values_), key.help);
  for (const auto& [action, keys] : now.values_.actions) {
    std::string list;
    for (const std::string& key : keys) list += (list.empty() ? "" : ", ") + quoted_toml(key);
    line(std::string(action_prefix) + action, quoted_toml(action), "[" + list + "]", "");
  }
  return out;
}

void Config::save(const std::string& path) const { files::write_file(path, text(false)); }

std::string Config::origin(std::string_view key) const { return settled().origin_of(key); }

std::vector<std::string> Config::keys() const {
  std::vector<std::string> names;
  for (const ConfigKey& key : config_keys()) names.push_back(key.name);
  for (const auto& [action, keys] : values_.actions) names.push_back(std::string(action_prefix) + action);
  return names;
}

}  // namespace fathom::engine
