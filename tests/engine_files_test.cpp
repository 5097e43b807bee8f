// The one writer of files (src/files), and what the engine writes with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <map>
#include <thread>

#include "engine/data_log.hpp"
#include "engine/trace.hpp"
#include "engine_fixture.hpp"
#include "files/file_names.hpp"
#include "files/output_file.hpp"
#include "trace_reader.hpp"

namespace fathom::engine::test::engine_files_test {
namespace {

using fathom::test::TestFolder;
using fathom::test::trace_zones;
using fathom::test::TraceZone;
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

// Many at once, of which never more than one may hold the file.
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
  if (geteuid() == 0) return;  // root may write everything
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
  for (const char* free : {"", "/dev/null"}) {
    names.writes("--json", free);
    names.writes("--csv", free);
  }
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  names.writes("--json", folder / "pipe");
  EXPECT_THAT(refusal([&] { names.writes("--csv", folder / "pipe"); }), HasSubstr("--json and --csv are one file"));
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
    for (const char* simulator : {"native", "device", "hybrid"}) {
      const TestFolder folder;
      Config config = traced(folder / "t.json", mode);
      config.set(std::string("simulator.kind=") + simulator);
      if (simulator != std::string("native")) config.set("simulator.device=host");
      Engine engine(config);
      spawn_box(engine);
      engine.run(50);
      engine.finish();
      // A device's stages are on a line of their own.
      const std::string around_stages = simulator == std::string("device") ? "" : "step";
      std::map<std::string, int> count;
      for (const TraceZone& zone : trace_zones(folder / "t.json")) {
        ++count[zone.name];
        for (const char* stage : {"find_pairs", "update_manifolds", "build_constraints", "solve", "finish"})
          if (zone.name == stage) {
            EXPECT_EQ(zone.parent, around_stages) << stage << ", " << mode << ", " << simulator;
          }
        if (zone.name.starts_with("ticks")) {
          EXPECT_EQ(zone.parent, "frame") << zone.name << ", " << mode;
        }
      }
      for (const char* name : {"step", "commands", "publish", "find_pairs", "solve", "finish"})
        EXPECT_EQ(count[name], 50) << name << ", " << mode << ", " << simulator;
      EXPECT_EQ(count["frame"], static_cast<int>(engine.stats().frame)) << mode;
    }
  }
}

// If a number of microseconds has no exact binary form, some readers cut it a nanosecond short, others round it.
TEST(EngineTrace, ZonesNestHoweverTheirTimesAreRead) {
  const TestFolder folder;
  trace::Session session(folder / "t.json");
  auto begin = std::chrono::steady_clock::now();
  constexpr int steps = 2000;
  for (int i = 0; i < steps; ++i) {
    const double ms = 1e-6 * (1 + 37 * i);
    trace::add_zone("step", begin, 5 * ms);
    trace::add_step({ms, ms, ms, ms, ms}, begin);
    begin += std::chrono::nanoseconds(i % 3 + 5 * (1 + 37 * i));
  }
  session.finish();
  const auto cut = [](double us) { return static_cast<std::int64_t>(us * 1000.0); };
  const auto rounded = [](double us) { return std::llround(us * 1000.0); };
  const std::vector<TraceZone> zones = trace_zones(folder / "t.json", cut);
  ASSERT_EQ(zones.size(), 6u * steps);
  for (const TraceZone& zone : zones) ASSERT_EQ(zone.parent, zone.name == "step" ? "" : "step") << zone.name;
  const std::vector<TraceZone> others = trace_zones(folder / "t.json", rounded);
  for (std::size_t i = 0; i < zones.size(); ++i) {
    ASSERT_EQ(zones[i].begin, others[i].begin);
    ASSERT_EQ(zones[i].end, others[i].end);
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
    const std::vector<TraceZone> zones = trace_zones(folder / file);
    return std::count_if(zones.begin(), zones.end(), [](const TraceZone& zone) { return zone.name == "step"; });
  };
  EXPECT_EQ(steps("first.json"), 10 + 20 + 5) << "all that happened while it was there";
  EXPECT_EQ(steps("second.json"), 20 + 5 + 7);
}

TEST(EngineTrace, EnginesThatRunAtTheSameTimeBothWriteIt) {
  const TestFolder folder;
  const auto config = [&](const char* file) {
    Config c = traced(folder / file, "async");
    c.set("simulator.kind=device");
    c.set("simulator.device=host");
    return c;
  };
  Engine first(config("first.json")), second(config("second.json"));
  spawn_box(first);
  spawn_box(second);
  std::thread other([&] { second.run(200); });
  first.run(200);
  other.join();
  first.finish();
  second.finish();
  for (const char* file : {"first.json", "second.json"}) {
    std::map<std::string, int> count;
    for (const TraceZone& zone : trace_zones(folder / file)) ++count[zone.name];
    EXPECT_EQ(count["step"], 400) << file;
    EXPECT_EQ(count["solve"], 400) << file;
  }
}

// A device's clock may count more time than passes here until the next step.
TEST(EngineTrace, StagesOfADeviceFollowEachOther) {
  const TestFolder folder;
  trace::Session session(folder / "t.json");
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 10; ++i) trace::add_step({1, 1, 1, 1, 1}, begin + std::chrono::milliseconds(i), "GPU");
  session.finish();
  const std::vector<TraceZone> zones = trace_zones(folder / "t.json");
  ASSERT_EQ(zones.size(), 50u);
  for (const TraceZone& zone : zones) EXPECT_EQ(zone.parent, "");
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
}  // namespace fathom::engine::test::engine_files_test
