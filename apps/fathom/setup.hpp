// From the options to the scene to run.
#pragma once

#include <cstdint>
#include <string>

#include "engine/config.hpp"
#include "files/file_names.hpp"
#include "options.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

/// What will run: a scene, with the world that scene, configuration and options result in, and that configuration.
struct Setup {
  Scene scene;
  engine::Config config;
  std::string size_note;  ///< " (--bodies 10 is rounded to 5)" where the environment's form asks for it, else empty
};

/// Throws `Error` if the options cannot be met.
Setup make_setup(const RunOptions& options);
/// Selects the device. If the machine does not have the requested one, `simulator.fallback` decides; an option that
/// names device or simulator rules out a fallback.
void choose_device(Setup& setup);
/// Both, for callers that only need the scene.
Scene make_scene(const RunOptions& options);
/// The configuration alone, whether or not the machine has that device; without a scene if the options name none.
engine::Config make_config(const RunOptions& options);
/// Applies the options that select simulator and device to the configuration. Throws `Error` if they contradict each
/// other, or the device's name is invalid.
void give_simulator(engine::Config& config, const SimulatorOptions& options);
/// Whether a file begins like a recording.
bool is_recording(const std::string& path);
/// The files that `make_scene` reads.
files::FileNames inputs_of(const RunOptions& options);
/// How many steps to run.
std::uint64_t steps_to_run(const RunOptions& options, const WorldDef& world);

}  // namespace fathom::cli
