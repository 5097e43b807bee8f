// Scenes inside the engine: what they do over time belongs to steps, in every mode and for every simulator.
#include "engine/scene_entities.hpp"
#include "engine_fixture.hpp"
#include "scene/environments.hpp"
#include "scene/heap.hpp"

namespace fathom::engine::test::engine_scene_test {
namespace {

constexpr int steps = 64;

std::uint64_t hash_of_the_scene(const Scene& scene) {
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < steps; ++i) instance.prepare_step(), world.step();
  return world.state_hash();
}

std::uint64_t hash_in_the_engine(const Scene& scene, const std::vector<const char*>& sets) {
  Config config = quiet_config();
  for (const char* set : sets) config.set(set);
  config.set("simulator.hashes=true");
  take_over_world(scene, config);
  Engine engine(config);
  spawn_scene(engine, scene);
  engine.run(steps);
  return engine.simulation().newest()->hash;
}

// Kicks, orbiting bodies, and bodies that leave and come back (seed 26 of the heaps).
TEST(EngineScenes, WhatASceneDoesOverTimeBelongsToSteps) {
  for (Scene scene : {drift(40), washer(60), make_heap(26).scene}) {
    scene.world.threads = 1;
    EXPECT_TRUE(scene.kicks || scene.stream || scene.orbit) << scene.name;
    for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device}) {
      scene.world.simulator = simulator;
      scene.world.device = "host";
      const std::uint64_t expected = hash_of_the_scene(scene);
      for (const std::vector<const char*>& sets :
           {std::vector{"simulator.mode=lockstep"},
            {"simulator.mode=ahead", "simulator.ahead=3"},
            {"simulator.mode=async"},
            {"simulator.mode=async", "loop.time=wall", "loop.time_scale=20", "loop.pacing=fixed"},
            {"simulator.mode=lockstep", "loop.time=wall", "loop.time_scale=20"}})
        EXPECT_EQ(hash_in_the_engine(scene, sets), expected)
            << scene.name << ", " << static_cast<int>(simulator) << ", " << testing::PrintToString(sets);
    }
  }
}

TEST(EngineScenes, BodiesThatWereDestroyedAreLeftOut) {
  for (const Scene& scene : {drift(12), washer(12), make_heap(26).scene}) {
    Config config = quiet_config();
    take_over_world(scene, config);
    Engine engine(config);
    const std::vector<EntityId> ids = spawn_scene(engine, scene);
    engine.run(5);
    for (const EntityId id : ids) engine.world().destroy(id);
    engine.run(steps);
    std::uint32_t bodies = 99;
    engine.simulation().inspect([&](const CommandRunner& runner) { bodies = runner.world().body_count(); });
    EXPECT_EQ(bodies, 0u) << scene.name;
  }
}

TEST(EngineScenes, ABodyThatComesBackIsTheSameEntity) {
  Scene scene;
  scene.world.gravity = {};
  scene.bodies = {cube({0, 0, 0})};
  scene.bodies[0].velocity.linear = {1, 0, 0};
  scene.stream = Stream{.interval = 30, .first = 0, .sources = {{{5, 0, 0}, 0, {}}}};
  Config config = quiet_config();
  take_over_world(scene, config);
  Engine engine(config);
  const EntityId id = spawn_scene(engine, scene).front();
  engine.run(30);
  EXPECT_NEAR(engine.world().find(id)->pose().position.x, 0.5f, 1e-4f);
  engine.run(30);
  EXPECT_NEAR(engine.world().find(id)->pose().position.x, 5.5f, 1e-4f);
}

}  // namespace
}  // namespace fathom::engine::test::engine_scene_test
