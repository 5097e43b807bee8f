// Timers, input, logging, data series and traces, each alone.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "engine/input_tape.hpp"
#include "engine/trace.hpp"
#include "engine_fixture.hpp"

namespace fathom::engine::test::engine_parts_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// --- timers ----------------------------------------------------------------------------------------------------

TEST(EngineTimers, FireInOrderOfTimeThenId) {
  Timers timers;
  std::vector<int> fired;
  timers.after(2, [&] { fired.push_back(2); });
  timers.after(1, [&] { fired.push_back(1); });
  timers.after(2, [&] { fired.push_back(3); });
  timers.after(5, [&] { fired.push_back(5); });
  timers.advance(TimeBase::simulated, 3);
  EXPECT_THAT(fired, ElementsAre(1, 2, 3));
  EXPECT_EQ(timers.count(), 1u);
}

TEST(EngineTimers, RepeatForEveryPeriodOfALongFrame) {
  Timers timers;
  int fired = 0;
  timers.every(0.25, [&] { ++fired; });
  timers.advance(TimeBase::simulated, 1.0);
  EXPECT_EQ(fired, 4);
  timers.advance(TimeBase::simulated, 1.2);
  EXPECT_EQ(fired, 4);
}

TEST(EngineTimers, BasesAreApart) {
  Timers timers;
  int simulated = 0, wall = 0;
  timers.after(1, [&] { ++simulated; });
  timers.after(
      1, [&] { ++wall; }, TimeBase::wall);
  timers.advance(TimeBase::wall, 2);
  EXPECT_EQ(simulated, 0);
  EXPECT_EQ(wall, 1);
}

TEST(EngineTimers, MayBeSetResetAndCancelledFromCallbacks) {
  Timers timers;
  std::vector<std::string> fired;
  TimerId self = 0, victim = 0;
  self = timers.every(1, [&] {
    fired.push_back("self");
    if (fired.size() == 2) timers.cancel(self);
  });
  victim = timers.after(1.5, [&] { fired.push_back("victim"); });
  timers.after(0.5, [&] {
    EXPECT_TRUE(timers.cancel(victim));
    timers.after(0.25, [&] { fired.push_back("nested"); });
  });
  timers.advance(TimeBase::simulated, 10);
  EXPECT_THAT(fired, ElementsAre("nested", "self"));
  EXPECT_EQ(timers.count(), 0u);
  EXPECT_FALSE(timers.cancel(victim));
  EXPECT_FALSE(timers.reset(victim, 1));
}

TEST(EngineTimers, ResetCountsFromNow) {
  Timers timers;
  int fired = 0;
  const TimerId id = timers.after(1, [&] { ++fired; });
  timers.advance(TimeBase::simulated, 0.9);
  EXPECT_TRUE(timers.reset(id, 1));
  timers.advance(TimeBase::simulated, 1.8);
  EXPECT_EQ(fired, 0);
  timers.advance(TimeBase::simulated, 1.9);
  EXPECT_EQ(fired, 1);
}

TEST(EngineTimers, RefuseTimesThatCannotBe) {
  Timers timers;
  EXPECT_THAT(refusal([&] { timers.after(-1, [] {}); }), HasSubstr("the delay is -1"));
  EXPECT_THAT(refusal([&] { timers.every(0, [] {}); }), HasSubstr("greater than 0"));
  EXPECT_THAT(refusal([&] { timers.after(std::nan(""), [] {}); }), HasSubstr("must be finite"));
  EXPECT_EQ(timers.count(), 0u);
}

// --- input -----------------------------------------------------------------------------------------------------

InputEvent key(char c, bool pressed = true) {
  return {pressed ? InputKind::key_pressed : InputKind::key_released, 0, static_cast<std::uint16_t>(c), 0, 0};
}

TEST(EngineInput, HighestPriorityFirstUntilConsumed) {
  Input input;
  std::vector<std::string> seen;
  input.add_handler(1, [&](const InputEvent&) { return seen.push_back("game"), false; });
  input.add_handler(10, [&](const InputEvent& e) { return seen.push_back("menu"), e.code == 'M'; });
  input.add_handler(1, [&](const InputEvent&) { return seen.push_back("game 2"), false; });
  const InputEvent events[] = {key('A'), key('M')};
  input.dispatch(events);
  EXPECT_THAT(seen, ElementsAre("menu", "game", "game 2", "menu"));
}

