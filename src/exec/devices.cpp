#include "exec/devices.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "exec/backends.hpp"
#include "fathom/error.hpp"

namespace fathom::exec {

namespace {

struct Selection {
  Backend backend;
  int index;
};

Selection parse(std::string_view text) {
  const std::string_view name = text.substr(0, text.find(':'));
  for (const Backend backend : {Backend::host, Backend::cuda, Backend::sycl}) {
    if (name != name_of(backend)) continue;
    if (name.size() == text.size()) return {backend, 0};
    const std::string_view digits = text.substr(name.size() + 1);
    int index = -1;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    if (backend != Backend::host && error == std::errc() && end == digits.data() + digits.size() && index >= 0) {
      return {backend, index};
    }
  }
  throw Error(ErrorCode::invalid_argument,
              "no device is called '" + std::string(text) + "': say auto, host, cuda, cuda:1, sycl or sycl:1");
}

}  // namespace

std::string_view name_of(Backend backend) {
  constexpr std::array<std::string_view, 3> names{"host", "cuda", "sycl"};
  return names[static_cast<std::size_t>(backend)];
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> all{host_device_info()};
  for (const auto list : {cuda_device_infos, sycl_device_infos}) {
    const std::vector<DeviceInfo> some = list();
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

const DeviceInfo& select_device(std::string_view selection, std::span<const DeviceInfo> devices) {
  if (selection == "auto") {
    const auto gpu =
        std::find_if(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.available && d.is_gpu; });
    return gpu != devices.end() ? *gpu : select_device("host", devices);
  }
  const auto [backend, index] = parse(selection);
  std::string why_not;
  int offered = 0;
  for (const DeviceInfo& device : devices) {
    if (device.backend != backend) continue;
    if (device.index == index && device.available) return device;
    if (device.index == index) why_not = device.why_not;
    ++offered;
  }
  if (why_not.empty()) {
    why_not = "there are " + std::to_string(offered) + " " + std::string(name_of(backend)) + " devices, counted from 0";
  }
  throw Error(ErrorCode::unavailable, "device '" + std::string(selection) + "' is not available: " + why_not);
}

}  // namespace fathom::exec
