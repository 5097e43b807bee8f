#include "files/unfinished.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <climits>
#include <csignal>
#include <cstring>
#include <mutex>

namespace fathom::files {
namespace {

/// Signal handlers may neither lock nor allocate, so names are in fixed slots, valid while `used` is set.
struct Slot {
  std::atomic<bool> used{false};
  char name[PATH_MAX];
};
static_assert(std::atomic<bool>::is_always_lock_free);

std::array<Slot, 64> slots;  // a run writes a handful of files; a signal leaves any further ones behind
std::mutex noting;

void end_by(int signal) {
  for (Slot& slot : slots)
    if (slot.used.load(std::memory_order_acquire)) unlink(slot.name);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

void remove_unfinished_on_signals() {
  for (const int signal :
       {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT, SIGALRM, SIGXCPU, SIGUSR1, SIGUSR2, SIGVTALRM, SIGPROF}) {
    struct sigaction now {};
    sigaction(signal, nullptr, &now);
    if (now.sa_handler != SIG_IGN) std::signal(signal, end_by);  // nohup and shells' background jobs ignore some
  }
}

void note_unfinished(const std::string& name) {
  if (name.size() >= PATH_MAX) return;
  const std::lock_guard lock(noting);
  for (Slot& slot : slots) {
    if (slot.used.load(std::memory_order_relaxed)) continue;
    std::memcpy(slot.name, name.c_str(), name.size() + 1);
    slot.used.store(true, std::memory_order_release);
    return;
  }
}

void forget_unfinished(const std::string& name) {
  const std::lock_guard lock(noting);
  for (Slot& slot : slots)
    if (slot.used.load(std::memory_order_relaxed) && name == slot.name)
      slot.used.store(false, std::memory_order_release);
}

}  // namespace fathom::files
