// What is wrong with a command line, in one line with a remedy.
#pragma once

#include <string>
#include <string_view>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace fathom::cli {

std::string complaint_of(const CLI::App& app, const CLI::ParseError& error);
/// Control characters, which names of files and scenes may have, as \n or \x1b.
std::string one_line(std::string_view text);

}  // namespace fathom::cli
