// The one way in which Fathom writes files, so that all of them keep the same promises.
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
  whole,    ///< the file appears complete or not at all: written beside its place, then renamed
  patched,  ///< the same, and what was written may be written over
  live,     ///< the file grows in its place, where others may follow it
  appended  ///< the same, after what is there
};

/// A file while it is written. Symbolic links are followed; an earlier file's permissions stay. Devices, pipes and
/// open descriptors (/dev/stdout, /dev/fd/N; "-" is stdout) are written through. A second writer of the same file is
/// refused, in this process or another. Every function throws `Error{file}` that names the file where it cannot do its
/// work.
class OutputFile {
 public:
  /// `ending` is that of the name under which the file grows, for programs that go by it.
  explicit OutputFile(std::string path, Writing writing = Writing::whole, const std::string& ending = {});
  /// Without `finish` nothing is left behind, but for a live file.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Writes over what is at `position` (bytes from the start) of a patched file.
  void overwrite(std::uint64_t position, const void* data, std::size_t size);
  /// Hands on what was written so far.
  void flush();
  /// Puts the file in its place.
  void finish();

  /// Whether it is a file of a disk, nothing that is written through.
  bool is_regular() const { return regular_; }
  /// Without symbolic links.
  const std::string& target() const { return target_; }
  /// The name under which it grows, for another program to write.
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

  std::string path_;     // as it was given
  std::string target_;   // without symbolic links
  std::string growing_;  // the temporary file's name, or the target's
  bool temporary_ = false;
  bool regular_ = false;
  std::unique_ptr<std::FILE, Close> file_;
  Descriptor through_;  // the device that gets a patched file at its end
};

/// Writes a file of this content.
void write_file(const std::string& path, std::string_view content);

}  // namespace fathom::files
