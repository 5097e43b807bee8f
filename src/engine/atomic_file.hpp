// A file that appears complete or not at all: written beside its place, then renamed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace fathom::engine {

/// Every function throws `Error{file}` that names the file where it cannot do its work.
class AtomicFile {
 public:
  explicit AtomicFile(std::string path);
  /// Without `finish` nothing is left behind.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, std::size_t size);
  /// Writes over what is at `position` (bytes from the start).
  void overwrite(std::uint64_t position, const void* data, std::size_t size);
  /// Puts the file in its place.
  void finish();

 private:
  [[noreturn]] void fail(const char* what) const;
  void close();

  std::string path_, temporary_;
  std::FILE* file_ = nullptr;
};

}  // namespace fathom::engine
