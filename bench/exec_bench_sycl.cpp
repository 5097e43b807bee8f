// exec_bench_sycl [index]: what submissions cost on a SYCL device.
#include <cstdlib>

#include "exec/sycl/sycl_device.hpp"
#include "exec_bench.hpp"

int main(int argc, char** argv) try {
  fathom::exec::SyclDevice device(argc > 1 ? std::atoi(argv[1]) : 0);
  fathom::exec::bench::run(device);
} catch (const fathom::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
