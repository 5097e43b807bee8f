// A set of algorithms beside settings that somebody chose one by one.
#pragma once

#include <fathom/world.hpp>
#include <functional>
#include <span>
#include <string_view>

namespace fathom {

/// What a preset decides, by the names of the configuration's keys.
std::span<const std::string_view> settings_of(Preset preset);

/// `apply`, but for the settings that stay as they are.
void apply_but(Preset preset, WorldDef& world, const std::function<bool(std::string_view key)>& stays);

}  // namespace fathom
