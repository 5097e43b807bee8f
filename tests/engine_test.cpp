// The engine as a whole: the loop's order, entities that come and go, modes that agree, time that does not run away.
#include "engine/engine.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <thread>

#include "engine/input_tape.hpp"
#include "engine/scene_entities.hpp"
#include "engine_fixture.hpp"
#include "scene/environments.hpp"
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();  // from its allocator_interface.h, which gcc lacks
#endif

namespace fathom::engine::test::engine_test {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;

class NotingFrontEnd final : public FrontEnd {
 public:
  explicit NotingFrontEnd(std::vector<std::string>& notes) : notes_(notes) {}
  void poll(std::vector<InputEvent>& events) override {
    notes_.push_back("poll");
    events.push_back({InputKind::mouse_moved, 0, 0, 1, 2});
  }
  void draw(const DrawFrame& frame) override { notes_.push_back("draw " + std::to_string(frame.step)); }

 private:
  std::vector<std::string>& notes_;
};

EntityDef ticking(TickPhase phase) {
  EntityDef def;
  def.tick = phase;
  return def;
}

EntityDef falling_cube(Vec3 position, TickPhase phase = TickPhase::none) {
  EntityDef def;
  def.physics = cube(position);
  def.graphics = GraphicsBody{def.physics->shape, {}, {}};
  def.tick = phase;
  return def;
}

TEST(EngineLoop, CallsInThePublishedOrder) {
  std::vector<std::string> notes;
  NotingFrontEnd front_end(notes);
  Engine engine(quiet_config(), &front_end);
  const auto note = [&](const char* text) {
    return [&notes, text](Entity&, const Tick& tick) { notes.push_back(text + std::to_string(tick.step)); };
  };
  engine.world().spawn(ticking(TickPhase::after), note("after "));
  engine.world().spawn(ticking(TickPhase::before), note("before "));
  engine.world().spawn(ticking(TickPhase::during), note("during "));
  engine.world().spawn(ticking(TickPhase::none), note("never "));
  engine.input().add_handler(0, [&](const InputEvent&) { return notes.push_back("event"), true; });
  engine.on_frame([&](Engine&) { notes.push_back("frame"); });
  engine.timers().after(
      0, [&] { notes.push_back("wall timer"); }, TimeBase::wall);
  engine.timers().after(0, [&] { notes.push_back("timer"); });
  engine.run(2);
  EXPECT_THAT(notes, ElementsAre("poll", "event", "frame", "wall timer", "timer", "before 1", "during 1", "after 1",
                                 "draw 1", "poll", "event", "frame", "before 2", "during 2", "after 2", "draw 2"));
}

TEST(EngineLoop, TicksSeeWhatTheirPhasePromises) {
  Engine engine(quiet_config());
  std::map<TickPhase, std::vector<float>> heights;
  const EntityId cube_id = engine.world().spawn(falling_cube({0, 0, 10}));
  for (const TickPhase phase : {TickPhase::before, TickPhase::during, TickPhase::after})
    engine.world().spawn(ticking(phase), [&, phase](Entity&, const Tick& tick) {
      heights[phase].push_back(tick.engine.world().find(cube_id)->pose().position.z);
    });
  engine.run(3);
  World world(engine.config().world_definition());
  const BodyId body = world.add(cube({0, 0, 10}));
  std::vector<float> expected{10};
  for (int i = 0; i < 3; ++i) world.step(), expected.push_back(world.pose(body).position.z);
  EXPECT_THAT(heights[TickPhase::before], ElementsAreArray(expected.begin(), expected.begin() + 3));
  EXPECT_THAT(heights[TickPhase::during], ElementsAreArray(expected.begin(), expected.begin() + 3));
  EXPECT_THAT(heights[TickPhase::after], ElementsAreArray(expected.begin() + 1, expected.end()));
}

TEST(EngineLoop, DuringTicksRunWhileTheSimulationDoes) {
  Engine engine(quiet_config());
  int met = 0;
  engine.world().spawn(ticking(TickPhase::during), [&](Entity&, const Tick& tick) {
    // The step ends during the tick, and the tick still sees the state before it.
    tick.engine.simulation().wait_for(tick.step);
    EXPECT_EQ(tick.engine.world().state()->step, tick.step - 1);
    ++met;
  });
  engine.run(3);
  EXPECT_EQ(met, 3);
}

TEST(EngineLoop, PauseSingleStepAndStop) {
  Engine engine(quiet_config());
  engine.set_paused(true);
  for (int i = 0; i < 3; ++i) engine.frame();
  EXPECT_EQ(engine.steps(), 0u);
  engine.single_step();
  engine.single_step();
  engine.frame();
  engine.frame();
  EXPECT_EQ(engine.steps(), 2u);
  engine.set_paused(false);
  engine.on_frame([](Engine& e) {
    if (e.steps() == 9) e.stop();
  });
  engine.run();
  EXPECT_EQ(engine.steps(), 9u);
  EXPECT_EQ(engine.simulation().completed(), 9u);
}

TEST(EngineLoop, ClosingTheWindowEndsTheRunUnlessConsumed) {
  InputTape tape;
  tape.entries = {{3, {InputKind::window_closed, 0, 0, 0, 0}}, {6, {InputKind::window_closed, 0, 0, 0, 0}}};
  PlayingFrontEnd front_end(tape);
  Engine engine(quiet_config(), &front_end);
  int asked = 0;
  engine.input().add_handler(1, [&](const InputEvent&) { return asked++ == 0; });
  engine.run();
  EXPECT_EQ(engine.stats().frame, 6u);
}

TEST(EngineLoop, ActionsOfTheConfigurationReachTheirHandlers) {
  InputTape tape;
  tape.entries = {{2, {InputKind::key_pressed, 0, 'J', 0, 0}}};
  PlayingFrontEnd front_end(tape);
  Config config = quiet_config();
  config.set("input.actions.jump=j");
  Engine engine(config, &front_end);
  const EntityId id = engine.world().spawn(falling_cube({0, 0, 0}));
  engine.input().on_action("jump", [&](bool) { engine.world().find(id)->set_velocity({0, 0, 8}, {}); });
  engine.run(2);
  EXPECT_GT(engine.world().find(id)->velocity().linear.z, 7);
}

TEST(EngineLoop, TimersInSimulatedTimeFireAtTheSameStepHoweverManyStepsAFrameMakes) {
  for (const bool wall : {false, true}) {
    Config config = quiet_config();
    if (wall) config.set("loop.time=wall");
    if (wall) config.set("loop.time_scale=50");
    Engine engine(config);
    std::vector<std::uint64_t> steps;
    engine.timers().every(0.1, [&] { steps.push_back(engine.steps()); });
    engine.run(25);
    EXPECT_THAT(steps, ElementsAre(6, 12, 18, 24)) << wall;
  }
}

TEST(EngineLoop, WallTimeDecidesHowManySteps) {
  Config config = quiet_config();
  for (const char* set : {"loop.time=wall", "loop.pacing=fixed", "loop.rate=200", "simulator.dt=0.01"}) config.set(set);
  Engine engine(config);
  int frames = 0;
  engine.on_frame([&](Engine&) { ++frames; });
  const auto start = std::chrono::steady_clock::now();
  engine.run(20);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GE(seconds, 0.19);
  EXPECT_GE(frames, 20);
  EXPECT_FLOAT_EQ(engine.simulation().definition().dt, 0.01f);
}

TEST(EngineLoop, ASlowMachineSlowsSimulatedTimeAndSaysSo) {
  const Folder folder;
  Config config = quiet_config();
  for (const char* set : {"loop.time=wall", "loop.max_steps_per_frame=2"}) config.set(set);
  config.edit().log.file = folder / "log";
  Engine engine(config);
  engine.on_frame([](Engine&) { std::this_thread::sleep_for(std::chrono::milliseconds(100)); });  // six steps' time
  while (engine.stats().frame < 12) {
    engine.frame();
    EXPECT_LE(engine.stats().steps, 2);
  }
  EXPECT_LE(engine.steps(), 24u);
  EXPECT_GT(engine.stats().time_given_up, 0.5);
  EXPECT_LT(engine.stats().speed, 0.5);
  engine.log().flush();
  EXPECT_THAT(read_text(folder / "log"), HasSubstr("the machine is too slow"));
}

TEST(EngineLoop, RefusesTimeScalesThatCannotBe) {
  Engine engine(quiet_config());
  EXPECT_THAT(refusal([&] { engine.set_time_scale(-1); }), HasSubstr("set time scale"));
  EXPECT_THAT(refusal([&] { engine.set_time_scale(std::nan("")); }), HasSubstr("must be finite"));
}

TEST(EngineLoop, ErrorsOfTheSimulationReachTheGame) {
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    Config config = quiet_config();
    config.set(std::string("simulator.mode=") + mode);
    Engine engine(config);
    const EntityId id = engine.world().spawn(falling_cube({0, 0, 0}));
    engine.on_frame([&](Engine& e) {
      if (e.stats().frame == 3) e.world().find(id)->apply_force({NAN, 0, 0});
      if (e.stats().frame == 1000) e.stop();
    });
    EXPECT_THAT(refusal([&] { engine.run(); }), HasSubstr("apply force: the force is (nan")) << mode;
  }
}

