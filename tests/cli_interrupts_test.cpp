// Every command ends within a second of a signal, in every mode and at any moment, and keeps its results so far.
#include <gmock/gmock.h>

#include <array>
#include <ctime>
#include <random>

#include "program.hpp"

namespace fathom::cli_interrupts_test {
namespace {

using test::operator+;
using test::Outcome;
using test::read_text;
using test::Words;
using testing::HasSubstr;
using Clock = std::chrono::steady_clock;

// Builds with checks are slower.
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
constexpr std::chrono::seconds soon{1};
constexpr std::chrono::milliseconds starting{100};  // of processor time; it takes far less
#else
constexpr std::chrono::seconds soon{15};
constexpr std::chrono::milliseconds starting{500};
#endif
constexpr int signals[] = {SIGINT, SIGTERM};
constexpr std::chrono::milliseconds moments[] = {std::chrono::milliseconds(0), std::chrono::milliseconds(60)};

class Interrupts : public fathom::test::Program {
 protected:
  /// Starts a command that would take forever, waits until it has begun `file`, then for `moment`, and sends the
  /// signal, twice as `timeout` does.
  Outcome interrupt(const Words& words, const std::string& file, int signal, std::chrono::milliseconds moment) {
    return interrupt_once(
        words, [&](pid_t) { return has_begun(file); }, signal, moment);
  }
  template <class Test>
  Outcome interrupt_once(const Words& words, const Test& has_started, int signal, std::chrono::milliseconds moment) {
    const pid_t child = start(words);
    for (int i = 0; i < 5000 && !has_started(child); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(moment);
    const Clock::time_point sent = Clock::now();
    kill(child, signal);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, signal);
    const Outcome outcome = finish(child);
    EXPECT_LT(Clock::now() - sent, soon) << testing::PrintToString(words);
    EXPECT_EQ(outcome.exit_code, 130) << testing::PrintToString(words) << outcome.err;
    for (const std::string& name : files())
      EXPECT_EQ(name.find(".part"), name.npos) << testing::PrintToString(words) << " leaves " << name;
    return outcome;
  }
  /// For longer than commands take to start.
  static bool has_worked(pid_t child) {
    clockid_t clock;
    timespec worked{};
    if (clock_getcpuclockid(child, &clock) == 0) clock_gettime(clock, &worked);
    return std::chrono::seconds(worked.tv_sec) + std::chrono::nanoseconds(worked.tv_nsec) > starting;
  }
  /// Also under its temporary name.
  bool has_begun(const std::string& file) const {
    for (const std::string& name : files())
      if (name.starts_with(file)) return true;
    return false;
  }
  void expect_recording(const std::string& name) const {
    EXPECT_EQ(fathom({"replay", path(name), "--quiet"}).exit_code, 0) << name;
    std::filesystem::remove(path(name));
  }
};

TEST_F(Interrupts, EndPlayInEveryMode) {
  const Words loops[] = {{},
                         {"--set", "loop.time=wall"},
                         {"--set", "loop.time=wall", "--set", "loop.time_scale=0"},
                         {"--set", "loop.paused=true"},
                         {"--set", "loop.time=wall", "--set", "loop.pacing=fixed", "--set", "loop.rate=1"}};
  int signal = 0;
  for (const char* mode : {"lockstep", "ahead", "async"}) {
    for (const Words& loop : loops) {
      for (const auto moment : moments) {
        const Words words{"play", "drift", "--bodies", "40", "--steps", "100000000", "--threads", "1"};
        const Words sets{"--set", "record.file=" + path("run.fathom"),  "--set", "log.console=false",
                         "--set", std::string("simulator.mode=") + mode};
        const Outcome outcome = interrupt(words + sets + loop, "run.fathom", signals[signal++ % 2], moment);
        EXPECT_THAT(outcome.out, HasSubstr("state hash"));
        expect_recording("run.fathom");
      }
    }
  }
}

TEST_F(Interrupts, EndPlayAtRandomMoments) {
  std::mt19937 random(27);
  const auto any = [&](std::initializer_list<const char*> of) { return std::string(of.begin()[random() % of.size()]); };
  for (int i = 0; i < 18; ++i) {
    const std::string simulator = std::array{"native", "device", "hybrid"}[i % 3];
    const std::string mode = std::array{"lockstep", "ahead", "async"}[i / 3 % 3];
    Words words{"play", "pyramid", "--layers", "4", "--steps", "100000000", "--threads", "1", "--simulator", simulator};
    if (simulator != "native") words = words + Words{"--device", "host"};
    for (const std::string& set :
         {"simulator.mode=" + mode, "simulator.ahead=" + any({"1", "2", "5"}), "loop.time=" + any({"steps", "wall"}),
          "loop.time_scale=" + any({"0", "0.1", "1", "30"}), "loop.pacing=" + any({"free", "fixed", "vsync"}),
          "loop.rate=" + any({"2", "60", "1000"}), "loop.paused=" + any({"false", "false", "true"}),
          "record.file=" + path("run.fathom"), "trace.file=" + path("trace.json"), "log.data=" + path("data.csv"),
          std::string("log.console=false")})
      words = words + Words{"--set", set};
    interrupt(words, "run.fathom", signals[random() % 2], std::chrono::milliseconds(random() % 150));
    expect_recording("run.fathom");
    EXPECT_TRUE(read_text(path("trace.json")).ends_with("\n]}\n"));
    EXPECT_TRUE(read_text(path("data.csv")).ends_with("\n"));
    for (const char* file : {"trace.json", "data.csv"}) std::filesystem::remove(path(file));
  }
}

// A paused loop without pacing makes a million zones per second.
TEST_F(Interrupts, EndPlayWithAFullTrace) {
  const Words words{"play", "drift", "--bodies",         "40",    "--threads",
                    "1",    "--set", "loop.paused=true", "--set", "trace.file=" + path("t.json")};
  interrupt(words, "t.json", SIGINT, std::chrono::milliseconds(1500));
  EXPECT_TRUE(read_text(path("t.json")).ends_with("\n]}\n"));
}

TEST_F(Interrupts, EndRunsWithTheirFiles) {
  for (const char* simulator : {"native", "device", "hybrid"}) {
    for (const int signal : signals) {
      for (const auto moment : moments) {
        Words words{"run",           "drift",  "--bodies",       "40",          "--steps",         "100000000",
                    "--threads",     "1",      "--quiet",        "--simulator", simulator,         "--csv",
                    path("run.csv"), "--json", path("run.json"), "--record",    path("run.fathom")};
        if (simulator != std::string("native")) words = words + Words{"--device", "host"};
        interrupt(words, "run.fathom", signal, moment);
        const auto steps = nlohmann::json::parse(read_text(path("run.json"))).at("steps").get<int>();
        const std::string rows = read_text(path("run.csv"));
        EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), steps + 1);
        if (steps > 0) expect_recording("run.fathom");
        std::filesystem::remove(path("run.fathom"));  // so that the next one has not begun
      }
    }
  }
}

