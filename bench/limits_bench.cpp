// limits_bench [--device=D] [--threads=N] [Google Benchmark's options]: primitives and stages on the host (the
// default), with the native simulator's stages, or on a device of a compiled-in back end, such as --device=cuda or
// sycl:1.
#include "limits_bench.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "exec/devices.hpp"

namespace {

using namespace fathom;

struct Request {
  std::string device = "host";
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

Request parse(int argc, char** argv) {
  Request request;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.starts_with("--device="))
      request.device = word.substr(9);
    else if (!word.starts_with("--threads=") || (request.threads = std::atoi(argv[i] + 10)) < 1)
      throw Error(ErrorCode::invalid_argument,
                  "'" + std::string(word) + "' is unknown; --device=D, --threads=N and --benchmark_… are known");
  }
  return request;
}

bench::Limits register_on([[maybe_unused]] const exec::DeviceInfo& device, int threads) {
#ifdef FATHOM_BENCH_CUDA
  if (device.backend == exec::Backend::cuda) return bench::register_cuda(device.index);
#endif
#ifdef FATHOM_BENCH_SYCL
  if (device.backend == exec::Backend::sycl) return bench::register_sycl(device.index);
#endif
  return bench::register_host(threads);
}

}  // namespace

int main(int argc, char** argv) try {
  benchmark::Initialize(&argc, argv);
  const Request request = parse(argc, argv);
  const exec::DeviceInfo device = exec::find_device(request.device);
  const bool host = device.backend == exec::Backend::host;
  const bench::Limits limits = register_on(device, request.threads);
  const std::string where = host ? std::to_string(request.threads) + " threads" : limits.device;
  std::printf("%s: %.1f GB/s of memory bandwidth, read and written\n", where.c_str(), 1e-9 * limits.bandwidth);
  std::fflush(stdout);
  WorldDef world;
  world.threads = request.threads;
  if (!host) world.simulator = SimulatorKind::device, world.device = request.device;
  bench::register_steps(world, host ? "native" : std::string(exec::name_of(device.backend)), limits.bandwidth);
  benchmark::RunSpecifiedBenchmarks();
} catch (const fathom::Error& error) {
  std::fprintf(stderr, "limits_bench: %s\n", error.what());
  return 2;
}
