// Sweep-and-sort (dissertation, section 3.3.1; Liu et al., "Real-time Collision Culling of a Million Bodies on Graphics
// Processing Units", 2010). The extrema of every box are projected on one axis with components ≥ 0, so that overlapping
// boxes have overlapping intervals (conditions 3.3–3.6). The list of minima stays almost sorted from step to step,
// which insertion sort exploits; then every body sweeps forward from its minimum to its maximum, with bodies divided
// among threads.
//
// A sea floor's interval covers all others. So bodies with intervals much longer than the median (at most 32) are left
// out of the list and tested against all others directly.
#include <algorithm>

#include "native/broad_phase.hpp"

namespace fathom::native {

namespace {

class SweepBroadPhase : public BroadPhase {
 public:
  explicit SweepBroadPhase(Vec3 axis) : axis_(axis) {}

  std::size_t find(const BroadPhaseInput& input, ThreadPool& pool, std::vector<std::vector<Pair>>& found) override {
    refresh(input, pool);
    const std::size_t chunks = (sorted_.size() + wide_.size() + grain - 1) / grain;
    if (found.size() < chunks) found.resize(chunks);
    if (input.changed.empty() && !input.set_changed()) return 0;
    pool.for_each_chunk(sorted_.size() + wide_.size(), grain, [&](std::size_t begin, std::size_t end) {
      std::vector<Pair>& pairs = found[begin / grain];
      pairs.clear();
      for (std::size_t i = begin; i < end; ++i) {
        if (i < sorted_.size())
          sweep_from(input, i, pairs);
        else
          match_wide(input, i - sorted_.size(), pairs);
      }
    });
    return chunks;
  }

  void refresh(const BroadPhaseInput& input, ThreadPool&) override {
    bounds_ = input.state.bounds.data();
    if (input.set_changed()) {
      ++times_collected_;
      collect(input);
      std::sort(sorted_.begin(), sorted_.end(), before);
    } else {
      for (Interval& interval : sorted_) interval = project(interval.slot);
      insertion_sort();
    }
  }

  void list_neighbours(std::vector<std::uint32_t>& slots) const override {
    for_each_slot([&](std::uint32_t slot) { slots.push_back(slot); });
  }
  std::uint64_t order() const override { return times_collected_; }

  std::size_t memory_bytes() const override {
    return sorted_.capacity() * sizeof(Interval) + wide_.capacity() * sizeof(std::uint32_t);
  }

  // Intervals follow from the boxes. Bodies were marked as wide when the set last changed.
  void save(ByteWriter& write) const override { write(sorted_, wide_); }

  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool&) override {
    in(sorted_, wide_);
    ++times_collected_;
    bounds_ = bounds.data();
    for_each_slot([&](std::uint32_t slot) { in.require(slot < bounds.size()); });
  }

 private:
  static constexpr std::size_t grain = 64;
  static constexpr std::size_t max_wide = 32;
  static constexpr float wide_factor = 8.0f;

  struct Interval {
    float lower, upper;
    std::uint32_t slot;

    float length() const { return upper - lower; }
  };

  static bool before(const Interval& a, const Interval& b) {
    return a.lower != b.lower ? a.lower < b.lower : a.slot < b.slot;
  }

  Interval project(std::uint32_t slot) const {
    return {dot(axis_, bounds_[slot].fat_box.lower), dot(axis_, bounds_[slot].fat_box.upper), slot};
  }

  void collect(const BroadPhaseInput& input) {
    sorted_.clear();
    wide_.clear();
    for (const BodyId id : input.bodies.living()) sorted_.push_back(project(id.index));
    if (sorted_.empty()) return;
    const auto shorter = [](const Interval& a, const Interval& b) {
      return a.length() != b.length() ? a.length() < b.length() : a.slot < b.slot;
    };
    const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
    std::nth_element(sorted_.begin(), middle, sorted_.end(), shorter);
    const float limit = wide_factor * middle->length();
    const std::size_t tail = std::min(max_wide, sorted_.size());
    std::partial_sort(sorted_.rbegin(), sorted_.rbegin() + static_cast<std::ptrdiff_t>(tail), sorted_.rend(),
                      [&](const Interval& a, const Interval& b) { return shorter(b, a); });
    while (wide_.size() < tail && sorted_.back().length() > limit) {
      wide_.push_back(sorted_.back().slot);
      sorted_.pop_back();
    }
  }

  void insertion_sort() {
    for (std::size_t i = 1; i < sorted_.size(); ++i) {
      const Interval moving = sorted_[i];
      std::size_t hole = i;
      for (; hole > 0 && before(moving, sorted_[hole - 1]); --hole) sorted_[hole] = sorted_[hole - 1];
      sorted_[hole] = moving;
    }
  }

  void test(const BroadPhaseInput& input, std::uint32_t a, std::uint32_t b, std::vector<Pair>& found) const {
    if (!overlaps(bounds_[a].fat_box, bounds_[b].fat_box)) return;
    if (!input.is_changed(a) && !input.is_changed(b)) return;  // found before
    if (input.is_wanted(a, b)) found.push_back({std::min(a, b), std::max(a, b)});
  }

  void sweep_from(const BroadPhaseInput& input, std::size_t i, std::vector<Pair>& found) const {
    const Interval& mine = sorted_[i];
    for (std::size_t j = i + 1; j < sorted_.size() && sorted_[j].lower <= mine.upper; ++j)
      test(input, mine.slot, sorted_[j].slot, found);
    for (const std::uint32_t wide : wide_) test(input, mine.slot, wide, found);
  }

  void match_wide(const BroadPhaseInput& input, std::size_t i, std::vector<Pair>& found) const {
    for (std::size_t j = i + 1; j < wide_.size(); ++j) test(input, wide_[i], wide_[j], found);
  }

  template <class Act>
  void for_each_slot(const Act& act) const {
    for (const Interval& interval : sorted_) act(interval.slot);
    for (const std::uint32_t slot : wide_) act(slot);
  }

  Vec3 axis_;
  const BodyBounds* bounds_ = nullptr;
  std::vector<Interval> sorted_;
  std::vector<std::uint32_t> wide_;
  std::uint64_t times_collected_ = 0;
};

}  // namespace

std::unique_ptr<BroadPhase> make_sweep_broad_phase(Vec3 axis) { return std::make_unique<SweepBroadPhase>(axis); }

}  // namespace fathom::native
