// The golden runs on the native simulator alone, with two threads and whatever vectors this machine has.
#include "validate/golden.hpp"

#include <cstdio>
#include <memory>

#include "native/solver_kernels.hpp"
#include "validate/setup.hpp"
#include "world/simulator.hpp"

namespace fathom {

// Left out of this program.
std::unique_ptr<Simulator> make_device_simulator(const WorldDef&) { return nullptr; }
std::unique_ptr<Simulator> make_hybrid_simulator(const WorldDef&) { return nullptr; }

}  // namespace fathom

int main() {
  using namespace fathom::validate;
  std::printf("%s\n", fathom::native::wide_kernels().name);
  int failures = 0;
  for (const Golden& golden : goldens()) {
    Setup setup;
    setup.threads = 2;
    const bool good = run_golden(golden, setup) == golden.native;
    std::printf("%-8s %4d bodies, %d steps: %s\n", golden.environment, static_cast<int>(golden.bodies), golden.steps,
                good ? "the same" : "DIFFERENT");
    failures += !good;
  }
  return failures != 0;
}
