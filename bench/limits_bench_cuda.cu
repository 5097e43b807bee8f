// limits_bench_cuda [Google Benchmark's options]: primitives and stages on the first CUDA device.
#include "exec/cuda/cuda_device.cuh"
#include "limits_bench.hpp"

int main(int argc, char** argv) try {
  using namespace fathom;
  benchmark::Initialize(&argc, argv);
  exec::CudaDevice device(0);
  const double bandwidth = bench::measure_bandwidth(device);
  bench::say_bandwidth(device.info().name, bandwidth);
  bench::register_primitives(device, bandwidth);
  WorldDef world;
  world.simulator = SimulatorKind::device;
  world.device = "cuda:0";
  bench::register_steps(world, "cuda", bandwidth);
  benchmark::RunSpecifiedBenchmarks();
} catch (const fathom::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
