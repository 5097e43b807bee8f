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
  float mass, inverse_inertia;
  bool holds;
};

FATHOM_HD ColumnLink column_link(const ColumnRung& r, const Mat3& inertia) {
  return {r.arm_below - r.arm_above,      r.rise(), r.linear,          inertia * r.angular,
          r.weight_time * r.acceleration, r.mass,   r.inverse_inertia, r.holds};
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
///     ColumnLink link(k);  SolverBody body(j);  Mat3 inertia(j, inverse_inertia);
template <class Links>
class ColumnHolds {
 public:
  FATHOM_HD ColumnHolds(const Links& links, std::uint32_t contacts) : c_(links), contacts_(contacts) {}

  FATHOM_HD ColumnHold hold(std::uint32_t k, Vec3 arm_above) const {
    for (std::uint32_t begin = 0; begin <= k;) {
      ColumnHold h = hold_from(begin, k, arm_above);
      if (h.end > k) return h;
      begin = h.end + 1;
    }
    return {};
  }

 private:
  /// Of the piece that begins with body `begin`, which may end before the contact.
  FATHOM_HD ColumnHold hold_from(std::uint32_t begin, std::uint32_t k, Vec3 arm_above) const {
    ColumnHold h{};
    h.begin = begin;
    const SolverBody base = c_.body(begin);
    h.base_target = base.linear, h.spin = base.angular;
    if (base.inverse_mass > 0) keep_momentum(base, h);
    const bool turns = length_squared(h.spin) > 0;
    Vec3 target = h.base_target, arm;
    for (h.end = begin; h.end < contacts_; ++h.end) {
      const ColumnLink link = c_.link(h.end);
      if (!link.holds) break;
      target += cross(h.spin, link.arm) + link.rise;
      h.weight += link.weight;
      if (h.end < k) continue;
      if (h.end == k) h.target = target;
      arm = h.end == k ? -arm_above : arm + link.arm;
      const Vec3 p = link.mass * (target - link.linear);
      h.gain.linear += p;
      h.gain.angular += cross(arm, p) - link.spin_momentum;
      if (turns) h.gain.angular += c_.inertia(h.end + 1, link.inverse_inertia) * h.spin;
    }
    return h;
  }

  FATHOM_HD void keep_momentum(const SolverBody& base, ColumnHold& h) const {
    ColumnMomentum m;
    Vec3 target, d;
    const Mat3 inertia = c_.inertia(h.begin, base.inverse_inertia);
    m.add(inertia, 1.0f / base.inverse_mass, base.linear, inertia * base.angular, {}, {});
    for (std::uint32_t j = h.begin; j < contacts_; ++j) {
      const ColumnLink link = c_.link(j);
      if (!link.holds) break;
      target += link.rise;
      d += link.arm;
      m.add(c_.inertia(j + 1, link.inverse_inertia), link.mass, link.linear, link.spin_momentum, target, d);
    }
    h.spin = m.spin();
    h.base_target = m.velocity(h.spin, {});
  }

  const Links& c_;
  const std::uint32_t contacts_;
};

}  // namespace fathom
