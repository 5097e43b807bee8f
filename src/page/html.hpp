// Shared by all report pages: one style, and escaped text.
#pragma once

#include <string>
#include <string_view>

#include "page/plot.hpp"

namespace fathom::page {

/// Text with HTML's special characters replaced.
std::string escaped(std::string_view text);
/// A self-contained page, for screen and print.
std::string document(std::string_view title, std::string_view body);
std::string to_html(const Table& table);

}  // namespace fathom::page
