// Nested profile zones, written as a Chrome trace that Perfetto (ui.perfetto.dev) and chrome://tracing read.
//
//   trace::Zone zone("ticks before");      // from here to the end of the block
//
// Off, a zone costs a relaxed load and a branch. On, it takes two clock readings and 32 bytes in a list of its thread.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fathom/profile.hpp>
#include <string>

namespace fathom::engine::trace {

namespace detail {
extern std::atomic<bool> enabled;
std::int64_t now();
/// `name` must live as long as the program: a literal.
void add(const char* name, std::int64_t begin, std::int64_t end);
}  // namespace detail

inline bool enabled() { return detail::enabled.load(std::memory_order_relaxed); }

/// Drops what was collected before and starts collecting from all threads, at most `limit` zones a thread.
void start(std::size_t limit = std::size_t{1} << 22);
void stop();
/// Writes what was collected; complete or not at all. Throws `Error{file}`. Zones must not be open on other threads.
void write(const std::string& path);
/// Zones collected, and those lost beyond the limit.
std::size_t zone_count();
std::size_t lost_count();

/// How the file calls the calling thread.
void name_thread(const std::string& name);
/// A zone of the calling thread that was measured already.
void add_zone(const char* name, std::chrono::steady_clock::time_point begin, double milliseconds);
/// A zone measured elsewhere, e.g. by a GPU's clock, on a line of its own.
void add_on_track(const std::string& track, const char* name, std::chrono::steady_clock::time_point begin,
                  double milliseconds);
/// The stages of a step that began then, one after the other: on the calling thread's line, or, as the device timed
/// them, on the device's.
void add_step(const StageTimes& times, std::chrono::steady_clock::time_point begin, const std::string& device = {});
/// A number over time.
void count(const char* name, double value);

class Zone {
 public:
  explicit Zone(const char* name) {
    if (enabled()) name_ = name, begin_ = detail::now();
  }
  ~Zone() {
    if (name_) detail::add(name_, begin_, detail::now());
  }
  Zone(const Zone&) = delete;
  Zone& operator=(const Zone&) = delete;

 private:
  const char* name_ = nullptr;
  std::int64_t begin_ = 0;
};

}  // namespace fathom::engine::trace
