// fathom: runs the environments and scene files from the command line, and measures them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <fathom/error.hpp>
#include <string>
#include <string_view>
#include <vector>

#ifdef FATHOM_HAS_BENCH
#include "bench_options.hpp"
#endif
#include "build_info.hpp"
#include "commands.hpp"
#include "measure/system.hpp"
#include "options.hpp"
#ifdef FATHOM_HAS_RENDER
#include "render_options.hpp"
#endif
#ifdef FATHOM_HAS_VIEWER
#include "view_options.hpp"
#endif
#include "scene/suggest.hpp"

namespace {

using namespace fathom::cli;

int complain(std::string_view text, int code) {
  fmt::print(stderr, "fathom: {}\n", text);
  return code;
}

/// The long options of the subcommand in use, or the subcommands' names where none is.
std::vector<std::string> known_words(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->parsed()) continue;
    if (!command->get_subcommands({}).empty()) return known_words(*command);
    for (const CLI::Option* option : command->get_options()) words.push_back(option->get_name(false, false));
    return words;
  }
  for (const CLI::App* command : app.get_subcommands({})) words.push_back(command->get_name());
  return words;
}

/// The remedy for a word that the command line does not know.
std::string remedy(const CLI::App& app) {
  for (const std::string& word : app.remaining(true)) {
    const std::vector<std::string> known = known_words(app);
    const std::vector<std::string_view> views(known.begin(), known.end());
    const std::string_view guess = fathom::nearest(word, views);
    if (!guess.empty()) return fmt::format("; did you mean {}?", guess);
  }
  return "; see 'fathom --help' and 'fathom run --help'";
}

int refuse(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help and --version
  std::string text = error.what();
  // One line, whatever CLI11 makes of it.
  while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
  return complain(text + remedy(app), bad_request);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fathom: real-time rigid-body physics. Runs scenes without a window and measures them.", "fathom");
  app.set_version_flag("--version",
                       fmt::format("fathom {} ({})", fathom::build_info::version, fathom::build_info::commit));
  app.require_subcommand(1);
  app.get_formatter()->column_width(36);

  fathom::survive_file_size_limit();
  RunOptions run_options;
  TableOptions table_options;
  const CLI::App* list_command = app.add_subcommand("list", "Say which environments, simulators and solvers there are");
  const CLI::App* devices_command =
      app.add_subcommand("devices", "List the processors and GPUs of this machine, and why one cannot be used");
  CLI::App* run_command = app.add_subcommand("run", "Simulate an environment or a scene file and print its figures");
  RunOptions play_options;
  CLI::App* play_command =
      app.add_subcommand("play", "Run a scene inside the engine's main loop, headless or in a window");
  declare_play(*play_command, play_options);
  CLI::App* table_command = app.add_subcommand("table", "Print results of 'run --json' side by side");
  ValidateOptions validate_options;
  CLI::App* validate_command =
      app.add_subcommand("validate", "Check physical laws and published tests, and write a report");
  declare_run(*run_command, run_options);
  declare_validate(*validate_command, validate_options);
  declare_table(*table_command, table_options);
#ifdef FATHOM_HAS_RENDER
  RenderOptions render_options;
  CLI::App* render_command = app.add_subcommand("render", "Draw a run into pictures, films or a web page");
  declare_render(*render_command, render_options);
#endif
#ifdef FATHOM_HAS_VIEWER
  ViewOptions view_options;
  CLI::App* view_command = app.add_subcommand("view", "Show a run in a window");
  declare_view(*view_command, view_options);
#endif
#ifdef FATHOM_HAS_BENCH
  BenchOptions bench_options;
  CLI::App* bench_command =
      app.add_subcommand("bench", "Repeat the published experiment, set other engines beside it, compare results");
  declare_bench(*bench_command, bench_options);
#endif
  ConfigOptions config_options;
  ReplayOptions replay_options;
  CLI::App* config_command = app.add_subcommand("config", "Print the engine's configuration and where it comes from");
  CLI::App* replay_command = app.add_subcommand("replay", "Repeat a recorded run and check every step");
  declare_config(*config_command, config_options);
  declare_replay(*replay_command, replay_options);

  try {
    app.parse(argc, argv);
    if (list_command->parsed()) return list();
    if (devices_command->parsed()) return devices();
    if (table_command->parsed()) return table(table_options);
#ifdef FATHOM_HAS_RENDER
    if (render_command->parsed()) return render(render_options);
#endif
#ifdef FATHOM_HAS_VIEWER
    if (view_command->parsed()) return view(view_options);
#endif
#ifdef FATHOM_HAS_BENCH
    if (bench_command->parsed()) return bench(bench_options);
#endif
    if (config_command->parsed()) return config(config_options);
    if (replay_command->parsed()) return replay(replay_options);
    if (play_command->parsed()) return play(play_options);
    if (validate_command->parsed()) return validate(validate_options);
    return run(run_options);
  } catch (const CLI::ParseError& error) {
    return refuse(app, error);
  } catch (const fathom::Error& error) {
    return complain(error.what(), bad_request);
  } catch (const std::bad_alloc&) {
    return complain("not enough memory; ask for fewer bodies", failed);
  } catch (const std::exception& error) {
    return complain(error.what(), failed);
  }
}
