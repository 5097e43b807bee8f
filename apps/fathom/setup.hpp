// From the options to the scene that will run.
#pragma once

#include <cstdint>

#include "files/file_names.hpp"
#include "options.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

/// The environment or file of the options, with what they override. Throws `Error` on what cannot be.
Scene make_scene(const RunOptions& options);
/// The files that `make_scene` reads.
files::FileNames inputs_of(const RunOptions& options);
/// How many steps to run.
std::uint64_t steps_to_run(const RunOptions& options, const WorldDef& world);

}  // namespace fathom::cli
