// The one writer of files (src/files), and what the engine writes with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fathom/error.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "engine/data_log.hpp"
#include "engine/trace.hpp"
#include "engine_fixture.hpp"
#include "files/file_names.hpp"
#include "files/output_file.hpp"

namespace fathom::engine::test {
namespace {

using fathom::test::TestFolder;
using files::FileNames;
using files::OutputFile;
using files::Writing;
using testing::HasSubstr;
namespace fs = std::filesystem;

TEST(EngineFiles, AppearCompleteOrNotAtAll) {
  const TestFolder folder;
  std::ofstream(folder / "f") << "earlier";
  {
    OutputFile file(folder / "f");
    file.write("new");
    EXPECT_EQ(read_text(folder / "f"), "earlier");
    EXPECT_EQ(folder.file_count(), 2u);
  }
  EXPECT_EQ(read_text(folder / "f"), "earlier");
  OutputFile file(folder / "f", Writing::patched);
  file.write("new");
  file.overwrite(0, "N", 1);
  file.finish();
  EXPECT_EQ(read_text(folder / "f"), "New");
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(EngineFiles, LiveOnesMayBeFollowed) {
  const TestFolder folder;
  std::ofstream(folder / "f") << "an earlier, longer one";
  OutputFile file(folder / "f", Writing::live);
  file.write("row\n");
  file.flush();
  EXPECT_EQ(read_text(folder / "f"), "row\n");
}

TEST(EngineFiles, HaveOneWriter) {
  const TestFolder folder;
  fs::create_symlink("f", folder / "link");
  const OutputFile first(folder / "f");
  for (const Writing writing : {Writing::whole, Writing::patched, Writing::live})
    for (const char* name : {"f", "link"})
      EXPECT_THAT(refusal([&] { OutputFile second(folder / name, writing); }),
                  HasSubstr(std::string(name) + ": is being written by this run already"));
  const OutputFile live(folder / "g", Writing::live);
  EXPECT_THAT(refusal([&] { OutputFile second(folder / "g"); }), HasSubstr("g: is being written by another run"));
  EXPECT_THAT(refusal([&] { OutputFile second(folder / "g", Writing::live); }), HasSubstr("is being written"));
}

// Many at once, more than one of which must never hold the file.
TEST(EngineFiles, HaveOneWriterHoweverManyBeginAtOnce) {
  const TestFolder folder;
  std::vector<std::thread> writers;
  std::atomic<int> held{0}, most{0};
  for (int i = 0; i < 8; ++i)
    writers.emplace_back([&] {
      for (int k = 0; k < 20; ++k) {
        try {
          OutputFile file(folder / "f");
          most = std::max(most.load(), ++held);
          file.write(std::string(5000, 'x'));
          --held;
          file.finish();
        } catch (const Error& error) {
          EXPECT_THAT(error.what(), HasSubstr("is being written"));
        }
      }
    });
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(most, 1);
  EXPECT_EQ(read_text(folder / "f").size(), 5000u);
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(EngineFiles, ThatCannotBeWrittenSayWhy) {
  const TestFolder folder;
  fs::create_symlink("circle", folder / "circle");
  fs::create_symlink(folder / "nowhere/f", folder / "dangling");
  for (const std::string& name : {std::string("/nowhere/f"), folder / "circle", folder / "dangling", folder / "."})
    EXPECT_THAT(refusal([&] { OutputFile file(name); }), HasSubstr(name + ": cannot be written ("));
  if (geteuid() == 0) return;  // who may write everything
  std::ofstream(folder / "mine") << "kept";
  fs::permissions(folder / "mine", fs::perms::owner_read);
  EXPECT_THAT(refusal([&] { OutputFile file(folder / "mine"); }), HasSubstr("Permission denied"));
}

TEST(EngineFiles, ADanglingLinkGetsItsFile) {
  const TestFolder folder;
  fs::create_symlink("later", folder / "link");
  files::write_file(folder / "link", "text");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(read_text(folder / "later"), "text");
}

TEST(EngineFiles, APatchedOneGoesThroughAPipeInTheEnd) {
  const TestFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = read_text(folder / "pipe"); });
  OutputFile file(folder / "pipe", Writing::patched);
  file.write(std::string(200'000, 'x'));
  file.overwrite(1, "y", 1);
  file.finish();
  reader.join();
  EXPECT_EQ(got.substr(0, 3), "xyx");
  EXPECT_EQ(got.size(), 200'000u);
}

TEST(EngineFiles, NamesOfOneFileAreOne) {
  const TestFolder folder;
  std::ofstream(folder / "f") << "here";
  fs::create_hard_link(folder / "f", folder / "hard");
  fs::create_symlink("f", folder / "soft");
  for (const char* name : {"f", "./f", "hard", "soft"}) {
    FileNames names;
    names.reads("the scene", folder / "f");
    names.reads("--config", folder / "f");
    EXPECT_THAT(refusal([&] { names.writes("--json", folder / name); }), HasSubstr("--json would overwrite the scene"));
  }
  FileNames names;
  for (const char* free : {"", "-", "/dev/null", "/dev/stdout"}) {
    names.writes("--json", free);
    names.writes("--csv", free);
  }
}

/// Of each thread of a trace: zones as (begin, end, name), in the file's order.
struct Zone {
  double begin, end;
  std::string name;
};
std::map<int, std::vector<Zone>> zones_of(const std::string& file) {
  std::map<int, std::vector<Zone>> zones;
  const nlohmann::json trace = nlohmann::json::parse(read_text(file));
  for (const nlohmann::json& e : trace.at("traceEvents"))
    if (e.at("ph") == "X") {
      const double begin = e.at("ts");
      zones[e.at("tid")].push_back({begin, begin + e.at("dur").get<double>(), e.at("name")});
    }
  return zones;
}

/// What Perfetto's importer takes: sorted by begin, each within those that are open.
void expect_nested(const std::vector<Zone>& zones) {
  constexpr double rounding = 1e-6;  // µs, of the sums above
  std::vector<const Zone*> open;
  double last = 0;
  for (const Zone& zone : zones) {
    EXPECT_GE(zone.begin, last) << zone.name;
    last = zone.begin;
    while (!open.empty() && open.back()->end <= zone.begin + rounding) open.pop_back();
    if (!open.empty()) {
      EXPECT_LE(zone.end, open.back()->end + rounding) << zone.name << " in " << open.back()->name;
    }
    open.push_back(&zone);
  }
}

Config traced(const std::string& file, const std::string& mode) {
  Config config;
  config.set("trace.file=" + file);
  config.set("simulator.mode=" + mode);
  config.set("log.console=false");
  return config;
}

void spawn_box(Engine& engine) {
  EntityDef box;
  box.physics = BodyDef{.pose = {.position = {0, 0, 1}}, .shape = fathom::box({0.5f, 0.5f, 0.5f})};
  engine.world().spawn(box);
}

TEST(EngineTrace, ZonesNestInEveryMode) {
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    const TestFolder folder;
    Engine engine(traced(folder / "t.json", mode));
    spawn_box(engine);
    engine.run(50);
    engine.finish();
    std::set<std::string> names;
    for (const auto& [thread, zones] : zones_of(folder / "t.json")) {
      expect_nested(zones);
      for (const Zone& zone : zones) names.insert(zone.name);
    }
    EXPECT_THAT(names, testing::IsSupersetOf({"step", "find_pairs", "solve", "frame", "commands"})) << mode;
  }
}

TEST(EngineTrace, EveryEngineOfAProcessHasItsOwn) {
  const TestFolder folder;
  auto first = std::make_unique<Engine>(traced(folder / "first.json", "lockstep"));
  first->run(10);
  Engine second(traced(folder / "second.json", "lockstep"));
  second.run(20);
  first->run(5);
  first.reset();
  second.run(7);
  second.finish();
  const auto steps = [&](const char* file) {
    int count = 0;
    for (const auto& [thread, zones] : zones_of(folder / file))
      for (const Zone& zone : zones) count += zone.name == "step";
    return count;
  };
  EXPECT_EQ(steps("first.json"), 10 + 20 + 5) << "all that happened while it was there";
  EXPECT_EQ(steps("second.json"), 20 + 5 + 7);
}

TEST(EngineTrace, IsRefusedBeforeTheRunWhereItCannotBeWritten) {
  EXPECT_THAT(refusal([] { Engine engine(traced("/nowhere/t.json", "lockstep")); }),
              HasSubstr("/nowhere/t.json: cannot be written"));
}

TEST(EngineConfig, ItsFilesAreDifferentOnes) {
  const TestFolder folder;
  const char* keys[] = {"record.file", "trace.file", "log.data", "log.file"};
  for (const char* one : keys)
    for (const char* other : keys) {
      if (one == other) continue;
      Config config;
      config.set(one + ("=" + (folder / "f")));
      config.set(other + ("=" + (folder / "f")));
      EXPECT_THAT(refusal([&] { Engine engine(config); }), HasSubstr("are one file, " + (folder / "f")));
      EXPECT_EQ(folder.file_count(), 0u);
    }
}

}  // namespace
}  // namespace fathom::engine::test
