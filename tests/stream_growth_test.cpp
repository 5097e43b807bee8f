// Long streams: what comes and goes in every step leaves nothing behind in memory, snapshots or time.
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <fstream>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::stream_growth_test {
namespace {

using test::Generator;
using test::uniform;

struct Kind {
  const char* name;
  int living, a_step;
  bool hulls;     ///< each body has its own
  bool asleep;    ///< bodies fall asleep, and are removed together while asleep
  bool reads;     ///< contacts and events, in every step
  int ahead = 0;  ///< on a device
};
constexpr Kind kinds[] = {
    {.name = "hulls of their own", .living = 20, .a_step = 1, .hulls = true, .asleep = false, .reads = false},
    {.name = "hulls, read, ahead",
     .living = 12,
     .a_step = 2,
     .hulls = true,
     .asleep = false,
     .reads = true,
     .ahead = 2},
    {.name = "asleep", .living = 20, .a_step = 20, .hulls = false, .asleep = true, .reads = false},
    {.name = "asleep, read", .living = 7, .a_step = 7, .hulls = true, .asleep = true, .reads = true},
    {.name = "read", .living = 200, .a_step = 5, .hulls = false, .asleep = false, .reads = true},
    {.name = "not read, ahead",
     .living = 100,
     .a_step = 10,
     .hulls = false,
     .asleep = false,
     .reads = false,
     .ahead = 3},
};

struct Measured {
  std::size_t memory = 0, snapshot = 0, resident = 0;
  double seconds = 1e9;  ///< for the fastest ten consecutive steps
};

/// 0 if the allocator retains freed memory.
std::size_t resident_bytes() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 0;
#else
  std::ifstream file("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * 4096;
#endif
}

class Growing {
 public:
  Growing(const Kind& kind, const WorldDef& def, unsigned seed) : kind_(kind), random_(seed), world_(def) {
    world_.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({50, 50, 0.5f})});
    if (kind.reads && !kind.asleep)
      for (int i = 0; i < 200; ++i)
        world_.add(
            {.pose = {.position = {0.6f * static_cast<float>(i % 20), 20, 0.25f + 0.5f * static_cast<float>(i / 20)}},
             .shape = box({0.25f, 0.25f, 0.25f}),
             .density = 1000});
  }

  Measured run(int steps) {
    Measured most;
    auto begin = std::chrono::steady_clock::now();
    for (int i = 1; i <= steps; ++i) {
      step();
      if (i % 10) continue;
      world_.wait();
      const auto now = std::chrono::steady_clock::now();
      most.seconds = std::min(most.seconds, std::chrono::duration<double>(now - begin).count());
      most.memory = std::max<std::size_t>(most.memory, world_.profile().counts.memory_bytes);
      std::vector<std::byte> snapshot;
      world_.save(snapshot);
      most.snapshot = std::max(most.snapshot, snapshot.size());
      begin = std::chrono::steady_clock::now();
    }
    most.resident = resident_bytes();
    return most;
  }

 private:
  void add() {
    BodyDef def;
    const float place = static_cast<float>(living_.size());
    def.shape = box({0.2f, 0.2f, 0.2f});
    if (kind_.hulls) {
      std::vector<Vec3> points(20);
      for (Vec3& point : points) point = 0.3f * test::in_cube(random_);
      def.shape = hull(points);
    }
    def.density = 1000;
    def.pose.position = {uniform(random_, -3, 3), uniform(random_, -3, 3), uniform(random_, 0.5f, 2)};
    if (kind_.asleep) def.pose.position = {1.2f * place - 12, 0, 0.25f};
    living_.push_back(world_.add(def));
  }

  void step() {
    constexpr int to_fall_asleep = 60;
    if (!kind_.asleep || world_.step_count() % to_fall_asleep == 0) {
      for (int i = 0; i < kind_.a_step; ++i) add();
      for (; static_cast<int>(living_.size()) > kind_.living; living_.pop_front()) world_.remove(living_.front());
    }
    world_.step();
    if (!kind_.reads) return;
    world_.for_each_contact([](const ContactInfo&) {});
    (void)(world_.contacts_begun().size() + world_.contacts_ended().size() + world_.hits().size());
  }

  Kind kind_;
  Generator random_;
  World world_;
  std::deque<BodyId> living_;
};

TEST(StreamGrowth, LeavesNothingBehind) {
  std::vector<WorldDef> worlds{test::sleepy_world()};
  if (worlds[0].simulator == SimulatorKind::native)
    for (const SimulatorKind kind : {SimulatorKind::hybrid, SimulatorKind::device}) {
      worlds.push_back(worlds[0]);
      worlds.back().simulator = kind;
      worlds.back().device = test::test_device();
    }
  unsigned seed = 0;
  for (WorldDef def : worlds)
    for (const Kind& kind : kinds) {
      SCOPED_TRACE(std::string(kind.name) + ", simulator " + std::to_string(static_cast<int>(def.simulator)));
      def.ahead = def.simulator == SimulatorKind::device ? kind.ahead : 0;
      Growing stream(kind, def, ++seed);
      stream.run(180);
      const Measured early = stream.run(240);
      stream.run(480);
      const Measured late = stream.run(240);
      EXPECT_LE(late.memory, early.memory + early.memory / 8);
      EXPECT_LE(late.snapshot, early.snapshot + early.snapshot / 8);
      EXPECT_LE(late.resident, early.resident + (std::size_t{2} << 20));
      EXPECT_LE(late.seconds, 2.5 * early.seconds);
    }
}

}  // namespace
}  // namespace fathom::stream_growth_test
