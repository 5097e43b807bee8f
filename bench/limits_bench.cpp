// limits_bench [--threads=N] [Google Benchmark's options]: primitives and stages on this machine's processor.
#include "limits_bench.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "exec/host/host_device.hpp"

int main(int argc, char** argv) {
  using namespace fathom;
  benchmark::Initialize(&argc, argv);
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (!word.starts_with("--threads=") || (threads = std::atoi(argv[i] + 10)) < 1) {
      std::fprintf(stderr, "limits_bench: '%s' is unknown; --threads=N and --benchmark_… are known\n", argv[i]);
      return 2;
    }
  }
  exec::HostDevice device(threads);
  const double bandwidth = bench::measure_bandwidth(device);
  bench::say_bandwidth(std::to_string(threads) + " threads", bandwidth);
  bench::register_primitives(device, bandwidth);
  WorldDef world;
  world.threads = threads;
  bench::register_steps(world, "native", bandwidth);
  benchmark::RunSpecifiedBenchmarks();
}
