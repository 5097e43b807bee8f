#include "exec/devices.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "exec/backends.hpp"
#include "fathom/error.hpp"

namespace fathom::exec {

namespace {

std::vector<DeviceInfo> list_devices_of(Backend backend) {
  switch (backend) {
    case Backend::cuda:
      return cuda_device_infos();
    case Backend::sycl:
      return sycl_device_infos();
    default:
      return {host_device_info()};
  }
}

const DeviceInfo& first_gpu_or_host(std::span<const DeviceInfo> devices) {
  const auto gpu =
      std::find_if(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.available && d.is_gpu; });
  return gpu != devices.end() ? *gpu : select_device("host", devices);
}

}  // namespace

std::string_view name_of(Backend backend) {
  constexpr std::array<std::string_view, 3> names{"host", "cuda", "sycl"};
  return names[static_cast<std::size_t>(backend)];
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> all;
  for (const Backend backend : {Backend::host, Backend::cuda, Backend::sycl}) {
    const std::vector<DeviceInfo> some = list_devices_of(backend);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

DeviceChoice parse_device(std::string_view text) {
  if (text == "auto") return {};
  const std::string_view name = text.substr(0, text.find(':'));
  for (const Backend backend : {Backend::host, Backend::cuda, Backend::sycl}) {
    if (name != name_of(backend)) continue;
    if (name.size() == text.size()) return {false, backend, 0};
    const std::string_view digits = text.substr(name.size() + 1);
    int index = -1;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    if (backend != Backend::host && error == std::errc() && end == digits.data() + digits.size() && index >= 0) {
      return {false, backend, index};
    }
  }
  throw Error(ErrorCode::invalid_argument, "no device is called '" + std::string(text) +
                                               "': say auto, host, cuda, cuda:1, sycl or sycl:1; 'fathom devices' "
                                               "lists what there is");
}

const DeviceInfo& select_device(std::string_view text, std::span<const DeviceInfo> devices) {
  const DeviceChoice choice = parse_device(text);
  if (choice.automatic) return first_gpu_or_host(devices);
  std::string why_not;
  int offered = 0;
  for (const DeviceInfo& device : devices) {
    if (device.backend != choice.backend) continue;
    if (device.index == choice.index && device.available) return device;
    // The entry of a back end without devices applies to every index.
    if (device.index == choice.index || device.name.empty()) why_not = device.why_not;
    ++offered;
  }
  if (why_not.empty()) {
    why_not = "there " + std::string(offered == 1 ? "is 1 " : "are " + std::to_string(offered) + " ") +
              std::string(name_of(choice.backend)) + (offered == 1 ? " device" : " devices") + ", counted from 0";
  }
  throw Error(ErrorCode::unavailable, "device '" + std::string(text) + "' is not available: " + why_not);
}

DeviceInfo find_device(std::string_view text) {
  const DeviceChoice choice = parse_device(text);
  return select_device(text, choice.automatic ? list_devices() : list_devices_of(choice.backend));
}

}  // namespace fathom::exec
