#include "engine/atomic_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fathom/error.hpp>
#include <filesystem>

namespace fathom::engine {

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  if (std::filesystem::is_directory(path_)) {
    errno = EISDIR;
    fail("cannot be written");
  }
  // A name of its own for each process, so that two runs do not write into each other's file.
  temporary_ = path_ + ".partial-" + std::to_string(getpid());
  file_ = std::fopen(temporary_.c_str(), "wb");
  if (!file_) fail("cannot be written");
}

AtomicFile::~AtomicFile() { close(); }

void AtomicFile::close() {
  if (file_) {
    std::fclose(file_);
    std::remove(temporary_.c_str());
  }
  file_ = nullptr;
}

void AtomicFile::write(const void* data, std::size_t size) {
  if (std::fwrite(data, 1, size, file_) != size) fail("could not be written to its end");
}

void AtomicFile::overwrite(std::uint64_t position, const void* data, std::size_t size) {
  if (std::fseek(file_, static_cast<long>(position), SEEK_SET) != 0) fail("cannot be written");
  write(data, size);
}

void AtomicFile::finish() {
  if (std::fflush(file_) != 0 || fsync(fileno(file_)) != 0) fail("could not be written to its end");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot be put in its place");
  std::fclose(file_);
  file_ = nullptr;
}

void AtomicFile::fail(const char* what) const {
  throw Error(ErrorCode::file,
              path_ + ": " + what + " (" + std::strerror(errno) + "); check the folder, its permissions and space");
}

}  // namespace fathom::engine
