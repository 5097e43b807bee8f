#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>

#include "commands.hpp"
#include "engine/config.hpp"
#include "engine/recording.hpp"
#include "engine_options.hpp"
#include "exec/devices.hpp"
#include "measure/system.hpp"
#include "setup.hpp"
#include "validators.hpp"

namespace fathom::cli {

engine::Config ConfigSources::load() const {
  engine::Config config;
  if (!file.empty()) config.load(file);
  for (const std::string& set : sets) config.set(set);
  return config;
}

void declare_config_sources(CLI::App& command, ConfigSources& sources) {
  command.add_option("--config", sources.file, "Read the engine's configuration ('fathom config' shows the keys)")
      ->type_name("FILE.toml")
      ->group("Configuration");
  command.add_option("--set", sources.sets, "Set one key of it, e.g. --set simulator.threads=4")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false)
      ->check(CLI::Validator(
          [](std::string& text) -> std::string {
            return text.find('=') != text.npos ? std::string()
                                               : "must be KEY=VALUE, e.g. simulator.threads=4, not " + text;
          },
          ""))
      ->group("Configuration");
}

void declare_replay(CLI::App& command, ReplayOptions& options) {
  command.add_option("file", options.file, "A recording written by 'fathom run --record' or by an engine")
      ->required()
      ->type_name("FILE");
  command.add_option("--threads", options.threads, "Threads, 0 for one per core (0)")
      ->type_name("N")
      ->check(whole_number(0, WorldDef::max_threads));
  command.add_option("--device", options.device, "Device of a run of the device simulator (auto)")->type_name("DEVICE");
  command.add_flag("--quiet", options.quiet, "Print nothing unless something differs");
  command.footer(
      "Exit code: 0 every step came out as recorded; 1 a step did not; 2 the file is not a valid recording.");
}

int config(const ConfigOptions& options) {
  inputs_of(options.run).writes("--write", options.write);
  const engine::Config config = make_config(options.run);
  if (options.write.empty())
    fmt::print("{}", config.text(true));
  else
    config.save(options.write);
  return finished;
}

namespace {

/// Thrown on Ctrl-C, through a replay.
struct Interrupted {
  std::uint64_t step;
};

}  // namespace

int replay(const ReplayOptions& options) {
  exec::parse_device(options.device);  // checks the name, which a replay on the native simulator would not read
  const auto start = std::chrono::steady_clock::now();
  const InterruptGuard interrupt;
  engine::ReplaySettings settings{.threads = options.threads, .device = options.device};
  settings.after_step = [](std::uint64_t step, World&) {
    if (InterruptGuard::requested()) throw Interrupted{step};
  };
  engine::ReplayResult result;
  try {
    result = engine::replay(options.file, settings);
  } catch (const Interrupted& end) {
    tell(fmt::format("fathom: {}: interrupted at step {}, every state until then as recorded\n", options.file,
                     end.step));
    return interrupted;
  }
  if (result.difference) {
    tell(fmt::format("fathom: {}: {}\n", options.file, result.difference->text()));
    return failed;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!options.quiet)
    fmt::print(
        "{}: {} steps from step {} replayed in {:.2f} s, every state as recorded\n  state hash             {:016x}\n",
        options.file, result.steps, result.first_step, seconds, result.state_hash);
  return finished;
}

}  // namespace fathom::cli
