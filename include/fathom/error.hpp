// The library's one exception type: a code, and a text that says what is wrong and how to fix it.
#pragma once

#include <fathom/export.hpp>
#include <stdexcept>
#include <string>

namespace fathom {

/// Kinds of error.
enum class ErrorCode {
  invalid_argument,  ///< a value is out of range, not finite or of zero length
  stale_id,          ///< the id names a body that was removed or never existed
  degenerate_shape,  ///< points that span no volume, a shape of zero size
  capacity,          ///< more bodies than the world or the machine can hold
  unavailable,       ///< a simulator, back end or option that this build or this machine does not have
  file,              ///< a file is missing, unreadable, unwritable or malformed
};

/// Thrown by every function of the library that rejects its input; the world is then unchanged.
class FATHOM_API Error : public std::runtime_error {
 public:
  /// `text` says what is wrong and how to fix it.
  Error(ErrorCode code, const std::string& text) : std::runtime_error(text), code_(code) {}
  /// The kind of error.
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace fathom
