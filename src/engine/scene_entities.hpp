// A scene's bodies as entities, with their joints.
#pragma once

#include <vector>

#include "engine/engine.hpp"
#include "scene/scene.hpp"

namespace fathom::engine {

/// Sets the scene's world as the configuration's base: it determines all settings that are not set.
void take_over_world(const Scene& scene, Config& config);

/// Spawns every body of the scene, in order, with its shape as graphics body, and an entity that joins them and
/// forwards the scene's actions (kicks, stream, orbit) to the simulation. Call it before the first frame: the run's
/// states then equal those of `fathom run` with the same scene, in every mode. Copies the scene.
std::vector<EntityId> spawn_scene(Engine& engine, const Scene& scene);

}  // namespace fathom::engine
