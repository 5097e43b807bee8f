// The engine's configuration: files, individual keys, origins, error messages.
#include <gmock/gmock.h>

#include "engine/config.hpp"
#include "engine/simulator_choice.hpp"
#include "engine_fixture.hpp"

namespace fathom::engine::test::engine_config_test {
namespace {

using testing::HasSubstr;

TEST(EngineConfig, FileAndOverridesWithTheirOrigins) {
  Config config;
  EXPECT_EQ(config.origin("simulator.threads"), "default");
  config.parse("[simulator]\nmode = 'async'\nthreads = 3\ngravity = [0, 0, -1.62]\n[input.actions]\njump = 'space'\n",
               "moon.toml");
  config.set("simulator.threads=5");
  config.set("window.title=Out there");
  config.set("input.actions.dive=[\"d\", 'down']");
  EXPECT_EQ(config->simulator.mode, SimulationMode::async);
  EXPECT_EQ(config->simulator.threads, 5);
  EXPECT_EQ(config->simulator.gravity.z, -1.62f);
  EXPECT_EQ(config->window.title, "Out there");
  EXPECT_THAT(config->actions.at("jump"), testing::ElementsAre("space"));
  EXPECT_THAT(config->actions.at("dive"), testing::ElementsAre("d", "down"));
  EXPECT_EQ(config.origin("simulator.mode"), "moon.toml:2");
  EXPECT_EQ(config.origin("simulator.threads"), "--set");
  EXPECT_THAT(config.text(true), HasSubstr("# moon.toml:4"));
}

TEST(EngineConfig, EveryValueSurvivesBeingStored) {
  const Folder folder;
  Config config;
  for (const char* set : {"simulator.dt=0.005", "simulator.mode=ahead", "simulator.ahead=3", "simulator.solver=impulse",
                          "loop.pacing=fixed", "loop.rate=144.5", "loop.time=wall", "world.spawns_per_frame=7",
                          "window.title=a \"quoted\" \\ title", "log.level=debug", "record.states=false",
                          "simulator.gravity=[1, 2.5, -3]", "input.actions.fire=[\"f\", \"mouse_left\"]"})
    config.set(set);
  config.save(folder / "engine.toml");
  EXPECT_EQ(folder.file_count(), 1u);
  Config loaded;
  loaded.load(folder / "engine.toml");
  EXPECT_EQ(loaded.text(false), config.text(false));
  EXPECT_EQ(loaded->simulator.dt, 0.005f);
  EXPECT_EQ(loaded->window.title, "a \"quoted\" \\ title");
  for (const std::string& key : loaded.keys()) {
    EXPECT_EQ(loaded.is_set(key), config.is_set(key)) << key;
    EXPECT_THAT(loaded.origin(key), HasSubstr(config.is_set(key) ? "engine.toml:" : "default")) << key;
  }
}

struct Bad {
  const char* text;
  const char* says;
};

TEST(EngineConfig, BadFilesAreRefusedNamingThePlaceAndTheRemedy) {
  const Bad files[] = {
      {"[simulator]\nthreds = 4\n", "e.toml:2:1: unknown key 'simulator.threds'; did you mean 'simulator.threads'?"},
      {"[simulater]\nthreads = 4\n", "did you mean 'simulator.threads'?"},
      {"xyzzyplugh = 1\n", "e.toml:1:1: unknown key 'xyzzyplugh'; 'fathom config' lists the keys"},
      {"[simulator]\nthreads = -1\n", "'simulator.threads' must be a whole number from 0 to 1024, not -1"},
      {"[simulator]\nthreads = 2.5\n", "'simulator.threads' must be a whole number"},
      {"[simulator]\nthreads = 99999999999999999999\n", "e.toml:2"},
      {"[simulator]\ndt = nan\n", "'simulator.dt' must be a number from 1e-06 to 1"},
      {"[simulator]\ndt = 10\n", "e.toml:2:1: 'simulator.dt' must be a number from 1e-06 to 1, not 10"},
      {"[simulator]\ndt = 'x'\n", "'simulator.dt' must be a number from 1e-06 to 1"},
      {"[simulator]\nsleep_time = -2.5\n", "must be a finite number of at least 0, not -2.5"},
      {"[simulator]\nmode = 'lockstop'\n",
       "must be one of lockstep, ahead, async, not 'lockstop'; did you mean 'lockstep'?"},
      {"[simulator]\nkind = 'quantum'\n", "'simulator.kind' must be one of native, device"},
      {"[simulator]\nsleep = 1\n", "'simulator.sleep' must be true or false"},
      {"[simulator]\ngravity = [0, 0]\n", "must be three finite numbers"},
      {"[simulator]\ngravity = [0, inf, 0]\n", "must be three finite numbers"},
      {"simulator = 3\n",
       "e.toml:1:1: unknown key 'simulator': it is a section; name a key in it, such as 'simulator.kind'"},
      {"[[body]]\nmass = 1\n",
       "e.toml:1:3: unknown key 'body': only scene files have it; 'fathom config' lists the keys of a configuration"},
      {"[world]\ngravity = [0, 0, 0]\n", "e.toml:2:1: unknown key 'world.gravity'; did you mean 'simulator.gravity'?"},
      {"[window]\ntitle = 3\n", "'window.title' must be a string"},
      {"[input.actions]\njump = 'spaec'\n", "'input.actions.jump' names no key with 'spaec'; did you mean 'space'?"},
      {"[input.actions]\njump = 3\n", "must be a key's name or a list of them"},
      {"[simulator\n", "e.toml:1:11: the name of a table is not closed; write [name] or [[name]]"},
      {"threads = 1\nthreads = 2\n", "e.toml:2:1: 'threads' is set twice; remove one of them"},
      {"[log]\nlevel = debug\n", "e.toml:2:9: 'debug' is not a value; write a number, true, false, or a text in"},
  };
  for (const Bad& bad : files) {
    Config config;
    const std::string before = config.text(true);
    EXPECT_THAT(refusal([&] { config.parse(bad.text, "e.toml"); }), HasSubstr(bad.says)) << bad.text;
    EXPECT_EQ(config.text(true), before) << bad.text;
  }
  Config config;
  EXPECT_THAT(refusal([&] { config.load("/nowhere/e.toml"); }), HasSubstr("/nowhere/e.toml: cannot be read"));
  EXPECT_THAT(refusal([&] { config.save("/nowhere/e.toml"); }), HasSubstr("/nowhere/e.toml: cannot be written"));
}

TEST(EngineConfig, BadAssignmentsAreRefused) {
  const Bad assignments[] = {
      {"simulator.threads", "write it as key=value"},
      {"=4", "write it as key=value"},
      {" =4", "write it as key=value"},
      {"window.title=\xff", "the text is not UTF-8"},
      {"simulator.thread=4", "did you mean 'simulator.threads'?"},
      // The key's own name counts more than its section's.
      {"world.dt=0.01", "unknown key 'world.dt'; did you mean 'simulator.dt'?"},
      {"solver.substeps=4", "did you mean 'simulator.substeps'?"},
      {"world.substep=4", "did you mean 'simulator.substeps'?"},
      {"dt=0.01", "did you mean 'simulator.dt'?"},
      {"logs.file=x", "did you mean 'log.file'?"},
      {"loop.time_scal=2", "did you mean 'loop.time_scale'?"},
      {"Simulator.DT=0.01", "did you mean 'simulator.dt'?"},
      {"simulator.sweep-axis=[1, 0, 0]", "did you mean 'simulator.sweep_axis'?"},
      {"input.action.jump=space", "did you mean 'input.actions.'?"},
      {"world.xyzzy=1", "unknown key 'world.xyzzy'; 'fathom config' lists the keys"},
      // Scene files have other names.
      {"solver.method=soft", "did you mean 'simulator.solver'?"},
      {"sleep.enabled=true", "did you mean 'simulator.sleep'?"},
      {"sleep.time=1", "did you mean 'simulator.sleep_time'?"},
      {"window=1", "unknown key 'window': it is a section; name a key in it, such as 'window.enabled'"},
      {"simulator.threads=many", "must be a whole number"},
      {"simulator.threads=", "must be a whole number"},
      {"simulator.threads=1\nwindow.width=3", "must be a whole number"},
      {"loop.pacing=vsnyc", "did you mean 'vsync'?"},
      {"input.actions.jump=nokey", "names no key"},
      {"input.actions.=a", "unknown key"},
  };
  for (const Bad& bad : assignments) {
    Config config;
    const std::string said = refusal([&] { config.set(bad.text); });
    EXPECT_THAT(said, HasSubstr(bad.says)) << bad.text;
    EXPECT_THAT(said, testing::StartsWith("--set ")) << bad.text;
  }
}

TEST(EngineConfig, BlanksBesideTheEqualsSignAreNoPartOfKeyOrValue) {
  Config config;
  config.set("simulator.dt = 0.01");
  config.set("log.level = debug ");
  config.set("log.file= x");
  EXPECT_FLOAT_EQ(config->simulator.dt, 0.01f);
  EXPECT_EQ(config->log.level, "debug");
  EXPECT_EQ(config->log.file, " x") << "unless the value alone has them";
}

TEST(EngineConfig, EngineRefusesBadValuesSetByPrograms) {
  Config config = quiet_config();
  config.edit().log.level = "loud";
  EXPECT_THAT(refusal([&] { Engine engine(config); }), HasSubstr("there is no log level 'loud'"));
  config = quiet_config();
  config.edit().simulator.dt = -1;
  EXPECT_THAT(refusal([&] { Engine engine(config); }), HasSubstr("dt is -1"));
  config = quiet_config();
  config.edit().log.file = "/nowhere/log";
  EXPECT_THAT(refusal([&] { Engine engine(config); }), HasSubstr("/nowhere/log: cannot be written"));
}

std::vector<exec::DeviceInfo> some_devices() {
  exec::DeviceInfo host, cuda;
  host.name = "CPU";
  host.available = true;
  cuda.backend = exec::Backend::cuda;
  cuda.is_gpu = true;
  cuda.why_not = "no driver";
  return {host, cuda};
}

TEST(EngineDevices, FallbackRules) {
  const auto devices = some_devices();
  const Folder folder;
  Log log({.level = LogLevel::debug, .console = false, .file = folder / "log"});
  Settings settings;
  EXPECT_EQ(choose_simulator(settings, {}, log).kind, SimulatorKind::native);
  settings.simulator.kind = SimulatorKind::device;
  const SimulatorChoice choice = choose_simulator(settings, devices, log);
  EXPECT_EQ(choice.kind, SimulatorKind::device);
  EXPECT_EQ(choice.device, "host");
  settings.simulator.device = "cuda:0";
  EXPECT_EQ(choose_simulator(settings, devices, log).kind, SimulatorKind::native);
  log.flush();
  EXPECT_THAT(read_text(folder / "log"), HasSubstr("no driver; the native simulator takes its place"));
  settings.simulator.fallback = false;
  EXPECT_THAT(refusal([&] { choose_simulator(settings, devices, log); }), HasSubstr("no driver"));
  settings.simulator.kind = SimulatorKind::native;
  settings.simulator.device = "gpu";
  EXPECT_THAT(refusal([&] { choose_simulator(settings, devices, log); }), HasSubstr("no device is called 'gpu'"));
}

}  // namespace
}  // namespace fathom::engine::test::engine_config_test
