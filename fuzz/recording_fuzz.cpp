// Any bytes as a recording, and any entries after a valid beginning with a correct checksum: refused with one `Error`,
// or replayed with all published states finite.
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include "engine/recording.hpp"
#include "engine/recording_format.hpp"
#include "worlds.hpp"

namespace {

using namespace fathom;
using namespace fathom::engine;

template <class T>
void put(ZstdWriter& file, const T& value) {
  file.write(std::as_bytes(std::span(&value, 1)));
}

void write_entries(const std::string& path, std::span<const std::byte> bytes) {
  static const std::vector<std::byte> sound = fuzz::snapshot(SimulatorKind::native);
  ZstdWriter file(path, recording_kind);
  put(file, Entry::snapshot);
  put(file, static_cast<std::uint64_t>(sound.size()));
  file.write(sound);
  put(file, std::uint64_t{0});
  file.write(bytes);
  file.finish();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string path =
      std::filesystem::temp_directory_path() / ("fathom_fuzz_recording_" + std::to_string(getpid()));
  const auto bytes = std::as_bytes(std::span(data, size));
  if (size > 0 && data[0] == 0)
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data + 1), static_cast<long>(size - 1));
  else
    write_entries(path, bytes);
  const auto check = [](std::uint64_t, World& world) {
    for (const BodyId id : world.bodies()) fuzz::require(is_finite(world.pose(id)));
  };
  try {
    replay(path, {.threads = 1, .device = "host", .after_step = check});
  } catch (const Error&) {
  }
  std::remove(path.c_str());
  return 0;
}
