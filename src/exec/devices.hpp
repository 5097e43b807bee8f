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
  std::string name;                 ///< the hardware's own name; empty if no device was found
  std::size_t memory = 0;           ///< bytes
  std::uint32_t compute_units = 0;  ///< hardware threads, multiprocessors
  bool is_gpu = false;
  bool available = false;
  std::string why_not;  ///< if not available: the reason, and a remedy if there is one
};

/// The host first, then CUDA, then SYCL. A back end that is not built or finds no device has one unavailable entry: the
/// list always gives the reason.
FATHOM_COMPONENT_API std::vector<DeviceInfo> list_devices();

/// The device that a user's text asks for; the machine may not have it.
struct DeviceChoice {
  bool automatic = true;            ///< the first GPU, else the host
  Backend backend = Backend::host;  ///< unless automatic
  int index = 0;
};

/// Reads `auto`, `host`, `cuda[:index]` or `sycl[:index]` (default index 0). Throws Error (invalid_argument) for any
/// other text; calls no driver.
FATHOM_COMPONENT_API DeviceChoice parse_device(std::string_view text);

/// The requested device among `devices`. Throws Error: invalid_argument for a text that `parse_device` rejects,
/// unavailable, with the reason, for a device that does not exist.
FATHOM_COMPONENT_API const DeviceInfo& select_device(std::string_view text, std::span<const DeviceInfo> devices);

/// The same among this machine's devices; calls only the drivers of back ends that may match.
DeviceInfo find_device(std::string_view text);

}  // namespace fathom::exec
