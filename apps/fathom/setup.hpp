// From the options to the scene that will run.
#pragma once

#include <cstdint>

#include "engine/config.hpp"
#include "files/file_names.hpp"
#include "options.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

/// What will run: a scene, whose world is what scene, configuration and options come to, and that configuration.
struct Setup {
  Scene scene;
  engine::Config config;
};

/// Throws `Error` on what cannot be.
Setup make_setup(const RunOptions& options);
/// Takes the device that this machine has. Where it has none that was asked for, `simulator.fallback` decides; an
/// option that names device or simulator wants no other.
void choose_device(Setup& setup);
/// Both, for those who need no more than the scene.
Scene make_scene(const RunOptions& options);
/// The configuration alone, whether the machine has that device or not; without a scene where the options name none.
engine::Config make_config(const RunOptions& options);
/// Puts the options that say which simulator runs, on what, over the configuration. Throws `Error` where they
/// contradict each other, or the device's name is none.
void give_simulator(engine::Config& config, const SimulatorOptions& options);
/// The files that `make_scene` reads.
files::FileNames inputs_of(const RunOptions& options);
/// How many steps to run.
std::uint64_t steps_to_run(const RunOptions& options, const WorldDef& world);

}  // namespace fathom::cli
