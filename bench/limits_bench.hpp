// The execution layer's primitives and the simulators' stages against the machine's limit: its memory bandwidth,
// measured first, in the same run. The counter `of_limit` is the fraction of it that they reach, counting the bytes
// that the work must move; data that fits into caches can exceed 1. One source per back end registers its device here.
#pragma once

#include <benchmark/benchmark.h>

#include <string>

#include "fathom/world.hpp"

namespace fathom::bench {

/// Measurements of a device whose primitives are then registered.
struct Limits {
  std::string device;    ///< its name
  double bandwidth = 0;  ///< bytes per second, read and written
};

Limits register_host(int threads);
/// These two throw Error{unavailable} if there is no such device; they exist only for back ends in this build.
Limits register_cuda(int index);
Limits register_sycl(int index);

/// Registers steps of busy scenes in worlds with the simulator, device and threads of `world`.
void register_steps(const WorldDef& world, const std::string& where, double bandwidth);

}  // namespace fathom::bench
