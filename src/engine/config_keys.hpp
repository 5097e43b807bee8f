// The table of configuration keys: name, meaning, and how each is read and written.
#pragma once

#include <toml++/toml.h>

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "engine/config.hpp"

namespace fathom::engine {

struct ConfigKey {
  std::string name;  ///< "simulator.threads"
  std::string help;
  bool is_text = false;
  /// Throws `std::string`: what is wrong with the value ("must be …").
  std::function<void(Settings&, const toml::node&)> set;
  /// The value as TOML.
  std::function<std::string(const Settings&)> get;
};

std::span<const ConfigKey> config_keys();

/// Keys with this prefix are actions: a string or an array of strings.
inline constexpr std::string_view action_prefix = "input.actions.";
void set_action(Settings& settings, const std::string& action, const toml::node& keys);
std::string quoted_toml(std::string_view text);

}  // namespace fathom::engine