// --- entities --------------------------------------------------------------------------------------------------

class Life final : public Entity {
 public:
  explicit Life(std::vector<std::string>& notes) : notes_(notes) {}
  void created(Engine& engine, EntityDef& def) override {
    notes_.push_back("created " + def.name);
    if (def.name == "ghost") def.simulated = false;
    if (def.name == "parent") engine.world().spawn({.name = "child"}, std::make_unique<Life>(notes_));
  }
  void tick(const Tick& tick) override {
    notes_.push_back("tick " + name());
    tick.engine.world().destroy(id());
  }
  void destroyed(Engine&) override { notes_.push_back("destroyed " + name()); }

 private:
  std::vector<std::string>& notes_;
};

TEST(EngineEntities, LivesBeginAndEndBetweenSteps) {
  std::vector<std::string> notes;
  Engine engine(quiet_config());
  EntityWorld& world = engine.world();
  EntityDef def = falling_cube({0, 0, 5}, TickPhase::before);
  def.name = "parent";
  const EntityId parent = world.spawn(def, std::make_unique<Life>(notes));
  def.name = "ghost";
  def.tick = TickPhase::none;
  const EntityId ghost = world.spawn(def, std::make_unique<Life>(notes));
  const EntityId unborn = world.spawn({.name = "unborn"}, std::make_unique<Life>(notes));
  EXPECT_EQ(world.find(parent), nullptr);
  EXPECT_TRUE(world.destroy(unborn));
  engine.frame();
  EXPECT_THAT(notes, ElementsAre("created parent", "created ghost", "tick parent"));
  ASSERT_NE(world.find(parent), nullptr) << "lives until the next frame";
  EXPECT_TRUE(world.find(parent)->has_physics());
  EXPECT_FALSE(world.find(ghost)->has_physics());
  EXPECT_EQ(world.find(ghost)->pose().position.z, 5);
  EXPECT_EQ(world.find(unborn), nullptr);
  notes.clear();
  engine.frame();
  EXPECT_THAT(notes, ElementsAre("destroyed parent", "created child"));
  EXPECT_EQ(world.find(parent), nullptr);
  EXPECT_FALSE(world.destroy(parent));
  EXPECT_EQ(world.count(), 2u);
  EXPECT_NE(world.find("child"), nullptr);
  std::uint32_t bodies = 99;
  engine.simulation().inspect([&](const CommandRunner& runner) { bodies = runner.world().body_count(); });
  EXPECT_EQ(bodies, 0u);
}

