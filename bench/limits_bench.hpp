// The execution layer's primitives and the simulators' stages against the machine's limit: the bandwidth of its memory,
// measured first, in the same run. The counter `of_limit` is the share of it that is reached, from the bytes that the
// work cannot do without; what fits into caches can exceed 1. One source a back end makes its device known here.
#pragma once

#include <benchmark/benchmark.h>

#include <string>

#include "fathom/world.hpp"

namespace fathom::bench {

/// What was found of a device; its primitives are registered by then.
struct Limits {
  std::string device;    ///< its name
  double bandwidth = 0;  ///< bytes a second, read and written
};

Limits register_host(int threads);
/// These two throw Error{unavailable} where there is no such device; only those of back ends that were built exist.
Limits register_cuda(int index);
Limits register_sycl(int index);

/// The steps of scenes at work in worlds with the simulator, device and threads of `world`.
void register_steps(const WorldDef& world, const std::string& where, double bandwidth);

}  // namespace fathom::bench
