// Columns: bodies that stand on each other one by one, held by one direct solution. Pure, for host and device.
//
// A sweep carries a change from one contact to the next, so a tall column needs as many as it has storeys, and its
// springs let it buckle before (docs/solver.md). While every contact of a column presses and none slips, it is as good
// as welded, and welds in a row need no matrix: going up, each body's velocity follows from the one below; going down,
// the momentum that those above must gain is what the contact has to give. Where a contact cannot give it, because it
// would pull or slip, the column goes as far towards that solution as all its contacts can.
#pragma once

#include "dynamics/contact_rows.hpp"

namespace fathom {

/// Contacts of a column worth it. Shorter ones stand by the sweeps, unless bodies of very different mass meet in them.
inline constexpr std::uint32_t least_column = 12;
/// Points no farther apart (m) touch.
inline constexpr float column_reach = 1e-4f;
/// A contact is given up to so many times the column's weight: knocks are left to the sweeps, because a body that was
/// stopped by such an impulse would start the next substep with it.
inline constexpr float column_load = 8;
/// Speed by which a whole column is pushed out of penetration, in gravity times a substep.
inline constexpr float column_push_out = 4;
/// A column whose top moves faster than this (m/s) away from its base is left to the sweeps: it comes down, and a brace
/// would only be costly (docs/solver.md).
inline constexpr float column_speed = 1;

FATHOM_HD bool is_calm(Vec3 top, Vec3 base) { return length_squared(top - base) <= column_speed * column_speed; }
FATHOM_HD bool is_worth_bracing(std::uint32_t contacts, bool uneven) { return contacts >= (uneven ? 2 : least_column); }

/// Inertia in world axes (kg·m²): of isotropic bodies from the inverse, which is zero for others, else from the
/// tensor's.
FATHOM_HD Mat3 column_inertia(float inverse, const SymMat3& inverse_tensor) {
  if (!(inverse > 0)) return fathom::inverse(to_matrix(inverse_tensor));
  const float i = 1.0f / inverse;
  return {{i, 0, 0}, {0, i, 0}, {0, 0, i}};
}

/// A column's contact as it is in a sweep. `up` is 1 where B is the upper body, else −1.
struct ColumnContactState {
  ContactFrame frame;
  PointRow points[max_manifold_points];
  int count = 0;
  ContactImpulses impulses;
  float up = 1;
};

/// A contact of a column and its upper body: all that a brace reads of them. It depends on no other contact, so all
/// can be made at the same time.
struct ColumnRung {
  Vec3 n, t1;                                            ///< unit, world axes
  float up;                                              ///< 1 where B is the upper body, else −1
  float friction, patch_radius;                          ///< m
  float x[max_manifold_points], y[max_manifold_points];  ///< m, of the points, along t1 and t2
  ContactImpulses impulses;                              ///< so far
  Mat3 distribution;                                     ///< from an impulse (n, t1, t2) to multipliers of points' rows
  std::uint32_t touches;                                 ///< a bit for each point
  bool holds;                                            ///< three points or more touch that are not in a line
  float speed;                                           ///< m/s by which the upper body is to rise from the lower
  Vec3 arm_below, arm_above;                             ///< m, from the centres to the contact
  Vec3 linear, angular, acceleration;                    ///< of the upper body
  float mass, inverse_inertia;                           ///< of the upper body, the latter as in SolverBody
  float weight_time;                                     ///< kg·s: its mass times a substep

