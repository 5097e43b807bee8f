// Which process writes a file: resolves names, and locks out a second writer.
//
// A run that writes a file holds the lock (flock) of the temporary file beside it, or of the file itself if that grows
// in place. The kernel releases locks when the process ends, however it ends.
#pragma once

#include <string>

namespace fathom::files {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;

  explicit operator bool() const { return number_ >= 0; }
  int number() const { return number_; }
  int release();

 private:
  int number_ = -1;
};

/// Whether writing to it writes to the program's standard output.
bool is_stdout(const std::string& path);

/// The path with symbolic links at its end resolved, even if the last target does not exist. If they form a cycle, sets
/// errno and returns "".
std::string without_links(const std::string& path);

/// The number in /dev/fd/N or /proc/self/fd/N, 1 for "-", otherwise -1.
int descriptor_named(const std::string& path);

/// A new, locked temporary file beside the target, registered as unfinished (unfinished.hpp).
struct TemporaryFile {
  Descriptor file;
  std::string name;
};

/// Both briefly wait for another process to finish with the target, then throw an `Error{file}` that names the writer.
/// All other failures return an empty descriptor and set errno. `given` is the target's name in messages.
TemporaryFile claim_beside(const std::string& target, const std::string& given, const std::string& ending);
Descriptor claim_target(const std::string& target, const std::string& given);

}  // namespace fathom::files