TEST(EngineEntities, SlotsAreReusedAndOldIdsAreNot) {
  Engine engine(quiet_config());
  const EntityId first = engine.world().spawn(falling_cube({0, 0, 5}));
  engine.frame();
  const BodyHandle old_body = engine.world().find(first)->body();
  engine.world().destroy(first);
  engine.frame();
  const EntityId second = engine.world().spawn(falling_cube({0, 0, 50}));
  engine.frame();
  EXPECT_EQ(second.index, first.index);
  EXPECT_EQ(engine.world().find(first), nullptr);
  EXPECT_EQ(engine.world().find(second)->body().index, old_body.index);
  EXPECT_GT(engine.world().find(second)->pose().position.z, 40);
  EXPECT_FALSE(engine.world().state()->contains(old_body));
}

TEST(EngineEntities, SpawnLimitHoldsAndIsReported) {
  const Folder folder;
  Config config = quiet_config();
  config.set("world.spawns_per_frame=10");
  config.edit().log.file = folder / "log";
  Engine engine(config);
  for (int i = 0; i < 30; ++i) engine.world().spawn({});
  engine.frame();
  EXPECT_EQ(engine.world().count(), 30u) << "what is there from the start is not limited";
  for (int i = 0; i < 25; ++i) engine.world().spawn({});
  std::vector<std::uint32_t> counts;
  std::vector<std::size_t> waiting;
  for (int i = 0; i < 4; ++i) {
    engine.frame();
    counts.push_back(engine.world().count());
    waiting.push_back(engine.stats().waiting);
  }
  EXPECT_THAT(counts, ElementsAre(40, 50, 55, 55));
  EXPECT_THAT(waiting, ElementsAre(15, 5, 0, 0));
  engine.log().flush();
  EXPECT_THAT(read_text(folder / "log"), HasSubstr("15 entities wait to be spawned; world.spawns_per_frame is 10"));
  EXPECT_THAT(read_text(folder / "log"), HasSubstr("no more entities wait"));
}

