// The files that one run reads and writes: no output may also be another output or an input.
#pragma once

#include <string>
#include <vector>

namespace fathom::files {

/// Both take the file's role for the user ("--json", "the scene") and its name; an empty name is ignored. Devices may
/// be named more than once, pipes may not: outputs written to one would mix.
class FileNames {
 public:
  void reads(const std::string& what, const std::string& path);
  /// Throws an `Error{invalid_argument}` that names both roles if the file has another one in the run.
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
