// Curves as an SVG picture.
#pragma once

#include <string>

#include "page/plot.hpp"

namespace fathom::page {

/// An <svg> element of the plot; colours follow the page's CSS variables.
std::string to_svg(const Plot& plot);
/// Names and colours of the curves, for several plots that share them.
std::string legend_of(const Plot& plot);

}  // namespace fathom::page
