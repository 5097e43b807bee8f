// Benchmarks of launches, copies and primitives on a device.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "exec/device.hpp"
#include "exec/reduce.hpp"
#include "limits_bench.hpp"

namespace fathom::bench {

using namespace exec;
using Word = std::uint32_t;

struct Increment {
  Word* numbers;
  FATHOM_HD void operator()(std::uint32_t i) const { ++numbers[i]; }
};

struct IncrementPhases {
  Word* numbers;
  std::uint32_t phase_count;
  std::uint32_t width;
  FATHOM_HD std::uint32_t phases() const { return phase_count; }
  FATHOM_HD std::uint32_t items(std::uint32_t) const { return width; }
  FATHOM_HD void operator()(std::uint32_t, std::uint32_t i) const { ++numbers[i]; }
};

struct alignas(16) Aligned4 {
  float x, y, z, w;
};
struct CopyVectors {
  const Aligned4* from;
  Aligned4* to;
  FATHOM_HD void operator()(std::uint32_t i) const { to[i] = from[i]; }
};

/// Unordered keys: the top bits of a multiplicative hash.
template <class Key>
struct Scramble {
  Key* keys;
  Word* values;
  FATHOM_HD void operator()(std::uint32_t i) const {
    keys[i] = static_cast<Key>((i + 1) * 0x9e3779b97f4a7c15u >> (64 - 8 * sizeof(Key)));
    values[i] = i;
  }
};

/// Registers all of them. The benchmarks share the device and run after `add` is gone.
template <class D>
class Primitives {
 public:
  explicit Primitives(std::shared_ptr<D> device) : device_(std::move(device)) {
    limits_ = {device_->info().name, measure_bandwidth()};
  }

  Limits add() const {
    for (const Word n : {1u, 16'384u, 262'144u}) add_launches(n);
    add_copies();
    for (const Word n : {10'000u, 100'000u, 1'000'000u, 16'000'000u}) {
      add_loops(n);
      add_primitives(n);
      add_sort<std::uint32_t>(n);
      add_sort<std::uint64_t>(n);
    }
    return limits_;
  }

 private:
  /// A benchmark's device, and what is needed to time it.
  struct Bench {
    D& device;
    double bandwidth;
    benchmark::State& state;

    /// Times `work` until it has finished; `before` is not timed. `bytes` is the minimum it must move; 0 if no limit is
    /// known.
    template <class Work, class Before>
    void time(double bytes, Work&& work, Before&& before) {
      before();
      work();  // triggers run-time compilation
      double seconds = 0;
      for (auto _ : state) {
        before();
        const double taken = seconds_of(device, work);
        state.SetIterationTime(taken);
        seconds += taken;
      }
      const auto iterations = static_cast<double>(state.iterations());
      if (bytes > 0) state.counters["of_limit"] = bytes / bandwidth * iterations / seconds;
    }
    template <class Work>
    void time(double bytes, Work&& work) {
      time(bytes, work, [] {});
    }
    /// A chain of `links`; the counter `each` is the time of one.
    template <class Work>
    void time_chain(int links, Work&& work) {
      time(0, work);
      using benchmark::Counter;
      state.counters["each"] = Counter(links, Counter::kIsIterationInvariantRate | Counter::kInvert);
    }
  };

