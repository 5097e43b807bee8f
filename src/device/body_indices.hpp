// The device index of each body, and the indices' former owners.
//
// Indices depend only on the application's calls, never on the device's progress: an index becomes free for the batch
// of edits after the one that removed its last owner, because steps run in order and that batch's step drops the
// owner's contacts. The same calls give the same indices, however and whenever results are read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <fathom/body.hpp>
#include <map>
#include <utility>
#include <vector>

#include "check/check.hpp"
#include "device/body_arrays.hpp"

namespace fathom::device {

/// The owner of an index up to a step, whose events may still name it.
struct FormerOwner {
  std::uint64_t step;  ///< the step whose edits removed it
  BodyId id;
  std::uint32_t index, unused = 0;
};

/// Successive indices of a compound's children.
struct ChildRange {
  std::uint64_t step;  ///< the step whose edits removed the compound
  std::uint32_t first, count;
};

class BodyIndices {
 public:
  /// Assigns an index to the body in `slot`, which is added by the edits before step `step`.
  std::uint32_t add(std::uint32_t slot, std::uint64_t step) {
    while (!resting_.empty() && resting_.front().step < step) {
      free_.push_back(resting_.front().index);
      resting_.pop_front();
    }
    if (of_slot_.size() <= slot) of_slot_.resize(slot + 1, none);
    std::uint32_t index = size();
    if (free_.empty()) {
      slots_.push_back(slot);
    } else {
      index = free_.back();
      free_.pop_back();
      slots_[index] = slot;
    }
    of_slot_[slot] = index;
    return index;
  }

  /// Releases the index of body `id`, which is removed by the edits before step `step`. Steps never decrease.
  void remove(BodyId id, std::uint64_t step) {
    FATHOM_ASSERT(former_.empty() || former_.back().step <= step);
    const std::uint32_t index = std::exchange(of_slot_[id.index], none);
    slots_[index] = none;
    resting_.push_back({step, id, index});
    former_.push_back({step, id, index});
    note_loss(former_.back());
  }

  /// Assigns `count` successive indices, which belong to no slot, to the children of the compound in `slot`, added by
  /// the edits before step `step`.
  void add_children(std::uint32_t slot, std::uint32_t count, std::uint64_t step) {
    while (!resting_children_.empty() && resting_children_.front().step < step) {
      free_children_[resting_children_.front().count].push_back(resting_children_.front().first);
      resting_children_.pop_front();
    }
    if (first_child_.size() <= slot) first_child_.resize(slot + 1, none);
    std::vector<std::uint32_t>& free = free_children_[count];
    if (free.empty()) {
      first_child_[slot] = size();
      slots_.resize(slots_.size() + count, none);
    } else {
      first_child_[slot] = free.back();
      free.pop_back();
    }
  }
  /// Releases the children's indices; call before `remove`.
  void remove_children(std::uint32_t slot, std::uint32_t count, std::uint64_t step) {
    resting_children_.push_back({step, std::exchange(first_child_[slot], none), count});
  }
  /// Index of the first child of the compound in `slot`.
  std::uint32_t first_child(std::uint32_t slot) const { return first_child_[slot]; }
  /// Ranges of children without a compound.
  std::vector<ChildRange> unused_children() const {
    std::vector<ChildRange> ranges(resting_children_.begin(), resting_children_.end());
    for (const auto& [count, firsts] : free_children_)
      for (const std::uint32_t first : firsts) ranges.push_back({0, first, count});
    return ranges;
  }

  /// Upper bound of all indices: in use, free or not yet free.
  std::uint32_t size() const { return static_cast<std::uint32_t>(slots_.size()); }
  std::uint32_t of(std::uint32_t slot) const { return of_slot_[slot]; }
  /// The slot of the body that currently has `index`, or `none`.
  std::uint32_t slot(std::uint32_t index) const { return slots_[index]; }
  const std::vector<std::uint32_t>& slots() const { return slots_; }

  /// The former owner that had `index` in step `step`; null if its present owner had it then.
  const BodyId* former(std::uint32_t index, std::uint64_t step) const {
    if (index >= losses_.size() || losses_[index].step < step) return nullptr;
    if (losses_[index].step_before < step) return &losses_[index].id;
    // If several have lost the index since, the first of them had it then.
    const auto first =
        std::ranges::find_if(former_, [&](const FormerOwner& f) { return f.index == index && f.step >= step; });
    return first != former_.end() ? &first->id : nullptr;
  }
  /// Drops former owners in steps before `step`, which will not be queried again.
  void forget_before(std::uint64_t step) {
    while (!former_.empty() && former_.front().step < step) former_.pop_front();
  }

