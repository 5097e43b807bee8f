// Faults on request, so that tests see what a simulator does when its device runs out of memory, is
// lost, or is slow.
#pragma once

#include <atomic>
#include <cstdint>

namespace fathom::exec {

/// Of all host devices of the process. Negative counts are off.
struct HostFaults {
  /// Allocations that still succeed; the one after them fails, those after that succeed again.
  std::atomic<std::int64_t> allocations{-1};
  /// Calls that still succeed; all after them fail, as those of a device that was unplugged.
  std::atomic<std::int64_t> calls{-1};
  /// Events are not done before somebody waits for them, as if a slow device had not got there: steps stay in flight
  /// as long as they may.
  std::atomic<bool> late{false};
};

inline HostFaults host_faults;

}  // namespace fathom::exec
