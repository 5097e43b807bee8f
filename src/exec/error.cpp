#include "exec/error.hpp"

#include <array>
#include <cstdio>
#include <string_view>

namespace fathom::exec {

namespace {

std::string site_text(const Where& where) {
  std::string_view file = where.file;
  if (const std::size_t slash = file.rfind('/'); slash != file.npos) file.remove_prefix(slash + 1);
  return std::string(file) + ":" + std::to_string(where.line);
}

std::string text(const std::string& what, std::size_t bytes, const Where& where) {
  const std::string size = bytes == 0 ? "" : " (" + bytes_text(bytes) + ")";
  return what + size + ", asked for at " + site_text(where) + " in " + where.function;
}

}  // namespace

DeviceError::DeviceError(ErrorCode code, const std::string& what, std::size_t bytes, const Where& where)
    : Error(code, text(what, bytes, where)), bytes_(bytes), where_(where) {}

std::string bytes_text(std::size_t bytes) {
  constexpr std::array units{"KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
  if (bytes < 1024) return std::to_string(bytes) + " B";
  double amount = static_cast<double>(bytes) / 1024;
  std::size_t unit = 0;
  for (; amount >= 1024 && unit + 1 < units.size(); ++unit) amount /= 1024;
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%.1f %s", amount, units[unit]);
  return out.data();
}

}  // namespace fathom::exec
