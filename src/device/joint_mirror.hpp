// Joints on the host: their colours, the pairs that they and the application keep apart, and the edits that the device
// has yet to receive.
//
// All of it depends only on the application's calls, never on the device's progress.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "device/body_indices.hpp"
#include "device/contact_arrays.hpp"
#include "device/joint_arrays.hpp"
#include "world/excluded_pairs.hpp"
#include "world/joint_table.hpp"

namespace fathom::device {

/// The content of the ApartTable on the device, and which of its slots are new.
class ApartPairs {
 public:
  /// Slots of the table, a power of two; 0 until there is a joint.
  std::size_t size() const { return pairs_.size(); }
  const std::vector<std::uint64_t>& pairs() const { return pairs_; }

  void begin() {
    if (pairs_.empty()) resize(first_size);
  }
  /// A pair must be removed as often as it was added.
  void add(std::uint64_t pair) {
    if (2 * (count_ + 1) > pairs_.size()) resize(2 * pairs_.size());
    const std::uint32_t slot = find(pair);
    if (times_[slot]++ > 0) return;
    ++count_;
    set(slot, pair);
  }
  void remove(std::uint64_t pair) {
    std::uint32_t gap = find(pair);
    if (--times_[gap] > 0) return;
    --count_;
    // Later entries move towards their home slots, so no search ends too early.
    for (std::uint32_t k = next(gap); pairs_[k] != ApartTable::no_pair; k = next(k)) {
      const std::uint32_t way = (k - ApartTable::home(pairs_[k], mask())) & mask();
      if (way < ((k - gap) & mask())) continue;
      times_[gap] = times_[k];
      set(gap, pairs_[k]);
      gap = k;
    }
    times_[gap] = 0;
    set(gap, ApartTable::no_pair);
  }

  void touch(std::uint32_t slot) { changed_.push_back(slot); }
  /// Changes since the last call.
  std::vector<ApartEdit> take_edits() {
    std::ranges::sort(changed_);
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    std::vector<ApartEdit> edits;
    for (const std::uint32_t slot : changed_) edits.push_back({pairs_[slot], slot});
    changed_.clear();
    return edits;
  }

 private:
  static constexpr std::size_t first_size = 64;

  std::uint32_t mask() const { return static_cast<std::uint32_t>(pairs_.size()) - 1; }
  std::uint32_t next(std::uint32_t slot) const { return (slot + 1) & mask(); }
  /// The slot where the pair is, or would be.
  std::uint32_t find(std::uint64_t pair) const {
    std::uint32_t slot = ApartTable::home(pair, mask());
    while (pairs_[slot] != pair && pairs_[slot] != ApartTable::no_pair) slot = next(slot);
    return slot;
  }
  void set(std::uint32_t slot, std::uint64_t pair) {
    pairs_[slot] = pair;
    touch(slot);
  }
  void resize(std::size_t size) {
    const std::vector<std::uint64_t> pairs = std::exchange(pairs_, std::vector(size, ApartTable::no_pair));
    const std::vector<std::uint32_t> times = std::exchange(times_, std::vector(size, 0u));
    for (std::size_t k = 0; k < pairs.size(); ++k)
      if (pairs[k] != ApartTable::no_pair) {
        const std::uint32_t slot = find(pairs[k]);
        pairs_[slot] = pairs[k], times_[slot] = times[k];
      }
    changed_.clear();
    for (std::uint32_t slot = 0; slot < size; ++slot) touch(slot);
  }

  std::vector<std::uint64_t> pairs_;
  std::vector<std::uint32_t> times_;  // number of times each was added
  std::vector<std::uint32_t> changed_;
  std::size_t count_ = 0;
};

/// Two bodies, by device index, that stop colliding, or collide again.
struct PairNote {
  std::uint32_t a = none, b = none;
  bool apart = false;
};

class JointMirror {
 public:
  /// The joint in `slot` was added, removed or changed.
  void note(std::uint32_t slot) {
    if (slot >= is_noted_.size()) is_noted_.resize(slot + 1);
    if (!is_noted_[slot]) noted_.push_back(slot);
    is_noted_[slot] = true;
  }
  /// The joint in `slot` is removed. A joint may get the same slot and generation again, for bodies with other indices.
  void note_removed(std::uint32_t slot) {
    note(slot);
    if (slot < joints_.size()) joints_[slot].generation = unknown;
  }
  /// Two bodies, by device index, stop colliding (`apart`), or collide again.
  void note_pair(std::uint32_t a, std::uint32_t b, bool apart) { pair_notes_.push_back({a, b, apart}); }
  /// Bodies get new indices, before the device knows any.
  void reorder(std::span<const std::uint32_t> new_of) {
    for (PairNote& note : pair_notes_) note.a = new_of[note.a], note.b = new_of[note.b];
  }
  bool has_notes() const { return !noted_.empty() || !pair_notes_.empty(); }
  const ApartPairs& apart() const { return apart_; }

