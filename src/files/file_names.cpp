#include "files/file_names.hpp"

#include <sys/stat.h>

#include <fathom/error.hpp>
#include <filesystem>

#include "files/claim.hpp"

namespace fathom::files {
namespace {

namespace fs = std::filesystem;

/// Equal for all names of the same file; "" for files that may be used more than once.
std::string identity_of(const std::string& path) {
  if (path.empty()) return {};
  const std::string target = without_links(path);
  const int number = descriptor_named(target);
  struct stat status {};
  if (target.empty()) return {};
  if ((number >= 0 ? fstat(number, &status) : stat(target.c_str(), &status)) == 0)
    return S_ISREG(status.st_mode) || S_ISFIFO(status.st_mode)
               ? std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino)
               : std::string();
  if (number >= 0) return {};
  std::error_code failure;
  return fs::weakly_canonical(target, failure).string();
}

}  // namespace

void FileNames::reads(const std::string& what, const std::string& path) { add(what, path, false); }
void FileNames::writes(const std::string& what, const std::string& path) { add(what, path, true); }

void FileNames::add(const std::string& what, const std::string& path, bool written) {
  const std::string identity = identity_of(path);
  if (identity.empty()) return;
  for (const Use& other : uses_) {
    if (other.identity != identity || !(written || other.written)) continue;
    if (written && other.written)
      throw Error(ErrorCode::invalid_argument,
                  other.what + " and " + what + " are one file, " + path + "; give each a file of its own");
    const auto& [output, input] = written ? std::pair{what, other.what} : std::pair{other.what, what};
    throw Error(ErrorCode::invalid_argument,
                output + " would overwrite " + input + ", " + path + ", which this run reads; give it another name");
  }
  uses_.push_back({what, identity, written});
}

}  // namespace fathom::files
