// Timed events, one-shot and repeating, in simulated or wall time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "engine/failures.hpp"

namespace fathom::engine {

enum class TimeBase : std::uint8_t {
  simulated,  ///< fires before the step that ends at or after its time; the same in every run
  wall,       ///< fires at the start of the frame after its time; not recorded
};

using TimerId = std::uint64_t;

/// Timers due together fire in the order of their times, then of their ids.
class Timers {
 public:
  using Callback = std::function<void()>;

  /// Fires once, `delay` ≥ 0 s from now, or from within a callback at least a microsecond. Throws
  /// `Error{invalid_argument}` if the delay is negative or not finite.
  TimerId after(double delay, Callback callback, TimeBase base = TimeBase::simulated);
  /// Fires every `period` s, once for each period that a frame spans. Throws `Error{invalid_argument}` for a period
  /// below a microsecond, the shortest time step.
  TimerId every(double period, Callback callback, TimeBase base = TimeBase::simulated);
  /// Restarts the timer with a new delay or period. False if the timer no longer exists.
  bool reset(TimerId id, double seconds);
  /// False if the timer no longer exists. May be called from a callback, including its own.
  bool cancel(TimerId id);
  bool contains(TimerId id) const { return timers_.contains(id); }
  std::size_t count() const { return timers_.size(); }

  /// Advances the clock to `now` (s) and fires timers due by then or at most `slack` (s) later, the possible error of
  /// sums of steps. An exception of a callback goes to `failures`, or is thrown after the others were called.
  void advance(TimeBase base, double now, double slack, Failures& failures);
  void advance(TimeBase base, double now);

 private:
  struct Timer {
    double due = 0;
    double period = 0;  // 0: once
    double start = 0;   // of a repeating timer; its times count from here, so they do not drift
    std::uint64_t fired = 0;
    TimeBase base = TimeBase::simulated;
    Callback callback;
  };
  using Due = std::map<std::pair<double, TimerId>, char>;

  TimerId add(double seconds, double period, Callback callback, TimeBase base);
  Due& due(TimeBase base) { return due_[static_cast<std::size_t>(base)]; }
  double& now(TimeBase base) { return now_[static_cast<std::size_t>(base)]; }

  std::map<TimerId, Timer> timers_;
  Due due_[2];
  double now_[2] = {0, 0};
  TimerId next_ = 1;
  bool advancing_ = false;
};

}  // namespace fathom::engine
