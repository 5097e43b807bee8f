// The step of the device simulator on given scenes: durations, spikes, stages, memory, quality.
//
//     device_bench [options] scene:size[:steps] … [options] scene:size[:steps] …
//
//     --device D  --ahead N  --copy  --threads N  --gpu|--native|--hybrid  --name TEXT
//     --preset fathom|dissertation  --broad-phase tree|sweep  --partition colours|cells  --solver soft|impulse
//     --warm-start on|off  --rounds N  --push-out M/S  --series FILE
//
// Options apply to the scenes after them; a preset sets all algorithms, and options after it change some. `unbatched`
// is the mean of all steps, `overlaps` the maximum of one body. A step's duration is `Profile::interval`. Results stay
// on the device; with --copy they are copied to the host after every step. The first 60 steps count as start-up, except
// for scenes shorter than 120 steps. Spikes are steps relative to the median of the 61 steps around them. `--series`
// appends every such step: scene, bodies, step, ms, each stage's ms, pairs, manifolds, colours.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "fathom/error.hpp"
#include "scene/environments.hpp"
#include "scene/quality.hpp"
#include "scene/scene.hpp"

namespace fathom {
namespace {

struct Options {
  SimulatorKind simulator = SimulatorKind::device;
  std::string device = "auto";
  int ahead = 2;
  bool copy_results = false;
  int threads = 0;
  WorldDef algorithms;  ///< only the members that presets set are used
  std::string name = "fathom";
  std::string series_file;
};

struct Run {
  Options options;
  std::string name;
  std::int64_t size = 0;
  std::uint64_t steps = 600;
};

Run parse_run(const std::string& text) {
  Run run;
  const std::size_t first = text.find(':');
  if (first == std::string::npos)
    throw Error(ErrorCode::invalid_argument, "'" + text + "' is not a scene:size[:steps]");
  const std::size_t second = text.find(':', first + 1);
  run.name = text.substr(0, first);
  run.size = std::atoll(text.substr(first + 1, second - first - 1).c_str());
  if (second != std::string::npos) run.steps = static_cast<std::uint64_t>(std::atoll(text.substr(second + 1).c_str()));
  return run;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

/// Each step's duration over the median of the 61 steps around it.
std::vector<double> ratios(const std::vector<double>& series) {
  std::vector<double> result;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const std::size_t begin = i < 30 ? 0 : i - 30, end = std::min(series.size(), i + 31);
    const auto first = series.begin() + static_cast<std::ptrdiff_t>(begin);
    result.push_back(series[i] / quantile({first, series.begin() + static_cast<std::ptrdiff_t>(end)}, 0.5));
  }
  return result;
}

void print_head() {
  std::printf(
      "algorithms         scene      bodies   median      p99      max | p99/med max/med | pairs  manifolds update  "
      "build   solve finish "
      "| kernels MiB | manifolds   points colours unbatched overlaps | penetr.mm  deep.mm  gap.mm displ.m energy.J "
      "below "
      "escaped bad | hash\n");
}

/// One line for each step.
void append(const std::string& file, const std::string& text) {
  std::FILE* const out = std::fopen(file.c_str(), "a");
  if (!out) throw Error(ErrorCode::invalid_argument, "cannot write '" + file + "': choose another --series");
  std::fputs(text.c_str(), out);
  std::fclose(out);
}

void take_algorithms(const WorldDef& from, WorldDef& to) {
  to.broad_phase = from.broad_phase;
  to.partition = from.partition;
  to.solver = from.solver;
}

void measure(const Run& run) {
  const Options& options = run.options;
  const Environment* environment = find_environment(run.name);
  if (!environment) throw Error(ErrorCode::invalid_argument, "no environment '" + run.name + "'");
  // The size of pyramids is in layers.
  Scene scene = environment->make(run.name == "pyramid" ? environment->bodies_of_layers(run.size) : run.size);
  scene.world.simulator = options.simulator;
  scene.world.device = options.device;
  scene.world.ahead = options.ahead;
  scene.world.copy_results = options.copy_results;
  scene.world.threads = options.threads;
  take_algorithms(options.algorithms, scene.world);
  World world(scene.world);
  SceneInstance instance(scene, world);
  std::vector<double> series, stages[5];
  std::uint64_t seen = 0;
  std::string lines;
  double unbatched = 0, overlaps = 0;
  Profile last;
  for (std::uint64_t step = 0; step < run.steps; ++step) {
    instance.prepare_step();
    const auto start = std::chrono::steady_clock::now();
    world.step();
    const Profile& p = world.profile();
    const double wall = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (p.step == seen) continue;
    seen = p.step;
    unbatched += p.counts.unbatched;
    overlaps = std::max<double>(overlaps, p.counts.overlaps);
    if (run.steps < 120 || p.step > 60) {
      series.push_back(p.interval > 0 ? p.interval : wall);
      const StageTimes& t = p.times;
      const double values[5] = {t.find_pairs, t.update_manifolds, t.build_constraints, t.solve, t.finish};
      for (int k = 0; k < 5; ++k) stages[k].push_back(values[k]);
      if (!options.series_file.empty()) {
        char line[200];
        std::snprintf(line, sizeof line, "%s %zu %llu %.4f %.4f %.4f %.4f %.4f %.4f %u %u %u\n", run.name.c_str(),
                      dynamic_body_count(scene), static_cast<unsigned long long>(p.step), series.back(), values[0],
                      values[1], values[2], values[3], values[4], p.counts.pairs, p.counts.manifolds, p.counts.colours);
        lines += line;
      }
    }
    last = p;
  }
  world.wait();
  if (!lines.empty()) append(options.series_file, lines);
  last = world.profile();
  const Quality q = measure_quality(scene, instance, world);
  const std::vector<double> ratio = ratios(series);
  std::printf("%-18s %-9s %8zu %8.4f %8.4f %8.4f | %7.2f %7.2f |", options.name.c_str(), run.name.c_str(),
              dynamic_body_count(scene), quantile(series, 0.5), quantile(series, 0.99), quantile(series, 1.0),
              quantile(ratio, 0.99), quantile(ratio, 1.0));
  for (const auto& stage : stages) std::printf(" %7.4f", quantile(stage, 0.5));
  std::printf(" | %4llu %7.1f | %8u %8u %3u %8.1f %3.0f | %7.3f %7.3f %7.3f %8.5f %8.2g %llu %llu %llu | %016llx\n",
              static_cast<unsigned long long>(last.counts.launches),
              static_cast<double>(last.counts.memory_bytes) / (1 << 20), last.counts.manifolds, last.counts.points,
              last.counts.colours, unbatched / static_cast<double>(run.steps), overlaps, 1e3 * q.ground_penetration_max,
              1e3 * q.overlap_max, 1e3 * q.joint_gap_max, q.displacement_max, q.kinetic_energy_per_body,
              static_cast<unsigned long long>(q.bodies_below_ground), static_cast<unsigned long long>(q.escaped),
              static_cast<unsigned long long>(q.non_finite), static_cast<unsigned long long>(world.state_hash()));
  std::fflush(stdout);
}

}  // namespace
}  // namespace fathom