TEST_F(Interrupts, EndAValidationInTheMiddleOfACaseWithTheCasesBefore) {
  for (const int signal : signals) {
    const Outcome outcome = interrupt({"validate", "--only", "free-fall", "--only", "kapla", "--threads", "1", "--json",
                                       path("v.json"), "--html", path("v.html")},
                                      "v.json", signal, std::chrono::milliseconds(300));
    EXPECT_THAT(outcome.err, HasSubstr("interrupted after 1 of 2 cases"));
    const auto report = nlohmann::json::parse(read_text(path("v.json")));
    EXPECT_EQ(report.at("finished"), false);
    ASSERT_EQ(report.at("cases").size(), 1u);
    EXPECT_EQ(report.at("cases")[0].at("name"), "free-fall");
    EXPECT_THAT(read_text(path("v.html")), HasSubstr("The suite was interrupted"));
    std::filesystem::remove(path("v.json"));
    std::filesystem::remove(path("v.html"));
  }
}

TEST_F(Interrupts, EndReplays) {
  ASSERT_EQ(fathom({"run", "drift", "--bodies", "100", "--steps", "40000", "--quiet", "--record", path("run.fathom")})
                .exit_code,
            0);
  const Outcome outcome =
      interrupt_once({"replay", path("run.fathom"), "--threads", "1"}, has_worked, SIGINT, moments[0]);
  EXPECT_THAT(outcome.err, HasSubstr("interrupted at step "));
}

#ifdef FATHOM_HAS_RENDER
TEST_F(Interrupts, EndPagesWithWhatWasDrawn) {
  for (const int signal : signals) {
    interrupt({"render", "drift", "--bodies", "5", "--web", path("p.html"), "--seconds", "100000", "--quiet"}, "p.html",
              signal, std::chrono::milliseconds(100));
    EXPECT_THAT(read_text(path("p.html")), HasSubstr("</html>"));
    std::filesystem::remove(path("p.html"));
  }
}
#endif

#ifdef FATHOM_HAS_BENCH
TEST_F(Interrupts, EndCampaignsThatGoOnLater) {
  const Words words{"bench", "campaign", "--only", "drift-100-native-1t", "--out", path("c"), "--quiet"};
  interrupt(words + Words{"--steps", "1000000"}, "c", SIGTERM, std::chrono::milliseconds(100));
  EXPECT_EQ(nlohmann::json::parse(read_text(path("c") + "/campaign.json")).at("runs").size(), 0u);
}
#endif

}  // namespace
}  // namespace fathom::cli_interrupts_test