  /// Index i becomes new_of[i]; a compound's children stay together.
  void reorder(const std::vector<std::uint32_t>& new_of) {
    std::vector<std::uint32_t> slots(slots_.size());
    for (std::uint32_t i = 0; i < slots.size(); ++i) slots[new_of[i]] = slots_[i];
    slots_ = std::move(slots);
    for (std::uint32_t& index : of_slot_)
      if (index != none) index = new_of[index];
    for (std::uint32_t& index : free_) index = new_of[index];
    for (std::uint32_t& index : first_child_)
      if (index != none) index = new_of[index];
    for (ChildRange& range : resting_children_) range.first = new_of[range.first];
    for (auto& [count, firsts] : free_children_)
      for (std::uint32_t& first : firsts) first = new_of[first];
    for (FormerOwner& f : resting_) f.index = new_of[f.index];
    for (FormerOwner& f : former_) f.index = new_of[f.index];
    list_losses();
  }

  template <class Self, class Archive>
  static void archive(Self& self, Archive& a) {
    std::vector<FormerOwner> resting(self.resting_.begin(), self.resting_.end());
    std::vector<FormerOwner> former(self.former_.begin(), self.former_.end());
    std::vector<ChildRange> resting_children(self.resting_children_.begin(), self.resting_children_.end());
    std::vector<ChildRange> free_children;
    for (const auto& [count, firsts] : self.free_children_)
      for (const std::uint32_t first : firsts) free_children.push_back({0, first, count});
    a(self.of_slot_, self.slots_, self.free_, resting, former, self.first_child_, resting_children, free_children);
    if constexpr (Archive::reading) {
      self.resting_children_.assign(resting_children.begin(), resting_children.end());
      for (const ChildRange& range : free_children) self.free_children_[range.count].push_back(range.first);
      self.resting_.assign(resting.begin(), resting.end());
      self.former_.assign(former.begin(), former.end());
      self.list_losses();
    }
  }
  /// Whether the data read is consistent with itself and with the bodies alive in `slot_count` slots, of which
  /// `children_of(slot)` is the number of children.
  template <class IsAlive, class ChildrenOf>
  bool is_sound(std::uint32_t slot_count, const IsAlive& is_alive, const ChildrenOf& children_of) const {
    if (of_slot_.size() > slot_count || first_child_.size() > slot_count) return false;
    std::vector<ChildRange> ranges = unused_children();
    for (std::uint32_t slot = 0; slot < slot_count; ++slot) {
      const std::uint32_t first = slot < first_child_.size() ? first_child_[slot] : none;
      const std::uint32_t count = is_alive(slot) ? children_of(slot) : 0;
      if ((first != none) != (count > 0)) return false;
      if (count > 0) ranges.push_back({0, first, count});
    }
    std::ranges::sort(ranges, {}, &ChildRange::first);
    std::uint64_t end = 0;
    for (const ChildRange& range : ranges) {
      if (range.first < end || range.count == 0) return false;
      end = std::uint64_t{range.first} + range.count;
      if (end > size()) return false;
      for (std::uint64_t i = range.first; i < end; ++i)
        if (slots_[i] != none) return false;
    }
    for (std::uint32_t slot = 0; slot < slot_count; ++slot) {
      const std::uint32_t index = slot < of_slot_.size() ? of_slot_[slot] : none;
      if (is_alive(slot) ? index >= size() || slots_[index] != slot : index != none) return false;
    }
    for (const std::uint32_t slot : slots_)
      if (slot != none && (slot >= of_slot_.size() || !is_alive(slot))) return false;
    const auto has_none = [&](std::uint32_t index) { return index < size() && slots_[index] == none; };
    return std::ranges::all_of(free_, has_none) &&
           std::ranges::all_of(resting_, [&](const FormerOwner& f) { return has_none(f.index); }) &&
           std::ranges::all_of(former_, [&](const FormerOwner& f) { return f.index < size(); });
  }

 private:
  /// When an index was last lost, by whom, and when the time before: identifies nearly all former owners directly.
  struct Loss {
    std::uint64_t step = 0, step_before = 0;
    BodyId id;
  };

  void note_loss(const FormerOwner& f) {
    if (losses_.size() <= f.index) losses_.resize(f.index + 1);
    Loss& loss = losses_[f.index];
    loss = {f.step, loss.step, f.id};
  }
  void list_losses() {
    losses_.clear();
    for (const FormerOwner& f : former_)
      if (f.index < size()) note_loss(f);
  }

  std::vector<std::uint32_t> of_slot_;  // by slot
  std::vector<std::uint32_t> slots_;    // by index
  std::vector<std::uint32_t> free_;
  std::deque<FormerOwner> resting_;  // in order of removal: not free before the next batch of edits
  std::deque<FormerOwner> former_;   // the same, for events
  // Ranges are used again for as many children only: compounds of a kind come and go together.
  std::vector<std::uint32_t> first_child_;                             // by slot; `none`: no compound
  std::deque<ChildRange> resting_children_;                            // like `resting_`
  std::map<std::uint32_t, std::vector<std::uint32_t>> free_children_;  // first indices, by number of children
  std::vector<Loss> losses_;                                           // by index
};

}  // namespace fathom::device