class LookingFrontEnd final : public FrontEnd {
 public:
  void poll(std::vector<InputEvent>&) override {}
  void draw(const DrawFrame& frame) override {
    revision = frame.revision;
    poses.assign(frame.poses.begin(), frame.poses.end());
    looks.assign(frame.bodies.begin(), frame.bodies.end());
  }
  std::uint64_t revision = 0;
  std::vector<Pose> poses;
  std::vector<GraphicsBody> looks;
};

TEST(EngineEntities, GraphicsAndPhysicsAreIndependent) {
  LookingFrontEnd front_end;
  Engine engine(quiet_config(), &front_end);
  EntityWorld& world = engine.world();
  const EntityId both = world.spawn(falling_cube({1, 0, 5}));
  EntityDef invisible = falling_cube({2, 0, 5});
  invisible.drawn = false;
  const EntityId unseen = world.spawn(invisible);
  EntityDef sign;
  sign.pose.position = {3, 0, 1};
  sign.graphics = GraphicsBody{sphere(0.2f), {1, 0, 0, 1}, {{0, 0, 2}, 0, {}}};
  const EntityId marker = world.spawn(sign);
  engine.run(10);
  ASSERT_EQ(front_end.poses.size(), 2u);
  EXPECT_LT(front_end.poses[0].position.z, 5);
  EXPECT_EQ(front_end.poses[0].position.z, world.find(unseen)->pose().position.z);
  EXPECT_EQ(front_end.poses[1].position, (Vec3{3, 0, 3})) << "its local pose counts";
  const std::uint64_t revision = front_end.revision;
  world.find(marker)->set_pose({{3, 0, 2}, 0, {}});
  engine.run(1);
  EXPECT_EQ(front_end.revision, revision);
  EXPECT_EQ(front_end.poses[1].position, (Vec3{3, 0, 4}));
  world.find(marker)->set_colour({0, 1, 0, 1});
  world.destroy(both);
  engine.run(1);
  EXPECT_NE(front_end.revision, revision);
  ASSERT_EQ(front_end.looks.size(), 1u);
  EXPECT_EQ(front_end.looks[0].colour.g, 1);
}

// --- modes -------------------------------------------------------------------------------------------------------

