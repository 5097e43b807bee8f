// The execution layer's primitives and the simulators' stages against the machine's limit: the bandwidth of its memory,
// measured first, in the same run. The counter `of_limit` is the share of it that is reached, from the bytes that the
// work cannot do without; what fits into caches can exceed 1. limits_bench.cpp runs it on the host,
// limits_bench_cuda.cu on CUDA.
#pragma once

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "exec_bench.hpp"
#include "scene/environments.hpp"

namespace fathom::bench {

using namespace exec;

/// Bytes a second, read and written, of the better of two ways to copy what no cache holds.
template <class D>
double measure_bandwidth(D& device) {
  constexpr std::uint32_t n = 1u << 24;  // of 16 bytes
  Buffer<exec::bench::Aligned4> a(device, n), b(device, n);
  device.zero(a.data(), n);
  const double by_kernel = exec::bench::microseconds(
      device,
      [&] {
        device.parallel_for(n, exec::bench::CopyVectors{a.data(), b.data()});
      },
      9);
  const double by_copy = exec::bench::microseconds(
      device, [&] { device.copy(b.data(), a.data(), n); }, 9);
  return 2.0 * n * sizeof(exec::bench::Aligned4) / (1e-6 * std::min(by_kernel, by_copy));
}

/// Times `work` with the wait for its end; `before` is not timed. `bytes` it cannot do without; 0 where no limit is
/// known.
template <class D, class Before, class Work>
void time(benchmark::State& state, D& device, double bytes, double bandwidth, Before&& before, Work&& work) {
  double seconds = 0;
  for (auto _ : state) {
    before();
    device.wait();
    const auto start = std::chrono::steady_clock::now();
    work();
    device.wait();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(taken.count());
    seconds += taken.count();
  }
  if (bytes > 0) state.counters["of_limit"] = bytes / bandwidth * static_cast<double>(state.iterations()) / seconds;
}

template <class D>
void register_primitives(D& device, double bandwidth) {
  using Word = std::uint32_t;
  const auto add = [&](const std::string& name, auto&& body) {
    benchmark::RegisterBenchmark(name.c_str(), body)->UseManualTime()->Unit(benchmark::kMicrosecond);
  };
  const auto nothing = [] {};
  add("exec/launch_and_wait", [&device, nothing, bandwidth](benchmark::State& state) {
    Buffer<Word> word(device, 1);
    device.zero(word.data(), 1);
    time(state, device, 0, bandwidth, nothing, [&] { device.parallel_for(1, exec::bench::Increment{word.data()}); });
  });
  for (const Word n : {10'000u, 1'000'000u, 16'000'000u}) {
    const std::string size = "/" + std::to_string(n);
    add("exec/copy" + size, [&device, nothing, bandwidth, n](benchmark::State& state) {
      Buffer<Word> a(device, n), b(device, n);
      device.zero(a.data(), n);
      time(state, device, 8.0 * n, bandwidth, nothing, [&] { device.copy(b.data(), a.data(), n); });
    });
    add("exec/parallel_for" + size, [&device, nothing, bandwidth, n](benchmark::State& state) {
      Buffer<Word> words(device, n);
      device.zero(words.data(), n);
      time(state, device, 8.0 * n, bandwidth, nothing,
           [&] { device.parallel_for(n, exec::bench::Increment{words.data()}); });
    });
    add("exec/exclusive_scan" + size, [&device, nothing, bandwidth, n](benchmark::State& state) {
      Scratch scratch(device);
      scratch.reserve(device.scan_scratch_bytes(n));
      Buffer<Word> in(device, n), out(device, n), total(device, 1);
      device.fill(in.data(), n, 1u);
      time(state, device, 8.0 * n, bandwidth, nothing,
           [&] { device.exclusive_scan(scratch, n, in.data(), out.data(), total.data()); });
    });
    add("exec/reduce" + size, [&device, nothing, bandwidth, n](benchmark::State& state) {
      Scratch scratch(device);
      scratch.reserve(reduce_scratch_bytes<Word>());
      Buffer<Word> in(device, n), total(device, 1);
      device.fill(in.data(), n, 1u);
      time(state, device, 4.0 * n, bandwidth, nothing,
           [&] { reduce(device, scratch, n, LoadFrom<Word>{in.data()}, Max{}, 0u, total.data()); });
    });
    // Keys and values have to be read and written once at least; a radix sort does so once a digit.
    add("exec/sort_by_key" + size, [&device, bandwidth, n](benchmark::State& state) {
      Scratch scratch(device);
      scratch.reserve(device.template sort_scratch_bytes<Word>(n));
      Buffer<Word> keys(device, n), values(device, n);
      time(
          state, device, 16.0 * n, bandwidth,
          [&] {
            device.parallel_for(n, exec::bench::Scramble<Word>{keys.data(), values.data()});
          },
          [&] { device.sort_by_key(scratch, n, keys.data(), values.data()); });
    });
  }
}

/// Bytes that a stage has to read and write at least where all its bodies and contacts take part, each array once a
/// pass: poses and velocities of 32 bytes, boxes of 24, manifolds of 96, three impulses of 4 a point. A stage that
/// leaves out what has not changed exceeds 1.
struct StageBytes {
  double find_pairs, update_manifolds, solve;

  StageBytes(const StepCounts& c, int substeps)
      : find_pairs(c.active * (32.0 + 24) + c.pairs * 8.0),
        update_manifolds(c.active * 32.0 + c.manifolds * 96.0),
        // A sweep and a relax sweep a substep read manifolds and change impulses and bodies.
        solve(substeps * (c.active * 128.0 + 2 * (c.manifolds * 96.0 + c.points * 24.0)) + c.active * 64.0) {}
};

/// The steps of a scene at work, with the share of every stage.
inline void register_steps(const WorldDef& wanted, const std::string& where, double bandwidth) {
  struct Entry {
    const char* environment;
    std::int64_t bodies;
    int settle;  ///< steps before the first timed one
  };
  for (const Entry& entry : {Entry{"drift", 10'000, 60},
                             {"spread", 10'000, 60},
                             {"pyramid", 9'455, 60},
                             {"drift", 100'000, 30},
                             {"spread", 100'000, 30}}) {
    const std::string name = "step/" + where + "/" + entry.environment + "/" + std::to_string(entry.bodies);
    benchmark::RegisterBenchmark(
        name.c_str(),
        [=](benchmark::State& state) {
          Scene scene = find_environment(entry.environment)->make(entry.bodies);
          scene.world.simulator = wanted.simulator, scene.world.device = wanted.device;
          scene.world.threads = wanted.threads;
          World world(scene.world);
          SceneInstance instance(scene, world);
          for (int i = 0; i < entry.settle; ++i) instance.prepare_step(), world.step();
          StageTimes sum;
          double share[3] = {}, steps = 0;
          for (auto _ : state) {
            instance.prepare_step();
            world.step();
            const Profile& p = world.profile();
            const StageBytes bytes(p.counts, scene.world.solver.substeps);
            const StageTimes& t = p.times;
            const double resolution = t.collision_resolution();
            share[0] += bytes.find_pairs / bandwidth / (1e-3 * std::max(t.find_pairs, 1e-6));
            share[1] += bytes.update_manifolds / bandwidth / (1e-3 * std::max(t.update_manifolds, 1e-6));
            share[2] += bytes.solve / bandwidth / (1e-3 * std::max(resolution, 1e-6));
            sum.find_pairs += t.find_pairs, sum.update_manifolds += t.update_manifolds, sum.solve += resolution;
            ++steps;
            state.SetIterationTime(1e-3 * t.total());
          }
          state.counters["pairs_us"] = 1e3 * sum.find_pairs / steps,
          state.counters["pairs_of_limit"] = share[0] / steps;
          state.counters["manifolds_us"] = 1e3 * sum.update_manifolds / steps;
          state.counters["manifolds_of_limit"] = share[1] / steps;
          state.counters["resolution_us"] = 1e3 * sum.solve / steps;
          state.counters["resolution_of_limit"] = share[2] / steps;
        })
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  }
}

inline void say_bandwidth(const std::string& where, double bandwidth) {
  std::printf("%s: %.1f GB/s of memory bandwidth, read and written\n", where.c_str(), 1e-9 * bandwidth);
  std::fflush(stdout);
}

}  // namespace fathom::bench
