// exec_bench [threads]: what submissions cost on the host.
#include "exec_bench.hpp"

#include <cstdlib>

#include "exec/host/host_device.hpp"

int main(int argc, char** argv) {
  fathom::exec::HostDevice device(argc > 1 ? std::atoi(argv[1]) : 0);
  fathom::exec::bench::run(device);
}
