// Bodies whose contacts carry more than sweeps can hold (dynamics/overload.hpp).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <fathom/body.hpp>
#include <span>
#include <utility>

#include "dynamics/overload.hpp"
#include "world/archive.hpp"
#include "world/body_table.hpp"
#include "world/growth.hpp"

namespace fathom::native {

/// Loads by slot, which all threads write as they store impulses. An overload in two consecutive steps is not a hit.
/// Only bodies with a noted load cost time.
class Overloads {
 public:
  /// Call when bodies are added.
  void resize(std::size_t slots) {
    const std::size_t before = loads_.size();
    if (slots <= before) return;
    grow_to(loads_, slots), grow_to(is_listed_, slots), grow_to(listed_, slots);
    std::fill(loads_.begin() + before, loads_.end(), Load{});
    std::fill(is_listed_.begin() + before, is_listed_.end(), false);
  }
  /// The slot's body has been removed.
  void forget(std::uint32_t slot) {
    if (slot < loads_.size()) loads_[slot] = {};
    if (slot < bases_.size()) bases_[slot] = {};
    if (slot < owed_.size()) owed_[slot] = {};
  }
  /// The body has been given a pose or a velocity: it is owed nothing from before.
  void clear_owed(std::uint32_t slot) {
    if (slot < owed_.size()) owed_[slot] = {};
  }
  /// An overloaded contact of the body wants at least this inertia (`wanted_inertia`).
  void note(std::uint32_t slot, float wanted) {
    std::atomic_ref<float> most(loads_[slot].now);
    float now = most.load(std::memory_order_relaxed);
    while (now < wanted && !most.compare_exchange_weak(now, wanted, std::memory_order_relaxed)) {
    }
    std::atomic_ref<bool>(any_).store(true, std::memory_order_relaxed);
    list(slot);
  }
  /// The body has at least this inertia in this step. Call after the step has begun.
  void require(std::uint32_t slot, float inertia) {
    loads_[slot].inertia_scale = std::max(loads_[slot].inertia_scale, inertia);
    any_scaled_ = true;
    list(slot);
  }
  /// The body moves little relative to what it rests on, whatever its velocity. Call before the step begins.
  void settle(std::uint32_t slot) {
    if (is_listed_[slot]) loads_[slot].is_settled = 1;
  }
  /// The motion of what the body stands on. Not for several threads at once.
  BaseMotion& base(std::uint32_t slot) {
    const std::size_t before = bases_.size();
    if (slot >= before) {
      grow_to(bases_, loads_.size());
      std::fill(bases_.begin() + before, bases_.end(), BaseMotion{});
    }
    return bases_[slot];
  }
  /// Some body was overloaded in the last step.
  bool any() const { return any_; }
  /// The body was overloaded in the last two steps.
  bool lasts(std::uint32_t slot) const { return slot < loads_.size() && loads_[slot].lasting() > 0; }
  /// Some body has more than its own inertia in this step.
  bool any_scaled() const { return any_scaled_; }
  /// The body's inertia in this step, as a multiple of its own.
  float inertia_scale(std::uint32_t slot) const { return loads_[slot].inertia_scale; }
  /// Begins a step, before which bodies had these velocities. Sleeping bodies keep their load and inertia: they wake
  /// under that load, whose impulses would throw a body that has only its own inertia.
  template <class IsAwake>
  void advance(const IsAwake& is_awake, std::span<const Velocity> velocities) {
    if (!any() && !had_any_ && !any_scaled_ && !any_asleep_) return;
    had_any_ = any();
    any_ = any_scaled_ = any_asleep_ = false;
    const std::uint32_t count = std::exchange(count_, 0);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t slot = listed_[i];
      Load& load = loads_[slot];
      if (!is_awake(slot)) {
        any_asleep_ = any_asleep_ || load.inertia_scale > 1;
        if (slot < owed_.size()) owed_[slot] = {};
      } else {
        const bool settled = load.is_settled || fathom::is_settled(velocities[slot].linear);
        load.inertia_scale = next_inertia_scale(load.inertia_scale, load.lasting(), settled);
        load.before = load.now;
        load.now = 0;
        any_scaled_ = any_scaled_ || load.inertia_scale > 1;
      }
      load.is_settled = 0;
      is_listed_[slot] = load.is_any() || owes(slot);
      if (is_listed_[slot]) listed_[count_++] = slot;
    }
  }
  /// Some body has or had a load, or is owed momentum.
  bool any_listed() const { return count_ > 0; }
  /// Some body may be owed momentum.
  bool may_owe() const { return any_scaled_ || owed_.size() > 0; }
  /// Gives bodies back what their added inertia has taken up, if it may. Call when all inertia of the step is known.
  /// `is_free`: awake and without joints; others lose what they are owed, or they would get it when a joint goes.
  template <class IsFree>
  void give_back(const IsFree& is_free, const BodyTable& bodies, std::span<Velocity> velocities, float fall) {
    for_each_owed(is_free, [&](std::uint32_t slot) {
      Velocity& v = velocities[slot];
      owed_[slot].before = v;
      const Velocity given = owed_[slot].momentum.give(loads_[slot].inertia_scale, bodies[slot].radius, fall);
      v.linear += given.linear, v.angular += given.angular;
    });
  }
  /// Ends the step, if some body has more than its own inertia in it: bodies now have these velocities. `up`: see
  /// `OwedMomentum`.
  template <class IsFree>
  void take_up(const IsFree& is_free, std::span<const Velocity> velocities, Vec3 up) {
    for_each_owed(is_free, [&](std::uint32_t slot) {
      Owed& owed = owed_[slot];
      const Velocity& now = velocities[slot];
      owed.momentum.take(loads_[slot].inertia_scale, now.linear - owed.before.linear, now.angular - owed.before.angular,
                         up);
    });
  }
  std::size_t memory_bytes() const {
    return loads_.capacity() * sizeof(Load) + is_listed_.capacity() + listed_.capacity() * sizeof(std::uint32_t) +
           bases_.capacity() * sizeof(BaseMotion) + owed_.capacity() * sizeof(Owed);
  }

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.loads_, s.bases_, s.owed_, s.any_, s.had_any_, s.any_scaled_, s.any_asleep_);
  }
  /// Rebuilds the list from the loads that were read.
  void restored(ByteReader& in, std::size_t slots) {
    in.require(loads_.size() <= slots && bases_.size() <= loads_.size() && owed_.size() <= loads_.size());
    is_listed_.clear(), listed_.clear();
    grow_to(is_listed_, loads_.size()), grow_to(listed_, loads_.size());
    count_ = 0;
    for (std::uint32_t slot = 0; slot < loads_.size(); ++slot) {
      is_listed_[slot] = loads_[slot].is_any() || owes(slot);
      if (is_listed_[slot]) listed_[count_++] = slot;
    }
    resize(slots);
  }

 private:
  struct Load {
    float now = 0;     ///< the largest inertia wanted since the step began; 0: nothing is overloaded
    float before = 0;  ///< … in the step before
    float inertia_scale = 1;
    std::uint32_t is_settled = 0;  ///< 1: see `settle`

    float lasting() const { return std::min(now, before); }
    bool is_any() const { return now > 0 || before > 0 || inertia_scale > 1; }
  };
  struct Owed {
    OwedMomentum momentum;
    Velocity before;  ///< as the step began, before it was given anything
  };
  bool owes(std::uint32_t slot) const { return slot < owed_.size() && owed_[slot].momentum.any(); }
  template <class IsFree, class Act>
  void for_each_owed(const IsFree& is_free, const Act& act) {
    const std::size_t before = owed_.size();
    if (before < loads_.size()) {
      grow_to(owed_, loads_.size());
      std::fill(owed_.begin() + before, owed_.end(), Owed{});
    }
    for (std::uint32_t i = 0; i < count_; ++i) {
      const std::uint32_t slot = listed_[i];
      if (!is_free(slot))
        owed_[slot] = {};
      else if (loads_[slot].inertia_scale > 1 || owes(slot))
        act(slot);
    }
  }
  /// The order depends on threads; nothing depends on the order.
  void list(std::uint32_t slot) {
    std::atomic_ref<bool> is_listed(is_listed_[slot]);
    if (is_listed.load(std::memory_order_relaxed) || is_listed.exchange(true, std::memory_order_relaxed)) return;
    listed_[std::atomic_ref<std::uint32_t>(count_).fetch_add(1, std::memory_order_relaxed)] = slot;
  }

  LargeArray<Load> loads_;
  LargeArray<BaseMotion> bases_;      // by slot; empty until the first body is carried along
  LargeArray<Owed> owed_;             // by slot; empty until the first body has added inertia
  LargeArray<bool> is_listed_;        // by slot
  LargeArray<std::uint32_t> listed_;  // slots whose loads differ from a new body's, in any order
  std::uint32_t count_ = 0;           // of these
  bool any_ = false, had_any_ = false, any_scaled_ = false;
  bool any_asleep_ = false;  ///< a sleeping body with more than its own inertia
};

}  // namespace fathom::native
