// Events on their way to the application: what finished steps have told and nobody has read yet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fathom {

/// Of a list that nobody reads the oldest events are dropped, so that it does not grow forever.
inline constexpr std::size_t max_unread_events = std::size_t{1} << 18;

/// What is read stays until the next step begins; what comes meanwhile is appended when the list is read again.
template <class Event>
class EventList {
 public:
  /// Returns how many events that were not read had to be dropped.
  std::size_t add(std::span<const Event> events) {
    arrived_.insert(arrived_.end(), events.begin(), events.end());
    if (arrived_.size() <= max_unread_events) return 0;
    const std::size_t dropped = arrived_.size() - max_unread_events / 2;
    arrived_.erase(arrived_.begin(), arrived_.begin() + static_cast<std::ptrdiff_t>(dropped));
    return dropped;
  }
  std::span<const Event> read() {
    if (!was_read_) shown_.clear();
    was_read_ = true;
    shown_.insert(shown_.end(), arrived_.begin(), arrived_.end());
    arrived_.clear();
    return shown_;
  }
  /// A step begins: what was read goes when the list is read again.
  void begin_step() { was_read_ = false; }
  void clear() {
    shown_.clear();
    arrived_.clear();
  }

  /// Those of step `step`, read or not.
  std::vector<Event> of_step(std::uint64_t step) const {
    std::vector<Event> some;
    for (const std::vector<Event>* list : {&shown_, &arrived_})
      for (const Event& event : *list)
        if (event.step == step) some.push_back(event);
    return some;
  }

 private:
  std::vector<Event> shown_, arrived_;
  bool was_read_ = false;
};

}  // namespace fathom
