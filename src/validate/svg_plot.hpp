// Curves as an SVG picture.
#pragma once

#include <string>

#include "validate/record.hpp"

namespace fathom::validate {

/// An <svg> element of the plot; colours follow the page's CSS variables.
std::string to_svg(const Plot& plot);
/// Text with the characters that HTML gives a meaning replaced.
std::string escaped(const std::string& text);

}  // namespace fathom::validate
