// Which devices this build and machine offer, and how a user chooses one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fathom/export.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::exec {

enum class Backend { host, cuda, sycl };

/// "host", "cuda", "sycl".
FATHOM_COMPONENT_API std::string_view name_of(Backend backend);

struct DeviceInfo {
  Backend backend = Backend::host;
  int index = 0;                    ///< counts within the back end
  std::string name;                 ///< the hardware's own name; empty where none was found
  std::size_t memory = 0;           ///< bytes
  std::uint32_t compute_units = 0;  ///< hardware threads, multiprocessors
  bool is_gpu = false;
  bool available = false;
  std::string why_not;  ///< where not available: the reason, and a remedy if there is one
};

/// The host first, then CUDA, then SYCL. A back end that is not built or finds nothing has one unavailable entry,
/// so that the list always says why.
FATHOM_COMPONENT_API std::vector<DeviceInfo> list_devices();

/// What a user's text asks for. Nothing says yet that the machine has it.
struct DeviceChoice {
  bool automatic = true;            ///< the first GPU, else the host
  Backend backend = Backend::host;  ///< unless automatic
  int index = 0;
};

/// Reads `auto`, `host`, `cuda[:index]` or `sycl[:index]` (index 0 where left out). Throws Error (invalid_argument)
/// for any other text; asks no driver.
FATHOM_COMPONENT_API DeviceChoice parse_device(std::string_view text);

/// The device among `devices` that was asked for. Throws Error: invalid_argument for a text that `parse_device` does
/// not read, unavailable for a device that is not there, with the reason.
FATHOM_COMPONENT_API const DeviceInfo& select_device(std::string_view text, std::span<const DeviceInfo> devices);

/// The same among the devices of this machine; asks only the drivers of back ends that may be the answer.
DeviceInfo find_device(std::string_view text);

}  // namespace fathom::exec
