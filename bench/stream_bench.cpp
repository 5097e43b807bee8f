// A stream: bodies that come and go in every step, and the cost of reading their results.
//
//     stream_bench [--device D] [--native|--hybrid] [--ahead N] [--threads N] [--bodies N] [--churn N] [--steps N]
//                  [--hulls] [--density N] [--read nothing|poses|events|contacts|all]
//
// The given number of bodies rain on a floor, `density` (1) per square metre; in every step `churn` of them arrive at
// the top, and the oldest are removed. Times are the host's, from the first call for a step to the last: `calls` is
// adding and removing, `step` the call of that name, `read` the requested reading. A run also waits for the results of
// its last step, so the sum is the time of a frame. The first 120 steps do not count. If nothing is read and nothing
// waits, `step` is the device's pace.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <random>
#include <string>
#include <vector>

#include "fathom/error.hpp"
#include "fathom/world.hpp"

namespace fathom {
namespace {

struct Options {
  WorldDef world;
  int bodies = 30000, churn = 100, steps = 600;
  bool hulls = false;
  float density = 1;  ///< bodies/m²
  std::string read = "nothing";
};

double median(std::vector<double> values, double q = 0.5) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

class Stream {
 public:
  explicit Stream(const Options& options) : options_(options), world_(options.world) {
    world_.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({500, 500, 0.5f})});
    for (int i = 0; i < options.bodies; ++i) add(0.6f + 12 * unit());
  }

  void exchange() {
    for (int i = 0; i < options_.churn; ++i) {
      world_.remove(living_.front());
      living_.pop_front();
    }
    for (int i = 0; i < options_.churn; ++i) add(13);
  }
  void read() {
    const std::string& what = options_.read;
    if (what == "poses" || what == "all") sum_ += world_.poses().size() + world_.velocities().size();
    if (what == "events" || what == "all")
      sum_ += world_.contacts_begun().size() + world_.contacts_ended().size() + world_.hits().size();
    if (what == "contacts" || what == "all") world_.for_each_contact([&](const ContactInfo&) { ++sum_; });
  }
  World& world() { return world_; }
  std::size_t sum() const { return sum_; }

 private:
  float unit() { return static_cast<float>(random_() >> 8) * 0x1p-24f; }

  void add(float height) {
    const float side = 0.5f * std::sqrt(static_cast<float>(options_.bodies) / options_.density);
    BodyDef def;
    const float size = 0.2f + 0.2f * unit();
    switch (random_() % 3) {
      case 0:
        def.shape = sphere(size);
        break;
      case 1:
        def.shape = capsule(0.6f * size, 0.4f * size);
        break;
      default:
        def.shape = box({size, 0.8f * size, 0.6f * size});
    }
    if (options_.hulls) {
      std::vector<Vec3> points(16);
      for (Vec3& p : points) p = 2 * size * (Vec3{unit(), unit(), unit()} - Vec3{0.5f, 0.5f, 0.5f});
      def.shape = hull(points);
    }
    def.density = 1000;
    def.pose.position = {side * (2 * unit() - 1), side * (2 * unit() - 1), height};
    living_.push_back(world_.add(def));
  }

  Options options_;
  std::mt19937 random_{1};
  World world_;
  std::deque<BodyId> living_;
  std::size_t sum_ = 0;
};

void measure(const Options& options) {
  constexpr int start_up = 120;
  Stream stream(options);
  World& world = stream.world();
  std::vector<double> calls, steps, reads, sums;
  StepCounts counts;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto milliseconds = [](auto duration) { return std::chrono::duration<double, std::milli>(duration).count(); };
  auto first = now();
  for (int i = 0; i < start_up + options.steps; ++i) {
    if (i == start_up) world.wait(), first = now();
    const auto begin = now();
    stream.exchange();
    const auto asked = now();
    world.step();
    const auto stepped = now();
    stream.read();
    const auto end = now();
    if (i < start_up) continue;
    calls.push_back(milliseconds(asked - begin));
    steps.push_back(milliseconds(stepped - asked));
    reads.push_back(milliseconds(end - stepped));
    sums.push_back(milliseconds(end - begin));
  }
  world.wait();
  const double mean = milliseconds(now() - first) / options.steps;
  counts = world.profile().counts;
  const StageTimes& t = world.profile().times;
  std::printf(
      "%d bodies, %d come and go, ahead %d, reading %s: mean %.4f ms per step, median %.4f, p99 %.4f "
      "(calls %.4f, step %.4f, read %.4f)\n",
      options.bodies, options.churn, options.world.ahead, options.read.c_str(), mean, median(sums), median(sums, 0.99),
      median(calls), median(steps), median(reads));
  std::printf(
      "  last step: pairs %.4f manifolds %.4f build %.4f solve %.4f finish %.4f ms; %u pairs, %u manifolds, %u "
      "colours, "
      "%llu launches, %llu bytes to, %llu from the device, %.1f MiB; hash %016llx\n",
      t.find_pairs, t.update_manifolds, t.build_constraints, t.solve, t.finish, counts.pairs, counts.manifolds,
      counts.colours, static_cast<unsigned long long>(counts.launches),
      static_cast<unsigned long long>(counts.bytes_to_device), static_cast<unsigned long long>(counts.bytes_to_host),
      static_cast<double>(counts.memory_bytes) / (1 << 20), static_cast<unsigned long long>(world.state_hash()));
}

Options parse(int argc, char** argv) {
  Options options;
  options.world.simulator = SimulatorKind::device;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const auto value = [&]() -> std::string {
      if (i + 1 == argc) throw Error(ErrorCode::invalid_argument, argument + " needs a value");
      return argv[++i];
    };
    const auto number = [&] { return std::atoi(value().c_str()); };
    if (argument == "--device")
      options.world.device = value();
    else if (argument == "--native")
      options.world.simulator = SimulatorKind::native;
    else if (argument == "--hybrid")
      options.world.simulator = SimulatorKind::hybrid;
    else if (argument == "--ahead")
      options.world.ahead = number();
    else if (argument == "--threads")
      options.world.threads = number();
    else if (argument == "--bodies")
      options.bodies = number();
    else if (argument == "--churn")
      options.churn = number();
    else if (argument == "--steps")
      options.steps = number();
    else if (argument == "--density")
      options.density = static_cast<float>(std::atof(value().c_str()));
    else if (argument == "--hulls")
      options.hulls = true;
    else if (argument == "--read")
      options.read = value();
    else
      throw Error(ErrorCode::invalid_argument, "unknown option '" + argument + "'");
  }
  return options;
}

}  // namespace
}  // namespace fathom

int main(int argc, char** argv) {
  try {
    fathom::measure(fathom::parse(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "stream_bench: %s\n", error.what());
    return 1;
  }
}
