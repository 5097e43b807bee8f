// Touches and hits that any thread finds as it stores a step's impulses (dynamics/touch.hpp). They are reported at the
// end of the step, in the order of contacts.
#pragma once

#include <atomic>
#include <cstdint>
#include <fathom/math.hpp>
#include <mutex>
#include <span>
#include <vector>

#include "dynamics/touch.hpp"
#include "native/contact.hpp"
#include "world/growth.hpp"

namespace fathom::native {

struct ContactHit {
  std::uint32_t contact;
  Hit hit;
};

class TouchChanges {
 public:
  void make_room(std::size_t contacts) {
    const std::size_t words = (contacts + 63) / 64;
    if (begun_.size() < words) grow_to(begun_, words), grow_to(ended_, words);
  }
  /// The contact begins or stops touching.
  void note(std::uint32_t contact, bool touches) {
    std::atomic_ref(touches ? begun_[contact / 64] : ended_[contact / 64])
        .fetch_or(std::uint64_t{1} << contact % 64, std::memory_order_relaxed);
  }
  void note(const ContactHit& hit) {
    const std::lock_guard lock(hits_mutex_);  // reserving room for one per contact would take a tenth of all memory
    hits_.push_back(hit);
  }

  // Bits by contact, 64 per word; cleared by the code that reports them.
  std::span<std::uint64_t> begun() { return begun_; }
  std::span<std::uint64_t> ended() { return ended_; }
  std::span<ContactHit> hits() { return hits_; }
  void clear_hits() { hits_.clear(); }

  std::size_t memory_bytes() const {
    return (begun_.capacity() + ended_.capacity()) * sizeof(std::uint64_t) + hits_.capacity() * sizeof(ContactHit);
  }

 private:
  std::vector<std::uint64_t> begun_, ended_;
  std::mutex hits_mutex_;
  std::vector<ContactHit> hits_;
};

/// What finding hits needs besides the contacts. All by slot.
struct TouchWatch {
  TouchChanges* changes = nullptr;
  const Pose* poses = nullptr;  ///< at the start of the step
  const Velocity* velocities = nullptr;
  const SolverBody* bodies = nullptr;
  float hit_threshold = 0;  ///< m/s
  float dt = 0;             ///< s

  /// For contacts that approached fast as the step began, or whose last hit continues.
  void note_hit(std::uint32_t index, Contact& c, const ContactManifold& m, const ContactFrame& frame,
                const PointRow* points, const float* impulses, bool pressed) const {
    const HitRule rule{hit_threshold, touch_distance(c.touch_halvings, true), dt};
    const Hit hit = pressed ? fastest_hit(m, frame, points, impulses, body(c.a), body(c.b), c.ahead, rule) : Hit{};
    if (hit.speed > 0 && !c.hits) changes->note({index, hit});
    c.hits = hit.is_closing;
  }

 private:
  Stepped body(std::uint32_t slot) const {
    return {poses[slot].position, velocities[slot].linear, velocities[slot].angular, poses[slot].rotation,
            bodies[slot]};
  }
};

}  // namespace fathom::native
