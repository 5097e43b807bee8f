// Settings mean the same in every command, wherever they are made.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <regex>

#include "program.hpp"

namespace fathom::cli_settings_test {
namespace {

using test::operator+;
using test::Outcome;
using test::read_text;
using test::Words;
using testing::HasSubstr;

// A wedge of overlapping boxes, a ball that is too fast, balls that bounce, boxes that fall asleep, two that a
// joint may connect.
constexpr const char* bodies = R"(
[[body]]
shape = {type = "box", half_extents = [50, 50, 0.5]}
motion = "static"
[[body]]
shape = {type = "box", half_extents = [0.5, 0.5, 0.5]}
position = [0, 0, 0.9]
repeat = {count = [1, 1, 4], spacing = [1, 1, 0.85]}
[[body]]
shape = {type = "box", half_extents = [0.5, 0.4, 0.5]}
position = [3, 0, 1]
repeat = {count = [2, 2, 2], spacing = [1.1, 1.1, 1.001]}
[[body]]
shape = {type = "sphere", radius = 0.5}
material = {restitution = 0.8}
position = [-3, 0, 1.5]
repeat = {count = [1, 3, 1], spacing = [1, 1.3, 1]}
[[body]]
shape = {type = "sphere", radius = 0.5}
position = [-9, 9, 6]
velocity = [30, -20, 0]
[[body]]
name = "upper"
shape = {type = "box", half_extents = [0.1, 0.1, 0.5]}
position = [0, 4, 3]
velocity = [1, 0, 0]
[[body]]
name = "lower"
shape = {type = "box", half_extents = [0.1, 0.1, 0.5]}
position = [0, 4, 2]
)";

#define FATHOM_A_JOINT "[[joint]]\ntype = 'ball'\na = 'upper'\nb = 'lower'\npoint = [0, 4, 2.5]\n"

struct Setting {
  const char* key;          ///< of the configuration, without "simulator."
  const char* value;        ///< TOML
  const char* scene;        ///< as the scene sets it
  Words option = {};        ///< as an option sets it
  const char* beside = "";  ///< what else the scene says
};

const Setting settings[] = {
    {"dt", "0.01", "[world]\ndt = 0.01", {"--dt", "0.01"}},
    {"gravity", "[1, 0, -5]", "[world]\ngravity = [1, 0, -5]"},
    {"preset", "\"dissertation\"", "[simulator]\npreset = 'dissertation'", {"--preset", "dissertation"}},
    {"solver", "\"impulse\"", "[solver]\nmethod = 'impulse'", {"--solver", "impulse"}},
    {"iterations",
     "2",
     "[solver]\niterations = 2\nmethod = 'impulse'",
     {"--iterations", "2"},
     "[solver]\nmethod = 'impulse'"},
    {"warm_start", "false", "[solver]\nwarm_start = false", {"--warm-start", "off"}},
    {"substeps", "3", "[solver]\nsubsteps = 3", {"--substeps", "3"}},
    {"contact_hertz", "10", "[solver]\ncontact_hertz = 10"},
    {"contact_damping_ratio", "3", "[solver]\ncontact_damping_ratio = 3"},
    {"push_out_velocity", "0.5", "[solver]\npush_out_velocity = 0.5"},
    {"restitution_threshold", "6", "[solver]\nrestitution_threshold = 6"},
    {"max_linear_speed", "12", "[solver]\nmax_linear_speed = 12"},
    {"partition", "\"cells\"", "[simulator]\npartition = 'cells'", {"--partition", "cells"}},
    {"sleep", "false", "[sleep]\nenabled = false\ntime = 0.05", {"--sleep", "off"}, "[sleep]\ntime = 0.05"},
    {"sleep_linear_speed", "0.0001", "[sleep]\nlinear_speed = 0.0001\ntime = 0.05", {}, "[sleep]\ntime = 0.05"},
    {"sleep_time", "0.05", "[sleep]\ntime = 0.05"},
    {"kind", "\"device\"", "[simulator]\nkind = 'device'", {"--simulator", "device"}},
    {"device", "\"host\"", "[simulator]\ndevice = 'host'", {"--device", "host"}},
    {"direct_joints",
     "false",
     "[solver]\ndirect_joints = false\n" FATHOM_A_JOINT,
     {"--direct-joints", "off"},
     FATHOM_A_JOINT},
};

class Settings : public fathom::test::Program {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  std::string scene(const std::string& name, const std::string& says) const {
    return write(name, "name = 'same'\n" + says + bodies);
  }
  /// The state hash that a command prints.
  std::string hash(Words arguments) const {
    const Outcome outcome = fathom(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << testing::PrintToString(arguments) << ": " << outcome.err;
    const std::size_t at = outcome.out.find("state hash");
    return at == std::string::npos ? "none: " + outcome.out : outcome.out.substr(at + 10, 30);
  }
};

TEST_F(Settings, GiveTheSameStatesInEveryCommandWhereverTheyAreMade) {
  for (const Setting& s : settings) {
    const std::string plain = scene("plain.toml", s.beside), saying = scene("saying.toml", s.scene);
    const std::string file = write("engine.toml", "[simulator]\n" + std::string(s.key) + " = " + s.value + "\n");
    const Words steps{"--steps", "50", "--threads", "1"}, quiet{"--set", "log.console=false"};
    const std::string before = hash(Words{"run", plain} + steps), expected = hash(Words{"run", saying} + steps);
    EXPECT_NE(expected, before) << s.key << ": the sample changes something";
    std::map<std::string, Words> places{{"scene", {saying}},
                                        {"file", {plain, "--config", file}},
                                        {"--set", {plain, "--set", "simulator." + std::string(s.key) + "=" + s.value}}};
    if (!s.option.empty()) places[s.option[0]] = Words{plain} + s.option;
    for (const auto& [place, words] : places) {
      EXPECT_EQ(hash(Words{"run"} + words + steps), expected) << "run, " << s.key << ", " << place;
      EXPECT_EQ(hash(Words{"play"} + words + steps + quiet), expected) << "play, " << s.key << ", " << place;
      const Words record{"--record", path("run.fathom"), "--quiet"};
      ASSERT_EQ(fathom(Words{"run"} + words + steps + record).exit_code, 0);
      EXPECT_EQ(hash({"replay", path("run.fathom")}), expected) << "replay, " << s.key << ", " << place;
      const Outcome shown = fathom(Words{"config"} + words);
      const std::string origin = place == "file" ? "engine.toml:2" : place == "scene" ? "saying.toml:" : place;
      const std::string line = shown.out.substr(shown.out.find(std::string(s.key) + " = " + s.value));
      EXPECT_THAT(line.substr(0, line.find('\n')), HasSubstr(origin)) << s.key << "\n" << shown.out << shown.err;
    }
  }
}

#ifdef FATHOM_HAS_VIEWER
// `cli.view` provides a display; without one this test is skipped.
TEST_F(Settings, AreThoseOfTheViewerToo) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display here";
  const Words frames{"--frames", "20", "--threads", "1", "--size", "64x64"}, steps{"--steps", "20", "--threads", "1"};
  for (const Setting& s : settings) {
    const std::string plain = scene("plain.toml", s.beside), saying = scene("saying.toml", s.scene);
    const std::string file = write("engine.toml", "[simulator]\n" + std::string(s.key) + " = " + s.value + "\n");
    std::vector<Words> places{
        {saying}, {plain, "--config", file}, {plain, "--set", "simulator." + std::string(s.key) + "=" + s.value}};
    if (!s.option.empty()) places.push_back(Words{plain} + s.option);
    const std::string expected = hash(Words{"run", saying} + steps);
    EXPECT_NE(expected, hash(Words{"run", plain} + steps)) << s.key << ": the sample changes something";
    for (const Words& words : places)
      EXPECT_EQ(hash(Words{"view"} + words + frames), expected) << s.key << testing::PrintToString(words);
  }
}
#endif

#ifdef FATHOM_HAS_RENDER
// A page holds the poses: equal worlds give equal pages.
TEST_F(Settings, RenderTheSame) {
  for (const Setting& s : {settings[0], settings[3], settings[8], settings[16]}) {
    const std::string plain = scene("plain.toml", s.beside), saying = scene("saying.toml", s.scene);
    const auto page = [&](Words words) {
      const Outcome outcome = fathom(Words{"render"} + words + Words{"--web", path("p.html"), "--seconds", "0.5"});
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      return read_text(path("p.html"));
    };
    const std::string expected = page({saying});
    EXPECT_EQ(page({plain, "--set", "simulator." + std::string(s.key) + "=" + s.value}), expected) << s.key;
    EXPECT_NE(page({plain}), expected) << s.key;
    if (!s.option.empty()) {
      EXPECT_EQ(page(Words{plain} + s.option), expected) << s.key;
    }
  }
}
#endif

#ifdef FATHOM_HAS_BENCH
TEST_F(Settings, CampaignsRunTheSame) {
  const Outcome outcome =
      fathom({"bench", "campaign", "--full", "--only", "drift-100-", "--steps", "20", "--out", path("c"), "--quiet"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto campaign = nlohmann::json::parse(read_text(path("c") + "/campaign.json"));
  EXPECT_GE(campaign.at("runs").size(), 3u);
  for (const auto& run : campaign.at("runs")) {
    const std::string simulator = run.at("simulator"), set = run.at("set"), found = run.at("state_hash");
    Words words{"run", "drift", "--bodies", "100", "--steps", "20", "--threads", "1", "--simulator", simulator};
    const std::string device = run.at("device");
    if (!device.empty()) words = words + Words{"--device", device};
    EXPECT_THAT(hash(words + Words{"--preset", set}), HasSubstr(found)) << run.at("key");
  }
}
#endif

TEST_F(Settings, ShippedScenesAreTheSameInRunAndPlay) {
  for (const char* name : {"impulse", "solver", "sleep", "kicks"}) {
    const std::string file = FATHOM_SOURCE_DIR "/examples/scenes/" + std::string(name) + ".toml";
    EXPECT_EQ(hash({"play", file, "--steps", "40"}), hash({"run", file, "--steps", "40"})) << name;
  }
}

TEST_F(Settings, ARecordedRunIsTheSameRun) {
  for (const Words& words :
       {Words{"washer", "--bodies", "60"}, {"heap", "--seed", "26"}, {"drift", "--bodies", "40"}}) {
    const Words run = Words{"run"} + words + Words{"--steps", "64"};
    const std::string expected = hash(run);
    EXPECT_EQ(hash(run + Words{"--record", path("run.fathom")}), expected) << words[0];
    EXPECT_EQ(hash({"replay", path("run.fathom")}), expected) << words[0];
    for (const char* mode : {"lockstep", "ahead", "async"})
      EXPECT_EQ(hash(Words{"play"} + words + Words{"--steps", "64", "--set", std::string("simulator.mode=") + mode}),
                expected)
          << words[0] << ", " << mode;
  }
}

TEST_F(Settings, ASavedConfigurationIsTheSameRun) {
  const Words run{"run", "drift", "--bodies", "60", "--steps", "40"};
  for (const Words& sets : {Words{},
                            {"--set", "simulator.preset=dissertation"},
                            {"--set", "simulator.gravity=[0, 0, -1]"},
                            {"--preset", "dissertation", "--solver", "soft"}}) {
    ASSERT_EQ(fathom(Words{"config", "--write", path("saved.toml")} + sets).exit_code, 0);
    EXPECT_EQ(hash(run + Words{"--config", path("saved.toml")}), hash(run + sets)) << testing::PrintToString(sets);
    std::ofstream(path("printed.toml")) << fathom(Words{"config"} + sets).out;
    EXPECT_EQ(hash(run + Words{"--config", path("printed.toml")}), hash(run + sets)) << "redirected";
  }
}

struct Refused {
  Words words;
  const char* says;
};

TEST_F(Settings, NamesOfDevicesAreCheckedInEveryCommand) {
  const Words size{"--bodies", "20", "--steps", "3"};
  ASSERT_EQ(fathom(Words{"run", "drift", "--record", path("run.fathom"), "--quiet"} + size).exit_code, 0);
  const Refused refused[] = {
      {Words{"run", "drift", "--device", "nosuch"} + size, "--device: no device is called 'nosuch'"},
      {Words{"run", "drift", "--set", "simulator.device=nosuch"} + size, "--set: no device is called 'nosuch'"},
      {Words{"play", "drift", "--device", "nosuch"} + size, "no device is called 'nosuch'"},
      {{"config", "drift", "--device", "nosuch"}, "no device is called 'nosuch'"},
      {{"validate", "--short", "--only", "free-fall", "--device", "nosuch"}, "no device is called 'nosuch'"},
      {{"replay", path("run.fathom"), "--device", "nosuch"}, "no device is called 'nosuch'"},
      {Words{"run", "drift", "--device", "cuda:99"} + size, "device 'cuda:99' is not available"},
      {Words{"play", "drift", "--device", "cuda:99"} + size, "device 'cuda:99' is not available"},
      {{"validate", "--short", "--only", "free-fall", "--device", "cuda:99"}, "device 'cuda:99' is not available"},
      {Words{"run", "drift", "--simulator", "native", "--device", "host"} + size, "remove it or --simulator native"},
      {{"validate", "--only", "free-fall", "--simulator", "native", "--device", "host"}, "remove it or --simulator"},
      {{"validate", "--only", "free-fall", "--simulator", "quantum"}, "must be device|hybrid|native, not quantum"},
  };
  for (const Refused& line : refused) {
    const Outcome outcome = fathom(line.words);
    EXPECT_EQ(outcome.exit_code, 2) << testing::PrintToString(line.words) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr(line.says)) << testing::PrintToString(line.words);
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST_F(Settings, ValidateRunsOnWhatItIsAskedToRunOn) {
  const auto simulator = [&](const Words& words) {
    const Outcome outcome =
        fathom(Words{"validate", "--short", "--only", "free-fall", "--quiet", "--json", path("v.json")} + words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto report = nlohmann::json::parse(read_text(path("v.json")));
    EXPECT_GE(report.at("threads").get<int>(), 1) << "as many as there were, also where nobody said how many";
    return report.at("simulator").get<std::string>();
  };
  EXPECT_THAT(simulator({}), HasSubstr("native"));
  EXPECT_THAT(simulator({"--device", "host"}), HasSubstr("device"));
  EXPECT_THAT(simulator({"--simulator", "hybrid", "--device", "host"}), HasSubstr("hybrid"));
}

TEST_F(Settings, AConfigurationsDeviceThatIsNotThereFallsBackInEveryCommand) {
  const Words size{"--bodies", "20", "--steps", "30"}, missing{"--set", "simulator.device=cuda:99"};
  const std::string native = hash(Words{"run", "layers"} + size);
  for (const char* command : {"run", "play"}) {
    const Outcome outcome = fathom(Words{command, "layers"} + size + missing);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr(native)) << command;
    EXPECT_THAT(outcome.err, HasSubstr("the native simulator takes its place")) << command;
    const Outcome refused =
        fathom(Words{command, "layers"} + size + missing + Words{"--set", "simulator.fallback=false"});
    EXPECT_EQ(refused.exit_code, 2) << command;
  }
}

}  // namespace
}  // namespace fathom::cli_settings_test
