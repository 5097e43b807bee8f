// The brace of a column (dynamics/columns.hpp) contact by contact, all of them at the same time.
//
// What a contact is to give hangs on all bodies of its column, but only by sums. Where work-items are many and a walk
// along the column would be one item's alone, each contact makes its own: as many additions as the column is high, of
// which none waits for another item.
#pragma once

#include "dynamics/columns.hpp"

namespace fathom {

/// What a contact and its upper body are in the others' sums.
struct ColumnLink {
  Vec3 arm;            ///< m, from the centre of the lower body to that of the upper
  Vec3 rise;           ///< m/s
  Vec3 linear;         ///< m/s, of the upper body
  Vec3 spin_momentum;  ///< kg·m²/s, its inertia times its spin
  Vec3 weight;         ///< N·s a substep
  float mass;          ///< kg; 0 where the contact does not hold
  float inertia;       ///< kg·m², of isotropic bodies, else 0

  FATHOM_HD bool holds() const { return mass > 0; }
};

FATHOM_HD ColumnLink column_link(const ColumnRung& r, const Mat3& inertia) {
  ColumnLink link;
  link.arm = r.arm_below - r.arm_above;
  link.rise = r.rise();
  link.linear = r.linear;
  link.spin_momentum = inertia * r.angular;
  link.weight = r.weight_time * r.acceleration;
  link.mass = r.holds ? r.mass : 0;
  link.inertia = r.inverse_inertia > 0 ? inertia.x.x : 0;
  return link;
}

/// What one contact of a column is to do for all of it.
struct ColumnHold {
  std::uint32_t begin, end;  ///< its piece: bodies [begin, end]; both 0 where the contact does not hold
  ColumnGain gain;           ///< of the bodies above
  Vec3 target, base_target;  ///< m/s, of the contact's upper body and the piece's lowest
  Vec3 spin;                 ///< rad/s, of all
  Vec3 weight;               ///< N·s a substep, of all
};

/// The hold of contact k, whose arm from its upper body's centre is `arm_above`. `Links` has
///
///     ColumnLink link(k);  bool holds(k);  SolverBody lower(k);  Mat3 inertia(j, inverse_inertia);
template <class Links>
class ColumnHolds {
 public:
  FATHOM_HD ColumnHolds(const Links& links, std::uint32_t contacts) : c_(links), contacts_(contacts) {}

  FATHOM_HD ColumnHold hold(std::uint32_t k, Vec3 arm_above) const {
    // Most columns are one piece.
    const ColumnHold lowest = hold_from(0, k, arm_above);
    if (lowest.end > k) return lowest;
    if (!c_.holds(k)) return {};
    std::uint32_t begin = k;
    while (c_.holds(begin - 1)) --begin;
    return hold_from(begin, k, arm_above);
  }

 private:
  /// Of the piece that begins with body `begin`, which may end before the contact.
  FATHOM_HD ColumnHold hold_from(std::uint32_t begin, std::uint32_t k, Vec3 arm_above) const {
    ColumnHold h{};
    h.begin = begin;
    const SolverBody base = c_.lower(begin);
    h.base_target = base.linear, h.spin = base.angular;
    const bool turns_anisotropic = base.inverse_mass > 0 ? keep_momentum(base, h) : length_squared(h.spin) > 0;
    Vec3 target = h.base_target, arm;
    // No branches on k, on which the work-items of a warp would part; and short, since a single warp waits for each
    // instruction that is not near.
    h.end = for_each_link(begin, [&](std::uint32_t j, const ColumnLink& link) {
      const bool is_own = j == k, counts = j >= k;
      target += cross(h.spin, link.arm) + link.rise;
      h.weight += link.weight;
      h.target = is_own ? target : h.target;
      arm = is_own ? -arm_above : arm + link.arm;
      const Vec3 p = (counts ? link.mass : 0.0f) * (target - link.linear);
      const Vec3 q = link.inertia * h.spin - link.spin_momentum;
      h.gain.linear += p;
      h.gain.angular += cross(arm, p) + (counts ? q : Vec3{});
    });
    if (turns_anisotropic)
      for_each_link(k, [&](std::uint32_t j, const ColumnLink& link) {
        if (!(link.inertia > 0)) h.gain.angular += c_.inertia(j + 1, 0) * h.spin;
      });
    return h;
  }

  /// How a piece moves that stands on nothing fixed; returns whether some of its bodies are not isotropic.
  FATHOM_HD bool keep_momentum(const SolverBody& base, ColumnHold& h) const {
    ColumnMomentum m;
    Vec3 target, d;
    bool isotropic = true;
    const Mat3 inertia = c_.inertia(h.begin, base.inverse_inertia);
    m.add(inertia, 1.0f / base.inverse_mass, base.linear, inertia * base.angular, {}, {});
    for_each_link(h.begin, [&](std::uint32_t j, const ColumnLink& link) {
      target += link.rise;
      d += link.arm;
      isotropic &= link.inertia > 0;
      m.add(inertia_of(j, link), link.mass, link.linear, link.spin_momentum, target, d);
    });
    h.spin = m.spin();
    h.base_target = m.velocity(h.spin, {});
    return !isotropic;
  }

  FATHOM_HD Mat3 inertia_of(std::uint32_t j, const ColumnLink& link) const {
    const float i = link.inertia;
    return i > 0 ? Mat3{{i, 0, 0}, {0, i, 0}, {0, 0, i}} : c_.inertia(j + 1, 0);
  }

  /// Calls act(j, link) for the contacts that hold from `begin` on; returns the one that does not. A link is asked for
  /// one before it is needed, so that its loads are under way, and into the place of the last but one, so that it need
  /// not be moved.
  template <class Act>
  FATHOM_HD std::uint32_t for_each_link(std::uint32_t begin, const Act& act) const {
    if (begin >= contacts_) return begin;
    const std::uint32_t last = contacts_ - 1;
    ColumnLink even = c_.link(begin), odd;
    for (std::uint32_t j = begin;; j += 2) {
      odd = c_.link(j < last ? j + 1 : last);
      if (!even.holds()) return j;
      act(j, even);
      if (j == last) return contacts_;
      even = c_.link(j + 1 < last ? j + 2 : last);
      if (!odd.holds()) return j + 1;
      act(j + 1, odd);
      if (j + 1 == last) return contacts_;
    }
  }

  const Links& c_;
  const std::uint32_t contacts_;
};

}  // namespace fathom
