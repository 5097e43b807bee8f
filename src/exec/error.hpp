// Exceptions of the execution layer: what was requested, how many bytes, and by which line.
#pragma once

#include <cstddef>
#include <string>

#include "exec/where.hpp"
#include "fathom/error.hpp"

namespace fathom::exec {

/// A refused allocation, copy or launch. The device stays usable unless `ErrorCode::unavailable` says it is lost.
class DeviceError : public Error {
 public:
  /// `bytes` is the requested size, or 0 if the failure has none.
  DeviceError(ErrorCode code, const std::string& what, std::size_t bytes, const Where& where);

  std::size_t bytes() const { return bytes_; }
  const Where& where() const { return where_; }

 private:
  std::size_t bytes_;
  Where where_;
};

/// "512 B", "1.5 GiB".
FATHOM_COMPONENT_API std::string bytes_text(std::size_t bytes);

}  // namespace fathom::exec
