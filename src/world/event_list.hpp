// Events reported by finished steps and not yet read by the application.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fathom {

/// A list that is never read drops its oldest events, so its size is bounded.
inline constexpr std::size_t max_unread_events = std::size_t{1} << 18;

/// Read events remain until the next step begins; reading again appends later ones.
template <class Event>
class EventList {
 public:
  /// Returns how many unread events were dropped.
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
  /// A step begins: events that were read are removed when the list is read again.
  void begin_step() { was_read_ = false; }
  void clear() {
    shown_.clear();
    arrived_.clear();
  }

  /// Events of step `step`, read or not.
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
