// What submissions cost on a device: launches, copies, primitives. exec_bench.cpp runs it on the host,
// exec_bench_cuda.cu on CUDA. Each figure is the median of several rounds.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "exec/device.hpp"
#include "exec/reduce.hpp"

namespace fathom::exec::bench {

/// Microseconds of one call, the submission and its end included; the first two rounds warm up.
template <class D, class Work>
double microseconds(D& device, Work&& work, int rounds = 15) {
  std::vector<double> times;
  for (int round = -2; round < rounds; ++round) {
    device.wait();
    const auto begin = std::chrono::steady_clock::now();
    work();
    device.wait();
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
    if (round >= 0) times.push_back(time.count());
  }
  std::nth_element(times.begin(), times.begin() + rounds / 2, times.end());
  return times[static_cast<std::size_t>(rounds / 2)];
}

inline void print_row(const std::string& name, double figure, const char* unit) {
  std::printf("%-58s %10.2f %s\n", name.c_str(), figure, unit);
}

struct Increment {
  std::uint32_t* numbers;
  FATHOM_HD void operator()(std::uint32_t i) const { ++numbers[i]; }
};

struct IncrementPhases {
  std::uint32_t* numbers;
  std::uint32_t phase_count;
  std::uint32_t width;
  FATHOM_HD std::uint32_t phases() const { return phase_count; }
  FATHOM_HD std::uint32_t items(std::uint32_t) const { return width; }
  FATHOM_HD void operator()(std::uint32_t, std::uint32_t i) const { ++numbers[i]; }
};

struct Vector4 {
  float x, y, z, w;
};
struct alignas(16) Aligned4 {
  Vector4 v;
};
struct CopyVectors {
  const Aligned4* from;
  Aligned4* to;
  FATHOM_HD void operator()(std::uint32_t i) const { to[i] = from[i]; }
};

/// Keys without order: the top bits of a multiplicative hash.
template <class Key>
struct Scramble {
  Key* keys;
  std::uint32_t* values;
  FATHOM_HD void operator()(std::uint32_t i) const {
    keys[i] = static_cast<Key>((i + 1) * 0x9e3779b97f4a7c15u >> (64 - 8 * sizeof(Key)));
    values[i] = i;
  }
};

template <class D>
void launches(D& device) {
  constexpr int repeat = 200;
  for (const std::uint32_t n : {1u, 16'384u, 262'144u}) {
    Buffer<std::uint32_t> numbers(device, n), count(device, 1);
    device.zero(numbers.data(), n);
    device.fill(count.data(), 1, n);
    const auto plain = [&] {
      for (int i = 0; i < repeat; ++i) device.parallel_for(n, Increment{numbers.data()});
    };
    const auto counted = [&] {
      for (int i = 0; i < repeat; ++i) device.parallel_for({count.data(), 4 * n}, Increment{numbers.data()});
    };
    auto plain_graph = device.record(plain);
    auto counted_graph = device.record(counted);
    const std::string items = ", " + std::to_string(n) + " items";
    print_row("launch" + items, microseconds(device, plain) / repeat, "us");
    print_row("the same in a graph", microseconds(device, [&] { device.launch(plain_graph); }) / repeat, "us");
    print_row("count on the device, 4 times the capacity", microseconds(device, counted) / repeat, "us");
    print_row("the same in a graph", microseconds(device, [&] { device.launch(counted_graph); }) / repeat, "us");
    print_row("phase of one kernel" + items,
              microseconds(device,
                           [&] {
                             device.parallel_phases(repeat, n, IncrementPhases{numbers.data(), repeat, n});
                           }) /
                  repeat,
              "us");
    print_row("launch and wait" + items,
              microseconds(
                  device, [&] { device.parallel_for(n, Increment{numbers.data()}); }, 101),
              "us");
  }
}

template <class D>
void copies(D& device) {
  constexpr std::uint32_t n = 1 << 22;  // 64 MiB
  constexpr double megabytes = n * sizeof(Aligned4) * 1e-6;
  Buffer<Aligned4> a(device, n), b(device, n);
  PinnedBuffer<Aligned4> staging(device, n);
  device.zero(a.data(), n);
  const auto row = [&](const char* name, double moved, auto&& work) {
    print_row(name, moved / 1e3 / (microseconds(device, work) * 1e-6), "GB/s");
  };
  row("copy to the device, 64 MiB", megabytes, [&] { device.copy_to_device(a.data(), staging.data(), n); });
  row("copy to the host", megabytes, [&] { device.copy_to_host(staging.data(), a.data(), n); });
  row("copy inside, bytes read and written", 2 * megabytes, [&] { device.copy(b.data(), a.data(), n); });
  row("copy by a kernel, likewise", 2 * megabytes, [&] { device.parallel_for(n, CopyVectors{a.data(), b.data()}); });
}

template <class Key, class D>
void sorts(D& device, Scratch& scratch, std::uint32_t n) {
  Buffer<Key> keys(device, n);
  Buffer<std::uint32_t> values(device, n), count(device, 1);
  device.fill(count.data(), 1, n - n / 4);
  scratch.reserve(device.template sort_scratch_bytes<Key>(n));
  // Sorting sorted keys would flatter: the scrambling is run, and its own time taken off.
  const auto scramble = [&] { device.parallel_for(n, Scramble<Key>{keys.data(), values.data()}); };
  const double apart = microseconds(device, scramble);
  const std::string name = "sort " + std::to_string(n) + " pairs, " + std::to_string(8 * sizeof(Key)) + "-bit keys";
  const auto time = [&](Range range) {
    return microseconds(device,
                        [&] {
                          scramble();
                          device.sort_by_key(scratch, range, keys.data(), values.data());
                        }) -
           apart;
  };
  print_row(name, time(n), "us");
  print_row("count on the device, 3/4 of the capacity", time({count.data(), n}), "us");
}

template <class D>
void primitives(D& device) {
  for (const std::uint32_t n : {10'000u, 100'000u, 1'000'000u, 10'000'000u}) {
    Scratch scratch(device);
    sorts<std::uint32_t>(device, scratch, n);
    sorts<std::uint64_t>(device, scratch, n);
    Buffer<std::uint32_t> in(device, n), out(device, n), total(device, 1);
    device.fill(in.data(), n, 1u);
    scratch.reserve(device.scan_scratch_bytes(n));
    scratch.reserve(device.select_scratch_bytes(n));
    scratch.reserve(reduce_scratch_bytes<std::uint32_t>());
    const std::string items = " " + std::to_string(n) + " items";
    print_row("scan" + items,
              microseconds(device, [&] { device.exclusive_scan(scratch, n, in.data(), out.data(), total.data()); }),
              "us");
    print_row("select" + items,
              microseconds(device, [&] { device.select(scratch, n, in.data(), out.data(), total.data()); }), "us");
    print_row(
        "reduce" + items,
        microseconds(device,
                     [&] { reduce(device, scratch, n, LoadFrom<std::uint32_t>{in.data()}, Max{}, 0u, total.data()); }),
        "us");
  }
}

template <class D>
void run(D& device) {
  std::printf("%s: %s, %s, %u compute units\n", std::string(name_of(device.info().backend)).c_str(),
              device.info().name.c_str(), bytes_text(device.info().memory).c_str(), device.info().compute_units);
  launches(device);
  copies(device);
  primitives(device);
}

}  // namespace fathom::exec::bench
