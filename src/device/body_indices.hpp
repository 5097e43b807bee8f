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

  /// Index i becomes new_of[i].
  void reorder(const std::vector<std::uint32_t>& new_of) {
    std::vector<std::uint32_t> slots(slots_.size());
    for (std::uint32_t i = 0; i < slots.size(); ++i) slots[new_of[i]] = slots_[i];
    slots_ = std::move(slots);
    for (std::uint32_t& index : of_slot_)
      if (index != none) index = new_of[index];
    for (std::uint32_t& index : free_) index = new_of[index];
    for (FormerOwner& f : resting_) f.index = new_of[f.index];
    for (FormerOwner& f : former_) f.index = new_of[f.index];
    list_losses();
  }

  template <class Self, class Archive>
  static void archive(Self& self, Archive& a) {
    std::vector<FormerOwner> resting(self.resting_.begin(), self.resting_.end());
    std::vector<FormerOwner> former(self.former_.begin(), self.former_.end());
    a(self.of_slot_, self.slots_, self.free_, resting, former);
    if constexpr (Archive::reading) {
      self.resting_.assign(resting.begin(), resting.end());
      self.former_.assign(former.begin(), former.end());
      self.list_losses();
    }
  }
  /// Whether the data read is consistent with itself and with the bodies alive in `slot_count` slots.
  template <class IsAlive>
  bool is_sound(std::uint32_t slot_count, const IsAlive& is_alive) const {
    if (of_slot_.size() > slot_count) return false;
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
  std::vector<Loss> losses_;         // by index
};

}  // namespace fathom::device
