#include "options.hpp"

#include <CLI/CLI.hpp>

#include "validators.hpp"

namespace fathom::cli {
namespace {

const std::string axis_rule = "must be three finite numbers of at least 0, not all 0, e.g. 3,2,1";

void declare_size(CLI::App& command, RunOptions& options) {
  auto* bodies = command.add_option("--bodies", options.bodies, "About how many bodies an environment has")
                     ->type_name("N")
                     ->check(whole_number(1))
                     ->group("Size");
  command.add_option("--layers", options.layers, "Size of layers or pyramid in layers")
      ->type_name("L")
      ->check(whole_number(1))
      ->group("Size")
      ->excludes(bodies);
  command.add_option("--seed", options.seed, "Which heap; the number decides everything about it (1)")
      ->type_name("K")
      ->check(whole_number(0))
      ->group("Size");
}

void declare_which_scene(CLI::App& command, RunOptions& options, bool required) {
  command
      .add_option("scene", options.scene,
                  "drift, layers, spread, pyramid, ring, walls, heap, … ('fathom list' describes them), or a scene "
                  "file (*.toml)")
      ->required(required)
      ->type_name("ENVIRONMENT|SCENE.toml");
  declare_size(command, options);
}

void declare_time_step(CLI::App& command, RunOptions& options) {
  command.add_option("--dt", options.dt, "Time step (s; 1/60 = 0.0166667)")
      ->type_name("S")
      ->check(number_between(1e-6, 1, "s"))
      ->group("Time");
}

/// Each of the three components.
CLI::Validator axis_component() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        double value = 0;
        const bool good = CLI::detail::lexical_cast(text, value) && value >= 0 && value <= 1e30;
        return good ? std::string() : axis_rule + ", not " + text;
      },
      "");
}

void declare_simulator_choice(CLI::App& command, SimulatorOptions& options, const std::string& help) {
  declare_choice<SimulatorKind>(
      command, "--simulator", options.simulator,
      {{"native", SimulatorKind::native}, {"device", SimulatorKind::device}, {"hybrid", SimulatorKind::hybrid}}, help);
  command
      .add_option("--device", options.device, "Device of the device simulator: auto, host, cuda[:N], sycl[:N] (auto)")
      ->type_name("DEVICE");
  command.add_option("--threads", options.threads, "Threads, 0 for one per core (0)")
      ->type_name("N")
      ->check(whole_number(0, WorldDef::max_threads));
}

void declare_simulator(CLI::App& command, RunOptions& options) {
  declare_simulator_choice(command, options.simulator, "Which simulator runs the scene (native)");
  command.add_option("--ahead", options.ahead, "Steps the device simulator may be ahead of what is read (0)")
      ->type_name("N")
      ->check(whole_number(0, 16));
  declare_choice<Preset>(command, "--preset", options.preset,
                         {{"fathom", Preset::fathom}, {"dissertation", Preset::dissertation}},
                         "Set of algorithms; the options below change parts of it");
  declare_choice<BroadPhase>(command, "--broad-phase", options.broad_phase,
                             {{"tree", BroadPhase::tree}, {"sweep", BroadPhase::sweep}}, "How pairs are found (tree)");
  command
      .add_option_function<std::vector<float>>(
          "--sweep-axis",
          [&options](const std::vector<float>& v) {
            options.sweep_axis = {v[0], v[1], v[2]};
            if (!(length(*options.sweep_axis) > 0)) throw CLI::ValidationError("--sweep-axis", axis_rule);
          },
          "Axis of the sweep, components at least 0 (3,2,1)")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3)
      ->check(axis_component());
  declare_choice<Partition>(command, "--partition", options.partition,
                            {{"colours", Partition::colours}, {"cells", Partition::cells}},
                            "Which contacts are solved at the same time (colours)");
  command.add_option("--marking-rounds", options.marking_rounds, "Batches that a cell of a device can have (32)")
      ->type_name("N")
      ->check(whole_number(1, 255));
  declare_choice<Solver>(command, "--solver", options.solver, {{"soft", Solver::soft}, {"impulse", Solver::impulse}},
                         "How contacts are solved (soft)");
  declare_choice<bool>(command, "--warm-start", options.warm_start, {{"on", true}, {"off", false}},
                       "Whether contacts begin with their last impulses (on)");
  declare_choice<bool>(command, "--direct-joints", options.direct_joints, {{"on", true}, {"off", false}},
                       "Whether mechanisms of rigid joints are solved directly, or by sweeps (on)");
  command.add_option("--iterations", options.iterations, "Sweeps per substep of solver impulse (10)")
      ->type_name("N")
      ->check(whole_number(1, 1000));
  command.add_option("--substeps", options.substeps, "Substeps of a step (4)")
      ->type_name("N")
      ->check(whole_number(1, SolverSettings::max_substeps));
  declare_choice<bool>(command, "--sleep", options.sleep, {{"on", true}, {"off", false}},
                       "Whether resting islands sleep (off in the environments)");
}

