// Which devices this build and machine offer, and how a user chooses one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::exec {

enum class Backend { host, cuda, sycl };

/// "host", "cuda", "sycl".
std::string_view name_of(Backend backend);

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
std::vector<DeviceInfo> list_devices();

/// The device that `selection` names among `devices`: `auto` (the first GPU, else the host), `host`, `cuda[:index]`
/// or `sycl[:index]` (index 0 where left out). Throws Error: invalid_argument for a text that is no selection,
/// unavailable for a device that is not there, with the reason.
const DeviceInfo& select_device(std::string_view selection, std::span<const DeviceInfo> devices);

}  // namespace fathom::exec
