// Every key means the same wherever it is set: scene, file, assignment, option, program.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "engine/recording.hpp"
#include "engine/scene_entities.hpp"
#include "engine_fixture.hpp"
#include "scene/environments.hpp"
#include "scene/scene_file.hpp"

namespace fathom::engine::test::engine_settings_test {
namespace {

using testing::HasSubstr;

/// A key with a non-default value, and how a scene sets it (if it can).
struct Sample {
  const char* key;
  const char* value;
  const char* scene = nullptr;
  bool recorded = true;  ///< false for threads, device and reading, which belong to the machine
};

const Sample world_samples[] = {
    {"simulator.kind", "\"device\"", "[simulator]\nkind = 'device'"},
    {"simulator.device", "\"host\"", "[simulator]\ndevice = 'host'", false},
    {"simulator.threads", "2", "[simulator]\nthreads = 2", false},
    {"simulator.device_ahead", "3", "[simulator]\nahead = 3", false},
    {"simulator.dt", "0.005", "[world]\ndt = 0.005"},
    {"simulator.gravity", "[1, 0, -3]", "[world]\ngravity = [1, 0, -3]"},
    {"simulator.max_bodies", "40", "[world]\nmax_bodies = 40"},
    {"simulator.preset", "\"dissertation\"", "[simulator]\npreset = 'dissertation'"},
    {"simulator.solver", "\"impulse\"", "[solver]\nmethod = 'impulse'"},
    {"simulator.broad_phase", "\"sweep\"", "[simulator]\nbroad_phase = 'sweep'"},
    {"simulator.sweep_axis", "[1, 0, 0]", "[simulator]\nsweep_axis = [1, 0, 0]"},
    {"simulator.partition", "\"cells\"", "[simulator]\npartition = 'cells'"},
    {"simulator.warm_start", "false", "[solver]\nwarm_start = false"},
    {"simulator.direct_joints", "false", "[solver]\ndirect_joints = false"},
    {"simulator.substeps", "7", "[solver]\nsubsteps = 7"},
    {"simulator.iterations", "3", "[solver]\niterations = 3"},
    {"simulator.marking_rounds", "9", "[solver]\nmarking_rounds = 9"},
    {"simulator.contact_hertz", "20", "[solver]\ncontact_hertz = 20"},
    {"simulator.contact_damping_ratio", "4", "[solver]\ncontact_damping_ratio = 4"},
    {"simulator.push_out_velocity", "0.5", "[solver]\npush_out_velocity = 0.5"},
    {"simulator.restitution_threshold", "5", "[solver]\nrestitution_threshold = 5"},
    {"simulator.max_linear_speed", "12", "[solver]\nmax_linear_speed = 12"},
    {"simulator.sleep", "false", "[sleep]\nenabled = false"},
    {"simulator.sleep_linear_speed", "0.25", "[sleep]\nlinear_speed = 0.25"},
    {"simulator.sleep_time", "0.125", "[sleep]\ntime = 0.125"},
};

const Sample other_samples[] = {
    {"simulator.fallback", "false"},
    {"simulator.mode", "\"async\""},
    {"simulator.ahead", "5"},
    {"simulator.hashes", "true"},
    {"loop.pacing", "\"fixed\""},
    {"loop.rate", "144.5"},
    {"loop.time", "\"wall\""},
    {"loop.time_scale", "0.5"},
    {"loop.paused", "true"},
    {"loop.max_steps_per_frame", "7"},
    {"world.spawns_per_frame", "8"},
    {"window.enabled", "true"},
    {"window.width", "640"},
    {"window.height", "480"},
    {"window.fullscreen", "true"},
    {"window.title", "\"a \\\"b\\\"\""},
    {"log.level", "\"debug\""},
    {"log.console", "false"},
    {"log.file", "\"l\""},
    {"log.file_size", "9"},
    {"log.files", "4"},
    {"log.data", "\"d\""},
    {"trace.file", "\"t\""},
    {"record.file", "\"r\""},
    {"record.snapshot_every", "11"},
    {"record.states", "false"},
};

std::vector<Sample> all_samples() {
  std::vector<Sample> all(std::begin(world_samples), std::end(world_samples));
  all.insert(all.end(), std::begin(other_samples), std::end(other_samples));
  return all;
}

/// The value that the configuration shows for a key.
std::string shown(const Config& config, const std::string& key) {
  const std::string table = "[" + key.substr(0, key.rfind('.')) + "]\n", name = key.substr(key.rfind('.') + 1) + " = ";
  const std::string text = config.text(false);
  const std::string lines = text.substr(text.find(table));
  std::size_t at = lines.find("\n" + name);
  if (at == std::string::npos) at = lines.find("\n# " + name) + 2;
  const std::string line = lines.substr(at + 1 + name.size(), lines.find('\n', at + 1) - at - 1 - name.size());
  return line.substr(0, line.find_last_not_of(' ', line.find("  #") - 1) + 1);
}

std::string shown(const WorldDef& world, const std::string& key) {
  Config config;
  config.set_base({world, "world"});
  return shown(config, key);
}

TEST(EngineSettings, EveryKeyHasASample) {
  std::set<std::string> sampled, known;
  for (const Sample& sample : all_samples()) sampled.insert(sample.key);
  for (const std::string& key : Config().keys()) known.insert(key);
  EXPECT_EQ(sampled, known);
}

TEST(EngineSettings, EveryKeyIsSetBySomebodyKeptAndNobodyElseIs) {
  const Folder folder;
  for (const Sample& s : all_samples()) {
    const std::string key = s.key, name = key.substr(key.rfind('.') + 1);
    Config file, assigned, given;
    file.parse(fmt::format("[{}]\n{} = {}\n", key.substr(0, key.rfind('.')), name, s.value), "f.toml");
    assigned.set(fmt::format("{}={}", key, s.value));
    given.give(key, "--option", [&](Settings& settings) { settings = *assigned; });
    EXPECT_NE(shown(Config(), key), s.value) << key << ": the sample is no default";
    for (const auto& [config, origin] :
         {std::pair<Config&, const char*>{file, "f.toml:2"}, {assigned, "--set"}, {given, "--option"}}) {
      EXPECT_EQ(shown(config, key), s.value);
      EXPECT_EQ(config.origin(key), origin) << key;
      for (const std::string& other : config.keys())
        EXPECT_EQ(config.is_set(other), other == key) << key << ", " << other;
      config.save(folder / "saved.toml");
      Config loaded;
      loaded.load(folder / "saved.toml");
      EXPECT_EQ(loaded.text(false), config.text(false)) << key;
      EXPECT_TRUE(loaded.world_definition().solver.method == config.world_definition().solver.method);
    }
  }
}

TEST(EngineSettings, ADefaultThatIsSetIsSet) {
  const Scene scene = drift(5);  // without gravity
  Config unset, set;
  set.set("simulator.gravity=[0, 0, -9.81]");
  const Folder folder;
  for (Config* config : {&unset, &set}) {
    config->save(folder / "saved.toml");
    Config loaded;
    loaded.load(folder / "saved.toml");
    take_over_world(scene, loaded);
    EXPECT_EQ(loaded.world_definition().gravity.z, config == &set ? -9.81f : 0.0f);
  }
}

constexpr const char* bodies = "\n[[body]]\nshape = {type = 'sphere', radius = 0.5}\nposition = [0, 0, 5]\n";

// The same setting in any of these places gives the same world, in the engine and in its recording.
TEST(EngineSettings, AWorldIsTheSameWhereverASettingIsMade) {
  const Folder folder;
  const Scene plain = parse_scene(bodies, "plain.toml");
  for (const Sample& s : world_samples) {
    const Scene saying = parse_scene(std::string(s.scene) + bodies, "saying.toml");
    const std::string key = s.key, assignment = fmt::format("{}={}", s.key, s.value);
    EXPECT_NE(shown(plain.world, key), s.value);
    for (const char* place : {"scene", "file", "--set", "option", "program"}) {
      const std::string_view where = place;
      Config config, other;
      other.set(assignment);
      if (where == "file") config.parse(fmt::format("simulator.{} = {}", key.substr(10), s.value), "file.toml");
      if (where == "--set") config.set(assignment);
      if (where == "option") config.give(key, "option", [&](Settings& settings) { settings = *other; });
      if (where == "program") config.edit().simulator = other->simulator;
      config.edit().log.console = false;
      config.edit().record.file = folder / "run.fathom";
      take_over_world(where == "scene" ? saying : plain, config);
      EXPECT_EQ(shown(config, key), s.value) << place;
      if (where != "program" || key != "simulator.preset") {
        EXPECT_THAT(config.origin(key), HasSubstr(where == "scene" ? "saying.toml:2" : place)) << key;
      }
      if (key == "simulator.kind" || key == "simulator.preset") config.set("simulator.device=host");
      Engine engine(config);
      spawn_scene(engine, plain);
      engine.run(2);
      if (key != "simulator.preset") {
        EXPECT_EQ(shown(engine.simulation().definition(), key), s.value) << place;
      }
      const Config expected = [&] {
        Config c;
        c.set(assignment);
        if (key == "simulator.kind" || key == "simulator.preset") c.set("simulator.device=host");
        return c;
      }();
      EXPECT_EQ(shown(engine.simulation().definition(), "simulator.solver"), shown(expected, "simulator.solver"));
      engine.finish();
      ReplaySettings replaying{.threads = 1, .device = "host"};
      replaying.after_step = [&](std::uint64_t, World& world) {
        if (!s.recorded || key == "simulator.preset") return;
        EXPECT_EQ(shown(world.definition(), key), s.value) << place;
      };
      EXPECT_EQ(replay(folder / "run.fathom", replaying).steps, 2u);
    }
  }
}

TEST(EngineSettings, WhatIsSetLaterWins) {
  const Scene scene = parse_scene("[solver]\nmethod = 'impulse'\nsubsteps = 2\n" + std::string(bodies), "s.toml");
  Config config;
  take_over_world(scene, config);
  EXPECT_EQ(config->simulator.substeps, 2);
  EXPECT_EQ(config.origin("simulator.substeps"), "s.toml:3");
  config.give("simulator.substeps", "--substeps", [](Settings& s) { s.simulator.substeps = 5; });
  config.set("simulator.threads=3");
  EXPECT_EQ(config->simulator.substeps, 5);
  config.set_base({});
  EXPECT_EQ(config->simulator.substeps, 5);
  EXPECT_EQ(config->simulator.solver, Solver::soft) << "the scene has gone";
}

TEST(EngineSettings, APresetSetsAllThatItDecidesButForWhatIsSetBesideOrAfterIt) {
  Config config;
  config.parse("[simulator]\nsolver = 'soft'\npartition = 'colours'\n", "f.toml");
  config.set("simulator.preset=dissertation");
  config.set("simulator.partition=colours");
  const WorldDef world = config.world_definition();
  EXPECT_EQ(world.solver.method, Solver::impulse) << "the file's solver was set before";
  EXPECT_EQ(world.partition, Partition::colours) << "set beside it";
  EXPECT_EQ(world.broad_phase, BroadPhase::sweep);
  EXPECT_FALSE(world.sleep.enabled);
  EXPECT_TRUE(world.solver.warm_start);
  EXPECT_EQ(config.origin("simulator.solver"), "preset dissertation");
  EXPECT_EQ(config.origin("simulator.partition"), "--set");
  // On a device the choice differs, however and whenever the device is named.
  config.give("simulator.device", "--device", [](Settings& s) { s.simulator.device = "host"; });
  EXPECT_EQ(config->simulator.kind, SimulatorKind::device);
  EXPECT_EQ(config.origin("simulator.kind"), "--device");
  EXPECT_FALSE(config.world_definition().solver.warm_start);
  EXPECT_EQ(config.world_definition().ahead, 2);
  const Scene scene = parse_scene("[simulator]\npreset = 'dissertation'\n" + std::string(bodies), "s.toml");
  Config over;
  over.set("simulator.kind=device");
  take_over_world(scene, over);
  EXPECT_FALSE(over.world_definition().solver.warm_start);
  EXPECT_TRUE(scene.world.solver.warm_start);
}

TEST(EngineSettings, ADeviceThatIsNamedIsUsedUnlessTheSimulatorIsNamedToo) {
  Config config;
  config.set("simulator.device=host");
  EXPECT_EQ(config.world_definition().simulator, SimulatorKind::device);
  config.set("simulator.kind=native");
  EXPECT_EQ(config.world_definition().simulator, SimulatorKind::native);
  EXPECT_EQ(parse_scene("[simulator]\ndevice = 'host'\n" + std::string(bodies), "s.toml").world.simulator,
            SimulatorKind::device);
  const Scene hybrid = parse_scene("[simulator]\nkind = 'hybrid'\n" + std::string(bodies), "s.toml");
  Config over;
  over.set("simulator.device=host");
  take_over_world(hybrid, over);
  EXPECT_EQ(over.world_definition().simulator, SimulatorKind::hybrid);
}

TEST(EngineSettings, WhereTheDeviceIsNotThereAPresetIsThatOfTheNativeSimulator) {
  for (const bool program : {false, true}) {
    Config config = quiet_config();
    config.set("simulator.preset=dissertation");
    if (program) config.edit().simulator.device = "cuda:99";
    if (!program) config.set("simulator.device=cuda:99");
    EXPECT_FALSE(config.world_definition().solver.warm_start);
    Engine engine(config);
    EXPECT_EQ(engine.simulation().definition().simulator, SimulatorKind::native);
    EXPECT_TRUE(engine.simulation().definition().solver.warm_start);
    EXPECT_EQ(engine.config().origin("simulator.kind"), "simulator.fallback");
  }
}

TEST(EngineSettings, ProgramsThatEditAreHeard) {
  Config config;
  config.edit().simulator.warm_start = false;
  config.edit().simulator.partition = Partition::cells;
  config.edit().actions["jump"] = {"space"};
  EXPECT_FALSE(config.world_definition().solver.warm_start);
  EXPECT_EQ(config.world_definition().partition, Partition::cells);
  EXPECT_EQ(config.origin("simulator.partition"), "program");
  config.edit().simulator.preset = Preset::dissertation;
  EXPECT_EQ(config.world_definition().solver.method, Solver::impulse);
  const Folder folder;
  config.save(folder / "saved.toml");
  Config loaded;
  loaded.load(folder / "saved.toml");
  EXPECT_EQ(loaded.text(false), config.text(false));
  EXPECT_THAT(loaded->actions.at("jump"), testing::ElementsAre("space"));
}

}  // namespace
}  // namespace fathom::engine::test::engine_settings_test