// Inputs by step: bodies come and go, are pushed and set.
CommandList script(std::uint64_t step) {
  CommandList list;
  const auto handle = [](std::uint64_t i) { return BodyHandle{static_cast<std::uint32_t>(i), 1}; };
  if (step == 1) {
    list.add(handle(0), ground());
    for (std::uint32_t i = 1; i <= 60; ++i)
      list.add(handle(i),
               cube({static_cast<float>(i % 4), static_cast<float>(i / 4 % 4), 1.1f * static_cast<float>(i / 16) + 1}));
  }
  if (step % 7 == 0) list.push({CommandKind::impulse, handle(1 + step % 50), {0.5f, 0.2f, 3}, {}, {}, 0});
  if (step % 11 == 3) list.push({CommandKind::force, handle(2 + step % 50), {30, 0, 60}, {}, {}, 0});
  if (step == 40) list.push({CommandKind::remove, handle(60), {}, {}, {}, 0});
  if (step == 45) list.add({60, 2}, cube({1, 1, 12}));
  if (step == 60) list.push({CommandKind::set_gravity, {}, {1, 0, -9}, {}, {}, 0});
  return list;
}

std::vector<std::uint64_t> scripted_hashes(SimulationSettings settings, int threads,
                                           SimulatorKind simulator = SimulatorKind::native) {
  constexpr std::uint64_t steps = 120;
  struct Hashes final : SimulationObserver {
    std::vector<std::uint64_t> all;
    void before_step(std::uint64_t, const CommandList&, const CommandRunner&) override {}
    void after_step(const World& world) override { all.push_back(world.state_hash()); }
  } hashes;
  settings.hashes = true;
  settings.paused = true;
  settings.last_step = steps;
  {
    WorldDef def;
    def.simulator = simulator;
    def.device = "host";
    def.threads = threads;
    Simulation simulation(def, settings, &hashes);
    if (settings.mode == SimulationMode::async) {
      for (std::uint64_t step = 1; step <= steps; ++step) simulation.submit_at(step, script(step));
      simulation.set_paused(false);
      simulation.finish();
    } else {
      for (std::uint64_t step = 1; step <= steps; ++step) {
        simulation.submit(script(step));
        const std::uint64_t lag =
            settings.mode == SimulationMode::ahead ? static_cast<std::uint64_t>(settings.ahead) : 0;
        if (step <= lag) continue;
        simulation.wait_for(step - lag);
        EXPECT_EQ(simulation.state(step - lag)->step, step - lag);
      }
      simulation.finish();
    }
    EXPECT_EQ(simulation.newest()->step, steps);
    EXPECT_EQ(simulation.newest()->hash, hashes.all.back());
  }
  return hashes.all;
}

TEST(EngineModes, AllGiveTheSameStates) {
  const std::vector<std::uint64_t> expected = scripted_hashes({}, 1);
  ASSERT_EQ(expected.size(), 120u);
  for (const int threads : {1, 3}) {
    EXPECT_EQ(scripted_hashes({}, threads), expected) << "lockstep, " << threads;
    for (const int ahead : {1, 4})
      EXPECT_EQ(scripted_hashes({.mode = SimulationMode::ahead, .ahead = ahead}, threads), expected) << ahead;
    EXPECT_EQ(scripted_hashes({.mode = SimulationMode::async, .paced = false}, threads), expected) << "async";
  }
  EXPECT_EQ(scripted_hashes({.mode = SimulationMode::async, .time_scale = 20}, 1), expected) << "async in wall time";
}

TEST(EngineModes, WaitingForWhatNeverComesIsRefused) {
  Simulation lockstep({}, {});
  EXPECT_THAT(refusal([&] { lockstep.wait_for(1); }), HasSubstr("waiting for step 1, but only 0"));
  lockstep.submit({});
  EXPECT_THAT(refusal([&] { lockstep.submit_at(1, {}); }), HasSubstr("step 1 was submitted already"));
  lockstep.finish();
  EXPECT_EQ(lockstep.completed(), 1u);
  Simulation async({}, {.mode = SimulationMode::async, .paused = true});
  EXPECT_THAT(refusal([&] { async.finish(); }), HasSubstr("it has no last step"));
  EXPECT_THAT(refusal([] { Simulation bad({}, {.mode = SimulationMode::ahead, .ahead = 0}); }),
              HasSubstr("at least 1"));
}

