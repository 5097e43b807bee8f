// Nested profile zones, written as a Chrome trace for Perfetto (ui.perfetto.dev) and chrome://tracing.
//
//   trace::Session session("trace.json");
//   {
//     trace::Zone zone("ticks before");    // from here to the end of the block
//   }
//   session.finish();
//
// Without a session a zone costs a relaxed load and a branch. With one it costs two clock readings and 32 bytes in its
// thread's list.
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
/// `name` must live as long as the program: use a literal.
void add(const char* name, std::int64_t begin, std::int64_t end);
}  // namespace detail

inline bool enabled() { return detail::enabled.load(std::memory_order_relaxed); }

/// Collects the zones of all threads of the process from its construction on. Several sessions may coexist, e.g. for
/// two engines; each collects everything.
class Session {
 public:
  /// Opens the file now, so that a wrong path does not lose a run; none for "". A thread has at most `limit` zones, a
  /// quarter of an hour at 60 frames per second: the file can then be written within a second. Throws `Error{file}`.
  explicit Session(const std::string& path = {}, std::size_t limit = std::size_t{1} << 19);
  /// Without `finish` no file remains.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void stop();
  /// Stops and writes the collected zones. Throws `Error{file}`.
  void finish();
  /// Zones collected, and those lost beyond the limit.
  std::size_t zone_count() const;
  std::size_t lost_count() const;

 private:
  std::unique_ptr<files::OutputFile> file_;
  std::int64_t begin_ = 0;  // ns
  bool collects_ = true;
};

/// Names the calling thread in the file.
void name_thread(const std::string& name);
/// Adds an already measured zone of the calling thread.
void add_zone(const char* name, std::chrono::steady_clock::time_point begin, double milliseconds);
/// Adds a zone measured elsewhere, e.g. by a GPU's clock, on a separate line that belongs to the calling thread alone.
void add_on_track(const std::string& track, const char* name, std::chrono::steady_clock::time_point begin,
                  double milliseconds);
/// Adds the stages of a step that began at this time, one after another: on the calling thread's line or, if the device
/// timed them, on the line of the thread's device, after those of the previous step.
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
