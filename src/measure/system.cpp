#include "measure/system.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>

namespace fathom {
namespace {

volatile std::sig_atomic_t interrupt_requested = 0;
std::atomic<std::int64_t> interrupted_at = 0;  // ms
static_assert(std::atomic<std::int64_t>::is_always_lock_free);
struct sigaction before_interrupt, before_terminate;
int guards = 0;  // only the outermost one acts

std::int64_t milliseconds_now() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{1000} * now.tv_sec + now.tv_nsec / 1'000'000;
}

/// One interruption may arrive as several signals: `timeout` signals both the process and its group, and wrappers
/// forward what the terminal has already sent to all.
constexpr std::int64_t one_interruption = 500;  // ms

void request_interrupt(int signal) {
  const std::int64_t now = milliseconds_now();
  if (!interrupt_requested) {
    interrupted_at = now;
    interrupt_requested = 1;
  } else if (now - interrupted_at > one_interruption) {
    sigaction(signal, signal == SIGINT ? &before_interrupt : &before_terminate, nullptr);
    raise(signal);
  }
}

}  // namespace

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    const std::size_t start = line.find_first_not_of(" \t", line.find(':') + 1);
    if (start != std::string::npos) return line.substr(start);
  }
  return "unknown processor";
}

std::uint64_t machine_memory() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

std::string system_name() {
  std::string name;
  std::ifstream release("/etc/os-release");
  for (std::string line; std::getline(release, line);)
    if (line.starts_with("PRETTY_NAME=\"")) name = line.substr(13, line.size() - 14) + ", ";
  utsname kernel{};
  uname(&kernel);
  return name + kernel.sysname + " " + kernel.release;
}

std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux reports KiB
}

std::uint64_t interruptions() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_nivcsw);
}

bool stderr_is_terminal() { return isatty(STDERR_FILENO) == 1; }

void tell(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }

void keep_standard_descriptors() {
  for (int number = 0; number <= STDERR_FILENO; ++number)
    if (fcntl(number, F_GETFD) < 0 && open("/dev/null", O_RDONLY) < 0) return;  // open returns the lowest free number
}

std::size_t terminal_columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::string fit_to_terminal(std::string text) {
  // A character in the last column makes some terminals wrap.
  if (const std::size_t most = terminal_columns() - 1; text.size() > most) text.resize(most);
  return text;
}

void survive_file_size_limit() { std::signal(SIGXFSZ, SIG_IGN); }

InterruptGuard::InterruptGuard() {
  if (guards++ > 0) return;
  interrupt_requested = 0;
  struct sigaction action {
  }, now{};
  action.sa_handler = request_interrupt;
  for (const int signal : {SIGINT, SIGTERM}) {
    sigaction(signal, &action, &now);
    if (now.sa_handler != request_interrupt) (signal == SIGINT ? before_interrupt : before_terminate) = now;
  }
}

// After an interruption the handlers stay to catch its remaining signals; the process is about to end.
InterruptGuard::~InterruptGuard() {
  if (--guards > 0 || interrupt_requested) return;
  sigaction(SIGINT, &before_interrupt, nullptr);
  sigaction(SIGTERM, &before_terminate, nullptr);
}

bool InterruptGuard::requested() { return interrupt_requested != 0; }

}  // namespace fathom