TEST(EngineModes, AllGiveTheSameStatesOnADevice) {
  const auto hashes = [](SimulationSettings settings) { return scripted_hashes(settings, 2, SimulatorKind::device); };
  const std::vector<std::uint64_t> expected = hashes({});
  EXPECT_EQ(hashes({.mode = SimulationMode::ahead, .ahead = 3}), expected);
  EXPECT_EQ(hashes({.mode = SimulationMode::async, .paced = false}), expected);
}

TEST(EngineModes, SceneEntitiesGiveTheStatesOfTheScene) {
  for (const Scene& scene : {drift(50), drift(1100), layers(150), pyramid(5)}) {
    World world(scene.world);
    SceneInstance instance(scene, world);
    for (int i = 0; i < 70; ++i) instance.prepare_step(), world.step();
    for (const char* mode : {"lockstep", "ahead"}) {
      Config config = quiet_config();
      config.set(std::string("simulator.mode=") + mode);
      config.set("simulator.hashes=true");
      take_over_world(scene, config);
      Engine engine(config);
      spawn_scene(engine, scene);
      engine.run(70);
      EXPECT_EQ(engine.simulation().newest()->hash, world.state_hash()) << scene.name << ", " << mode;
    }
  }
}

TEST(EngineModes, AheadDrawsWhatWasSimulatedStepsBefore) {
  std::vector<std::string> notes;
  NotingFrontEnd front_end(notes);
  Config config = quiet_config();
  config.set("simulator.mode=ahead");
  config.set("simulator.ahead=2");
  Engine engine(config, &front_end);
  engine.run(5);
  std::erase_if(notes, [](const std::string& note) { return note == "poll"; });
  EXPECT_THAT(notes, ElementsAre("draw 0", "draw 0", "draw 1", "draw 2", "draw 3"));
  EXPECT_EQ(engine.world().state()->step, 5u) << "after the run the newest state is there";
}

TEST(EngineModes, AsyncFollowsWallTimeAndIsDrawnBetweenStates) {
  LookingFrontEnd front_end;
  Config config = quiet_config();
  for (const char* set : {"simulator.mode=async", "loop.time=wall", "loop.pacing=fixed", "loop.rate=500"})
    config.set(set);
  config.set("simulator.dt=0.05");
  Engine engine(config, &front_end);
  EntityDef def = falling_cube({0, 0, 0});
  def.physics->gravity_scale = 0;
  def.physics->velocity.linear = {1, 0, 0};
  engine.world().spawn(def);
  std::vector<float> seen;
  engine.on_frame([&](Engine&) {
    if (!front_end.poses.empty()) seen.push_back(front_end.poses[0].position.x);
  });
  const auto start = std::chrono::steady_clock::now();
  engine.run(10);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GE(seconds, 0.4);
  EXPECT_EQ(engine.steps(), 10u);
  int between = 0;
  for (std::size_t i = 1; i < seen.size(); ++i) {
    EXPECT_GE(seen[i], seen[i - 1] - 1e-5f);
    const float steps = seen[i] / 0.05f;
    between += std::abs(steps - std::round(steps)) > 0.05f;
  }
  EXPECT_GT(between, 3);
}

TEST(EngineModes, AsyncCanBePausedAndScaled) {
  Config config = quiet_config();
  for (const char* set : {"simulator.mode=async", "loop.time=wall", "loop.pacing=fixed", "loop.rate=500"})
    config.set(set);
  Engine engine(config);
  engine.run(2);
  engine.set_paused(true);
  const std::uint64_t before = engine.simulation().completed();
  for (int i = 0; i < 50; ++i) engine.frame();
  EXPECT_LE(engine.simulation().completed(), before + 1);
  engine.set_time_scale(10);
  engine.set_paused(false);
  const auto start = std::chrono::steady_clock::now();
  engine.run(60);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 0.9);
}

