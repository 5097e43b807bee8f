// What the pages of reports have in common: one look, and text made safe.
#pragma once

#include <string>
#include <string_view>

#include "page/plot.hpp"

namespace fathom::page {

/// Text with the characters that HTML gives a meaning replaced.
std::string escaped(std::string_view text);
/// A page that needs nothing from outside, on screens and in print.
std::string document(std::string_view title, std::string_view body);
std::string to_html(const Table& table);

}  // namespace fathom::page
