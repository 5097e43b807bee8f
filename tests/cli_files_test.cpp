// Everything the program writes: devices, pipes and links are respected, a file has only one writer, and unfinished
// output leaves nothing behind.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "program.hpp"

namespace fathom::cli_files_test {
namespace {

using nlohmann::json;
using test::Outcome;
using test::read_text;
using test::Words;
using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

/// A command that writes one file, whose name comes last.
struct Writer {
  Words words;
  std::string says;  ///< what the file begins with
};

const std::vector<Writer>& writers() {
  static const Words run{"run", "drift", "--bodies", "20", "--steps", "5", "--quiet"};
  static const auto of_run = [](const char* option) {
    Words words = run;
    words.push_back(option);
    return words;
  };
  static const Words validate{"validate", "--short", "--only", "free-fall", "--quiet", "--threads", "1"};
  static const auto of_validate = [](const char* option) {
    Words words = validate;
    words.push_back(option);
    return words;
  };
  static const std::vector<Writer> all{
      {of_run("--json"), "{"},
      {of_run("--csv"), "step,step_ms,"},
      {of_run("--record"), "FATHOMRC"},
      {of_run("--trace"), "{\"displayTimeUnit\""},
      {{"config", "--write"}, "[simulator]"},
      {of_validate("--json"), "{"},
      {of_validate("--html"), "<!doctype html>"},
#ifdef FATHOM_HAS_BENCH
      {{"bench", "peers", "--engines", "fathom", "--scenes", "drift:20@5", "--rounds", "1", "--threads", "1", "--json"},
       "{"},
#endif
#ifdef FATHOM_HAS_RENDER
      {{"render", "drift", "--bodies", "5", "--seconds", "0.1", "--quiet", "--web"}, "<!DOCTYPE html>"},
#endif
  };
  return all;
}

class ProgramFiles : public fathom::test::Program {
 protected:
  Outcome write(const Writer& writer, const std::string& file) const {
    Words words = writer.words;
    words.push_back(file);
    return fathom(words);
  }
  static std::string name(const Writer& writer) { return writer.words.front() + " " + writer.words.back(); }
  /// The output besides the program's own messages.
  Words left() const {
    Words names = files();
    std::erase(names, "out");
    std::erase(names, "err");
    return names;
  }
  void expect_one_line(const Outcome& outcome, const std::string& says, const std::string& what) const {
    EXPECT_EQ(outcome.exit_code, 2) << what;
    EXPECT_THAT(outcome.err, HasSubstr(says)) << what;
    EXPECT_THAT(outcome.err, HasSubstr("fathom: ")) << what;
  }
};

TEST_F(ProgramFiles, SavesAShapeThatScenesLoad) {
  const Outcome outcome = fathom(
      {"save-shape", FATHOM_SOURCE_DIR "/examples/scenes/surfaces.toml", "hillside", "-o", path("hillside.shape")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("hillside.shape: the shape of 'hillside', 5192 triangles, "));
  const auto run_with = [&](const std::string& shape) {
    std::ofstream(path("scene.toml")) << "[[body]]\nmotion = \"static\"\nshape = {type = \"saved\", file = \"" + shape +
                                             "\"}\n[[body]]\nposition = [9, 9, 3]\n"
                                             "shape = {type = \"sphere\", radius = 0.5}\n";
    return fathom({"run", path("scene.toml"), "--steps", "60"});
  };
  const Outcome run = run_with("hillside.shape");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  std::ofstream(path("none.shape")) << "no shape";
  EXPECT_THAT(run_with("none.shape").err, HasSubstr("none.shape: shape: "));
  const Outcome unknown = fathom(
      {"save-shape", FATHOM_SOURCE_DIR "/examples/scenes/surfaces.toml", "hilside", "-o", path("hillside.shape")});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("there is no body named 'hilside'; did you mean 'hillside'?"));
}

TEST_F(ProgramFiles, EveryWriterFollowsLinksAndKeepsPermissions) {
  for (const Writer& writer : writers()) {
    std::ofstream(path("target")) << "earlier";
    fs::permissions(path("target"), fs::perms::owner_read | fs::perms::owner_write);
    fs::create_symlink("target", path("inner"));
    fs::create_symlink(path("inner"), path("link"));
    const Outcome outcome = write(writer, path("link"));
    EXPECT_EQ(outcome.exit_code, 0) << name(writer) << outcome.err;
    EXPECT_TRUE(fs::is_symlink(path("link")) && fs::is_symlink(path("inner"))) << name(writer);
    EXPECT_THAT(read_text(path("target")), testing::StartsWith(writer.says)) << name(writer);
    EXPECT_EQ(fs::status(path("target")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_THAT(left(), ElementsAre("inner", "link", "target")) << name(writer);
    for (const char* file : {"inner", "link", "target"}) fs::remove(path(file));
  }
}

TEST_F(ProgramFiles, EveryWriterWritesThroughAPipe) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  for (const Writer& writer : writers()) {
    std::string got;
    std::thread reader([&] { got = read_text(path("pipe")); });
    const Outcome outcome = write(writer, path("pipe"));
    reader.join();
    EXPECT_EQ(outcome.exit_code, 0) << name(writer) << outcome.err;
    EXPECT_THAT(got, testing::StartsWith(writer.says)) << name(writer);
    EXPECT_TRUE(fs::is_fifo(path("pipe"))) << name(writer);
    EXPECT_THAT(left(), ElementsAre("pipe")) << name(writer);
  }
}

TEST_F(ProgramFiles, EveryWriterTellsOfAFullDevice) {
  for (const Writer& writer : writers()) {
    expect_one_line(write(writer, "/dev/full"), "/dev/full: could not be written to its end", name(writer));
    EXPECT_TRUE(fs::is_character_file("/dev/full")) << name(writer);
    EXPECT_THAT(left(), ElementsAre()) << name(writer);
  }
  stdout_ = "/dev/full";
  for (const Words& words : std::vector<Words>{{"config"},
                                               {"list"},
                                               {"run", "--help"},
                                               {"run", "drift", "--bodies", "5", "--steps", "2"},
                                               {"run", "drift", "--bodies", "5", "--steps", "2", "--json", "-"},
                                               {"validate", "--list"}})
    expect_one_line(fathom(words), "could not be written to its end (No space left on device)", words.front());
}

TEST_F(ProgramFiles, WhatGoesToStdoutIsAloneThere) {
  for (const char* out : {"-", "/dev/stdout"}) {
    for (Writer writer : writers()) {
      std::erase(writer.words, "--quiet");
      const Outcome outcome = write(writer, out);
      EXPECT_EQ(outcome.exit_code, 0) << name(writer) << outcome.err;
      EXPECT_THAT(outcome.out, testing::StartsWith(writer.says)) << name(writer);
      for (const char* other : {"  state hash  ", "pass  ", "Milliseconds per step"})
        EXPECT_EQ(outcome.out.find(other), std::string::npos) << name(writer) << ", " << other;
      EXPECT_TRUE(writer.says != "{" || json::accept(outcome.out)) << name(writer);
      EXPECT_THAT(left(), ElementsAre()) << name(writer);
    }
    for (const char* key : {"record.file", "trace.file", "log.data"}) {
      const Outcome outcome = fathom({"play", "drift", "--bodies", "5", "--steps", "3", "--set",
                                      std::string(key) + "=" + out, "--set", "log.console=false"});
      EXPECT_EQ(outcome.exit_code, 0) << key << outcome.err;
      EXPECT_EQ(outcome.out.find("state hash"), std::string::npos) << key;
      EXPECT_THAT(outcome.err, HasSubstr("state hash")) << key;
      EXPECT_THAT(left(), ElementsAre()) << key;
    }
  }
}

TEST_F(ProgramFiles, ThatNobodyHearsMessagesEndsNothing) {
  const struct {
    Words words;
    int exit_code;
  } lines[] = {
      {{"run", "nosuch"}, 2},
      {{"nosuch"}, 2},
      {{"run", "drift", "--bodies", "5", "--steps", "2", "--json", "-"}, 0},
      {{"validate", "--short", "--only", "free-fall", "--json", "-"}, 0},
      {{"play", "drift", "--bodies", "5", "--steps", "2", "--set", "simulator.device=cuda:99"}, 0},
      {{"replay", "nosuch"}, 2},
#ifdef FATHOM_HAS_BENCH
      {{"bench", "peers", "--engines", "fathom", "--scenes", "drift:20@5", "--rounds", "1", "--threads", "1", "--json",
        path("p")},
       0},
      {{"bench", "campaign", "--only", "drift-100-native-1t-fathom", "--steps", "3", "--out", path("c")}, 0},
#endif
  };
  for (const auto& [words, exit_code] : lines) {
    stderr_ = "/dev/full";
    closed_.clear();
    EXPECT_EQ(fathom(words).exit_code, exit_code) << testing::PrintToString(words);
    stderr_ = "err";
    closed_ = {STDERR_FILENO};
    if (words.back() == path("c")) continue;  // its folder exists by then
    EXPECT_EQ(fathom(words).exit_code, exit_code) << testing::PrintToString(words) << ", closed";
  }
}

// A file that gets the descriptor of a closed stdout must not receive printed text.
TEST_F(ProgramFiles, AreWholeWhateverIsClosed) {
  for (int closed = 0; closed < 8; ++closed) {
    closed_.clear();
    for (int number = 0; number < 3; ++number)
      if ((closed >> number & 1) != 0) closed_.push_back(number);
    Words words{"run", "drift", "--bodies", "5", "--steps", "3"};
    for (const char* kind : {"json", "csv", "record", "trace"})
      words.insert(words.end(), {std::string("--") + kind, path(kind)});
    const bool heard = (closed >> STDOUT_FILENO & 1) == 0;
    EXPECT_EQ(fathom(words).exit_code, heard ? 0 : 2) << closed;
    words = {"play", "drift", "--bodies", "5", "--steps", "3"};
    for (const char* key : {"record.file", "trace.file", "log.data", "log.file"})
      words.insert(words.end(), {"--set", std::string(key) + "=" + path(key)});
    EXPECT_EQ(fathom(words).exit_code, heard ? 0 : 2) << closed;
    closed_.clear();
    EXPECT_EQ(json::parse(read_text(path("json"))).at("steps"), 3) << closed;
    const std::string rows = read_text(path("csv"));
    EXPECT_THAT(rows, testing::StartsWith("step,")) << closed;
    EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 4) << closed;
    for (const char* trace : {"trace", "trace.file"})
      EXPECT_TRUE(json::accept(read_text(path(trace)))) << closed << ", " << trace;
    for (const char* recording : {"record", "record.file"})
      EXPECT_EQ(fathom({"replay", path(recording), "--quiet"}).exit_code, 0) << closed << ", " << recording;
    EXPECT_THAT(read_text(path("log.data")), testing::StartsWith("series,")) << closed;
    EXPECT_EQ(read_text(path("log.file")).find("state hash"), std::string::npos) << closed;
    for (const std::string& file : left()) fs::remove(path(file));
  }
}

TEST_F(ProgramFiles, ARecordingThroughAPipeIsSound) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  std::thread reader([&] { std::ofstream(path("copy"), std::ios::binary) << read_text(path("pipe")); });
  EXPECT_EQ(fathom({"run", "drift", "--bodies", "20", "--steps", "5", "--quiet", "--record", path("pipe")}).exit_code,
            0);
  reader.join();
  const Outcome replayed = fathom({"replay", path("copy"), "--quiet"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
}

TEST_F(ProgramFiles, AFileHasOnePartInARun) {
  fs::copy_file(FATHOM_SOURCE_DIR "/examples/scenes/shapes.toml", path("scene.toml"));
  const std::string scene = read_text(path("scene.toml"));
  fs::create_symlink("x", path("link"));
  std::ofstream(path("config.toml")) << "[simulator]\nthreads = 1\n";
  const struct {
    Words words;
    std::string says;
  } lines[] = {
      {{"run", "drift", "--json", path("x"), "--csv", path("x")}, "--json and --csv are one file"},
      {{"run", "drift", "--json", path("x"), "--trace", path("link")}, "--json and --trace are one file"},
      {{"run", "drift", "--record", path("x"), "--csv", path("./x")}, "--csv and --record are one file"},
      {{"run", "drift", "--csv", path("x"), "--set", "record.file=" + path("x")}, "--csv and record.file are one file"},
      {{"run", path("scene.toml"), "--json", path("./scene.toml")}, "--json would overwrite the scene"},
      {{"play", path("scene.toml"), "--set", "record.file=" + path("scene.toml")}, "record.file would overwrite"},
      {{"run", "drift", "--config", path("config.toml"), "--csv", path("config.toml")}, "would overwrite --config"},
      {{"config", "--config", path("config.toml"), "--write", path("config.toml")}, "would overwrite --config"},
      {{"play", "drift", "--set", "log.data=" + path("x"), "--set", "trace.file=" + path("x")}, "are one file"},
      {{"validate", "--json", path("x"), "--html", path("x")}, "--html and --json are one file"},
#ifdef FATHOM_HAS_RENDER
      {{"render", "drift", "--web", path("x.mp4"), "--video", path("x.mp4")}, "--video and --web are one file"},
      {{"render", path("scene.toml"), "--web", path("scene.toml")}, "--web would overwrite the scene"},
#endif
  };
  const Words before = left();
  for (const auto& [words, says] : lines) {
    expect_one_line(fathom(words), says, says);
    EXPECT_EQ(left(), before) << says;
  }
  EXPECT_EQ(read_text(path("scene.toml")), scene);
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  expect_one_line(fathom({"run", "drift", "--json", path("pipe"), "--csv", path("pipe")}), "are one file", "a pipe");
  for (const char* out : {"-", "/dev/stdout", "/proc/self/fd/1"}) {
    expect_one_line(fathom({"run", "drift", "--json", "-", "--csv", out}), "cannot both go to stdout", out);
    expect_one_line(fathom({"run", "drift", "--json", "-", "--record", out}), "are one file", out);
    expect_one_line(fathom({"validate", "--json", "-", "--html", out}), "are one file", out);
  }
  // Devices may be named any number of times.
  EXPECT_EQ(
      fathom({"run", "drift", "--bodies", "5", "--steps", "2", "--quiet", "--json", "/dev/null", "--csv", "/dev/null"})
          .exit_code,
      0);
}

TEST_F(ProgramFiles, ASecondWriterIsRefusedAndTheFirstStaysWhole) {
  const Words run{"run", "drift", "--bodies", "20", "--steps", "100000000", "--quiet"};
  Words words = run;
  words.insert(words.end(), {"--csv", path("o")});
  const pid_t first = start(words);
  ASSERT_TRUE(has_grown("o", first, 10000));
  for (const Writer& writer : writers())
    expect_one_line(write(writer, path("o")),
                    path("o") + ": is being written by another run (process " + std::to_string(first) + ")",
                    name(writer));
  kill(first, SIGINT);
  EXPECT_EQ(finish(first).exit_code, 130);
  EXPECT_THAT(left(), ElementsAre("o"));
}

TEST_F(ProgramFiles, SignalsLeaveNoHalfFiles) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT, SIGXCPU, SIGUSR1}) {
    const pid_t child = start({"validate", "--quiet", "--threads", "1", "--html", path("v.html"), "--json", path("v")});
    while (!fs::exists(growing("v", child))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, signal);
    // Ctrl-C and SIGTERM are handled, except for a moment at the start; the others end the program.
    const bool ended = finish(child).exit_code == -1;
    if (signal != SIGINT && signal != SIGTERM) {
      EXPECT_TRUE(ended) << strsignal(signal);
    }
    EXPECT_EQ(left(), ended ? Words{} : (Words{"v", "v.html"})) << strsignal(signal);
    for (const std::string& file : left()) fs::remove(path(file));
  }
  // The second Ctrl-C does not wait for the step.
  const pid_t child =
      start({"run", "pyramid", "--layers", "40", "--steps", "1000000", "--quiet", "--csv", path("slow.csv")});
  while (!fs::exists(growing("slow.csv", child))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (int i = 0; i < 200 && kill(child, SIGINT) == 0; ++i) std::this_thread::sleep_for(std::chrono::microseconds(100));
  finish(child);
  for (const std::string& file : left()) EXPECT_EQ(file, "slow.csv");
}

#ifdef FATHOM_HAS_BENCH

TEST_F(ProgramFiles, PeersThatDoNotComeToTheirEndKeepTheLastResults) {
  fs::create_directory(path("p"));
  std::ofstream(path("p/peers.json")) << "earlier";
  for (const Words& wrong : {Words{"--engines", "nosuch"}, {"--scenes", "nosuch:3"}}) {
    Words words{"bench", "peers", "--out", path("p")};
    words.insert(words.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(fathom(words).exit_code, 2);
    EXPECT_EQ(read_text(path("p/peers.json")), "earlier");
  }
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t child = start({"bench", "peers", "--out", path("p"), "--engines", "fathom", "--scenes",
                               "pyramid:10@1000000", "--rounds", "1000", "--threads", "1"});
    while (!fs::exists(growing("p/peers.json", child))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const auto asked = std::chrono::steady_clock::now();
    kill(child, signal);
    const Outcome outcome = finish(child);
    EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(5)) << "within a step, not a run";
    EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("peers.json stays as it was"));
    EXPECT_EQ(read_text(path("p/peers.json")), "earlier");
    EXPECT_EQ(std::distance(fs::directory_iterator(path("p")), fs::directory_iterator()), 2) << "and runs/";
  }
}

TEST_F(ProgramFiles, CampaignsInOneFolderDoNotMix) {
  const Words campaign{"bench",   "campaign", "--quick", "--only", "pyramid-55", "--steps",
                       "1000000", "--quiet",  "--limit", "1000",   "--out",      path("c")};
  const pid_t first = start(campaign);
  while (!fs::exists(path("c/campaign.json"))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  Words second = campaign;
  second.push_back("--resume");
  const Outcome refused = fathom(second);
  expect_one_line(refused, "is being written by another run (process " + std::to_string(first) + ")", "--resume");
  kill(first, SIGINT);
  EXPECT_EQ(finish(first).exit_code, 130);
  expect_one_line(fathom({"bench", "campaign", "--resume", "--out", path("nosuch")}),
                  "nosuch: has no campaign to continue; leave --resume out to start one", "nosuch");
  EXPECT_FALSE(fs::exists(path("nosuch")));
}

#endif

}  // namespace
}  // namespace fathom::cli_files_test