  /// Edits that bring the device up to date with `table`; `h` is a substep (s), `min_hit` that of GenericJoint. New
  /// joints take the lowest colour that is free on both bodies, in the order of slots.
  std::vector<JointEdit> take_edits(const JointTable& table, const BodyIndices& indices, float h, float min_hit) {
    std::ranges::sort(noted_);
    apart_.begin();
    joints_.resize(std::max<std::size_t>(joints_.size(), table.slot_count()));
    colours_.resize(std::max<std::size_t>(colours_.size(), indices.size()));
    for (const std::uint32_t slot : noted_)
      if (!is_known(table, slot)) forget(joints_[slot]);
    std::vector<JointEdit> edits;
    for (const std::uint32_t slot : noted_) {
      JointEdit& edit = edits.emplace_back();
      edit.slot = slot;
      edit.is_new = !is_known(table, slot);
      if (table.alive(slot)) {
        if (edit.is_new) joints_[slot] = added(table, indices, slot);
        edit.record = record(joints_[slot], table[slot], h);
        if (edit.record.is_generic) note_generic(table, edit, h, min_hit);
      }
      is_noted_[slot] = false;
    }
    noted_.clear();
    return edits;
  }
  /// The definitions that belong to these edits.
  std::vector<GenericEdit> take_generic_edits() { return std::exchange(generic_edits_, {}); }
  /// Applies the notes of pairs.
  std::vector<PairNote> take_pair_notes() {
    if (!pair_notes_.empty()) apart_.begin();
    for (const PairNote& note : pair_notes_) apply(note);
    return std::exchange(pair_notes_, {});
  }
  std::vector<ApartEdit> take_apart_edits() { return apart_.take_edits(); }
  /// Whether there ever was a generic or distance joint.
  bool had_generic() const { return had_generic_; }

  /// Restores notes that did not reach the device.
  void take_back(const std::vector<JointEdit>& edits, const std::vector<PairNote>& pair_notes,
                 const std::vector<ApartEdit>& apart_edits) {
    for (const JointEdit& edit : edits) {
      note(edit.slot);
      if (edit.is_new) joints_[edit.slot].generation = unknown;
    }
    for (auto note = pair_notes.rbegin(); note != pair_notes.rend(); ++note) apply({note->a, note->b, !note->apart});
    pair_notes_ = pair_notes;
    for (const ApartEdit& edit : apart_edits)
      if (edit.slot < apart_.size()) apart_.touch(edit.slot);
  }

  /// Whether the device knows the joint currently in `slot`.
  bool is_known(const JointTable& table, std::uint32_t slot) const {
    return slot < joints_.size() && table.alive(slot) && joints_[slot].generation == table.id(slot).generation;
  }

  template <class Self, class Archive>
  static void archive(Self& self, Archive& a) {
    a(self.joints_, self.noted_, self.had_generic_);
  }
  /// Whether the data read is consistent with itself and with `table`.
  bool is_sound(const JointTable& table, std::uint32_t index_count) const {
    const auto fits = [&](const Mirrored& joint) {
      return joint.a == none ||
             (joint.a < index_count && joint.b < index_count && joint.a != joint.b && joint.fixed_a <= 1 &&
              joint.apart <= 1 && (joint.colour < dynamic_colours || joint.colour == overflow_colour));
    };
    return had_generic_ <= 1 && joints_.size() <= table.slot_count() && std::ranges::all_of(joints_, fits) &&
           std::ranges::all_of(noted_, [&](std::uint32_t slot) { return slot < table.slot_count(); });
  }
  /// Rebuilds everything else from sound data that was read; `excluded` is by slot. A device that knows bodies gets the
  /// whole table of pairs.
  void rebuild(const ExcludedPairs& excluded, const BodyIndices& indices, bool is_on_device) {
    for (const std::uint32_t slot : std::exchange(noted_, {})) note(slot);
    excluded.for_each([&](std::uint32_t a, std::uint32_t b) { note_pair(indices.of(a), indices.of(b), true); });
    if (is_on_device) take_pair_notes();
    apart_.take_edits();
    if (joints_.empty()) return;
    apart_.begin();
    is_noted_.resize(joints_.size());
    for (const Mirrored& joint : joints_) {
      if (joint.a == none) continue;
      colours_.resize(std::max({colours_.size(), std::size_t{joint.a} + 1, std::size_t{joint.b} + 1}));
      hold(joint);
    }
    apart_.take_edits();
  }