TEST(EngineInput, ActionsFollowTheirKeysAndCanBeShadowed) {
  Input input;
  input.bind("jump", "space");
  input.bind("jump", "j");
  input.bind("fire", "mouse_left");
  std::vector<bool> jumps;
  int fires = 0;
  input.on_action("jump", [&](bool pressed) { jumps.push_back(pressed); });
  const auto fire = input.on_action("fire", [&](bool pressed) { fires += pressed; });
  bool shadow = false;
  input.add_handler(5, [&](const InputEvent&) { return shadow; });
  int below = 0;
  input.add_handler(-5, [&](const InputEvent&) { return ++below, false; });
  InputEvent click{InputKind::mouse_pressed, 0, 0, 3, 4};
  const InputEvent events[] = {key(' '), key('J'), click};
  input.dispatch(events);
  EXPECT_THAT(jumps, ElementsAre(true, true));
  EXPECT_TRUE(input.held("jump"));
  EXPECT_EQ(fires, 1);
  EXPECT_EQ(below, 0) << "an action consumes its key";
  const InputEvent up[] = {key(' ', false), key('J', false)};
  input.dispatch(up);
  EXPECT_FALSE(input.held("jump"));
  shadow = true;
  input.dispatch(events);
  EXPECT_EQ(fires, 1);
  shadow = false;
  input.remove_handler(fire);
  input.dispatch(std::span(&click, 1));
  EXPECT_EQ(fires, 1);
  EXPECT_EQ(below, 1);
  EXPECT_THAT(refusal([&] { input.bind("jump", "spcae"); }), HasSubstr("did you mean 'space'?"));
}

TEST(EngineInput, HandlersMayComeAndGoWhileEventsAreRouted) {
  Input input;
  int calls = 0;
  Input::HandlerId later = 0;
  input.add_handler(2, [&](const InputEvent&) {
    input.remove_handler(later);
    input.add_handler(1, [&](const InputEvent&) { return ++calls, false; });
    return false;
  });
  later = input.add_handler(0, [&](const InputEvent&) { return calls += 100, false; });
  const InputEvent event = key('X');
  input.dispatch(std::span(&event, 1));
  EXPECT_EQ(calls, 0);
}

TEST(EngineInput, KeyNamesGoBothWays) {
  for (const std::string_view name : key_names()) EXPECT_EQ(name_of_key(key_named(name)), name);
  EXPECT_EQ(key_named("a"), 65);
  EXPECT_EQ(key_named("escape"), 256);
  EXPECT_EQ(key_named("A"), -1);
}

TEST(EngineInput, TapesAreStoredAndPlayedBack) {
  const Folder folder;
  InputTape tape;
  tape.entries = {{1, key('W')}, {3, {InputKind::mouse_moved, shift, 0, 10.5f, -3}}, {3, key('W', false)}};
  tape.save(folder / "tape");
  const InputTape loaded = InputTape::load(folder / "tape");
  EXPECT_EQ(loaded.entries, tape.entries);
  PlayingFrontEnd player(loaded);
  RecordingFrontEnd recorder(player);
  std::vector<std::size_t> counts;
  for (int frame = 0; frame < 4; ++frame) {
    std::vector<InputEvent> events;
    recorder.poll(events);
    counts.push_back(events.size());
  }
  EXPECT_THAT(counts, ElementsAre(1, 0, 2, 0));
  EXPECT_TRUE(player.at_end());
  EXPECT_EQ(recorder.tape().entries, tape.entries);
  std::ofstream(folder / "bad") << "fathom input 1\n1 0 65 0 0 0\n1 99 0 0 0 0\n";
  EXPECT_THAT(refusal([&] { InputTape::load(folder / "bad"); }), HasSubstr("bad:3: a number is out of range"));
  std::ofstream(folder / "short") << "fathom input 1\n1 0 65\n";
  EXPECT_THAT(refusal([&] { InputTape::load(folder / "short"); }), HasSubstr("short:2: an event is six numbers"));
  std::ofstream(folder / "other") << "hello\n";
  EXPECT_THAT(refusal([&] { InputTape::load(folder / "other"); }), HasSubstr("not an input tape"));
}

// --- log and data ------------------------------------------------------------------------------------------------

TEST(EngineLog, LevelsAndFile) {
  const Folder folder;
  {
    Log log({.level = LogLevel::info, .console = false, .file = folder / "log.txt"});
    log.debug("hidden {}", 1);
    log.info("shown {}", 2);
    log.error("bad {}", "thing");
    EXPECT_FALSE(log.wants(LogLevel::debug));
    log.flush();
  }
  const std::string text = read_text(folder / "log.txt");
  EXPECT_THAT(text, HasSubstr("shown 2"));
  EXPECT_THAT(text, HasSubstr("error   bad thing"));
  EXPECT_THAT(text, testing::Not(HasSubstr("hidden")));
  EXPECT_THAT(refusal([] { log_level_named("warnin"); }), HasSubstr("did you mean 'warning'?"));
}

