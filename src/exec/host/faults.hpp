// Faults on request, to test what a simulator does when its device runs out of memory, is lost, or is slow.
#pragma once

#include <atomic>
#include <cstdint>

namespace fathom::exec {

/// Applies to all host devices of the process. Negative counts are off.
struct HostFaults {
  /// Number of allocations that still succeed; the next one fails, later ones succeed again.
  std::atomic<std::int64_t> allocations{-1};
  /// Number of calls that still succeed; all later ones fail, as if the device had been unplugged.
  std::atomic<std::int64_t> calls{-1};
  /// Events are not done before they are waited for, as on a slow device: steps stay in flight as long as they may.
  std::atomic<bool> late{false};
};

inline HostFaults host_faults;

}  // namespace fathom::exec
