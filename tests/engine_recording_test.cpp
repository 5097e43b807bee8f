// Recordings are replayed bit for bit, report differences, and are rejected if damaged.
#include <gmock/gmock.h>

#include "engine/recording.hpp"
#include "engine/scene_entities.hpp"
#include "engine_fixture.hpp"
#include "scene/environments.hpp"

namespace fathom::engine::test::engine_recording_test {
namespace {

using testing::HasSubstr;

// A game: a scene, bodies that come and go, forces.
std::uint64_t record_game(const std::string& path, const char* mode, bool states, int threads = 2) {
  const Scene scene = layers(120);
  Config config = quiet_config();
  config.edit().record.file = path;
  config.edit().record.states = states;
  config.edit().record.snapshot_every = 25;
  config.edit().simulator.threads = threads;
  config.edit().simulator.hashes = true;
  config.edit().simulator.sleep = true;
  config.set(std::string("simulator.mode=") + mode);
  Engine engine(config);
  const std::vector<EntityId> ids = spawn_scene(engine, scene);
  EntityDef def;
  def.tick = TickPhase::before;
  engine.world().spawn(def, [&](Entity&, const Tick& tick) {
    if (tick.step % 10 == 0) tick.engine.world().find(ids[50])->apply_impulse({1, 0, 4});
    if (tick.step == 30) tick.engine.world().destroy(ids[20]);
    EntityDef stone;
    const Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
    stone.physics = fathom::test::dynamic(hull(corners), {0, 0, 8});
    if (tick.step == 40) tick.engine.world().spawn(stone);
  });
  engine.run(90);
  const std::uint64_t hash = engine.simulation().newest()->hash;
  engine.finish();
  return hash;
}

TEST(EngineRecording, IsReplayedBitForBit) {
  const Folder folder;
  const std::string file = folder / "run.fathom";
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    for (const bool states : {true, false}) {
      const std::uint64_t hash = record_game(file, mode, states);
      EXPECT_EQ(folder.file_count(), 1u) << "nothing else is left behind";
      for (const int threads : {1, 3}) {
        const ReplayResult result = replay(file, {.threads = threads});
        EXPECT_FALSE(result.difference.has_value()) << mode << ": " << result.difference->text();
        EXPECT_EQ(result.first_step, 1u);
        EXPECT_GE(result.steps, 90u);
        EXPECT_TRUE(std::string(mode) == "async" || result.state_hash == hash);
      }
    }
  }
}

TEST(EngineRecording, NamesTheFirstStepBodyAndFieldThatDiffer) {
  const Folder folder;
  const std::string file = folder / "run.fathom";
  record_game(file, "lockstep", true);
  float change = 0;
  const auto nudge = [&](std::uint64_t step, World& world) {
    const BodyId body = world.bodies()[7];
    Velocity v = world.velocity(body);
    v.angular.y = std::nextafter(v.angular.y, 10.0f) + change;
    if (step == 33) world.set_velocity(body, v.linear, v.angular);
  };
  ReplayResult result = replay(file, {.threads = 1, .after_step = nudge});
  ASSERT_TRUE(result.difference.has_value());
  EXPECT_EQ(result.difference->step, 33u);
  EXPECT_EQ(result.difference->seen_at, 33u);
  EXPECT_EQ(result.difference->body->index, 7u);
  EXPECT_EQ(result.difference->field, "angular velocity.y");
  EXPECT_THAT(
      result.difference->text(),
      HasSubstr("step 33 differs from the recording: body {index 7, generation 1}, angular velocity.y: recorded"));

  record_game(file, "lockstep", false);
  change = 2;
  result = replay(file, {.threads = 1, .after_step = nudge});
  ASSERT_TRUE(result.difference.has_value());
  EXPECT_EQ(result.difference->step, 33u);
  EXPECT_EQ(result.difference->seen_at, 50u) << "without states the next snapshot tells";
  EXPECT_TRUE(result.difference->body.has_value());
}

TEST(EngineRecording, MayBeginInTheMiddleOfAWorldsLife) {
  const Folder folder;
  const Scene scene = drift(60);
  World world(scene.world);
  SceneInstance instance(scene, world);
  for (int i = 0; i < 40; ++i) instance.prepare_step(), world.step();
  Recorder recorder(folder / "run.fathom", {.snapshot_every = 7});
  CommandRunner runner(world);
  for (int i = 0; i < 40; ++i) {
    CommandList commands;
    if (i == 20) commands.push({CommandKind::set_velocity, {5, 1}, {1, 2, 3}, {}, {}, 0});
    recorder.before_step(world.step_count() + 1, commands, runner);
    runner.run(commands);
    world.step();
    recorder.after_step(world);
  }
  recorder.finish();
  const ReplayResult result = replay(folder / "run.fathom");
  EXPECT_FALSE(result.difference.has_value()) << result.difference->text();
  EXPECT_EQ(result.first_step, 41u);
  EXPECT_EQ(result.steps, 40u);
  EXPECT_EQ(result.state_hash, world.state_hash());
}

TEST(EngineRecording, HoldsForTheDeviceSimulatorToo) {
  const Folder folder;
  Scene scene = layers(60);
  Config config = quiet_config();
  take_over_world(scene, config);
  config.set("simulator.kind=device");
  config.set("simulator.device=host");
  config.set("simulator.hashes=true");
  config.set("record.snapshot_every=20");
  config.edit().record.file = folder / "run.fathom";
  Engine engine(config);
  spawn_scene(engine, scene);
  engine.run(50);
  const std::uint64_t hash = engine.simulation().newest()->hash;
  engine.finish();
  const ReplayResult result = replay(folder / "run.fathom", {.threads = 1, .device = "host"});
  EXPECT_FALSE(result.difference.has_value()) << result.difference->text();
  EXPECT_EQ(result.steps, 50u);
  EXPECT_EQ(result.state_hash, hash);
}

// A pendulum that exists from the start, and a second bob that is joined to it later.
TEST(EngineRecording, HoldsJoints) {
  const Folder folder;
  Scene scene;
  scene.bodies = {fathom::test::dynamic(sphere(0.1f), {0, 0, 2}), fathom::test::dynamic(sphere(0.1f), {1, 0, 2}),
                  fathom::test::dynamic(sphere(0.1f), {1, 0, 1})};
  scene.bodies[0].motion = MotionType::fixed;
  scene.joints = {{0, 1, ball_joint({}, {}, {}, {-1, 0, 0})}};
  for (const char* mode : {"lockstep", "ahead"}) {
    Config config = quiet_config();
    take_over_world(scene, config);
    config.set(std::string("simulator.mode=") + mode);
    config.set("record.snapshot_every=40");
    config.edit().record.file = folder / "run.fathom";
    Engine engine(config);
    const std::vector<EntityId> ids = spawn_scene(engine, scene);
    EntityDef def;
    def.tick = TickPhase::before;
    engine.world().spawn(def, [&](Entity&, const Tick& tick) {
      if (tick.step == 20) tick.engine.world().join(ids[1], ids[2], ball_joint({}, {}, {}, {0, 0, 1}));
    });
    engine.run(60);
    engine.simulation().finish();
    std::uint64_t hash = 0;
    engine.simulation().inspect([&](const CommandRunner& runner) {
      const World& world = runner.world();
      EXPECT_EQ(world.joint_count(), 2u);
      EXPECT_NEAR(distance(world.pose(world.bodies()[0]).position, world.pose(world.bodies()[1]).position), 1, 1e-4);
      hash = world.state_hash();
    });
    engine.finish();
    const ReplayResult result = replay(folder / "run.fathom", {.threads = 1});
    EXPECT_FALSE(result.difference.has_value()) << mode << ": " << result.difference->text();
    EXPECT_EQ(result.state_hash, hash);
  }
}

// A hinge gets a motor, then becomes a slider, then is removed.
TEST(EngineRecording, HoldsChangesOfJoints) {
  const Folder folder;
  Scene scene;
  scene.bodies = {fathom::test::dynamic(sphere(0.1f), {0, 0, 2}), fathom::test::dynamic(box({0.5f, 0.1f, 0.1f}), {})};
  scene.bodies[0].motion = MotionType::fixed;
  scene.bodies[1].pose.position = {0, 0, 2};
  JointDef joint = revolute_joint({}, {}, {}, {});
  joint.user_data = 4;
  scene.joints = {{0, 1, joint}};
  for (const char* mode : {"lockstep", "ahead"}) {
    Config config = quiet_config();
    take_over_world(scene, config);
    config.set(std::string("simulator.mode=") + mode);
    config.set("record.snapshot_every=40");
    config.edit().record.file = folder / "run.fathom";
    Engine engine(config);
    const std::vector<EntityId> ids = spawn_scene(engine, scene);
    EntityDef def;
    def.tick = TickPhase::before;
    engine.world().spawn(def, [&](Entity&, const Tick& tick) {
      JointDef motor = joint, slider = prismatic_joint({}, {}, {}, {});
      motor.axis(JointAxisName::twist).drive_velocity(2, 50);
      slider.axis(JointAxisName::x).drive_velocity(1, 500), slider.user_data = 4;
      if (tick.step == 10) tick.engine.world().change_joint(ids[0], ids[1], motor);
      if (tick.step == 30) tick.engine.world().change_joint(ids[0], ids[1], slider);
      if (tick.step == 50) tick.engine.world().unjoin(ids[0], ids[1], 4);
    });
    const auto velocity = [&] {
      engine.simulation().finish();
      Velocity now{};
      engine.simulation().inspect(
          [&](const CommandRunner& runner) { now = runner.world().velocity(runner.world().bodies()[1]); });
      return now;
    };
    engine.run(25);
    EXPECT_NEAR(velocity().angular.x, 2, 1e-3f) << mode;
    engine.run(20);
    EXPECT_NEAR(velocity().linear.x, 1, 1e-3f) << mode;
    engine.run(25);
    EXPECT_LT(velocity().linear.z, -1) << mode << ": it falls";
    std::uint64_t hash = 0;
    engine.simulation().inspect([&](const CommandRunner& runner) { hash = runner.world().state_hash(); });
    engine.finish();
    const ReplayResult result = replay(folder / "run.fathom", {.threads = 1});
    EXPECT_FALSE(result.difference.has_value()) << mode << ": " << result.difference->text();
    EXPECT_EQ(result.state_hash, hash);
  }
}

// A ball falls through a sensor and, excluded from it, through the ground; the game reverts that for another ball.
TEST(EngineRecording, HoldsSensorsAndExcludedPairs) {
  const Folder folder;
  Scene scene;
  scene.bodies = {fathom::test::ground(), fathom::test::dynamic(box({2, 2, 0.1f}), {0, 0, 1.5f}),
                  fathom::test::dynamic(sphere(0.2f), {0, 0, 2}), fathom::test::dynamic(sphere(0.2f), {1, 0, 2})};
  scene.bodies[1].motion = MotionType::fixed, scene.bodies[1].sensor = true;
  scene.excluded = {{0, 2}, {0, 3}};
  for (const char* mode : {"lockstep", "ahead"}) {
    Config config = quiet_config();
    take_over_world(scene, config);
    config.set(std::string("simulator.mode=") + mode);
    config.set("record.snapshot_every=20");
    config.edit().record.file = folder / "run.fathom";
    Engine engine(config);
    const std::vector<EntityId> ids = spawn_scene(engine, scene);
    EntityDef def;
    def.tick = TickPhase::before;
    std::size_t told = 0;
    engine.world().spawn(def, [&](Entity&, const Tick& tick) {
      if (tick.step == 5) tick.engine.world().include(ids[0], ids[3]);
      if (const StatePtr state = tick.engine.simulation().newest()) told += state->sensor_begun.size();
    });
    engine.run(60);
    engine.simulation().finish();
    std::uint64_t hash = 0;
    engine.simulation().inspect([&](const CommandRunner& runner) {
      const World& world = runner.world();
      EXPECT_LT(world.pose(world.bodies()[2]).position.z, 0);
      EXPECT_GT(world.pose(world.bodies()[3]).position.z, 0.6f);
      hash = world.state_hash();
    });
    engine.finish();
    if (std::string(mode) == "lockstep") {
      EXPECT_GE(told, 2u);
    }
    const ReplayResult result = replay(folder / "run.fathom", {.threads = 1});
    EXPECT_FALSE(result.difference.has_value()) << mode << ": " << result.difference->text();
    EXPECT_EQ(result.state_hash, hash);
  }
}

// The second of two joints breaks when it is joined later; the game is told.
TEST(EngineRecording, HoldsJointsThatBreak) {
  const Folder folder;
  Scene scene;
  scene.bodies = {fathom::test::dynamic(sphere(0.1f), {0, 0, 2}), fathom::test::dynamic(sphere(0.1f), {0, 0, 1}, 5),
                  fathom::test::dynamic(sphere(0.1f), {0, 0, 0}, 5)};
  scene.bodies[0].motion = MotionType::fixed;
  JointDef rope = ball_joint({}, {}, {}, {0, 0, 1});
  rope.break_force = 80, rope.user_data = 3;
  scene.joints = {{0, 1, rope}};
  for (const char* mode : {"lockstep", "ahead"}) {
    Config config = quiet_config();
    take_over_world(scene, config);
    config.set(std::string("simulator.mode=") + mode);
    config.set("record.snapshot_every=40");
    config.edit().record.file = folder / "run.fathom";
    Engine engine(config);
    const std::vector<EntityId> ids = spawn_scene(engine, scene);
    EntityDef def;
    def.tick = TickPhase::before;
    int told = 0;
    engine.world().spawn(def, [&](Entity&, const Tick& tick) {
      if (tick.step == 1) tick.engine.world().join(ids[1], ids[2], ball_joint({}, {}, {}, {0, 0, 1}));
      if (const StatePtr state = tick.engine.simulation().newest())
        for (const BreakEvent& b : state->breaks) told += b.user_data == 3;
    });
    engine.run(60);
    engine.simulation().finish();
    std::uint64_t hash = 0;
    engine.simulation().inspect([&](const CommandRunner& runner) {
      EXPECT_EQ(runner.world().joint_count(), 1u);
      EXPECT_LT(runner.world().pose(runner.world().bodies()[1]).position.z, 0);
      hash = runner.world().state_hash();
    });
    engine.finish();
    // In mode ahead, the newest state may not be the one that reports it.
    if (std::string(mode) == "lockstep") {
      EXPECT_GE(told, 1);
    }
    const ReplayResult result = replay(folder / "run.fathom", {.threads = 1});
    EXPECT_FALSE(result.difference.has_value()) << mode << ": " << result.difference->text();
    EXPECT_EQ(result.state_hash, hash);
  }
}

TEST(EngineRecording, HoldsLimitsDrivesAndDistances) {
  const Folder folder;
  Scene scene;
  scene.bodies = {fathom::test::dynamic(sphere(0.1f), {0, 0, 2}),
                  fathom::test::dynamic(box({0.5f, 0.1f, 0.1f}), {1, 0, 2}),
                  fathom::test::dynamic(sphere(0.1f), {1, 0, 1})};
  scene.bodies[0].motion = MotionType::fixed;
  JointDef hinge = revolute_joint({}, {}, {}, {{-1, 0, 0}, 0, {}});
  hinge.axis(JointAxisName::twist).limit(-1, 1).drive_velocity(3, 50);
  hinge.axis(JointAxisName::swing_y).mode = AxisMode::free;
  scene.joints = {{0, 1, hinge}, {1, 2, distance_joint({}, {}, {}, {}, 0, 1)}};
  Config config = quiet_config();
  take_over_world(scene, config);
  config.edit().record.file = folder / "run.fathom";
  Engine engine(config);
  spawn_scene(engine, scene);
  engine.run(60);
  const std::uint64_t hash = engine.simulation().newest()->hash;
  engine.simulation().inspect([&](const CommandRunner& runner) {
    const World& world = runner.world();
    ASSERT_EQ(world.joint_count(), 2u);
    EXPECT_EQ(world.joint(world.joints()[0]).axes, hinge.axes);
    EXPECT_NEAR(world.joint_positions(world.joints()[0])[3], 1, 0.01) << "the motor has turned it to its limit";
    EXPECT_EQ(world.joint(world.joints()[1]).type, JointType::distance);
  });
  engine.finish();
  const ReplayResult result = replay(folder / "run.fathom", {.threads = 1});
  EXPECT_FALSE(result.difference.has_value()) << result.difference->text();
  if (hash != 0) {
    EXPECT_EQ(result.state_hash, hash);
  }
}

TEST(EngineRecording, DamagedFilesAreRefused) {
  const Folder folder;
  const std::string file = folder / "run.fathom";
  record_game(file, "lockstep", true, 1);
  const std::string good = read_text(file);
  const auto with = [&](const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
    return refusal([&] { replay(file); });
  };
  EXPECT_EQ(with(good), "");
  EXPECT_THAT(with(""), HasSubstr("it is empty"));
  EXPECT_THAT(with("hello, this is not a recording at all"), HasSubstr("this is not a recording of fathom"));
  EXPECT_THAT(with(good.substr(0, 20)), HasSubstr("this is not a recording of fathom"));
  EXPECT_THAT(with(good.substr(0, 32)), HasSubstr("it is truncated: 0 of"));
  EXPECT_THAT(with(good.substr(0, good.size() / 2)), HasSubstr("it is truncated"));
  EXPECT_THAT(with(good.substr(0, good.size() - 1)), HasSubstr("it is truncated"));
  EXPECT_THAT(with(good + "x"), HasSubstr("it was altered"));
  for (std::size_t at = 0; at < good.size(); at += good.size() / 97) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 4);
    EXPECT_NE(with(bad), "") << at;
  }
  std::string later = good;
  later[8] = 14;
  EXPECT_THAT(with(later), HasSubstr("format version 14, this build reads version 13"));
  later[8] = 3;
  EXPECT_THAT(with(later), HasSubstr("format version 3, this build reads version 13; use the build that wrote it"));
  EXPECT_THAT(refusal([&] { replay(folder / "none"); }), HasSubstr("no such file"));
  EXPECT_THAT(refusal([&] { replay(folder / ""); }), HasSubstr(": is a folder; give the path of what"));
}

TEST(EngineRecording, AppearsCompleteOrNotAtAll) {
  const Folder folder;
  {
    Recorder recorder(folder / "run.fathom", {});
    World world;
    recorder.before_step(1, {}, CommandRunner(world));
    EXPECT_EQ(folder.file_count(), 1u) << "the partial file";
  }
  EXPECT_EQ(folder.file_count(), 0u);
  EXPECT_THAT(refusal([&] { Recorder bad("/nowhere/run.fathom", {}); }),
              HasSubstr("/nowhere/run.fathom: cannot be written"));
  EXPECT_THAT(refusal([&] { Recorder bad(folder / "x", {.snapshot_every = 0}); }), HasSubstr("give at least 1"));
}

}  // namespace
}  // namespace fathom::engine::test::engine_recording_test
