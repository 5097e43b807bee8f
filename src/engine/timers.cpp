#include "engine/timers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>

namespace fathom::engine {
namespace {

constexpr double shortest_period = 1e-6;  // s, the shortest time step: shorter periods would fire endlessly

void check(double seconds, bool repeating) {
  if (std::isfinite(seconds) && seconds >= (repeating ? shortest_period : 0)) return;
  throw Error(ErrorCode::invalid_argument,
              fmt::format("timer: the {} is {} s; it must be finite and {}", repeating ? "period" : "delay", seconds,
                          repeating ? "greater than 0, at least a microsecond" : "at least 0"));
}

}  // namespace

TimerId Timers::after(double delay, Callback callback, TimeBase base) {
  check(delay, false);
  return add(delay, 0, std::move(callback), base);
}

TimerId Timers::every(double period, Callback callback, TimeBase base) {
  check(period, true);
  return add(period, period, std::move(callback), base);
}

TimerId Timers::add(double seconds, double period, Callback callback, TimeBase base) {
  const TimerId id = next_++;
  // A timer set by a callback must not be due at once, or it could fire endlessly.
  const double when = now(base) + (advancing_ ? std::max(seconds, shortest_period) : seconds);
  timers_.emplace(id, Timer{when, period, now(base), 0, base, std::move(callback)});
  due(base).emplace(std::pair(when, id), 0);
  return id;
}

bool Timers::reset(TimerId id, double seconds) {
  const auto found = timers_.find(id);
  if (found == timers_.end()) return false;
  Timer& timer = found->second;
  check(seconds, timer.period > 0);
  due(timer.base).erase({timer.due, id});
  timer.start = now(timer.base);
  timer.fired = 0;
  timer.due = timer.start + seconds;
  if (timer.period > 0) timer.period = seconds;
  due(timer.base).emplace(std::pair(timer.due, id), 0);
  return true;
}

bool Timers::cancel(TimerId id) {
  const auto found = timers_.find(id);
  if (found == timers_.end()) return false;
  due(found->second.base).erase({found->second.due, id});
  timers_.erase(found);
  return true;
}

void Timers::advance(TimeBase base, double to) {
  Failures failures;
  advance(base, to, 0, failures);
  failures.throw_first();
}

void Timers::advance(TimeBase base, double to, double slack, Failures& failures) {
  Due& queue = due(base);
  while (!queue.empty() && queue.begin()->first.first <= to + slack) {
    const auto [when, id] = queue.begin()->first;
    queue.erase(queue.begin());
    // A timer set by a callback counts from when the callback was due, not from the end of a long frame.
    now(base) = std::min(when, to);
    const auto found = timers_.find(id);
    Timer& timer = found->second;
    const Callback callback = timer.callback;
    if (timer.period > 0) {
      timer.due = timer.start + static_cast<double>(++timer.fired + 1) * timer.period;
      queue.emplace(std::pair(timer.due, id), 0);
    } else {
      timers_.erase(found);
    }
    advancing_ = true;
    failures.guard(callback);
    advancing_ = false;
  }
  now(base) = to;
}

}  // namespace fathom::engine
