#include "files/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fathom/error.hpp>

#include "files/unfinished.hpp"

namespace fathom::files {
namespace {

constexpr const char* check_folder = "check the folder and its permissions";

/// Applies an earlier file's permissions and, if permitted, its owner.
void take_over_rights(int file, const struct stat& earlier) {
  fchmod(file, earlier.st_mode & 07777);
  if (fchown(file, earlier.st_uid, earlier.st_gid) != 0) return;  // then it is ours
}

}  // namespace

OutputFile::OutputFile(std::string path, Writing writing, const std::string& ending)
    : path_(std::move(path)), target_(without_links(path_)) {
  if (target_.empty()) fail("cannot be written", check_folder);
  struct stat status {};
  const bool exists = stat(target_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) {
    errno = EISDIR;
    fail("cannot be written", check_folder);
  }
  growing_ = target_;
  if (descriptor_named(target_) >= 0 || (exists && !S_ISREG(status.st_mode))) {
    open_through(writing);
    return;
  }
  // Without this check a folder's owner could replace a read-only file.
  if (exists && access(target_.c_str(), W_OK) != 0) fail("cannot be written", check_folder);
  regular_ = true;
  if (writing == Writing::live || writing == Writing::appended) {
    adopt(claim_target(target_, path_).release());
    if (writing == Writing::live && ftruncate(fileno(file_.get()), 0) != 0) fail("cannot be written", check_folder);
    if (std::fseek(file_.get(), 0, SEEK_END) != 0) fail("cannot be written", check_folder);
    return;
  }
  open_whole(ending);
  if (exists) take_over_rights(fileno(file_.get()), status);
}

OutputFile::~OutputFile() {
  if (!temporary_) return;
  std::remove(growing_.c_str());
  forget_unfinished(growing_);
}

void OutputFile::open_whole(const std::string& ending) {
  TemporaryFile beside = claim_beside(target_, path_, ending);
  if (!beside.file) fail("cannot be written", check_folder);
  growing_ = beside.name;
  temporary_ = true;
  adopt(beside.file.release());
}

void OutputFile::open_through(Writing writing) {
  const int number = descriptor_named(target_);
  const int device =
      number >= 0 ? fcntl(number, F_DUPFD_CLOEXEC, 0) : open(target_.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
  if (device < 0) fail("cannot be written", check_folder);
  if (writing != Writing::patched) return adopt(device);
  through_ = Descriptor(device);
  file_.reset(std::tmpfile());
  if (!file_) fail("cannot be written by way of a temporary file", "check the folder for temporary files");
}

void OutputFile::adopt(int descriptor) {
  if (descriptor >= 0) file_.reset(fdopen(descriptor, "w"));
  if (!file_) fail("cannot be written", check_folder);
}

void OutputFile::write(const void* data, std::size_t size) {
  if (std::fwrite(data, 1, size, file_.get()) != size) fail_write();
}

void OutputFile::overwrite(std::uint64_t position, const void* data, std::size_t size) {
  if (std::fseek(file_.get(), static_cast<long>(position), SEEK_SET) != 0) fail_write();
  write(data, size);
}

void OutputFile::flush() {
  if (std::fflush(file_.get()) != 0) fail_write();
}

void OutputFile::copy_through() {
  std::array<char, 1 << 16> bytes;
  std::rewind(file_.get());
  while (const std::size_t size = std::fread(bytes.data(), 1, bytes.size(), file_.get())) {
    for (std::size_t done = 0; done < size;) {
      const ssize_t written = ::write(through_.number(), bytes.data() + done, size - done);
      if (written < 0 && errno != EINTR) fail_write();
      done += written > 0 ? static_cast<std::size_t>(written) : 0;
    }
  }
  if (std::ferror(file_.get()) || close(through_.release()) != 0) fail_write();
}

void OutputFile::finish() {
  flush();
  if (through_) copy_through();
  if (temporary_) {
    if (fsync(fileno(file_.get())) != 0) fail_write();
    // Still locked, so no other run claims its name before it is in place.
    if (std::rename(growing_.c_str(), target_.c_str()) != 0) fail("cannot be put in its place", check_folder);
    forget_unfinished(growing_);
    temporary_ = false;
  }
  if (std::fclose(file_.release()) != 0) fail_write();
}

void OutputFile::fail(const char* what, const char* remedy) const {
  throw Error(ErrorCode::file, path_ + ": " + what + " (" + std::strerror(errno) + "); " + remedy);
}

void OutputFile::fail_write() const { fail("could not be written to its end", "is the disk full?"); }

void write_file(const std::string& path, std::string_view content) {
  OutputFile file(path);
  file.write(content);
  file.finish();
}

}  // namespace fathom::files
