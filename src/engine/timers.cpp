#include "engine/timers.hpp"

#include <cmath>
#include <fathom/error.hpp>
#include <string>

namespace fathom::engine {
namespace {

void check(double seconds, bool repeating) {
  if (std::isfinite(seconds) && (repeating ? seconds > 0 : seconds >= 0)) return;
  throw Error(ErrorCode::invalid_argument, std::string("timer: the ") + (repeating ? "period" : "delay") + " is " +
                                               std::to_string(seconds) + " s; it must be finite and " +
                                               (repeating ? "greater than 0" : "at least 0"));
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
  const double when = now(base) + seconds;
  timers_.emplace(id, Timer{when, period, base, std::move(callback)});
  due(base).emplace(std::pair(when, id), 0);
  return id;
}

bool Timers::reset(TimerId id, double seconds) {
  const auto found = timers_.find(id);
  if (found == timers_.end()) return false;
  Timer& timer = found->second;
  check(seconds, timer.period > 0);
  due(timer.base).erase({timer.due, id});
  timer.due = now(timer.base) + seconds;
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
  Due& queue = due(base);
  while (!queue.empty() && queue.begin()->first.first <= to) {
    const auto [when, id] = queue.begin()->first;
    queue.erase(queue.begin());
    // A callback that sets a timer counts from the time it was due, not from the end of a long frame.
    now(base) = when;
    const auto found = timers_.find(id);
    Callback callback = found->second.callback;
    if (found->second.period > 0) {
      found->second.due = when + found->second.period;
      queue.emplace(std::pair(found->second.due, id), 0);
    } else {
      timers_.erase(found);
    }
    callback();
  }
  now(base) = to;
}

}  // namespace fathom::engine
