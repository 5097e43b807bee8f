#include "files/claim.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <fathom/error.hpp>
#include <filesystem>
#include <optional>
#include <thread>
#include <utility>

#include "files/unfinished.hpp"

namespace fathom::files {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* mark = ".partial-";
constexpr std::chrono::milliseconds patience{250}, pause{5};

std::string folder_of(const std::string& target) {
  const fs::path folder = fs::path(target).parent_path();
  return folder.empty() ? "." : folder.string();
}

/// Also false if the file system does not support locks.
bool is_locked(const std::string& name) {
  const Descriptor file(open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  return file && flock(file.number(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

/// Keeps other runs from checking for writers between our check and our lock. Does not wait long for a run that holds
/// the folder's lock for other reasons.
Descriptor lock_folder(const std::string& target) {
  Descriptor folder(open(folder_of(target).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  for (const auto end = Clock::now() + patience; folder && Clock::now() < end; std::this_thread::sleep_for(pause))
    if (flock(folder.number(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) break;
  return folder;
}

/// The process that is writing the target through a file beside it.
std::optional<int> writer_beside(const std::string& target) {
  const std::string start = fs::path(target).filename().string() + mark;
  std::error_code unreadable;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_of(target), unreadable)) {
    const std::string name = entry.path().filename().string();
    int process = 0;
    if (!name.starts_with(start)) continue;
    std::from_chars(name.data() + start.size(), name.data() + name.size(), process);
    if (process > 0 && is_locked(entry.path().string())) return process;
  }
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& given, std::optional<int> process) {
  if (process == getpid())
    throw Error(ErrorCode::file, given + ": is being written by this run already; give each output its own file");
  throw Error(ErrorCode::file, given + ": is being written by another run" +
                                   (process ? " (process " + std::to_string(*process) + ")" : std::string()) +
                                   "; wait until it ends, or give another name");
}

/// Calls `take` while no other run checks for writers, until it returns a file or an error that waiting cannot fix.
template <class Take>
auto claim(const std::string& target, const std::string& given, const Take& take) {
  for (const auto end = Clock::now() + patience;; std::this_thread::sleep_for(pause)) {
    const Descriptor alone = lock_folder(target);
    const std::optional<int> writer = writer_beside(target);
    if (writer == getpid()) refuse(given, writer);
    if (!writer) {
      auto taken = take();
      if (taken) return std::move(*taken);
    }
    if (Clock::now() >= end) refuse(given, writer);
  }
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

int Descriptor::release() { return std::exchange(number_, -1); }

int descriptor_named(const std::string& path) {
  if (path == "-") return STDOUT_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    int number = -1;
    const char* end = path.data() + path.size();
    if (path.starts_with(folder) && std::from_chars(path.data() + folder.size(), end, number).ptr == end) return number;
  }
  return -1;
}

bool is_stdout(const std::string& path) { return descriptor_named(without_links(path)) == STDOUT_FILENO; }

std::string without_links(const std::string& path) {
  constexpr int max_links = 40;  // the kernel's limit
  fs::path at = path;
  std::error_code failure;
  for (int links = 0; descriptor_named(at.string()) < 0 && fs::is_symlink(fs::symlink_status(at, failure)); ++links) {
    const fs::path next = fs::read_symlink(at, failure);
    if (failure || links == max_links) {
      errno = failure ? failure.value() : ELOOP;
      return {};
    }
    at = next.is_absolute() ? next : at.parent_path() / next;
  }
  return at.string();
}

TemporaryFile claim_beside(const std::string& target, const std::string& given, const std::string& ending) {
  const std::string start = target + mark + std::to_string(getpid());
  return claim(target, given, [&]() -> std::optional<TemporaryFile> {
    if (is_locked(target)) return std::nullopt;
    // A killed process with the same number may have left its file behind.
    for (int i = 0;; ++i) {
      const std::string name = start + (i == 0 ? "" : "-" + std::to_string(i)) + ending;
      note_unfinished(name);  // before it exists: a signal may arrive in between
      Descriptor file(open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
      if (!file) forget_unfinished(name);
      if (!file && errno == EEXIST) continue;
      if (file) flock(file.number(), LOCK_EX | LOCK_NB);
      return TemporaryFile{std::move(file), name};
    }
  });
}

Descriptor claim_target(const std::string& target, const std::string& given) {
  return claim(target, given, [&]() -> std::optional<Descriptor> {
    Descriptor file(open(target.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666));
    if (file && flock(file.number(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return std::nullopt;
    return file;
  });
}

}  // namespace fathom::files
