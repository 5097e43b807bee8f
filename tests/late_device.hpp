// A slow device on the host, for faults that only occur while steps are in flight.
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
