// fathom_peers: `fathom bench peers` without the rest of the program, to be carried to other machines.
#include <CLI/CLI.hpp>
#include <iostream>

#include "peers_command.hpp"

namespace {
enum ExitCode { good = 0, failed = 1, bad_request = 2 };
}

int main(int argc, char** argv) {
  CLI::App app("Sets Fathom beside other physics engines on the four environments: speed and quality.", "fathom_peers");
  fathom::peers::Options options;
  app.get_formatter()->column_width(36);
  fathom::peers::declare(app, options);
  try {
    app.parse(argc, argv);
    return fathom::peers::run(options) ? good : failed;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? good : bad_request;
  } catch (const std::exception& error) {
    std::cerr << "fathom_peers: " << error.what() << '\n';
    return bad_request;
  }
}
