// Bodies whose contacts carry more than sweeps can hold (dynamics/overload.hpp).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynamics/overload.hpp"

namespace fathom::native {

/// Loads by slot, written by all threads as impulses are stored. What is overloaded in two steps on end is no hit.
class Overloads {
 public:
  void resize(std::size_t slots) {
    if (loads_.size() < slots) loads_.resize(slots);
  }
  /// The slot's body is removed.
  void forget(std::uint32_t slot) {
    if (slot < loads_.size()) loads_[slot] = {};
  }
  /// An overloaded contact of the body wants it that inert (`wanted_inertia`).
  void note(std::uint32_t slot, float wanted) {
    std::atomic_ref<float> most(loads_[slot].now);
    float now = most.load(std::memory_order_relaxed);
    while (now < wanted && !most.compare_exchange_weak(now, wanted, std::memory_order_relaxed)) {
    }
    std::atomic_ref<bool>(any_).store(true, std::memory_order_relaxed);
  }
  /// The body is at least that inert in this step; to be called once it has begun.
  void require(std::uint32_t slot, float inertia) {
    loads_[slot].inertia_scale = std::max(loads_[slot].inertia_scale, inertia);
    any_scaled_ = true;
  }
  /// Some body was overloaded in the last step.
  bool any() const { return any_; }
  /// The body was, and in the step before.
  bool lasts(std::uint32_t slot) const { return slot < loads_.size() && loads_[slot].lasting() > 0; }
  /// Some body has more than its own inertia in this step.
  bool any_scaled() const { return any_scaled_; }
  /// The body's inertia in this step, in parts of its own.
  float inertia_scale(std::uint32_t slot) const { return loads_[slot].inertia_scale; }
  /// Begins a step. What sleeps keeps its load and its inertia: it wakes under that load, whose impulses would throw
  /// what is as light as it was at first.
  template <class IsAwake>
  void advance(const IsAwake& is_awake) {
    if (!any() && !had_any_ && !any_scaled_ && !any_asleep_) return;
    had_any_ = any();
    any_ = any_scaled_ = any_asleep_ = false;
    for (std::uint32_t slot = 0; slot < loads_.size(); ++slot) {
      Load& load = loads_[slot];
      if (!is_awake(slot)) {
        any_asleep_ = any_asleep_ || load.inertia_scale > 1;
        continue;
      }
      load.inertia_scale = next_inertia_scale(load.inertia_scale, load.lasting());
      load.before = load.now;
      load.now = 0;
      any_scaled_ = any_scaled_ || load.inertia_scale > 1;
    }
  }
  std::size_t memory_bytes() const { return loads_.capacity() * sizeof(Load); }

  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.loads_, s.any_, s.had_any_, s.any_scaled_, s.any_asleep_);
  }

 private:
  struct Load {
    float now = 0;     ///< the most that is wanted since the step began; 0: nothing is overloaded
    float before = 0;  ///< … in the step before
    float inertia_scale = 1;

    float lasting() const { return std::min(now, before); }
  };
  std::vector<Load> loads_;
  bool any_ = false, had_any_ = false, any_scaled_ = false;
  bool any_asleep_ = false;  ///< with more than its own inertia
};

}  // namespace fathom::native