 private:
  static constexpr std::uint32_t unknown = 0;  // no living joint has this generation

  /// A joint in the form that the device will have.
  struct Mirrored {
    std::uint32_t a = none, b = none;  // device indices
    std::uint32_t colour = 0;
    std::uint32_t fixed_a = 0;
    std::uint32_t apart = 0;  // 1: it keeps its bodies apart
    std::uint32_t generation = unknown;
  };

  void apply(const PairNote& note) {
    const std::uint64_t pair = ApartTable::pair(note.a, note.b);
    note.apart ? apart_.add(pair) : apart_.remove(pair);
  }

  Mirrored added(const JointTable& table, const BodyIndices& indices, std::uint32_t slot) {
    const JointInfo& info = table[slot];
    Mirrored joint{indices.of(info.a), indices.of(info.b),          overflow_colour,
                   info.fixed_a,       !info.def.collide_connected, table.id(slot).generation};
    const std::uint64_t taken = colours_[joint.b] | (joint.fixed_a ? 0 : colours_[joint.a]);
    const auto free = static_cast<std::uint32_t>(std::countr_one(taken));
    if (free < dynamic_colours) joint.colour = free;
    hold(joint);
    return joint;
  }
  void hold(const Mirrored& joint) {
    if (joint.colour != overflow_colour) {
      colours_[joint.b] |= bit(joint);
      if (!joint.fixed_a) colours_[joint.a] |= bit(joint);
    }
    if (joint.apart) apart_.add(ApartTable::pair(joint.a, joint.b));
  }
  void forget(Mirrored& joint) {
    if (joint.a == none) return;
    if (joint.colour != overflow_colour) {
      colours_[joint.b] &= ~bit(joint);
      if (!joint.fixed_a) colours_[joint.a] &= ~bit(joint);
    }
    if (joint.apart) apart_.remove(ApartTable::pair(joint.a, joint.b));
    joint = {};
  }
  static std::uint64_t bit(const Mirrored& joint) { return std::uint64_t{1} << joint.colour; }

  static JointRecord record(const Mirrored& joint, const JointInfo& info, float h) {
    const bool is_generic = info.def.type != JointType::ball;
    const JointSoftness softness = is_generic
                                       ? rigid_joint_softness(h)
                                       : joint_softness(info.def.hertz, info.def.damping_ratio, info.masses[0], h);
    JointRecord r;
    r.a = joint.a, r.b = joint.b, r.colour = joint.colour, r.fixed_a = joint.fixed_a != 0;
    r.anchor_a = info.anchor_a, r.anchor_b = info.anchor_b;
    r.bias_rate = softness.bias_rate, r.mass_scale = softness.mass_scale, r.impulse_scale = softness.impulse_scale;
    r.compliance = softness.compliance;
    r.max_impulse = max_impulse(info.def.hertz, info.def.max_force, h);
    r.max_start = max_start(info.swing_rate, h);
    r.is_generic = is_generic;
    return r;
  }
  void note_generic(const JointTable& table, const JointEdit& edit, float h, float min_hit) {
    const JointInfo& info = table[edit.slot];
    had_generic_ = 1;
    generic_edits_.push_back(
        {make_generic_joint(info.def, {info.swapped, table.is_alone(edit.slot), info.masses}, h, min_hit), edit.slot,
         edit.is_new});
  }

  std::vector<Mirrored> joints_;        // by slot
  std::vector<std::uint64_t> colours_;  // used by joints, by device index
  ApartPairs apart_;
  std::vector<PairNote> pair_notes_;  // for the next step
  std::vector<std::uint32_t> noted_;
  std::vector<bool> is_noted_;
  std::vector<GenericEdit> generic_edits_;
  std::uint32_t had_generic_ = 0;
};

}  // namespace fathom::device
