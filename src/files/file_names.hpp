// The files that one run reads and writes: no output is another output, or an input.
#pragma once

#include <string>
#include <vector>

namespace fathom::files {

/// Both take what the file is to the user ("--json", "the scene") and its name; an empty one is no file. Devices may be
/// named more than once, a pipe not: what is written to it would mix.
class FileNames {
 public:
  void reads(const std::string& what, const std::string& path);
  /// Throws `Error{invalid_argument}` that names both where the file has another part in the run.
  void writes(const std::string& what, const std::string& path);

 private:
  struct Use {
    std::string what, identity;
    bool written;
  };
  void add(const std::string& what, const std::string& path, bool written);

  std::vector<Use> uses_;
};

}  // namespace fathom::files
