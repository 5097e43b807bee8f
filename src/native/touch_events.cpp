// Reports a step's touches and hits to the application, in the order of contacts.
#include <algorithm>
#include <bit>

#include "native/native_simulator.hpp"
#include "world/growth.hpp"

namespace fathom::native {

void NativeSimulator::report_touches() {
  TouchChanges& changes = graph_.touch_changes();
  if (graph_.any_parts()) report_parts(changes);
  report_touches(changes.begun(), begun_, true);
  report_touches(changes.ended(), ended_, false);
  report_hits();
}

// Bodies touch as long as any of the pair's contacts does.
void NativeSimulator::report_parts(TouchChanges& changes) {
  std::vector<std::uint32_t> pairs;  // their first contacts
  const auto for_each_of = [&](std::span<std::uint64_t> bits, const auto& act) {
    for (std::size_t i = 0; i < bits.size(); ++i)
      for (std::uint64_t left = bits[i]; left != 0; left &= left - 1) {
        const auto index = static_cast<std::uint32_t>(64 * i + static_cast<std::size_t>(std::countr_zero(left)));
        if (graph_[index].in_parts) act(index, bits[i], left & (~left + 1));
      }
  };
  for (const std::span<std::uint64_t> bits : {changes.begun(), changes.ended()})
    for_each_of(bits,
                [&](std::uint32_t index, std::uint64_t&, std::uint64_t) { pairs.push_back(graph_.first_part(index)); });
  if (pairs.empty()) return;
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const auto touches = [&](std::uint32_t first) {
    bool any = false;
    graph_.for_each_in_ring(first, [&](std::uint32_t part) { any |= graph_[part].in_touch; });
    return any;
  };
  std::vector<bool> touched;
  for (const std::uint32_t first : pairs) touched.push_back(touches(first));
  for_each_of(changes.ended(), [&](std::uint32_t index, std::uint64_t& word, std::uint64_t bit) {
    graph_[index].in_touch = false;
    word &= ~bit;
  });
  for_each_of(changes.begun(), [&](std::uint32_t index, std::uint64_t& word, std::uint64_t bit) {
    graph_[index].in_touch = true;
    word &= ~bit;
  });
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool touch = touches(pairs[i]);
    if (touch == touched[i]) continue;
    LargeArray<ContactEvent>& events = touch ? begun_ : ended_;
    grow_to(events, events.size() + 1);
    events[events.size() - 1] = event(graph_[pairs[i]].a, graph_[pairs[i]].b);
  }
}

// Counts the position of each part's events first, so that several threads can write them.
void NativeSimulator::report_touches(std::span<std::uint64_t> bits, LargeArray<ContactEvent>& events, bool touch) {
  const std::size_t before = events.size();
  std::size_t count = 0;
  for (const std::uint64_t word : bits) count += static_cast<std::size_t>(std::popcount(word));
  if (count == 0) return;
  grow_to(events, before + count);
  const std::size_t parts = parts_for(pool_, count);
  const auto begin = [&](std::size_t part) { return part * bits.size() / parts; };
  event_offsets_.assign(1, before);
  for (std::size_t part = 0; part + 1 < parts; ++part) {
    std::size_t index = event_offsets_.back();
    for (std::size_t i = begin(part); i < begin(part + 1); ++i)
      index += static_cast<std::size_t>(std::popcount(bits[i]));
    event_offsets_.push_back(index);
  }
  for_each_part(pool_, parts, [&](std::size_t part) {
    std::size_t index = event_offsets_[part];
    for (std::size_t i = begin(part); i < begin(part + 1); ++i)
      for (std::uint64_t left = std::exchange(bits[i], 0); left != 0; left &= left - 1) {
        Contact& c = graph_[static_cast<std::uint32_t>(64 * i + static_cast<std::size_t>(std::countr_zero(left)))];
        c.in_touch = touch;
        events[index++] = event(c.a, c.b);
      }
  });
}

void NativeSimulator::report_hits() {
  const std::span<ContactHit> found = graph_.touch_changes().hits();
  if (found.empty()) return;
  std::ranges::sort(found, {}, &ContactHit::contact);
  grow_to(hits_, found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Contact& c = graph_[found[i].contact];
    const Hit& hit = found[i].hit;
    const ContactEvent ids = event(c.a, c.b);
    hits_[i] = {ids.a, ids.b, hit.point, c.b < c.a ? -hit.normal : hit.normal, hit.speed, 0, ids.step};
  }
  graph_.touch_changes().clear_hits();
}

ContactEvent NativeSimulator::event(std::uint32_t a, std::uint32_t b) const {
  return {bodies.id(std::min(a, b)), bodies.id(std::max(a, b)), steps + 1};
}

}  // namespace fathom::native