int main(int argc, char** argv) {
  using namespace fathom;
  Options options;
  std::vector<Run> runs;
  try {
    for (int i = 1; i < argc; ++i) {
      const std::string argument = argv[i];
      const auto value = [&]() -> std::string {
        if (i + 1 == argc) throw Error(ErrorCode::invalid_argument, argument + " needs a value");
        return argv[++i];
      };
      if (argument == "--device")
        options.device = value();
      else if (argument == "--native")
        options.simulator = SimulatorKind::native;
      else if (argument == "--ahead")
        options.ahead = std::atoi(value().c_str());
      else if (argument == "--copy")
        options.copy_results = true;
      else if (argument == "--threads")
        options.threads = std::atoi(value().c_str());
      else if (argument == "--hybrid")
        options.simulator = SimulatorKind::hybrid;
      else if (argument == "--gpu")
        options.simulator = SimulatorKind::device;
      else if (argument == "--preset") {
        const std::string preset = value();
        options.algorithms = {.simulator = options.simulator};
        apply(preset == "dissertation" ? Preset::dissertation : Preset::fathom, options.algorithms);
      } else if (argument == "--broad-phase")
        options.algorithms.broad_phase = value() == "sweep" ? BroadPhase::sweep : BroadPhase::tree;
      else if (argument == "--partition")
        options.algorithms.partition = value() == "cells" ? Partition::cells : Partition::colours;
      else if (argument == "--solver")
        options.algorithms.solver.method = value() == "impulse" ? Solver::impulse : Solver::soft;
      else if (argument == "--warm-start")
        options.algorithms.solver.warm_start = value() == "on";
      else if (argument == "--rounds")
        options.algorithms.solver.marking_rounds = std::atoi(value().c_str());
      else if (argument == "--push-out")
        options.algorithms.solver.push_out_velocity = static_cast<float>(std::atof(value().c_str()));
      else if (argument == "--series")
        options.series_file = value();
      else if (argument == "--name")
        options.name = value();
      else {
        runs.push_back(parse_run(argument));
        runs.back().options = options;
      }
    }
    if (runs.empty())
      for (const char* run : {"drift:1000", "layers:1000", "spread:1000", "pyramid:10"}) {
        runs.push_back(parse_run(run));
        runs.back().options = options;
      }
    print_head();
    for (const Run& run : runs) measure(run);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "device_bench: %s\n", error.what());
    return 2;
  }
}