  template <class Work>
  static double seconds_of(D& device, Work&& work) {
    device.wait();
    const auto start = std::chrono::steady_clock::now();
    work();
    device.wait();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  /// Bytes per second, read and written, for the better of two ways to copy data that fits in no cache.
  double measure_bandwidth() const {
    constexpr std::uint32_t n = 1u << 24;  // elements of 16 bytes
    D& device = *device_;
    Buffer<Aligned4> a(device, n), b(device, n);
    device.zero(a.data(), n);
    const auto median = [&](auto&& work) {
      std::vector<double> times;
      for (int i = 0; i < 11; ++i) times.push_back(seconds_of(device, work));
      std::sort(times.begin() + 2, times.end());  // the first two warm up
      return times[6];
    };
    const double by_kernel = median([&] { device.parallel_for(n, CopyVectors{a.data(), b.data()}); });
    const double by_copy = median([&] { device.copy(b.data(), a.data(), n); });
    return 2.0 * n * sizeof(Aligned4) / std::min(by_kernel, by_copy);
  }

  template <class Body>
  void add(const std::string& name, Body body) const {
    benchmark::RegisterBenchmark(("exec/" + name).c_str(),
                                 [device = device_, bandwidth = limits_.bandwidth, body](benchmark::State& state) {
                                   body(Bench{*device, bandwidth, state});
                                 })
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  }

  void add_launches(Word n) const {
    constexpr int links = 200;
    const std::string items = "/" + std::to_string(n);
    /// Chains of launches over all items, plain and as a graph; with a count on the device, below the capacity.
    const auto chain = [&](const std::string& name, bool counted, bool graph) {
      add(name + items, [=](Bench bench) {
        D& device = bench.device;
        Buffer<Word> numbers(device, n), count(device, 1);
        device.zero(numbers.data(), n);
        device.fill(count.data(), 1, n);
        const auto submit = [&] {
          for (int i = 0; i < links; ++i) {
            if (counted)
              device.parallel_for({count.data(), 4 * n}, Increment{numbers.data()});
            else
              device.parallel_for(n, Increment{numbers.data()});
          }
        };
        if (!graph) return bench.time_chain(links, submit);
        auto recorded = device.record(submit);
        bench.time_chain(links, [&] { device.launch(recorded); });
      });
    };
    chain("launch", false, false);
    chain("launch_in_graph", false, true);
    chain("launch_counted", true, false);
    chain("launch_counted_in_graph", true, true);
    add("phase" + items, [=](Bench bench) {
      Buffer<Word> numbers(bench.device, n);
      bench.device.zero(numbers.data(), n);
      bench.time_chain(links, [&] {
        bench.device.parallel_phases(links, n, IncrementPhases{numbers.data(), links, n});
      });
    });
    add("launch_and_wait" + items, [=](Bench bench) {
      Buffer<Word> numbers(bench.device, n);
      bench.device.zero(numbers.data(), n);
      bench.time(0, [&] { bench.device.parallel_for(n, Increment{numbers.data()}); });
    });
  }

  /// Between host and device, not limited by memory bandwidth.
  void add_copies() const {
    constexpr std::uint32_t n = 1u << 22;  // 64 MiB
    const auto copy = [&](const std::string& name, bool to_device) {
      add(name + "/64MiB", [=](Bench bench) {
        Buffer<Aligned4> there(bench.device, n);
        PinnedBuffer<Aligned4> here(bench.device, n);
        bench.device.zero(there.data(), n);
        bench.time(0, [&] {
          if (to_device)
            bench.device.copy_to_device(there.data(), here.data(), n);
          else
            bench.device.copy_to_host(here.data(), there.data(), n);
        });
        bench.state.SetBytesProcessed(bench.state.iterations() * n * static_cast<std::int64_t>(sizeof(Aligned4)));
      });
    };
    copy("copy_to_device", true);
    copy("copy_to_host", false);
  }

  void add_loops(Word n) const {
    const std::string size = "/" + std::to_string(n);
    add("copy" + size, [=](Bench bench) {
      Buffer<Word> a(bench.device, n), b(bench.device, n);
      bench.device.zero(a.data(), n);
      bench.time(8.0 * n, [&] { bench.device.copy(b.data(), a.data(), n); });
    });
    add("parallel_for" + size, [=](Bench bench) {
      Buffer<Word> words(bench.device, n);
      bench.device.zero(words.data(), n);
      bench.time(8.0 * n, [&] { bench.device.parallel_for(n, Increment{words.data()}); });
    });
    add("parallel_for_16_bytes" + size, [=](Bench bench) {
      Buffer<Aligned4> a(bench.device, n), b(bench.device, n);
      bench.device.zero(a.data(), n);
      bench.time(2.0 * sizeof(Aligned4) * n, [&] { bench.device.parallel_for(n, CopyVectors{a.data(), b.data()}); });
    });
  }

  void add_primitives(Word n) const {
    const std::string size = "/" + std::to_string(n);
    add("exclusive_scan" + size, [=](Bench bench) {
      D& device = bench.device;
      Scratch scratch(device);
      scratch.reserve(device.scan_scratch_bytes(n));
      Buffer<Word> in(device, n), out(device, n), total(device, 1);
      device.fill(in.data(), n, 1u);
      bench.time(8.0 * n, [&] { device.exclusive_scan(scratch, n, in.data(), out.data(), total.data()); });
    });
    add("select" + size, [=](Bench bench) {
      D& device = bench.device;
      Scratch scratch(device);
      scratch.reserve(device.select_scratch_bytes(n));
      Buffer<Word> in(device, n), out(device, n), total(device, 1);
      device.fill(in.data(), n, 1u);
      bench.time(8.0 * n, [&] { device.select(scratch, n, in.data(), out.data(), total.data()); });
    });
    add("reduce" + size, [=](Bench bench) {
      D& device = bench.device;
      Scratch scratch(device);
      scratch.reserve(reduce_scratch_bytes<Word>());
      Buffer<Word> in(device, n), total(device, 1);
      device.fill(in.data(), n, 1u);
      bench.time(4.0 * n, [&] { reduce(device, scratch, n, LoadFrom<Word>{in.data()}, Max{}, 0u, total.data()); });
    });
  }

  /// Keys and values must be read and written at least once; a radix sort does so once per digit.
  template <class Key>
  void add_sort(Word n) const {
    const auto sort = [&](const std::string& name, Word sorted) {
      add(name + "_" + std::to_string(8 * sizeof(Key)) + "/" + std::to_string(n), [=](Bench bench) {
        D& device = bench.device;
        Scratch scratch(device);
        scratch.reserve(device.template sort_scratch_bytes<Key>(n));
        Buffer<Key> keys(device, n);
        Buffer<Word> values(device, n), count(device, 1);
        device.fill(count.data(), 1, sorted);
        bench.time(
            2.0 * (sizeof(Key) + sizeof(Word)) * sorted,
            [&] {
              if (sorted == n)
                device.sort_by_key(scratch, n, keys.data(), values.data());
              else
                device.sort_by_key(scratch, {count.data(), n}, keys.data(), values.data());
            },
            [&] {
              device.parallel_for(n, Scramble<Key>{keys.data(), values.data()});
            });
      });
    };
    sort("sort_by_key", n);
    sort("sort_by_key_counted", n - n / 4);  // a count on the device, 3/4 of the capacity
  }

  std::shared_ptr<D> device_;
  Limits limits_;
};

}  // namespace fathom::bench
