// exec_bench_cuda [index]: what submissions cost on a CUDA device.
#include <cstdlib>

#include "exec/cuda/cuda_device.cuh"
#include "exec_bench.hpp"

int main(int argc, char** argv) try {
  fathom::exec::CudaDevice device(argc > 1 ? std::atoi(argv[1]) : 0);
  fathom::exec::bench::run(device);
} catch (const fathom::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
