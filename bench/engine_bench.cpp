// The engine's overhead per step: ticks of entities, spawning, publishing states, zones, recording.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <filesystem>

#include "engine/recording.hpp"
#include "engine/scene_entities.hpp"
#include "engine/trace.hpp"
#include "scene/environments.hpp"

namespace fathom::engine {
namespace {

Config quiet_config(const char* mode = "lockstep") {
  Config config;
  config.set("log.console=false");
  config.set("simulator.threads=1");
  config.set(std::string("simulator.mode=") + mode);
  return config;
}

class Ticking final : public Entity {
 public:
  void tick(const Tick& tick) override { phase_ += tick.dt * rate_; }

 private:
  float phase_ = 0, rate_ = 1.5f;
};

class Pushing final : public Entity {
 public:
  void tick(const Tick&) override { apply_force({0, 0, 9.81f - velocity().linear.z}); }
};

template <class Logic>
void spawn_ticking(Engine& engine, std::int64_t count, TickPhase phase, bool with_body) {
  for (std::int64_t i = 0; i < count; ++i) {
    EntityDef def;
    def.tick = phase;
    if (with_body) {
      def.physics = BodyDef{.shape = box({0.5f, 0.5f, 0.5f}), .mass = 1.0f};
      def.physics->pose.position = {3.0f * static_cast<float>(i % 100), 3.0f * static_cast<float>(i / 100), 0};
    }
    engine.world().spawn(std::move(def), std::make_unique<Logic>());
  }
  engine.frame();
}

// The whole frame: loop, publication of an empty step, and every entity's tick, on the game's thread.
void frame_with_ticks(benchmark::State& state) {
  Engine engine(quiet_config());
  spawn_ticking<Ticking>(engine, state.range(0), TickPhase::before, false);
  for (auto _ : state) engine.frame();
  state.counters["entities"] = static_cast<double>(engine.world().count());
}
BENCHMARK(frame_with_ticks)->Arg(0)->Arg(10000)->Unit(benchmark::kMicrosecond)->UseRealTime();

// Only ticks that read their body's state and push it.
void ticks_that_push(benchmark::State& state) {
  Engine engine(quiet_config());
  spawn_ticking<Pushing>(engine, state.range(0), TickPhase::before, true);
  const Tick tick{engine, TickPhase::before, 2, 0, 0.016f};
  Failures failures;
  for (auto _ : state) {
    engine.world().run_ticks(tick, failures);
    engine.world().commands().clear();
  }
}
BENCHMARK(ticks_that_push)->Arg(10000)->Unit(benchmark::kMicrosecond);

void spawn_and_destroy(benchmark::State& state) {
  Engine engine(quiet_config());
  engine.frame();
  std::vector<EntityId> ids;
  Failures failures;
  for (auto _ : state) {
    for (std::int64_t i = 0; i < state.range(0); ++i) ids.push_back(engine.world().spawn({}));
    engine.world().take_over_changes(~0u, failures);
    for (const EntityId id : ids) engine.world().destroy(id);
    engine.world().take_over_changes(~0u, failures);
    ids.clear();
  }
}
BENCHMARK(spawn_and_destroy)->Arg(1000)->Unit(benchmark::kMicrosecond);

// A scene's step by itself, through the engine, and through the engine with a recorder.
void scene_step(benchmark::State& state) {
  const Scene scene = spread(state.range(0));
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < 120; ++i) world.step();
  for (auto _ : state) world.step();
}
BENCHMARK(scene_step)->Arg(10000)->Unit(benchmark::kMicrosecond)->UseRealTime();

void scene_frame(benchmark::State& state, const char* mode) {
  const Scene scene = spread(state.range(0));
  Config config = quiet_config(mode);
  take_over_world(scene, config);
  config.set("simulator.threads=1");
  Engine engine(config);
  spawn_scene(engine, scene);
  for (int i = 0; i < 120; ++i) engine.frame();
  for (auto _ : state) engine.frame();
}
BENCHMARK_CAPTURE(scene_frame, lockstep, "lockstep")->Arg(10000)->Unit(benchmark::kMicrosecond)->UseRealTime();
BENCHMARK_CAPTURE(scene_frame, ahead, "ahead")->Arg(10000)->Unit(benchmark::kMicrosecond)->UseRealTime();

void recorded_step(benchmark::State& state, bool states) {
  const Scene scene = layers(state.range(0));
  WorldDef def = scene.world;
  def.threads = 1;
  World world(def);
  SceneInstance instance(scene, world);
  const std::string path = std::filesystem::temp_directory_path() / ("fathom-bench-" + std::to_string(getpid()));
  Recorder recorder(path, {.snapshot_every = 1 << 30, .states = states});
  const CommandRunner runner(world);
  for (auto _ : state) {
    state.PauseTiming();
    world.step();
    state.ResumeTiming();
    recorder.before_step(world.step_count(), {}, runner);
    recorder.after_step(world);
  }
  state.counters["bytes_per_step"] =
      static_cast<double>(recorder.bytes()) / static_cast<double>(std::max<std::uint64_t>(1, recorder.steps()));
}
BENCHMARK_CAPTURE(recorded_step, hashes, false)->Arg(1000)->Iterations(300)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(recorded_step, states, true)->Arg(1000)->Iterations(300)->Unit(benchmark::kMicrosecond);

void save_world(benchmark::State& state) {
  const Scene scene = layers(state.range(0));
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < 120; ++i) world.step();
  std::vector<std::byte> bytes;
  for (auto _ : state) world.save(bytes);
  state.counters["bytes"] = static_cast<double>(bytes.size());
}
BENCHMARK(save_world)->Arg(10000)->Unit(benchmark::kMicrosecond);

void restore_world(benchmark::State& state) {
  const Scene scene = layers(state.range(0));
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < 120; ++i) world.step();
  std::vector<std::byte> bytes;
  world.save(bytes);
  World other({.threads = 1});
  for (auto _ : state) other.restore(bytes);
}
BENCHMARK(restore_world)->Arg(10000)->Unit(benchmark::kMicrosecond);

void zone_off(benchmark::State& state) {
  for (auto _ : state) {
    const trace::Zone zone("zone");
    benchmark::ClobberMemory();
  }
}
BENCHMARK(zone_off);

void zone_on(benchmark::State& state) {
  const trace::Session session;
  for (auto _ : state) {
    const trace::Zone zone("zone");
    benchmark::ClobberMemory();
  }
}
BENCHMARK(zone_on);

}  // namespace
}  // namespace fathom::engine
