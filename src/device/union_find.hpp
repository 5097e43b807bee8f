// Union-find over bodies, for kernels.
//
// The root is the smallest index of a set, whatever the order of unions, because each union attaches the larger root to
// the smaller (Jaiganesh and Burtscher, "A High-Performance Connected Components Implementation for GPUs", HPDC 2018).
#pragma once

#include <cstdint>

#include "exec/atomic.hpp"

namespace fathom::device {

FATHOM_HD std::uint32_t root_of(std::uint32_t* parent, std::uint32_t i) {
  std::uint32_t p = exec::atomic_load(parent[i]);
  while (p != i) {
    i = p;
    p = exec::atomic_load(parent[i]);
  }
  return i;
}

FATHOM_HD void unite(std::uint32_t* parent, std::uint32_t i, std::uint32_t j) {
  std::uint32_t a = root_of(parent, i), b = root_of(parent, j);
  while (a != b) {
    const std::uint32_t low = a < b ? a : b, high = a < b ? b : a;
    if (exec::atomic_cas(parent[high], high, low) == high) return;
    a = root_of(parent, low);
    b = root_of(parent, high);
  }
}

}  // namespace fathom::device