TEST(EngineLog, FilesRotate) {
  const Folder folder;
  {
    Log log({.console = false, .file = folder / "log.txt", .file_size = 1, .files = 2});
    const std::string line(1000, 'x');
    for (int i = 0; i < 4500; ++i) log.info("{}", line);
  }
  EXPECT_EQ(folder.file_count(), 3u);
  for (const char* file : {"log.txt", "log.1.txt", "log.2.txt"}) {
    EXPECT_LE(std::filesystem::file_size(folder / file), 1u << 20) << file;
    EXPECT_GT(std::filesystem::file_size(folder / file), 300'000u) << file;
    EXPECT_TRUE(read_text(folder / file).ends_with("x\n")) << file;
  }
}

TEST(EngineLog, AFileGoesOnWhereItEndedWithOneWriter) {
  const Folder folder;
  std::ofstream(folder / "target") << "earlier\n";
  std::filesystem::create_symlink("target", folder / "log");
  const LogSettings settings{.console = false, .file = folder / "log", .file_size = 1, .files = 1};
  {
    Log log(settings);
    log.info("first");
    EXPECT_THAT(refusal([&] { Log other(settings); }), HasSubstr("log: is being written by another run"));
    log.info("second");
  }
  EXPECT_THAT(read_text(folder / "target"), testing::MatchesRegex("earlier\n.*first\n.*second\n"));
  Log log(settings);
  const std::string line(1000, 'x');
  for (int i = 0; i < 1100; ++i) log.info("{}", line);
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "log")) << "files behind a link rotate there";
  EXPECT_THAT(read_text(folder / "target.1"), testing::StartsWith("earlier\n"));
  EXPECT_THAT(refusal([&] { Log other(settings); }), HasSubstr("another run")) << "of the new file, too";
}

TEST(EngineLog, DevicesAndPipesDoNotRotate) {
  const Folder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::size_t got = 0;
  std::thread reader([&] { got = read_text(folder / "pipe").size(); });
  {
    Log log({.console = false, .file = folder / "pipe", .file_size = 1});
    Log null({.console = false, .file = "/dev/null", .file_size = 1});
    const std::string line(1000, 'x');
    for (int i = 0; i < 1500; ++i) log.info("{}", line), null.info("{}", line);
  }
  reader.join();
  EXPECT_GT(got, 1'500'000u);
  EXPECT_EQ(folder.file_count(), 1u);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(EngineData, SeriesBecomeRows) {
  const Folder folder;
  {
    DataLog data(folder / "data.csv");
    data.set_now(7, 12, 0.2);
    data.add("depth", -3.5);
    data.add("odd,name", 1e300);
    data.flush();
  }
  EXPECT_EQ(read_text(folder / "data.csv"),
            "series,frame,step,time,value\ndepth,7,12,0.2,-3.5\nodd_name,7,12,0.2,1e+300\n");
  DataLog none;
  none.add("depth", 1);
  EXPECT_FALSE(none.is_open());
  EXPECT_THAT(refusal([] { DataLog bad("/nowhere/data.csv"); }), HasSubstr("/nowhere/data.csv"));
}

// --- trace -------------------------------------------------------------------------------------------------------

TEST(EngineTrace, ZonesOfAllThreadsNestInAChromeTrace) {
  const Folder folder;
  trace::Session session(folder / "trace.json");
  trace::name_thread("test");
  {
    const trace::Zone outer("outer");
    const trace::Zone inner("inner");
    std::thread([] {
      trace::name_thread("a \"worker\"");
      const trace::Zone zone("work");
    }).join();
  }
  const auto begin = std::chrono::steady_clock::now();
  trace::add_on_track("GPU", "kernel", begin, 0.5);
  trace::add_step({.find_pairs = 1, .update_manifolds = 2, .build_constraints = 3, .solve = 4, .finish = 5}, begin);
  trace::count("bodies", 42);
  session.stop();
  { const trace::Zone off("off"); }
  session.finish();
  const auto json = nlohmann::json::parse(read_text(folder / "trace.json"));
  std::map<std::string, nlohmann::json> named;
  std::vector<std::string> threads;
  for (const auto& event : json.at("traceEvents")) {
    if (event.at("ph") == "M")
      threads.push_back(event.at("args").at("name"));
    else
      named[event.at("name")] = event;
  }
  EXPECT_THAT(threads, testing::IsSupersetOf({"test", "a \"worker\"", "GPU"}));
  const auto start = [&](const char* name) { return named.at(name).at("ts").get<double>(); };
  const auto end = [&](const char* name) { return start(name) + named.at(name).at("dur").get<double>(); };
  EXPECT_LE(start("outer"), start("inner"));
  EXPECT_LE(end("inner"), end("outer") + 0.002);
  EXPECT_NE(named.at("work").at("tid"), named.at("outer").at("tid"));
  EXPECT_NEAR(named.at("kernel").at("dur").get<double>(), 500, 0.01);
  EXPECT_NEAR(start("solve") - start("find_pairs"), 6000, 0.01);
  EXPECT_EQ(named.at("bodies").at("args").at("value"), 42);
  EXPECT_FALSE(named.contains("off"));
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(EngineTrace, IsBounded) {
  {
    trace::Session session({}, 10);
    for (int i = 0; i < 25; ++i) const trace::Zone zone("z");
    session.stop();
    EXPECT_EQ(session.zone_count(), 10u);
    EXPECT_EQ(session.lost_count(), 15u);
  }
  trace::Session session;
  session.stop();
  EXPECT_EQ(session.zone_count(), 0u);
}

}  // namespace
}  // namespace fathom::engine::test::engine_parts_test