TEST(EngineModes, AsyncGivesUpTimeRatherThanSpiralling) {
  Config config = quiet_config();
  for (const char* set : {"simulator.mode=async", "loop.time=wall", "loop.pacing=fixed", "loop.rate=200"})
    config.set(set);
  config.set("simulator.dt=0.000001");  // no machine can keep up
  Engine engine(config);
  const EntityId id = engine.world().spawn(falling_cube({0, 0, 0}));
  for (int i = 1; i < 64; ++i) engine.world().spawn(falling_cube({2.0f * static_cast<float>(i), 0, 0}));
  engine.on_frame([](Engine& e) {
    if (e.stats().frame > 30) e.stop();
  });
  engine.run();
  EXPECT_NE(engine.world().find(id), nullptr);
  EXPECT_GT(engine.stats().time_given_up, 0.01);
}

TEST(EngineModes, GameAndSimulationHammerEachOther) {
  // For the thread sanitizer: everything that may be called during simulation.
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    Config config = quiet_config();
    config.set(std::string("simulator.mode=") + mode);
    config.set("simulator.threads=2");
    LookingFrontEnd front_end;
    Engine engine(config, &front_end);
    EntityDef floor;
    floor.physics = ground();
    engine.world().spawn(floor);
    std::vector<EntityId> ids;
    engine.world().spawn(ticking(TickPhase::during), [&](Entity&, const Tick& tick) {
      EntityWorld& world = tick.engine.world();
      ids.push_back(world.spawn(falling_cube({static_cast<float>(tick.step % 5), 0, 3}, TickPhase::before),
                                [](Entity& entity, const Tick&) {
                                  entity.apply_force({0, 0, 12});
                                }));
      if (ids.size() > 20) world.destroy(ids[ids.size() - 20]);
      tick.engine.simulation().inspect([](const CommandRunner& runner) {
        runner.world().cast_ray({0, 0, 50}, {0, 0, -100});
      });
    });
    engine.on_frame([](Engine& e) {
      if (e.stats().frame == 60) e.stop();
    });
    engine.run();
    EXPECT_GE(engine.world().count(), 15u) << mode;
  }
}

// Hours of simulated time: bodies come and go; timers, data and states are reused. CI runs it for seconds; the
// environment variable FATHOM_SOAK_SECONDS extends it.
TEST(EngineSoak, MemoryDoesNotGrow) {
  const auto used = [] {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    // The sanitizers retain freed memory for a while, and their own records.
    return __sanitizer_get_current_allocated_bytes();
#else
    std::ifstream file("/proc/self/statm");
    std::size_t pages = 0, all = 0;
    file >> all >> pages;
    return pages * 4096;
#endif
  };
  const char* asked = std::getenv("FATHOM_SOAK_SECONDS");
  const double budget = asked ? std::atof(asked) : 5;
  Config config = quiet_config();
  for (const char* set : {"simulator.dt=0.05", "simulator.substeps=1", "simulator.sleep=true"}) config.set(set);
  Engine engine(config);
  EntityDef floor;
  floor.physics = ground();
  engine.world().spawn(floor);
  std::deque<EntityId> alive;
  engine.timers().every(1.0, [&] {
    EntityDef def = falling_cube({0, 0, 3});
    def.name = "a name that is too long for the small string";
    alive.push_back(engine.world().spawn(def, [](Entity& entity, const Tick&) { entity.apply_torque({0, 0, 1}); }));
    if (alive.size() > 20) engine.world().destroy(alive.front()), alive.pop_front();
    engine.timers().after(0.5, [] {});
  });
  engine.run(20000);  // caches and pools fill
  const std::size_t before = used();
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < budget) engine.run(2000);
  EXPECT_LT(used(), before + (1 << 20));
  EXPECT_GT(engine.time(), 1000);
  EXPECT_EQ(engine.world().count(), 21u);
  RecordProperty("simulated_hours", std::to_string(engine.time() / 3600));
}

}  // namespace
}  // namespace fathom::engine::test::engine_test
