#include "about.hpp"

#include <fmt/format.h>

#include <fathom/version.hpp>
#include <thread>

#include "build_info.hpp"
#include "exec/devices.hpp"
#include "exec/error.hpp"
#include "measure/counted.hpp"
#include "measure/system.hpp"

namespace fathom::cli {
namespace {

constexpr const char* parts =
    "run"
#ifdef FATHOM_HAS_RENDER
    " render"
#endif
#ifdef FATHOM_HAS_VIEWER
    " view"
#endif
#ifdef FATHOM_HAS_BENCH
    " bench"
#endif
    ;

std::string device_line(const exec::DeviceInfo& device) {
  const std::string_view backend = exec::name_of(device.backend);
  if (!device.available) return fmt::format("{}: unavailable: {}", backend, device.why_not);
  return fmt::format("{}:{}: {}, {}", backend, device.index, device.name, exec::bytes_text(device.memory));
}

}  // namespace

std::string version_text() {
  const LibraryInfo info = library_info();
  constexpr const char* checks[] = {"none", "cheap", "all"};
  return fmt::format(
      "fathom {} ({})\n"
      "  build      {}, {}, {} library, checks: {}\n"
      "  SIMD       {} of this processor\n"
      "  back ends  {}\n"
      "  parts      {}",
      info.text, *build_info::commit ? build_info::commit : "no commit", info.type, info.compiler, info.linkage,
      checks[info.checks], info.simd, info.back_ends, parts);
}

std::string machine_text() {
  std::string text =
      fmt::format("system     {}\nprocessor  {}, {}\nmemory     {}\n", system_name(), processor_name(),
                  counted(std::thread::hardware_concurrency(), "thread"), exec::bytes_text(machine_memory()));
  for (const exec::DeviceInfo& device : exec::list_devices())
    text += fmt::format("device     {}\n", device_line(device));
  return text;
}

}  // namespace fathom::cli
