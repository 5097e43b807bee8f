// A slow device on the host, for what goes wrong only where steps are still in flight.
#pragma once

#include "exec/host/faults.hpp"

namespace fathom::test {

/// While it lives, steps of host devices stay in flight as long as they may.
struct LateDevice {
  LateDevice() { exec::host_faults.late = true; }
  ~LateDevice() { exec::host_faults.late = false; }
  LateDevice(const LateDevice&) = delete;
  LateDevice& operator=(const LateDevice&) = delete;
};

}  // namespace fathom::test
