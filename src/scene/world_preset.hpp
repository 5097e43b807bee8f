// A set of algorithms combined with individually chosen settings.
#pragma once

#include <fathom/world.hpp>
#include <functional>
#include <span>
#include <string_view>

namespace fathom {

/// The settings of a preset, by configuration key.
std::span<const std::string_view> settings_of(Preset preset);

/// `apply`, except for the settings that stay.
void apply_but(Preset preset, WorldDef& world, const std::function<bool(std::string_view key)>& stays);

}  // namespace fathom