  FATHOM_HD Vec3 rise() const { return (up * speed) * n; }
  FATHOM_HD bool touches_at(int i) const { return touches >> i & 1u; }
};

/// What contact k would have to hold if it were welded. `Column` gives access to contacts and bodies, contact k being
/// between bodies k and k + 1, from the base upwards:
///
///     void load(k, ColumnContactState&);  ContactStep step(k);  Vec3 acceleration(j);
///
/// After the soft sweep a brace pushes out of penetration, after the relax sweep it does not.
template <class Column>
FATHOM_HD ColumnRung column_rung(const Column& c, std::uint32_t k, const SolverBody& below, const SolverBody& above,
                                 std::uint32_t contacts, bool pushes_out) {
  ColumnContactState s;
  c.load(k, s);
  const ContactAxes axes(s.frame);
  const bool upward = s.up > 0;
  const SolverBody &a = upward ? below : above, &b = upward ? above : below;
  const NormalMotion moved = axes.motion(a.moved, a.turned, b.moved, b.turned);
  const ContactStep step = c.step(k);
  ColumnRung r;
  r.n = axes.n, r.t1 = axes.t1;
  r.up = s.up;
  r.friction = s.frame.friction, r.patch_radius = s.frame.patch_radius;
  r.impulses = s.impulses;
  r.arm_below = upward ? s.frame.arm_a : s.frame.arm_b;
  r.arm_above = upward ? s.frame.arm_b : s.frame.arm_a;
  r.linear = above.linear, r.angular = above.angular;
  r.acceleration = c.acceleration(k + 1);
  r.mass = 1.0f / above.inverse_mass;
  r.inverse_inertia = above.inverse_inertia;
  r.weight_time = r.mass / step.inverse_substep;
  r.touches = 0;
  float n = 0, x1 = 0, y1 = 0, xx = 0, yy = 0, xy = 0, wanted = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    r.x[i] = r.y[i] = 0;
    if (i >= s.count) continue;
    const PointRow& p = s.points[i];
    r.x[i] = p.x, r.y[i] = p.y;
    const float separation = p.separation + moved.at(p.x, p.y);
    if (!(s.impulses.normal[i] > 0) && separation > column_reach) continue;
    r.touches |= 1u << i;
    n += 1.0f, x1 += p.x, y1 += p.y;
    xx = fma(p.x, p.x, xx), yy = fma(p.y, p.y, yy), xy = fma(p.x, p.y, xy);
    wanted = fma(-step.softness.bias_rate, min(separation, 0.0f), wanted);
  }
  const float spread = fma(-xy, xy, xx * yy);
  r.holds = above.inverse_mass > 0 && n >= 3 && spread > 1e-3f * (xx + yy) * (xx + yy);
  r.speed = 0;
  r.distribution = Mat3{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  if (!r.holds) return r;
  r.distribution = inverse(Mat3{{n, y1, -x1}, {y1, yy, -xy}, {-x1, -xy, xx}});
  const float most = column_push_out * length(r.acceleration) / step.inverse_substep;
  if (pushes_out) r.speed = min(wanted / n, most / static_cast<float>(contacts));
  return r;
}

/// What the bodies above a contact must gain: momentum, and angular momentum about the contact.
struct ColumnGain {
  Vec3 linear, angular;
};

/// Sums over the bodies of a piece that stands on nothing fixed, about its base's centre.
class ColumnMomentum {
 public:
  /// A body with its centre at `d` (m), which is to move with `target` (m/s) if the base is at rest.
  FATHOM_HD void add(const Mat3& inertia, float mass, Vec3 linear, Vec3 spin_momentum, Vec3 target, Vec3 d) {
    const Vec3 p = mass * (linear - target);
    mass_ += mass;
    first_ = mul_add(first_, mass, d);
    linear_ += p;
    angular_ += spin_momentum + cross(d, p);
    inertia_ = inertia_ + inertia + mass * lever(d);
  }

  /// rad/s, of all bodies if they keep their momentum.
  FATHOM_HD Vec3 spin() const {
    const Vec3 d = centre();
    return inverse(inertia_ + -mass_ * lever(d)) * (angular_ - cross(d, linear_));
  }
  /// m/s that comes to the target of a body at `d`.
  FATHOM_HD Vec3 velocity(Vec3 spin, Vec3 d) const { return mul_add(cross(spin, d - centre()), 1.0f / mass_, linear_); }

 private:
  FATHOM_HD Vec3 centre() const { return (1.0f / mass_) * first_; }
  /// dd·1 − d dᵀ
  FATHOM_HD static Mat3 lever(Vec3 d) {
    const float dd = dot(d, d);
    return {Vec3{dd, 0, 0} - d.x * d, Vec3{0, dd, 0} - d.y * d, Vec3{0, 0, dd} - d.z * d};
  }

