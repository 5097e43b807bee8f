// Who writes a file: where a name leads, and the locks that keep two writers apart.
//
// A run that writes a file holds the lock (flock) of the temporary file beside it, or of the file itself where that
// grows in its place. The locks go with the process, however it ends.
#pragma once

#include <string>

namespace fathom::files {

/// A file descriptor that is closed at its end.
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

/// Whether what is written to it goes where the program prints.
bool is_stdout(const std::string& path);

/// The path with symbolic links at its end followed, also where the last one leads nowhere yet. Sets errno and returns
/// "" where they lead in a circle.
std::string without_links(const std::string& path);

/// The number in /dev/fd/N or /proc/self/fd/N, 1 for "-", else -1.
int descriptor_named(const std::string& path);

/// A new temporary file beside the target, locked, and noted as unfinished (unfinished.hpp).
struct TemporaryFile {
  Descriptor file;
  std::string name;
};

/// Both wait a moment for another process to come to its end with the target, then throw `Error{file}` that says who
/// writes it; an empty descriptor and errno tell of all else. `given` is what messages call the target.
TemporaryFile claim_beside(const std::string& target, const std::string& given, const std::string& ending);
Descriptor claim_target(const std::string& target, const std::string& given);

}  // namespace fathom::files
