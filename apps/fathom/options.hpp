// Command-line options.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine_options.hpp"

namespace CLI {
class App;
}

namespace fathom::cli {

/// Exit codes of the program.
enum Exit : int {
  finished = 0,      ///< the run finished and every state is finite
  failed = 1,        ///< a state is not finite, or the run could not continue
  bad_request = 2,   ///< the command line, a scene or a file is wrong
  interrupted = 130  ///< Ctrl-C; measurements so far are written
};

/// Which simulator, on which device.
struct SimulatorOptions {
  std::optional<SimulatorKind> simulator;
  std::optional<std::string> device;
  std::optional<int> threads;
};

/// Options of `fathom run`. Absent values are the scene's own.
struct RunOptions {
  std::string scene;  ///< an environment's name or a scene file's path
  std::optional<std::int64_t> bodies;
  std::optional<std::int64_t> layers;
  std::optional<std::uint64_t> seed;  ///< of a heap
  SimulatorOptions simulator;
  std::optional<int> ahead;
  std::optional<std::uint64_t> steps;
  std::optional<double> seconds;
  std::optional<float> dt;
  std::optional<int> substeps;
  std::optional<BroadPhase> broad_phase;
  std::optional<Vec3> sweep_axis;
  std::optional<Partition> partition;
  std::optional<Solver> solver;
  std::optional<int> iterations;
  std::optional<bool> warm_start;
  std::optional<bool> direct_joints;
  std::optional<int> marking_rounds;
  std::optional<Preset> preset;
  std::optional<bool> sleep;
  std::string json;  ///< path, "-" for stdout, empty for none
  std::string csv;
  std::string record;
  std::string trace;
  ConfigSources config;
  bool quiet = false;

  /// Whether an option is given that affects the states, or what computes them.
  bool decides_states() const;
};

struct TableOptions {
  std::vector<std::string> files;
};

/// Options of `fathom save-shape`.
struct SaveShapeOptions {
  std::string scene, body, output;
};

/// Options of `fathom config`.
struct ConfigOptions {
  RunOptions run;     ///< what to configure; the scene may be absent
  std::string write;  ///< path; empty: print
};

/// Options of `fathom bug-report`.
struct BugReportOptions {
  RunOptions run;  ///< what is run and recorded; the scene may be absent
  std::string output = "fathom-bug-report";
  std::string command_line;  ///< as given
};

/// Options of `fathom validate`.
struct ValidateOptions {
  std::vector<std::string> only;  ///< parts of case or group names; empty for all
  SimulatorOptions simulator;
  bool brief = false;
  bool list = false;
  std::optional<int> seeds;  ///< for the case heaps
  std::optional<std::uint64_t> first;
  std::string html;
  std::string json;
  bool quiet = false;
};

/// Declares the options common to all commands that simulate: the scene, its size, the world, the configuration.
void declare_scene(CLI::App& command, RunOptions& options, bool required = true);
/// Declares how long a scene runs; `help` is that of --steps.
void declare_duration(CLI::App& command, RunOptions& options, const std::string& help = "Steps to simulate (1800)");
/// Declares the options of a subcommand; parsing fills them.
void declare_run(CLI::App& command, RunOptions& options);
/// Of these, `fathom play` has the scene and its duration; the configuration covers the others.
void declare_play(CLI::App& command, RunOptions& options);
void declare_config(CLI::App& command, ConfigOptions& options);
void declare_table(CLI::App& command, TableOptions& options);
void declare_save_shape(CLI::App& command, SaveShapeOptions& options);
void declare_validate(CLI::App& command, ValidateOptions& options);
void declare_bug_report(CLI::App& command, BugReportOptions& options);

}  // namespace fathom::cli
