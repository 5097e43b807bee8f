// `fathom bug-report`: everything that others need to see what went wrong, in one folder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>

#include "about.hpp"
#include "commands.hpp"
#include "files/input_file.hpp"
#include "files/output_file.hpp"
#include "measure/system.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "run.hpp"
#include "setup.hpp"

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t steps_of_report = 300;

/// The report's folder.
class Folder {
 public:
  explicit Folder(const std::string& path) : path_(path) {
    std::error_code failure;
    if (fs::exists(path_, failure) && !(fs::is_directory(path_, failure) && fs::is_empty(path_, failure)))
      throw Error(ErrorCode::file, path + ": exists already; give another name with -o");
    fs::create_directories(path_, failure);
    if (failure || !fs::is_directory(path_))
      throw Error(ErrorCode::file, path + ": the folder cannot be created; check its name and permissions");
  }

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    files::OutputFile file(*this / name);
    file.write(text);
    file.finish();
  }

 private:
  fs::path path_;
};

/// What is run and recorded, or why it cannot be.
struct Subject {
  std::optional<Setup> setup;
  std::uint64_t steps = steps_of_report;
  std::string refusal;
};

bool can_be_read(const std::string& file) {
  std::error_code failure;
  return fs::is_regular_file(file, failure) && std::ifstream(file).is_open();
}

/// Throws `Error` if the command line is wrong. A scene file that is refused may be what the report is about.
Subject subject_of(const RunOptions& run) {
  Subject subject;
  if (run.scene.empty()) {
    make_config(run);
    return subject;
  }
  try {
    subject.setup = make_setup(run);
    if (run.steps || run.seconds) subject.steps = steps_to_run(run, subject.setup->scene.world);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::file || !can_be_read(run.scene)) throw;
    subject.refusal = error.what();
  }
  return subject;
}

/// Runs the scene and records it; errors are written down, as the report may be about them.
std::string run_text(const BugReportOptions& options, Subject& subject, const Folder& folder) {
  if (!subject.setup) return fmt::format("The scene was refused:\n{}\n", subject.refusal);
  try {
    Setup& setup = *subject.setup;
    folder.write("config.toml", setup.config.text(true));
    choose_device(setup);
    const std::uint64_t steps = subject.steps;
    Progress progress(steps, !options.run.quiet && stderr_is_terminal());
    const RunResult result = simulate(setup.scene, steps, {folder / "run.fathom", {}, {}},
                                      [&](const Profile& profile, double) { progress.update(profile.step); });
    const Json report = to_json(setup.scene, result);
    folder.write("run.json", report.dump(2) + "\n");
    return to_text(report, setup.size_note);
  } catch (const std::exception& error) {
    return fmt::format("The run ended with an error:\n{}\n", error.what());
  }
}

/// Copies the scene's file; files that it names are not copied, because the recording has their content.
void copy_scene(const std::string& scene, const Folder& folder) {
  std::error_code failure;
  if (!fs::is_regular_file(scene, failure)) return;
  fs::copy_file(scene, folder / fs::path(scene).filename().string(), failure);
  if (failure) throw Error(ErrorCode::file, scene + ": cannot be copied (" + failure.message() + ")");
}

}  // namespace

int bug_report(const BugReportOptions& options) {
  const InterruptGuard interrupt;
  Subject subject = subject_of(options.run);
  const Folder folder(options.output);
  std::string text =
      fmt::format("What happened, and what did you expect?\n\n  (write it here)\n\nCommand: {}\n\n{}\n\n{}",
                  options.command_line, version_text(), machine_text());
  // First, so that it exists even if the run crashes the program.
  folder.write("report.txt", text);
  if (!options.run.scene.empty()) {
    copy_scene(options.run.scene, folder);
    text += "\n" + run_text(options, subject, folder);
    folder.write("report.txt", text);
  }
  if (!options.run.quiet)
    fmt::print("{}\nSay in it what happened, and send the whole folder.\n", folder / "report.txt");
  // The report holds it too, but it may be a mistake in the scene.
  if (!subject.refusal.empty()) throw Error(ErrorCode::file, subject.refusal);
  return InterruptGuard::requested() ? interrupted : finished;
}

void declare_bug_report(CLI::App& command, BugReportOptions& options) {
  declare_scene(command, options.run, false);
  declare_duration(command, options.run, "Steps to record (300)");
  command.add_option("-o,--output", options.output, "The folder (fathom-bug-report)")->type_name("FOLDER");
  command.add_flag("--quiet", options.run.quiet, "No progress bar, no name of the folder");
  command.footer(
      "Writes version, hardware, configuration, scene, recording and figures into a new folder. Without a scene:\n"
      "version and hardware. A run that ends with an error and a scene file that is refused are written down, too.\n"
      "Examples:\n"
      "  fathom bug-report\n"
      "  fathom bug-report my-scene.toml --steps 600 --simulator device -o report");
}

}  // namespace fathom::cli
