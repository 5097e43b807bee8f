// What is wrong with a command line, in one line with a remedy.
#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace fathom::cli {

std::string complaint_of(const CLI::App& app, const CLI::ParseError& error);

}  // namespace fathom::cli
