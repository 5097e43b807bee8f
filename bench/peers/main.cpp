// fathom_peers: `fathom bench peers` without the rest of the program, for copying to other machines.
#include <CLI/CLI.hpp>
#include <iostream>

#include "files/unfinished.hpp"
#include "peers_command.hpp"

namespace {
enum ExitCode { bad_request = 2 };

int exit_code(fathom::peers::Outcome outcome) {
  constexpr int codes[] = {0, 1, 130};  // in the order of Outcome
  return codes[static_cast<int>(outcome)];
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Compares Fathom with other physics engines on the four environments: speed and quality.",
               "fathom_peers");
  fathom::peers::Options options;
  fathom::files::remove_unfinished_on_signals();
  app.get_formatter()->column_width(36);
  fathom::peers::declare(app, options);
  try {
    app.parse(argc, argv);
    return exit_code(fathom::peers::run(options));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : bad_request;
  } catch (const std::exception& error) {
    std::cerr << "fathom_peers: " << error.what() << '\n';
    return bad_request;
  }
}