  float mass_ = 0;
  Vec3 first_;  ///< Σ m d
  Vec3 linear_, angular_;
  Mat3 inertia_{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
};

/// Multipliers of the points' rows: of all ways to share what the contact should give, the most even one.
FATHOM_HD Vec3 column_multipliers(const ColumnRung& r, const ColumnGain& gain) {
  const Vec3 t2 = cross(r.n, r.t1);
  Vec3 sum = r.up * Vec3{dot(gain.linear, r.n), dot(gain.angular, r.t1), dot(gain.angular, t2)};
  for (int i = 0; i < max_manifold_points; ++i) {
    if (!r.touches_at(i)) continue;
    const float p = r.impulses.normal[i];
    sum += Vec3{p, r.y[i] * p, -r.x[i] * p};
  }
  return r.distribution * sum;
}
/// Normal impulse of point i.
FATHOM_HD float column_share(Vec3 multipliers, const ColumnRung& r, int i) {
  return fma(-r.x[i], multipliers.z, fma(r.y[i], multipliers.y, multipliers.x));
}

/// What a contact would give for all of the gain.
struct ColumnGift {
  Vec3 multipliers;                     ///< of the points' rows
  float load, slide_1, slide_2, twist;  ///< N·s more, of the points together and of friction
};

FATHOM_HD ColumnGift column_gift(const ColumnRung& r, const ColumnGain& gain) {
  const Vec3 t2 = cross(r.n, r.t1);
  return {column_multipliers(r, gain), r.up * dot(gain.linear, r.n), r.up * dot(gain.linear, r.t1),
          r.up * dot(gain.linear, t2), r.up * dot(gain.angular, r.n)};
}

/// Keeps |now + part·change| ≤ limit + part·limit_change, which is part (a part + 2 b) + c ≤ 0.
struct ColumnCone {
  float a, b, c;

  ColumnCone() = default;
  FATHOM_HD ColumnCone(float now_1, float now_2, float change_1, float change_2, float limit, float limit_change)
      : a(fma(change_1, change_1, change_2 * change_2) - limit_change * limit_change),
        b(fma(now_1, change_1, now_2 * change_2) - limit * limit_change),
        c(min(fma(now_1, now_1, now_2 * now_2) - limit * limit, 0.0f)) {}

  /// The largest part of a change, `part` at most, that does.
  FATHOM_HD float part_within(float part) const {
    if (fma(part, fma(part, a, 2 * b), c) <= 0) return part;
    const float root = b + fathom::sqrt(max(fma(-a, c, b * b), 0.0f));
    return root > 0 ? clamp(-c / root, 0.0f, part) : part;
  }
};

/// What a contact can give of it without pulling or slipping.
struct ColumnLimits {
  float now[max_manifold_points], change[max_manifold_points];  ///< N·s, of the points' impulses
  float sum, sum_change, most;                                  ///< of all points, and the most that it may be
  ColumnCone slide, twist;

  /// The part of the gift, `part` at most, that is possible.
  FATHOM_HD float part_possible(float part) const {
    for (int i = 0; i < max_manifold_points; ++i)
      if (fma(part, change[i], now[i]) < 0) part = now[i] / -change[i];
    if (sum_change > 0 && fma(part, sum_change, sum) > most) part = max(most - sum, 0.0f) / sum_change;
    return twist.part_within(slide.part_within(part));
  }
};

FATHOM_HD ColumnLimits column_limits(const ColumnRung& r, const ColumnGift& gift, Vec3 weight) {
  ColumnLimits l;
  for (int i = 0; i < max_manifold_points; ++i) {
    l.now[i] = r.touches_at(i) ? r.impulses.normal[i] : 0;
    l.change[i] = r.touches_at(i) ? column_share(gift.multipliers, r, i) - l.now[i] : 0;
  }
  const float now = r.impulses.sum(), change = gift.load;
  l.sum = now, l.sum_change = change;
  l.most = column_load * max(-r.up * dot(weight, r.n), 0.0f);
  const float mu = r.friction, radius = r.patch_radius;
  l.slide = {r.impulses.slide_1, r.impulses.slide_2, gift.slide_1, gift.slide_2, mu * now, mu * change};
  l.twist = {r.impulses.twist, 0, gift.twist, 0, mu * radius * now, mu * radius * change};
  return l;
}

/// The contact's impulses with that part of the gift.
FATHOM_HD ContactImpulses column_impulses(const ColumnRung& r, const ColumnGift& gift, float part, bool pushes_out) {
  ContactImpulses p = r.impulses;
  for (int i = 0; i < max_manifold_points; ++i)
    if (r.touches_at(i))
      p.normal[i] = max(fma(part, column_share(gift.multipliers, r, i) - p.normal[i], p.normal[i]), 0.0f);
  p.slide_1 = fma(part, gift.slide_1, p.slide_1);
  p.slide_2 = fma(part, gift.slide_2, p.slide_2);
  p.twist = fma(part, gift.twist, p.twist);
  if (!pushes_out) p.step += p.sum() - r.impulses.sum();
  return p;
}

}  // namespace fathom
