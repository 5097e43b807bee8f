// The program from outside: its output, its files and its exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"
#include "trace_reader.hpp"

namespace fathom::cli_test {
namespace {

using nlohmann::json;
using test::operator+;
using test::Outcome;
using test::Program;
using test::read_text;
using testing::HasSubstr;
namespace fs = std::filesystem;

TEST_F(Program, DevicesSayWhatTheyAreOrWhyNot) {
  const Outcome outcome = fathom({"devices"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* backend : {"\nhost ", "\ncuda", "\nsycl"}) EXPECT_THAT(outcome.out, HasSubstr(backend));
  EXPECT_THAT(outcome.out, HasSubstr("iB "));
}

TEST_F(Program, VersionSaysWhatAReportOfAnErrorNeeds) {
  const Outcome outcome = fathom({"--version"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, testing::MatchesRegex("fathom [0-9]+[.][0-9]+[.][0-9]+ [(].*[)]\n(.|\n)*"));
  for (const char* word : {"build ", "checks: ", "SIMD ", "back ends  host", "parts      run"})
    EXPECT_THAT(outcome.out, HasSubstr(word));
}

TEST_F(Program, ABugReportHasAllThatRepeatsTheRun) {
  const std::string scene = FATHOM_SOURCE_DIR "/examples/scenes/masses.toml";
  const Outcome outcome = fathom({"bug-report", scene, "--steps", "20", "-o", path("report")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string text = read_text(path("report/report.txt"));
  for (const char* word : {"fathom 0.", "SIMD", "processor", "device     host", "bug-report", "state hash"})
    EXPECT_THAT(text, HasSubstr(word));
  EXPECT_EQ(read_text(path("report/masses.toml")), read_text(scene));
  EXPECT_THAT(read_text(path("report/config.toml")), HasSubstr("[simulator]"));
  const std::string hash = json::parse(read_text(path("report/run.json"))).at("state_hash");
  EXPECT_THAT(fathom({"replay", path("report/run.fathom")}).out, HasSubstr(hash));

  const Outcome again = fathom({"bug-report", "-o", path("report")});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("report: exists already; give another name with -o"));
}

TEST_F(Program, ABugReportHasTheSceneThatIsRefusedButNoMistakeOfTheCommandLine) {
  const std::pair<std::vector<std::string>, const char*> mistakes[] = {
      {{"nowhere.toml"}, "nowhere.toml: no such file; give the path of a scene"},
      {{"nowhere"}, "there is no environment 'nowhere'"},
      {{"drift", "--config", "/nowhere/e.toml"}, "/nowhere/e.toml: cannot be read"},
      {{"drift", "--seconds", "1e-9"}, "--seconds comes to less than one step"},
      {{"drift", "--simulator", "native", "--device", "host"}, "remove it or --simulator native"},
      {{"--simulator", "native", "--device", "host"}, "remove it or --simulator native"},
      {{"--bodies", "3"}, "--bodies, --layers and --seed are those of an environment"},
  };
  for (const auto& [words, says] : mistakes) {
    const Outcome outcome = fathom(test::Words{"bug-report", "-o", path("report")} + words);
    EXPECT_EQ(outcome.exit_code, 2) << says;
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(path("report"))) << says;
  }
  // What is refused may be right.
  std::ofstream(path("s.toml")) << "[[body]]\nshap = 3\n";
  const Outcome refused = fathom({"bug-report", path("s.toml"), "-o", path("report"), "--quiet"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("s.toml:2:1: unknown key 'shap'"));
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  EXPECT_THAT(read_text(path("report/report.txt")), HasSubstr("The scene was refused:\n" + path("s.toml") + ":2:1:"));
  EXPECT_EQ(read_text(path("report/s.toml")), "[[body]]\nshap = 3\n");
}

TEST_F(Program, ListsEnvironments) {
  const Outcome outcome = fathom({"list"});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* word : {"drift", "layers", "spread", "pyramid", "native", "sweep", "impulse"}) {
    EXPECT_THAT(outcome.out, HasSubstr(word));
  }
  EXPECT_EQ(outcome.err, "");
}

TEST_F(Program, HelpNamesEveryOption) {
  const Outcome outcome = fathom({"run", "--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* word : {"--bodies", "--layers", "--simulator", "--threads", "--steps", "--seconds", "--dt",
                           "--substeps", "--broad-phase", "--solver", "--sleep", "--json", "--csv", "--record",
                           "--trace", "--config", "--set", "--quiet", "Examples"}) {
    EXPECT_THAT(outcome.out, HasSubstr(word));
  }
}

TEST_F(Program, JsonHasThePublishedKeys) {
  const json r = result_of({"pyramid", "--layers", "5", "--steps", "20", "--threads", "1"});
  EXPECT_EQ(r.at("environment"), "pyramid");
  EXPECT_EQ(r.at("bodies"), 55);
  EXPECT_EQ(r.at("simulator"), "native");
  EXPECT_FALSE(r.at("device").get<std::string>().empty());
  EXPECT_EQ(r.at("threads"), 1);
  EXPECT_NEAR(r.at("dt").get<double>(), 1.0 / 60, 1e-7);
  EXPECT_EQ(r.at("substeps"), 4);
  EXPECT_EQ(r.at("steps"), 20);
  std::vector<json> times{r.at("step_ms")};
  for (const char* stage : {"broad_phase", "narrow_phase", "collision_resolution"}) {
    times.push_back(r.at("stages_ms").at(stage));
  }
  for (const json& time : times) {
    EXPECT_GE(time.at("mean").get<double>(), 0);
    EXPECT_LE(time.at("median").get<double>(), time.at("p99").get<double>());
    EXPECT_LE(time.at("p99").get<double>(), time.at("max").get<double>());
  }
  EXPECT_GT(r.at("counts").at("pairs").get<int>(), 0);
  EXPECT_GT(r.at("counts").at("manifolds").get<int>(), 0);
  EXPECT_GT(r.at("counts").at("points").get<int>(), 0);
  for (const char* key : {"ground_penetration_max", "displacement_max", "top_drop", "kinetic_energy_per_body",
                          "bodies_below_ground", "overlap_max", "escaped", "non_finite"}) {
    EXPECT_TRUE(r.at("quality").at(key).is_number()) << key;
  }
  EXPECT_THAT(r.at("state_hash").get<std::string>(), testing::MatchesRegex("[0-9a-f]{16}"));
}

TEST_F(Program, OptionsReachTheWorld) {
  const json r = result_of({"spread", "--bodies", "10", "--seconds", "0.5", "--dt", "0.01", "--substeps", "2",
                            "--threads", "2", "--broad-phase", "sweep", "--solver", "impulse", "--sleep", "on"});
  EXPECT_EQ(r.at("bodies"), 9);
  EXPECT_EQ(r.at("steps"), 50);
  EXPECT_NEAR(r.at("dt").get<double>(), 0.01, 1e-9);
  EXPECT_EQ(r.at("substeps"), 2);
  EXPECT_EQ(r.at("threads"), 2);
  EXPECT_EQ(r.at("broad_phase"), "sweep");
  EXPECT_EQ(r.at("solver"), "impulse");
  EXPECT_EQ(r.at("sleep"), true);
}

TEST_F(Program, HashIsTheSameTwiceAndForAnyThreadCount) {
  const std::vector<std::string> run{"drift", "--bodies", "300", "--steps", "60"};
  const auto hash = [&](const char* threads) {
    std::vector<std::string> arguments = run;
    arguments.insert(arguments.end(), {"--threads", threads});
    return result_of(arguments).at("state_hash");
  };
  const json first = hash("1");
  EXPECT_EQ(hash("1"), first);
  EXPECT_EQ(hash("2"), first);
  EXPECT_EQ(hash("5"), first);
}

TEST_F(Program, CsvHasARowAStep) {
  const Outcome outcome = fathom({"run", "layers", "--bodies", "20", "--steps", "15", "--csv", path("steps.csv")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream rows(read_text(path("steps.csv")));
  std::string head, row;
  std::getline(rows, head);
  EXPECT_THAT(head, testing::StartsWith("step,step_ms,find_pairs_ms,update_manifolds_ms,"));
  const auto columns = std::count(head.begin(), head.end(), ',');
  int step = 0;
  while (std::getline(rows, row)) {
    EXPECT_THAT(row, testing::StartsWith(std::to_string(++step) + ","));
    EXPECT_EQ(std::count(row.begin(), row.end(), ','), columns);
  }
  EXPECT_EQ(step, 15);
  EXPECT_THAT(outcome.out, HasSubstr("collision resolution"));
}

TEST_F(Program, RunsASceneFile) {
  const json r = result_of({FATHOM_SOURCE_DIR "/examples/scenes/shapes.toml", "--steps", "10"});
  EXPECT_EQ(r.at("environment"), "shapes");
  EXPECT_EQ(r.at("steps"), 10);
}

TEST_F(Program, ScenesWithJointsOrSurfacesRunAreRecordedAndPlayed) {
  for (const char* name : {"joints", "mechanisms", "surfaces"}) {
    const std::string scene = FATHOM_SOURCE_DIR "/examples/scenes/" + std::string(name) + ".toml";
    const std::string hash = result_of({scene, "--steps", "90"}).at("state_hash");
    ASSERT_EQ(fathom({"run", scene, "--steps", "90", "--quiet", "--record", path("run.fathom")}).exit_code, 0);
    for (const std::vector<std::string>& again :
         {std::vector<std::string>{"replay", path("run.fathom"), "--threads", "1"}, {"play", scene, "--steps", "90"}}) {
      const Outcome outcome = fathom(again);
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_THAT(outcome.out, HasSubstr(hash)) << name << ": " << again[0];
    }
  }
  const Outcome refused =
      fathom({"run", FATHOM_SOURCE_DIR "/examples/scenes/joints.toml", "--partition", "cells", "--steps", "1"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("joints: joint 0 between body 1 ('crane') and body 2 ('link.0')"));
}

TEST_F(Program, TableReadsItsOwnResults) {
  ASSERT_EQ(
      fathom({"run", "drift", "--bodies", "10", "--steps", "5", "--quiet", "--json", path("drift.json")}).exit_code, 0);
  const Outcome outcome = fathom({"table", path("drift.json")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("mean ms"));
  EXPECT_THAT(outcome.out, HasSubstr("drift"));
}

TEST_F(Program, QuietSaysNothing) {
  const Outcome outcome = fathom({"run", "drift", "--bodies", "10", "--steps", "5", "--quiet"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "");
  const std::vector<std::string> play{
      "play", "drift", "--bodies", "10", "--steps", "5", "--quiet", "--set", "record.file=" + path("r")};
  const Outcome played = fathom(play);
  EXPECT_EQ(played.exit_code, 0);
  EXPECT_EQ(played.out, "");
  EXPECT_EQ(played.err, "");
  std::vector<std::string> told = play;
  told.insert(told.end(), {"--set", "log.level=info"});
  EXPECT_THAT(fathom(told).err, HasSubstr("recorded 5 steps")) << "a level that was asked for";
}

TEST_F(Program, JsonOnStdoutIsAlone) {
  const Outcome outcome = fathom({"run", "drift", "--bodies", "10", "--steps", "5", "--json", "-"});
  EXPECT_TRUE(json::accept(outcome.out)) << outcome.out;
  EXPECT_THAT(outcome.err, HasSubstr("state hash"));
}

struct BadLine {
  std::vector<std::string> arguments;
  std::string says;
};

TEST_F(Program, PresetsAndSimulatorsAreNamedInTheReport) {
  const std::vector<std::string> run = {"run", "pyramid", "--layers", "3", "--steps", "5", "--quiet", "--json", "-"};
  const auto report = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = run;
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = fathom(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out);
  };
  const auto published = report({"--preset", "dissertation", "--device", "host"});
  EXPECT_EQ(published.at("simulator"), "device");
  EXPECT_EQ(published.at("broad_phase"), "sweep");
  EXPECT_EQ(published.at("partition"), "cells");
  EXPECT_EQ(published.at("solver"), "impulse");
  EXPECT_EQ(published.at("warm_start"), false);
  EXPECT_EQ(published.at("ahead"), 2);
  EXPECT_EQ(published.at("counts").at("unbatched"), 0);
  EXPECT_EQ(report({"--preset", "dissertation", "--warm-start", "on", "--device", "host"}).at("warm_start"), true);
  const auto hybrid = report({"--simulator", "hybrid", "--device", "host"});
  EXPECT_EQ(hybrid.at("simulator"), "hybrid");
  EXPECT_EQ(hybrid.at("partition"), "colours");
}

TEST_F(Program, BadCommandLinesAreOneLineAndExitCode2) {
  const BadLine lines[] = {
      {{}, "'fathom' needs a subcommand (list, devices, run,"},
      {{"rum"}, "did you mean run?"},
      {{"run"}, "'scene' is missing; write 'fathom run ENVIRONMENT|SCENE.toml'; see 'fathom run --help'"},
      {{"run", "pyramids"},
       "there is no environment 'pyramids' (a scene file's name ends in .toml); did you mean 'pyramid'?"},
      {{"run", "nowhere.toml"}, "nowhere.toml: no such file"},
      {{"run", "drift", "--bodys", "3"}, "'fathom run' has no option --bodys; did you mean --bodies?"},
      {{"run", "drift", "--only", "x"}, "'fathom run' has no option --only; see 'fathom run --help'"},
      {{"run", "drift", "--bogus"}, "'fathom run' has no option --bogus; see 'fathom run --help'"},
      {{"run", "drift", "--no-sleep"}, "'fathom run' has no option --no-sleep; did you mean --sleep?"},
      {{"run", "drift", "--bodys=3"}, "'fathom run' has no option --bodys; did you mean --bodies?"},
      {{"run", "--bodys", "3", "drift"}, "'fathom run' has no option --bodys; did you mean --bodies?"},
      {{"run", "drift", "--zzz"}, "'fathom run' has no option --zzz; see 'fathom run --help'"},
      {{"run", "drift", "layers"}, "'layers' is one word too many; see 'fathom run --help'"},
      {{"run", "--", "drift", "layers"}, "'layers' is one word too many; see 'fathom run --help'"},
      {{"run", "drift", "—bodies", "3"}, "'—bodies' begins with a dash; write two hyphens: --bodies"},
      {{"run", "drift", "--threads", "1", "--threads", "2"}, "--threads is given twice (1, 2); keep one of them"},
      {{"run", "drift", "--dt", "0.1", "--dt", "0.2", "--dt", "0.3"},
       "--dt is given 3 times (0.1, 0.2, 0.3); keep one of them"},
      {{"run", "drift", "--solver", "soft", "--solver", "impulse"},
       "--solver is given twice (soft, impulse); keep one of them"},
      {{"bug-report", "-o", "a", "-o", "b"}, "--output is given twice (a, b); keep one of them"},
      {{"run", "drift", "--json"}, "--json: the value is missing; write --json FILE"},
      {{"run", "drift", "--set"}, "--set: the value is missing; write --set KEY=VALUE"},
      {{"run", "drift", "--quiet=abc"}, "--quiet takes no value; leave '=abc' out"},
      {{""}, "'fathom' has no subcommand ''; see 'fathom --help'"},
      {{"run", "DRIFT"}, "did you mean 'drift'?"},
      {{"run", "two\nlines"}, "there is no environment 'two\\nlines'"},
      {{"--quiet", "run", "drift"}, "'fathom' has no option --quiet"},
      {{"zzz"}, "'fathom' has no subcommand zzz; see 'fathom --help'"},
      {{"rum", "drift", "--bodies", "3"}, "'fathom' has no subcommand rum; did you mean run?"},
      {{"play", "drift", "--step", "3"}, "'fathom play' has no option --step; did you mean --steps?"},
      {{"validate", "--onyl", "x"}, "'fathom validate' has no option --onyl; did you mean --only?"},
      {{"config", "--sett", "x"}, "'fathom config' has no option --sett; did you mean --set?"},
      {{"table"}, "'files' is missing; write 'fathom table FILE'; see 'fathom table --help'"},
      {{"replay"}, "see 'fathom replay --help'"},
      {{"replay", "x", "--threads", "5000"}, "must be a whole number from 0 to 1024, not 5000"},
      {{"run", "drift", "--threads", "5000"}, "must be a whole number from 0 to 1024, not 5000"},
      {{"run", "drift", "--threads", "99999999999999999999"}, "from 0 to 1024, not 99999999999999999999"},
      {{"run", "drift", "--marking-rounds", "999"}, "must be a whole number from 1 to 255, not 999"},
      {{"run", "drift", "--substeps", "1001"}, "must be a whole number from 1 to 1000, not 1001"},
      {{"run", "drift", "--simulator", "native", "--device", "host"},
       "--device applies to the simulators device and hybrid only; remove it or --simulator native"},
      {{"run", "drift", "--simulator", "native", "--set", "simulator.device=host"},
       "--set simulator.device applies to the simulators device and hybrid only; remove it or --simulator native"},
      {{"run", "drift", "--set", "simulator.kind=native", "--device", "host"},
       "--device applies to the simulators device and hybrid only; remove it or --set simulator.kind=native"},
#ifdef FATHOM_HAS_RENDER
      {{"render"}, "see 'fathom render --help'"},
      {{"render", "drift", "--vidio", "x"}, "'fathom render' has no option --vidio; did you mean --video?"},
      {{"render", "drift"}, "nothing to draw; ask for pictures (--at 0,5,10s)"},
      {{"render", "drift", "--web", "p.html", "-o", "shots"}, "-o is where pictures go; say of which times"},
      {{"render", "drift", "--at", "0", "--seconds", "3"}, "--seconds is the length of a film or page; add --video"},
      {{"render", "drift", "--at", "0", "--fps", "3"}, "--fps is that of a film or page; add --video"},
      {{"render", "drift", "--web", "p.html", "--contacts"}, "leave --contacts and --joints out, or add --at"},
      {{"render", "drift", "--web", "p.html", "--size", "64x64"}, "leave --size and --samples out, or add --at"},
      {{"render", "drift", "--web", "p.html", "--samples", "2"}, "leave --size and --samples out, or add --at"},
      {{"render", "drift", "--web", "p.html", "--gpu", "best"}, "best"},
      {{"render", "drift", "--at", "0,,1"}, "--at must be times like 0,5,10s"},
      {{"render", "drift", "--at", "nan"}, "--at must be times like 0,5,10s"},
      {{"render", "drift", "--at", "1,"}, "--at must be times like 0,5,10s"},
      {{"render", "drift", "--at", "0", "-o", "a.jpg"},
       "-o: pictures are PNG; let its name end in .png, or give a folder"},
      {{"render", "drift", "--web", "p.html", "--seconds", "1e9"},
       "--seconds: must be a finite number greater than 0 and at most 1000000, not 1e9"},
      {{"render", "drift", "--at", ""}, "--at: is empty; give it a value, or leave it out"},
#endif
#ifdef FATHOM_HAS_VIEWER
      {{"view", "drift", "--pausd"}, "'fathom view' has no option --pausd; did you mean --paused?"},
      {{"view", "drift", "--frames", "1", "--screenshot", "a.jpg"},
       "--screenshot: must be a name that ends in .png, not a.jpg"},
      {{"view", "drift", "--screenshot", "a.png"}, "--screenshot requires --frames; see 'fathom view --help'"},
#endif
#ifdef FATHOM_HAS_BENCH
      {{"bench"}, "'fathom bench' needs a subcommand (campaign, peers, compare, report); see 'fathom bench --help'"},
      {{"bench", "compare", "a.json"},
       "'after' is missing; write 'fathom bench compare A.json B.json'; see 'fathom bench compare --help'"},
      {{"bench", "campaign", "--quick", "--full"}, "--quick and --full exclude each other; give one of them"},
      {{"bench", "campain"}, "'fathom bench' has no subcommand campain; did you mean campaign?"},
      {{"bench", "campaign", "--rouds", "3"}, "'fathom bench campaign' has no option --rouds; did you mean --rounds?"},
      {{"bench", "peers", "--limit", "nan"}, "--limit must be a number of seconds from 0 to 1e9, not nan"},
      {{"bench", "peers", "--bogus"}, "'fathom bench peers' has no option --bogus; see 'fathom bench peers --help'"},
      {{"bench", "peers", "--threads", "0"}, "--threads: must be a whole number from 1 to 1024, not 0"},
      {{"bench", "compare", "/tmp", "/tmp"}, "/tmp: cannot be read (Is a directory); give files of"},
      {{"bench", "report"}, "see 'fathom bench report --help'"},
      {{"bench", "campaign", "--out", ""}, "--out: is empty; give it a value, or leave it out"},
      {{"bench", "peers", "--out", ""}, "--out: is empty; give it a value, or leave it out"},
#endif
      {{"run", "drift", "--bodies", "0"}, "--bodies: must be a whole number from 1, not 0"},
      {{"run", "drift", "--bodies", "-3"}, "--bodies: must be a whole number from 1, not -3"},
      {{"run", "drift", "--bodies", "1000000000"}, "a world holds at most 16777216"},
      {{"run", "drift", "--bodies", "many"},
       "--bodies: must be a whole number from 1, not many; see 'fathom run --help'"},
      {{"run", "drift", "--bodies", "nan"}, "--bodies: must be a whole number from 1, not nan"},
      {{"run", "pyramid", "--layers", "1e3"}, "--layers: must be a whole number from 1, not 1e3"},
      {{"config", "--bodies", "10"}, "--bodies, --layers and --seed are those of an environment; name one"},
      {{"run", ""}, "scene: is empty; give it a value, or leave it out"},
      {{"run", "drift", "--bodies", ""}, "--bodies: is empty; give it a value, or leave it out"},
      {{"run", "drift", "--bodies="}, "--bodies"},
      {{"run", "drift", "--json", ""}, "--json: is empty; give it a value, or leave it out"},
      {{"run", "drift", "--config", ""}, "--config: is empty; give it a value, or leave it out"},
      {{"play", "drift", "--set", ""}, "--set: is empty; give it a value, or leave it out"},
      {{"validate", "--only", ""}, "--only: is empty; give it a value, or leave it out"},
      {{"replay", ""}, "file: is empty; give it a value, or leave it out"},
      {{"table", ""}, "files: is empty; give it a value, or leave it out"},
      {{"run", "drift", "--layers", "3"}, "drift has no layers; give its size with --bodies"},
      {{"run", "pyramid", "--layers", "0"}, "--layers: must be a whole number from 1, not 0"},
      {{"run", "pyramid", "--layers", "3", "--bodies", "3"},
       "--bodies and --layers exclude each other; give one of them"},
      // CLI11 would read 8 and 16.
      {{"run", "drift", "--bodies", "010"}, "--bodies: must be a whole number from 1, not 010"},
      {{"run", "drift", "--threads", "0x10"}, "--threads: must be a whole number from 0 to 1024, not 0x10"},
      {{"run", "pyramid", "--layers", "1000000"}, "a world holds at most"},
      {{"run", "heap", "--seed", "-1"}, "must be a whole number from 0, not -1"},
      {{"run", "heap", "--seed", "one"}, "must be a whole number from 0, not one"},
      {{"run", "heap", "--bodies", "10"}, "leave --bodies and --layers out and try another --seed"},
      {{"run", "drift", "--seed", "3"}, "--seed says which heap it is; 'drift' has none"},
      {{"run", "heaps"}, "did you mean 'heap'?"},
      {{"validate", "--only", "heaps", "--seeds", "0"}, "must be a whole number from 1 to 1000000000, not 0"},
      {{"validate", "--only", "heaps", "--first", "x"}, "must be a whole number from 0, not x"},
      {{"validate", "--only", "free-fall", "--seeds", "3"}, "add --only heaps"},
      {{"run", "drift", "--steps", "0"}, "must be a whole number from 1 to 1000000000, not 0"},
      {{"run", "drift", "--steps", "3", "--seconds", "3"},
       "--steps and --seconds exclude each other; give one of them"},
      {{"run", "drift", "--seconds", "nan"}, "must be a finite number greater than 0, not nan"},
      {{"run", "drift", "--seconds", "1e-9"}, "--seconds comes to less than one step"},
      {{"run", "drift", "--dt", "-1"}, "--dt: must be a number from 1e-06 to 1 s, not -1; see 'fathom run --help'"},
      {{"run", "drift", "--dt", "inf"}, "--dt: must be a number from 1e-06 to 1 s, not inf"},
      {{"run", "drift", "--dt", "nan"}, "--dt: must be a number from 1e-06 to 1 s, not nan"},
      {{"run", "drift", "--dt", "10"}, "--dt: must be a number from 1e-06 to 1 s, not 10"},
      {{"run", "drift", "--dt", "1e-300"}, "--dt: must be a number from 1e-06 to 1 s, not 1e-300"},
      {{"run", "drift", "--dt", "1/60"}, "--dt: must be a number from 1e-06 to 1 s, not 1/60"},
      {{"config", "--dt", "10"}, "--dt: must be a number from 1e-06 to 1 s, not 10"},
      {{"bug-report", "drift", "--dt", "10"}, "--dt: must be a number from 1e-06 to 1 s, not 10"},
      {{"run", "drift", "--substeps", "0"}, "must be a whole number from 1 to 1000, not 0"},
      {{"run", "drift", "--threads", "-1"}, "must be a whole number from 0 to 1024, not -1"},
      {{"run", "drift", "--broad-phase", "grid"}, "must be sweep|tree, not grid"},
      {{"run", "drift", "--solver", "pgs"}, "must be impulse|soft, not pgs"},
      {{"run", "drift", "--sleep", "maybe"}, "must be off|on, not maybe"},
      {{"run", "drift", "--simulator", "gpu"}, "must be device|hybrid|native, not gpu"},
      {{"run", "drift", "--preset", "best"}, "must be dissertation|fathom, not best"},
      {{"run", "drift", "--partition", "rows"}, "must be cells|colours, not rows"},
      {{"run", "drift", "--broad-phase", "sweep", "--sweep-axis", "0,-1,0"},
       "--sweep-axis: must be three finite numbers of at least 0, not all 0, e.g. 3,2,1, not -1"},
      {{"run", "drift", "--broad-phase", "sweep", "--sweep-axis", "0,0,0"},
       "--sweep-axis: must be three finite numbers of at least 0, not all 0, e.g. 3,2,1"},
      {{"config", "--sweep-axis", "a,b,c"}, "--sweep-axis: must be three finite numbers of at least 0"},
      {{"config", "--sweep-axis", "1,2"}, "--sweep-axis takes 3 values, X,Y,Z, not 2"},
      {{"config", "--sweep-axis", "1,2,3,4"}, "--sweep-axis takes 3 values, X,Y,Z, not 4"},
      {{"run", "drift", "--sweep-axis", "0,1,0"}, "add --broad-phase sweep"},
      {{"run", "drift", "--marking-rounds", "8"}, "add --partition cells and --device"},
      {{"run", "drift", "--iterations", "8"}, "add --solver impulse"},
      {{"run", "drift", "--simulator", "hybrid", "--ahead", "2"}, "add --simulator device"},
      {{"run", "drift", "--json", "/nowhere/x.json"}, "/nowhere/x.json: cannot be written"},
      {{"run", "drift", "--json", "-", "--csv", "-"}, "cannot both go to stdout"},
      {{"run", FATHOM_SOURCE_DIR "/examples/scenes/shapes.toml", "--bodies", "3"}, "a scene file says itself"},
      {{"table", "/nowhere/x.json"}, "/nowhere/x.json: cannot be read"},
      {{"replay", "/nowhere/run.fathom"}, "/nowhere/run.fathom: no such file, or it is empty; give the path of what"},
      {{"replay", FATHOM_SOURCE_DIR "/README.md"},
       "README.md: this is not a recording of fathom; give the path of what 'fathom run --record FILE'"},
      {{"config", "--set", "simulator.treads=2"}, "did you mean 'simulator.threads'?"},
      {{"run", "drift", "--set", "world.dt=0.01"}, "unknown key 'world.dt'; did you mean 'simulator.dt'?"},
      {{"run", "drift", "--set", "world.dt", "0.01"},
       "--set: must be KEY=VALUE, e.g. simulator.threads=4, not world.dt; see 'fathom run --help'"},
      {{"run", "drift", "--bodies", "10", "--set", "simulator.max_bodies=5"},
       "drift has 10 bodies with what stands still, but simulator.max_bodies is 5 (--set); raise it"},
      {{"config", "--config", "/nowhere/e.toml"}, "/nowhere/e.toml: cannot be read"},
      {{"run", "drift", "--config", "/tmp"}, "/tmp: cannot be read (Is a directory); 'fathom config --write FILE'"},
      {{"table", "/tmp"}, "/tmp: cannot be read (Is a directory)"},
      {{"run", "/tmp"}, "/tmp: is a folder"},
      {{"replay", "/tmp"}, "/tmp: is a folder; give the path of what 'fathom run --record FILE'"},
      {{"run", "drift", "--set", "simulator.threads=x"}, "'simulator.threads' must be a whole number"},
      {{"run", "drift", "--record", "/nowhere/run.fathom"}, "/nowhere/run.fathom: cannot be written"},
      {{"run", "drift", "--trace", "/nowhere/t.json"}, "/nowhere/t.json: cannot be written"},
  };
  for (const BadLine& line : lines) {
    const Outcome outcome = fathom(line.arguments);
    EXPECT_EQ(outcome.exit_code, 2) << line.says;
    EXPECT_EQ(outcome.out, "") << line.says;
    EXPECT_THAT(outcome.err, HasSubstr(line.says));
    EXPECT_THAT(outcome.err, testing::StartsWith("fathom: "));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST_F(Program, RecordingsAreNoScenes) {
  ASSERT_EQ(fathom({"run", "drift", "--bodies", "5", "--steps", "3", "--record", path("r.fathom")}).exit_code, 0);
  for (const char* command : {"run", "play", "config", "bug-report"}) {
    const Outcome outcome = fathom({command, path("r.fathom")});
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_EQ(outcome.err, "fathom: " + path("r.fathom") +
                               ": is a recording, not a scene; 'fathom replay' repeats it, 'fathom render' draws it\n");
  }
}

TEST_F(Program, ScenesComeThroughPipes) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  const pid_t child = start({"run", path("pipe"), "--steps", "1", "--quiet"});
  std::ofstream(path("pipe")) << "[[body]]\nshape = {type = 'sphere', radius = 1}\n";
  const Outcome outcome = finish(child);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(Program, SizesThatAreRoundedSayWhatTheyCameTo) {
  const std::pair<std::vector<std::string>, const char*> heads[] = {
      {{"run", "pyramid", "--bodies", "10"}, "pyramid: 5 bodies (--bodies 10 is rounded to 5), 1 step of"},
      {{"run", "pyramid", "--bodies", "14"}, "pyramid: 14 bodies, 1 step of"},
      {{"run", "pyramid", "--layers", "3"}, "pyramid: 14 bodies, 1 step of"},
      {{"run", "spread", "--bodies", "250"}, "spread: 225 bodies (--bodies 250 is rounded to 225), 1 step of"},
      {{"run", "many_pyramids", "--bodies", "7"}, "many_pyramids: 55 bodies (--bodies 7 is rounded to 55), 1 step of"},
      {{"run", "large_world", "--bodies", "10"}, "large_world: 100 bodies (--bodies 10 is rounded to 9), 1 step of"},
      {{"run", "layers", "--bodies", "7"}, "layers: 7 bodies, 1 step of"},
      {{"play", "pyramid", "--bodies", "10"}, "pyramid (--bodies 10 is rounded to 5): "},
  };
  for (const auto& [words, head] : heads) {
    const Outcome outcome = fathom(test::Words(words) + test::Words{"--steps", "1"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, testing::StartsWith(head));
  }
}

TEST_F(Program, FaultyScenesAreRefusedWithTheirPlaceAndARemedy) {
  const std::string body = "[[body]]\nshape = {type = 'box', half_extents = [1, 1, 1]}\n";
  const std::pair<std::string, std::string> scenes[] = {
      {body + "inertia = [1, 1, 10]", "s.toml:3:11: the inertia's principal moments are (1, 1, 10) kg·m²; none may be"},
      {"[[body]]\nshape = {type = 'box', half_extents = [1, 1, 1e-30]}",
       "s.toml:2:9: shape: fathom::box: the smallest"},
      {body + "motion = 'fixed'\nvelocity = [1, 0, 0]", "s.toml:4:12: a static body has no 'velocity'; remove it, or"},
      {body + "rotation = [0, 0, 0, 0]", "s.toml:3:12: 'rotation' is all 0; write [1, 0, 0, 0]"},
      {body + "rotation = [nan, 0, 0, 0]", "s.toml:3:13: 'rotation' must be finite"},
      {body + "position = [inf, 0, 0]", "s.toml:3:13: 'position' must be finite"},
      {"[[body]]\nshape = {type = 'mesh'}", "s.toml:2:9: shape needs 'vertices': lists [x, y, z] of 'vertices' (m)"},
      {"[[body]]\nshape = {type = 'trimesh'}", "there is no shape of type 'trimesh'; take \"mesh\""},
      {"[world]\ndt = -1\n" + body, "s.toml:2:6: 'dt' must be between 1e-6 and 1 s, not -1; typically 1/60"},
      {"[world]\ndt = nan\n" + body, "s.toml:2:6: 'dt' must be between 1e-6 and 1 s, not nan; typically 1/60"},
      {"[world]\ndt = tru\n" + body, "s.toml:2:6: 'tru' is not a value; write a number, true, false, or a text in"},
      {body + "motion = 'static'\nbullet = true",
       "s.toml:4:10: a static body cannot be a 'bullet'; remove it, or write"},
      {"[simulator]\ndevice = 'nosuch'\n" + body, "s.toml:2: no device is called 'nosuch': say auto, host,"},
      {"[world]\ndt = 10\n" + body, "s.toml:2:6: 'dt' must be between 1e-6 and 1 s, not 10; typically 1/60"},
      {body + "motion = 'static'\nmass = 3", "s.toml:4:8: a static body has no 'mass'; remove it, or write motion ="},
      {"[simulator]\nkind = 'native'\ndevice = 'host'\n" + body,
       "s.toml:3:10: 'device' applies to the simulators device and hybrid only; remove it or kind = \"native\""},
      {body + "motion = 'sttic'", "s.toml:3:10: 'sttic' is not a valid motion; did you mean 'static'?"},
      {"[wrld]\n" + body, "s.toml:1:2: unknown key 'wrld' in a scene; did you mean 'world'?"},
  };
  for (const auto& [text, says] : scenes) {
    std::ofstream(path("s.toml")) << text;
    const Outcome outcome = fathom({"run", path("s.toml"), "--steps", "1"});
    EXPECT_EQ(outcome.exit_code, 2) << says;
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  std::ofstream(path("s.toml")) << body + "motion = 'fixed'";
  EXPECT_EQ(fathom({"run", path("s.toml"), "--steps", "1", "--quiet"}).exit_code, 0) << "the name of C++";
}

TEST_F(Program, FaultyResultsAreRefused) {
  std::ofstream(path("empty.json")) << "{}";
  std::ofstream(path("text.json")) << "hello";
  EXPECT_THAT(fathom({"table", path("empty.json")}).err, HasSubstr("is not a result of 'fathom run --json'"));
  EXPECT_THAT(fathom({"table", path("text.json")}).err, HasSubstr("is not JSON"));
}

TEST_F(Program, EarlierFilesSurviveAKilledRunAndAFullDisk) {
  std::ofstream(path("run.csv")) << "earlier";
  const pid_t child =
      start({"run", "drift", "--bodies", "100", "--steps", "100000000", "--csv", path("run.csv"), "--quiet"});
  EXPECT_TRUE(has_grown("run.csv", child));
  kill(child, SIGKILL);
  finish(child);
  EXPECT_EQ(read_text(path("run.csv")), "earlier");
  const Outcome full = fathom({"run", "drift", "--bodies", "100", "--steps", "200", "--csv", "/dev/full", "--quiet"});
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("is the disk full?"));
}

TEST_F(Program, ValidateWritesItsReport) {
  const Outcome outcome = fathom({"validate", "--short", "--only", "free-fall", "--threads", "1", "--html",
                                  path("v.html"), "--json", path("v.json")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("pass  free-fall"));
  const json report = json::parse(read_text(path("v.json")));
  EXPECT_EQ(report.at("checks"), report.at("passed"));
  EXPECT_THAT(read_text(path("v.html")), HasSubstr("<svg"));
  EXPECT_THAT(files(), testing::UnorderedElementsAre("out", "err", "v.html", "v.json"));
}

TEST_F(Program, ValidateListsItsCasesAndRefusesOthers) {
  EXPECT_THAT(fathom({"validate", "--list"}).out, HasSubstr("kapla"));
  const Outcome outcome = fathom({"validate", "--only", "nonsense"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("no case has 'nonsense' in its name"));
}

// Seed 26 is a stream: bodies leave and come back while it is recorded.
TEST_F(Program, HeapsOfASeedRunAreRecordedAndPlayed) {
  const std::vector<std::string> size{"heap", "--seed", "26", "--steps", "60", "--threads", "1"};
  const auto with = [&](std::vector<std::string> first, const std::vector<std::string>& more) {
    first.insert(first.end(), size.begin(), size.end());
    first.insert(first.end(), more.begin(), more.end());
    return fathom(first);
  };
  EXPECT_EQ(with({"run"}, {"--quiet", "--json", path("plain.json")}).exit_code, 0);
  EXPECT_EQ(with({"run"}, {"--quiet", "--json", path("recorded.json"), "--record", path("heap.fathom")}).exit_code, 0);
  EXPECT_EQ(json::parse(read_text(path("plain.json"))).at("state_hash"),
            json::parse(read_text(path("recorded.json"))).at("state_hash"));
  EXPECT_EQ(fathom({"replay", path("heap.fathom"), "--threads", "1"}).exit_code, 0);
  EXPECT_EQ(fathom({"play", "heap", "--seed", "26", "--steps", "60", "--quiet"}).exit_code, 0);
}

TEST_F(Program, InterruptedRunWritesWhatItMeasured) {
  const pid_t child = start({"run", "drift", "--bodies", "100", "--steps", "100000000", "--json", path("run.json"),
                             "--csv", path("run.csv"), "--quiet"});
  EXPECT_TRUE(has_grown("run.csv", child, 10000)) << "rows appear once steps are made";
  kill(child, SIGINT);
  const Outcome outcome = finish(child);
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  const json r = json::parse(read_text(path("run.json")));
  EXPECT_EQ(r.at("finished"), false);
  const auto steps = r.at("steps").get<int>();
  EXPECT_GT(steps, 0);
  const std::string csv = read_text(path("run.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), steps + 1);
}

TEST_F(Program, RecordsAndReplays) {
  const Outcome run = fathom({"run", "drift", "--bodies", "80", "--steps", "70", "--threads", "2", "--record",
                              path("run.fathom"), "--trace", path("trace.json"), "--set", "record.snapshot_every=20"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Outcome again = fathom({"replay", path("run.fathom"), "--threads", "1"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("70 steps from step 1 replayed"));
  const std::string hash = again.out.substr(again.out.find("state hash"));
  EXPECT_THAT(run.out, HasSubstr(hash));
  EXPECT_EQ(fathom({"replay", path("run.fathom"), "--quiet"}).out, "");
  int steps = 0;
  for (const fathom::test::TraceZone& zone : fathom::test::trace_zones(path("trace.json"))) {
    steps += zone.name == "step";
    if (zone.name == "find_pairs") {
      EXPECT_EQ(zone.parent, "step");
    }
  }
  EXPECT_EQ(steps, 70);
  std::ofstream(path("cut.fathom")) << read_text(path("run.fathom")).substr(0, 900);
  const Outcome cut = fathom({"replay", path("cut.fathom")});
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_THAT(cut.err, HasSubstr("cut.fathom: it is truncated"));
}

TEST_F(Program, AFullDiskIsOneErrorAndLeavesEarlierFiles) {
  const std::vector<std::string> outputs[] = {{"--record", path("o")}, {"--csv", path("o")}, {"--trace", path("o")}};
  for (const auto& output : outputs) {
    std::vector<std::string> arguments{"run", "layers", "--bodies", "200", "--steps", "300", "--quiet"};
    arguments.insert(arguments.end(), output.begin(), output.end());
    std::ofstream(path("o")) << "an earlier run";
    largest_file_ = 20000;
    const Outcome outcome = fathom(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << output[0];
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(path("o") + ": could not be written to its end"));
    EXPECT_EQ(read_text(path("o")), "an earlier run") << output[0];
    const auto files = std::distance(fs::directory_iterator(path("")), fs::directory_iterator());
    EXPECT_EQ(files, 3) << "no half file is left";
  }
  // The engine's loop records too.
  const Outcome played = fathom({"play", "layers", "--bodies", "200", "--steps", "300", "--set",
                                 "record.file=" + path("o"), "--set", "log.level=error"});
  EXPECT_EQ(played.exit_code, 2);
  EXPECT_EQ(std::count(played.err.begin(), played.err.end(), '\n'), 1) << played.err;
  EXPECT_EQ(read_text(path("o")), "an earlier run");
}

TEST_F(Program, KilledWhileRecordingTheEarlierRecordingStays) {
  const std::vector<std::string> short_run{"run", "layers",   "--bodies",         "60",     "--steps",
                                           "20",  "--record", path("run.fathom"), "--quiet"};
  ASSERT_EQ(fathom(short_run).exit_code, 0);
  const std::string earlier = read_text(path("run.fathom"));
  const pid_t child =
      start({"run", "layers", "--bodies", "500", "--steps", "100000000", "--record", path("run.fathom"), "--quiet"});
  const std::string partial = growing("run.fathom", child);
  EXPECT_TRUE(has_grown("run.fathom", child, 100000));
  kill(child, SIGKILL);
  EXPECT_EQ(finish(child).exit_code, -1);
  EXPECT_TRUE(fs::exists(partial));
  EXPECT_EQ(read_text(path("run.fathom")), earlier);
  EXPECT_EQ(fathom({"replay", path("run.fathom"), "--quiet"}).exit_code, 0);
  const Outcome half = fathom({"replay", partial});
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_EQ(std::count(half.err.begin(), half.err.end(), '\n'), 1) << half.err;
}

// The engine's main loop around the same scene, in the modes whose ticks belong to steps; in async if nothing ticks.
TEST_F(Program, PlaysAScenesRunInTheEnginesLoop) {
  for (const auto& [scene, modes] :
       {std::pair{"layers", std::vector{"lockstep", "ahead", "async"}}, {"drift", std::vector{"lockstep", "ahead"}}}) {
    const json run = result_of({scene, "--bodies", "60", "--steps", "40"});
    for (const char* mode : modes) {
      const Outcome played = fathom({"play", scene, "--bodies", "60", "--steps", "40", "--set",
                                     std::string("simulator.mode=") + mode, "--set", "log.console=false"});
      EXPECT_EQ(played.exit_code, 0) << played.err;
      EXPECT_THAT(played.out, HasSubstr(run.at("state_hash").get<std::string>())) << scene << ", " << mode;
    }
  }
  const Outcome wrong = fathom({"play", "layers", "--set", "simulator.mode=fast"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_EQ(std::count(wrong.err.begin(), wrong.err.end(), '\n'), 1) << wrong.err;
}

TEST_F(Program, ConfigTellsValuesAndOrigins) {
  ASSERT_EQ(fathom({"config", "--set", "simulator.substeps=7", "--write", path("fathom.toml")}).exit_code, 0);
  const Outcome shown = fathom({"config", "--config", path("fathom.toml"), "--set", "loop.rate=50"});
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_THAT(shown.out, testing::ContainsRegex("substeps = 7 +# .*fathom.toml:[0-9]+"));
  EXPECT_THAT(shown.out, testing::ContainsRegex("rate = 50 +# --set"));
  const json r = result_of({"pyramid", "--layers", "2", "--steps", "2", "--set", "simulator.substeps=7", "--set",
                            "simulator.threads=2", "--threads", "1"});
  EXPECT_EQ(r.at("substeps"), 7);
  EXPECT_EQ(r.at("threads"), 1) << "an option of its own comes last";
}

// A wrapped line is not overwritten but fills the screen.
TEST_F(Program, ProgressStaysOnOneLineOfATerminal) {
  for (const std::size_t columns : {20, 64, 65, 200}) {
    winsize size{24, static_cast<unsigned short>(columns), 0, 0};
    int terminal = -1;
    const pid_t child = forkpty(&terminal, nullptr, nullptr, &size);
    if (child == 0) {
      execl(FATHOM_PROGRAM, FATHOM_PROGRAM, "run", "drift", "--bodies", "300", "--seconds", "1e6", "--csv", "/dev/null",
            nullptr);
      _exit(127);
    }
    std::string shown;
    char bytes[4096];
    while (std::count(shown.begin(), shown.end(), '\r') < 3) {
      const ssize_t got = read(terminal, bytes, sizeof bytes);
      if (got <= 0) break;
      shown.append(bytes, static_cast<std::size_t>(got));
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    close(terminal);
    std::istringstream lines(shown.substr(0, shown.rfind('\r')));
    std::string line;
    std::size_t widest = 0;
    while (std::getline(lines, line, '\r')) widest = std::max(widest, line.substr(0, line.find('\033')).size());
    EXPECT_GT(widest, 10u) << shown;
    EXPECT_LT(widest, columns) << shown;
    EXPECT_EQ(shown.find('\n'), shown.npos) << shown;
    EXPECT_THAT(shown, HasSubstr(columns >= 65 ? "]" : "%"));
  }
}

}  // namespace
}  // namespace fathom::cli_test
