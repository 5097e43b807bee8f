// How every part of Fathom writes files, with the same guarantees.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "files/claim.hpp"

namespace fathom::files {

enum class Writing {
  whole,    ///< the file appears complete or not at all: written beside its destination, then renamed
  patched,  ///< the same, and written parts may be overwritten
  live,     ///< the file grows in place, where other programs can follow it
  appended  ///< the same, after existing content
};

/// A file being written. Follows symbolic links; keeps an earlier file's permissions. Writes directly to devices, pipes
/// and open descriptors (/dev/stdout, /dev/fd/N; "-" is stdout). Refuses a second writer of the same file, in this
/// process or another. Every function that fails throws an `Error{file}` that names the file.
class OutputFile {
 public:
  /// `ending` is the extension of the temporary name, for programs that need it.
  explicit OutputFile(std::string path, Writing writing = Writing::whole, const std::string& ending = {});
  /// Without `finish`, leaves nothing behind, except for a live file.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Overwrites bytes at `position` (from the start) of a patched file.
  void overwrite(std::uint64_t position, const void* data, std::size_t size);
  /// Flushes the data written so far.
  void flush();
  /// Moves the file into place.
  void finish();

  /// Whether it is a regular file, not a device, pipe or descriptor.
  bool is_regular() const { return regular_; }
  /// The path without symbolic links.
  const std::string& target() const { return target_; }
  /// The name under which it grows, for another program to write to.
  const std::string& growing() const { return growing_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void open_whole(const std::string& ending);
  void open_through(Writing writing);
  void adopt(int descriptor);
  void copy_through();
  [[noreturn]] void fail(const char* what, const char* remedy) const;
  [[noreturn]] void fail_write() const;

  std::string path_;     // as given
  std::string target_;   // without symbolic links
  std::string growing_;  // the temporary file's name, or the target's
  bool temporary_ = false;
  bool regular_ = false;
  std::unique_ptr<std::FILE, Close> file_;
  Descriptor through_;  // the device that receives a patched file at the end
};

/// Writes a file with this content.
void write_file(const std::string& path, std::string_view content);

}  // namespace fathom::files