void declare_output(CLI::App& command, RunOptions& options) {
  command.add_option("--json", options.json, "Write the figures of the run as JSON ('-' is stdout)")
      ->type_name("FILE")
      ->group("Output");
  command.add_option("--csv", options.csv, "Write a row per step: each stage's ms and the counts")
      ->type_name("FILE")
      ->group("Output");
  command.add_option("--record", options.record, "Record the run for 'fathom replay'")
      ->type_name("FILE")
      ->group("Output");
  command.add_option("--trace", options.trace, "Write profile zones as a Chrome trace (ui.perfetto.dev reads it)")
      ->type_name("FILE.json")
      ->group("Output");
  command.add_flag("--quiet", options.quiet, "No progress bar, no table")->group("Output");
}

}  // namespace

void declare_duration(CLI::App& command, RunOptions& options, const std::string& help) {
  const std::int64_t max_steps = 1'000'000'000;
  auto* steps = command.add_option("--steps", options.steps, help)
                    ->type_name("N")
                    ->check(whole_number(1, max_steps))
                    ->group("Time");
  command.add_option("--seconds", options.seconds, "Simulated time instead of --steps (s)")
      ->type_name("S")
      ->check(positive_number())
      ->excludes(steps)
      ->group("Time");
}

bool RunOptions::decides_states() const {
  const bool of_scene = bodies || layers || seed || dt || !config.file.empty() || !config.sets.empty();
  const bool of_simulator = simulator.simulator || simulator.device || ahead || preset || sleep;
  const bool of_detection = broad_phase || sweep_axis;
  const bool of_solver = partition || solver || iterations || warm_start || direct_joints || marking_rounds || substeps;
  return of_scene || of_simulator || of_detection || of_solver;
}

void declare_scene(CLI::App& command, RunOptions& options, bool required) {
  declare_which_scene(command, options, required);
  declare_time_step(command, options);
  declare_simulator(command, options);
  declare_config_sources(command, options.config);
}

void declare_run(CLI::App& command, RunOptions& options) {
  declare_scene(command, options);
  declare_duration(command, options);
  declare_output(command, options);
  command.footer(
      "Examples:\n"
      "  fathom run pyramid --layers 15\n"
      "  fathom run layers --bodies 10000 --threads 2 --json layers.json --csv layers.csv\n"
      "  fathom run examples/scenes/materials.toml --seconds 5\n"
      "\n"
      "Exit code: 0 the run finished and every state is finite; 1 it did not, or a state is not finite;\n"
      "2 the command line, a scene or a file is wrong; 130 Ctrl-C, what was measured is written.");
}

void declare_play(CLI::App& command, RunOptions& options) {
  declare_scene(command, options);
  declare_duration(command, options);
  command.add_flag("--quiet", options.quiet, "Print nothing unless something is wrong");
  command.footer(
      "The configuration decides everything else: mode, pacing, window, logging, recording ('fathom config').\n"
      "In a window space pauses, a full stop makes one step, escape ends. Examples:\n"
      "  fathom play layers --set simulator.mode=async --set loop.time=wall --set window.enabled=true\n"
      "  fathom play pyramid --layers 15 --steps 600 --set simulator.mode=ahead --set trace.file=trace.json");
}

void declare_config(CLI::App& command, ConfigOptions& options) {
  declare_scene(command, options.run, false);
  command.add_option("--write", options.write, "Write what is set to this file instead of printing everything")
      ->type_name("FILE.toml");
  command.footer(
      "With a scene the values are those of its run. A line that begins with # is not set here: its value\n"
      "is the default, or that of the scene or preset. Examples:\n"
      "  fathom config --set simulator.mode=async --write engine.toml\n"
      "  fathom config pyramid --config engine.toml --preset dissertation");
}

void declare_table(CLI::App& command, TableOptions& options) {
  command.add_option("files", options.files, "Results written by 'fathom run --json'")->required()->type_name("FILE");
}

void declare_validate(CLI::App& command, ValidateOptions& options) {
  command.add_option("--only", options.only, "Cases or groups whose names contain this text")->type_name("TEXT");
  command.add_flag("--short", options.brief, "The shorter form that is part of the tests");
  command.add_flag("--list", options.list, "List the cases");
  declare_simulator_choice(command, options.simulator, "Which simulator is validated (native)");
  command
      .add_option("--seeds", options.seeds,
                  "How many random heaps each of the cases 'heaps' judges (60, --short 6, on surfaces 2)")
      ->type_name("N")
      ->check(whole_number(1, 1'000'000'000))
      ->group("Heaps");
  command.add_option("--first", options.first, "Seed of the first of them (1)")
      ->type_name("K")
      ->check(whole_number(0))
      ->group("Heaps");
  command.add_option("--html", options.html, "Write the report with tables and plots")
      ->type_name("FILE")
      ->group("Output");
  command.add_option("--json", options.json, "Write the report as JSON ('-' is stdout)")
      ->type_name("FILE")
      ->group("Output");
  command.add_flag("--quiet", options.quiet, "No line per check")->group("Output");
  command.footer(
      "Examples:\n"
      "  fathom validate --html validation.html\n"
      "  fathom validate --only heaps --seeds 100 --first 1 --simulator device\n"
      "\n"
      "Exit code: 0 all checks pass or fail as they are known to; 1 a check fails; 2 the command line or a file is\n"
      "wrong; 130 Ctrl-C, the report has the cases that ended.");
}

}  // namespace fathom::cli
