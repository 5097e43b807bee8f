// fathom: runs the environments and scene files from the command line, and measures them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fathom/error.hpp>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "about.hpp"
#ifdef FATHOM_HAS_BENCH
#include "bench_options.hpp"
#endif
#include "commands.hpp"
#include "complaint.hpp"
#include "files/unfinished.hpp"
#include "measure/system.hpp"
#include "options.hpp"
#ifdef FATHOM_HAS_RENDER
#include "render_options.hpp"
#endif
#ifdef FATHOM_HAS_VIEWER
#include "view_options.hpp"
#endif

namespace {

using namespace fathom::cli;

int complain(std::string_view text, int code) {
  fathom::tell(fmt::format("fathom: {}\n", one_line(text)));
  return code;
}

int stdout_is_lost(const std::string& why) {
  return complain(fmt::format("stdout: could not be written to its end ({}); is the disk full?", why), bad_request);
}

/// The reader of the output must learn that a part is missing.
int flushed(int code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  return stdout_is_lost(std::strerror(errno));
}

/// An unset variable in a script gives an empty word, which must not mean "none" or 0.
void refuse_empty_values(CLI::App& app) {
  const auto fault = [](std::string& text) {
    return text.empty() ? "is empty; give it a value, or leave it out" : std::string();
  };
  // A "transform" runs before the option's own checks.
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_min() > 0) option->transform(CLI::Validator(fault, ""));
  for (CLI::App* command : app.get_subcommands({})) refuse_empty_values(*command);
}

/// The subcommands and their options.
class Program {
 public:
  Program() : app_("Fathom: real-time rigid-body physics. Runs scenes without a window and measures them.", "fathom") {
    app_.set_version_flag("--version", version_text());
    app_.require_subcommand(1);
    app_.get_formatter()->column_width(36);
    add("list", "List environments, simulators and solvers", list);
    add("devices", "List the processors and GPUs of this machine, and why one cannot be used", devices);
    add("run", "Simulate an environment or a scene file and print its figures", declare_run, run);
    add("play", "Run a scene inside the engine's main loop, headless or in a window", declare_play, play);
    add("table", "Print results of 'run --json' side by side", declare_table, table);
    add("save-shape", "Write a body's shape as a file that loads without being built again", declare_save_shape,
        save_shape);
    add("validate", "Check physical laws and published tests, and write a report", declare_validate, validate);
#ifdef FATHOM_HAS_RENDER
    add("render", "Draw a run into pictures, films or a web page", declare_render, render);
#endif
#ifdef FATHOM_HAS_VIEWER
    add("view", "Show a run in a window", declare_view, view);
#endif
#ifdef FATHOM_HAS_BENCH
    add("bench", "Repeat the published experiment, measure other engines, compare results", declare_bench, bench);
#endif
    add("config", "Print the engine's configuration and where it comes from", declare_config, config);
    add("replay", "Repeat a recorded run and check every step", declare_replay, replay);
    add("bug-report", "Write version, hardware, scene and a recording into one folder", declare_bug_report,
        [this](const BugReportOptions& options) {
          BugReportOptions complete = options;
          complete.command_line = command_line_;
          return bug_report(complete);
        });
    refuse_empty_values(app_);
  }

  int run_command(int argc, char** argv) {
    for (int i = 0; i < argc; ++i) command_line_ += (i == 0 ? "" : " ") + std::string(argv[i]);
    try {
      app_.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == 0) return app_.exit(error);  // --help and --version
      return complain(complaint_of(app_, error), bad_request);
    }
    for (const auto& [command, work] : commands_)
      if (command->parsed()) return work();
    return bad_request;
  }

 private:
  void add(const std::string& name, const std::string& help, int (*work)()) {
    commands_.emplace_back(app_.add_subcommand(name, help), work);
  }
  template <class Options, class Work>
  void add(const std::string& name, const std::string& help, void (*declare)(CLI::App&, Options&), Work work) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app_.add_subcommand(name, help);
    declare(*command, *options);
    commands_.emplace_back(command, [options, work] { return work(*options); });
  }

  CLI::App app_;
  std::string command_line_;
  std::vector<std::pair<const CLI::App*, std::function<int()>>> commands_;
};

}  // namespace

int main(int argc, char** argv) {
  fathom::keep_standard_descriptors();
  fathom::survive_file_size_limit();
  fathom::files::remove_unfinished_on_signals();
  try {
    return flushed(Program().run_command(argc, argv));
  } catch (const fathom::Error& error) {
    return complain(error.what(), bad_request);
  } catch (const std::bad_alloc&) {
    return complain("not enough memory; ask for fewer bodies", failed);
  } catch (const std::system_error& error) {
    // thrown by fmt if stdout cannot accept what is printed
    return std::ferror(stdout) ? stdout_is_lost(error.code().message()) : complain(error.what(), failed);
  } catch (const std::exception& error) {
    return complain(error.what(), failed);
  }
}
