// Every loop and wait of the engine ends on request, in every mode, and nothing is made that was not requested.
#include <gmock/gmock.h>

#include <thread>

#include "engine/input_tape.hpp"
#include "engine/recording.hpp"
#include "engine_fixture.hpp"

namespace fathom::engine::test::engine_ends_test {
namespace {

using testing::HasSubstr;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

Config with(const std::vector<std::string>& sets) {
  Config config = quiet_config();
  for (const std::string& set : sets) config.set(set);
  return config;
}

EntityDef falling_cube() {
  EntityDef def;
  def.physics = cube({0, 0, 5});
  return def;
}

// Whatever a frame waits for, a run ends soon after the request, and its recording is complete.
TEST(EngineEnds, ARunEndsSoonInEveryModeWhateverItWaitsFor) {
  const Folder folder;
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    for (const std::vector<std::string>& loop : {std::vector<std::string>{"loop.time=steps"},
                                                 {"loop.time=wall"},
                                                 {"loop.time=wall", "loop.time_scale=0"},
                                                 {"loop.time=wall", "loop.time_scale=0.001"},
                                                 {"loop.paused=true"},
                                                 {"loop.time=wall", "loop.pacing=fixed", "loop.rate=1"},
                                                 {"loop.time=wall", "loop.pacing=vsync", "loop.rate=1"}}) {
      std::vector<std::string> sets = loop;
      sets.push_back(std::string("simulator.mode=") + mode);
      sets.push_back("record.file=" + (folder / "run.fathom"));
      Engine engine(with(sets));
      engine.world().spawn(falling_cube());
      const auto start = Clock::now();
      engine.end_when([&] { return seconds_since(start) > 0.05; });
      engine.run();
      EXPECT_LT(seconds_since(start), 0.5) << testing::PrintToString(sets);
      EXPECT_EQ(engine.simulation().completed(), engine.steps()) << testing::PrintToString(sets);
      const std::uint64_t steps = engine.steps();
      engine.finish();
      EXPECT_EQ(folder.file_count(), 1u) << "nothing else is left behind";
      EXPECT_EQ(replay(folder / "run.fathom", {.threads = 1}).steps, steps) << testing::PrintToString(sets);
    }
  }
}

TEST(EngineEnds, ClosingTheWindowEndsARunInEveryMode) {
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    for (const char* time : {"steps", "wall"}) {
      InputTape tape;
      tape.entries = {{3, {InputKind::window_closed, 0, 0, 0, 0}}};
      PlayingFrontEnd window(tape);
      Engine engine(with({std::string("simulator.mode=") + mode, std::string("loop.time=") + time}), &window);
      engine.run();
      EXPECT_EQ(engine.stats().frame, 3u) << mode;
      EXPECT_EQ(engine.simulation().completed(), engine.steps()) << mode;
    }
  }
}

TEST(EngineEnds, AsyncFramesDoNotWaitForSlowTime) {
  for (const char* scale : {"0", "0.001", "0.1"}) {
    Engine engine(with({"simulator.mode=async", "loop.time=wall", std::string("loop.time_scale=") + scale}));
    const auto start = Clock::now();
    for (int i = 0; i < 20; ++i) engine.frame();
    EXPECT_LT(seconds_since(start), 0.8) << scale;
  }
}

TEST(EngineEnds, SingleStepsAreMadeWhilePausedInEveryMode) {
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    for (const char* time : {"steps", "wall"}) {
      Engine engine(
          with({std::string("simulator.mode=") + mode, std::string("loop.time=") + time, "loop.paused=true"}));
      engine.world().spawn(falling_cube());
      for (int i = 0; i < 3; ++i) engine.frame();
      EXPECT_EQ(engine.steps(), 0u);
      engine.single_step();
      engine.single_step();
      for (int i = 0; i < 100 && engine.steps() < 2; ++i) engine.frame();
      for (int i = 0; i < 5; ++i) engine.frame();
      EXPECT_EQ(engine.steps(), 2u) << mode << ", " << time;
      engine.simulation().halt();  // in mode `ahead` it may still be running
      EXPECT_EQ(engine.simulation().completed(), 2u) << mode << ", " << time;
    }
  }
}

TEST(EngineEnds, NothingIsSimulatedBeforeTheFirstFrame) {
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    Engine engine(with({std::string("simulator.mode=") + mode}));
    engine.set_paused(true);
    engine.set_paused(false);
    engine.set_time_scale(2);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(engine.simulation().completed(), 0u) << mode;
    const EntityId id = engine.world().spawn(falling_cube());
    engine.run(10);
    EXPECT_EQ(engine.steps(), 10u) << mode;
    EXPECT_LT(engine.world().find(id)->pose().position.z, 5) << "it fell from the first step on";
    engine.set_paused(true);
    engine.set_paused(false);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(engine.simulation().completed(), 10u) << mode << ": nor after a run";
  }
}

TEST(EngineEnds, RunsAndSingleFramesFollowEachOther) {
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    Engine engine(with({std::string("simulator.mode=") + mode}));
    engine.run(3);
    engine.frame();
    engine.run(4);
    const std::uint64_t steps = engine.steps();
    EXPECT_GE(steps, 8u) << mode;
    EXPECT_EQ(engine.simulation().completed(), steps) << mode;
    bool stopped = false;
    engine.on_frame([&](Engine& e) {
      if (!std::exchange(stopped, true)) e.stop();
    });
    engine.run();
    for (int i = 0; i < 50; ++i) engine.frame();
    EXPECT_GT(engine.steps(), steps + 1) << mode << ": stop() ends a run, not the engine";
    for (int i = 0; i < 50; ++i) engine.stop(), engine.frame();
    EXPECT_GT(engine.steps(), steps + 51) << mode << ": nor frames made one by one";
  }
}

TEST(EngineEnds, WaitingForWhatStandsStillIsRefused) {
  Simulation simulation({}, {.mode = SimulationMode::async, .paused = true, .last_step = 100});
  EXPECT_THAT(refusal([&] { simulation.wait_for(1); }), HasSubstr("it is paused or its time scale is 0"));
  EXPECT_THAT(refusal([&] { simulation.finish(); }), HasSubstr("it is paused or its time scale is 0"));
  simulation.single_steps(2);
  simulation.wait_for(2);
  EXPECT_THAT(refusal([&] { simulation.wait_for(3); }), HasSubstr("it is paused"));
  simulation.wait_for(3, 0.01);
  simulation.set_time_scale(0);
  simulation.set_paused(false);
  EXPECT_THAT(refusal([&] { simulation.wait_for(3); }), HasSubstr("its time scale is 0"));
  simulation.halt();
  EXPECT_EQ(simulation.completed(), 2u);
}

}  // namespace
}  // namespace fathom::engine::test::engine_ends_test
