// Nested profile zones, written as a Chrome trace that Perfetto (ui.perfetto.dev) and chrome://tracing read.
//
//   trace::Session session("trace.json");
//   {
//     trace::Zone zone("ticks before");    // from here to the end of the block
//   }
//   session.finish();
//
// Without a session a zone costs a relaxed load and a branch. With one it takes two clock readings and 32 bytes in a
// list of its thread.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fathom/profile.hpp>
#include <memory>
#include <string>

namespace fathom::files {
class OutputFile;
}

namespace fathom::engine::trace {

namespace detail {
extern std::atomic<bool> enabled;
std::int64_t now();
/// `name` must live as long as the program: a literal.
void add(const char* name, std::int64_t begin, std::int64_t end);
}  // namespace detail

inline bool enabled() { return detail::enabled.load(std::memory_order_relaxed); }

/// Collects what all threads of the process do from its beginning on. There may be several at once, as where two
/// engines run: each gets all that happens from its beginning on.
class Session {
 public:
  /// Opens the file, so that a run is not lost to a wrong path; none for "". A thread has at most `limit` zones, those
  /// of a quarter of an hour at 60 frames a second, so that the file can be written within a second. Throws
  /// `Error{file}`.
  explicit Session(const std::string& path = {}, std::size_t limit = std::size_t{1} << 19);
  /// Without `finish` no file is left.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void stop();
  /// Stops and writes what was collected. Throws `Error{file}`.
  void finish();
  /// Zones collected, and those lost beyond the limit.
  std::size_t zone_count() const;
  std::size_t lost_count() const;

 private:
  std::unique_ptr<files::OutputFile> file_;
  std::int64_t begin_ = 0;  // ns
  bool collects_ = true;
};

/// How the file calls the calling thread.
void name_thread(const std::string& name);
/// A zone of the calling thread that was measured already.
void add_zone(const char* name, std::chrono::steady_clock::time_point begin, double milliseconds);
/// A zone measured elsewhere, e.g. by a GPU's clock, on a line of its own, which is the calling thread's alone.
void add_on_track(const std::string& track, const char* name, std::chrono::steady_clock::time_point begin,
                  double milliseconds);
/// The stages of a step that began then, one after the other: on the calling thread's line, or, as the device timed
/// them, on the line of the thread's device, after those of the step before.
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
