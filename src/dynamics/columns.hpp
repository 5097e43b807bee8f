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
/// would only be costly. In `layers`, where a hundred columns of up to a hundred cubes fall, none is braced after the
/// first half second.
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

/// Braces a column after a sweep. `Column` gives access to its contacts, from the base upwards, contact k between
/// bodies k and k + 1, and to its bodies:
///
///     void load(k, ColumnContactState&);  void set_impulses(k, const ContactImpulses&);  ContactStep step(k);
///     SolverBody body(j);  Vec3 acceleration(j);  Mat3 inertia(j);  void set_velocity(j, linear, angular);
template <class Column>
class ColumnBrace {
 public:
  /// After the soft sweep it pushes out of penetration, after the relax sweep it does not.
  FATHOM_HD ColumnBrace(const Column& column, std::uint32_t contacts, bool pushes_out)
      : c_(column), contacts_(contacts), pushes_out_(pushes_out) {}

  FATHOM_HD void operator()() const {
    for (std::uint32_t begin = 0; begin < contacts_;) {
      const Piece piece = go_up(begin);
      if (piece.end > begin) hold(piece);
      begin = piece.end + 1;
    }
  }

 private:
  /// What a contact would have to hold if it were welded.
  struct Link {
    ColumnContactState state;
    ContactAxes axes;
    Vec3 arm_below, arm_above;
    bool touches[max_manifold_points];
    bool holds;         ///< three points or more touch that are not in a line
    float speed;        ///< by which the upper body is to rise from the lower
    Mat3 distribution;  ///< from an impulse (n, t1, t2) to multipliers of the points' rows
  };
  /// Bodies [begin, end] whose contacts hold, the velocities they are to have, and their weight (N·s a substep).
  struct Piece {
    std::uint32_t begin, end;
    Vec3 top, spin;  ///< m/s of the top body, rad/s of all
    Vec3 weight;
  };
  /// What the bodies above a contact must gain: momentum, and angular momentum about the contact.
  struct Gain {
    Vec3 linear, angular;
  };
  /// Sums over a piece that stands on nothing fixed, about its base.
  struct Momentum {
    float mass = 0;
    Vec3 first;  ///< Σ m d
    Vec3 linear, angular;
    Mat3 inertia{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  };

  FATHOM_HD Link link(std::uint32_t k, const SolverBody& below, const SolverBody& above) const {
    Link l;
    c_.load(k, l.state);
    const ColumnContactState& s = l.state;
    l.axes = ContactAxes(s.frame);
    const bool upward = s.up > 0;
    l.arm_below = upward ? s.frame.arm_a : s.frame.arm_b;
    l.arm_above = upward ? s.frame.arm_b : s.frame.arm_a;
    const SolverBody &a = upward ? below : above, &b = upward ? above : below;
    const NormalMotion moved = l.axes.motion(a.moved, a.turned, b.moved, b.turned);
    const ContactStep step = c_.step(k);
    float n = 0, x1 = 0, y1 = 0, xx = 0, yy = 0, xy = 0, wanted = 0;
    for (int i = 0; i < max_manifold_points; ++i) {
      l.touches[i] = false;
      if (i >= s.count) continue;
      const PointRow& p = s.points[i];
      const float separation = p.separation + moved.at(p.x, p.y);
      if (!(s.impulses.normal[i] > 0) && separation > column_reach) continue;
      l.touches[i] = true;
      n += 1.0f, x1 += p.x, y1 += p.y;
      xx = fma(p.x, p.x, xx), yy = fma(p.y, p.y, yy), xy = fma(p.x, p.y, xy);
      wanted = fma(-step.softness.bias_rate, min(separation, 0.0f), wanted);
    }
    const float spread = fma(-xy, xy, xx * yy);
    l.holds = above.inverse_mass > 0 && n >= 3 && spread > 1e-3f * (xx + yy) * (xx + yy);
    l.speed = 0;
    if (!l.holds) return l;
    l.distribution = inverse(Mat3{{n, y1, -x1}, {y1, yy, -xy}, {-x1, -xy, xx}});
    const float most = column_push_out * length(c_.acceleration(k + 1)) / step.inverse_substep;
    if (pushes_out_) l.speed = min(wanted / n, most / static_cast<float>(contacts_));
    return l;
  }

  FATHOM_HD static Vec3 rise(const Link& l) { return (l.state.up * l.speed) * l.axes.n; }
  FATHOM_HD static float mass(const SolverBody& b) { return 1.0f / b.inverse_mass; }
  /// dd·1 − d dᵀ
  FATHOM_HD static Mat3 lever(Vec3 d) {
    const float dd = dot(d, d);
    return {Vec3{dd, 0, 0} - d.x * d, Vec3{0, dd, 0} - d.y * d, Vec3{0, 0, dd} - d.z * d};
  }

  FATHOM_HD Piece go_up(std::uint32_t begin) const {
    SolverBody body = c_.body(begin);
    const bool stands = body.inverse_mass == 0;
    Piece piece{begin, begin, stands ? body.linear : Vec3{}, stands ? body.angular : Vec3{}, {}};
    Momentum m;
    Vec3 d;
    if (!stands) add(m, begin, body, {}, {});
    for (; piece.end < contacts_; ++piece.end) {
      const std::uint32_t above = piece.end + 1;
      const SolverBody next = c_.body(above);
      const Link l = link(piece.end, body, next);
      if (!l.holds) break;
      const Vec3 arm = l.arm_below - l.arm_above;
      d += arm;
      piece.top += cross(piece.spin, arm) + rise(l);
      piece.weight = mul_add(piece.weight, mass(next) / c_.step(piece.end).inverse_substep, c_.acceleration(above));
      if (!stands) add(m, above, next, piece.top, d);
      body = next;
    }
    if (!stands) keep_momentum(m, d, piece);
    return piece;
  }

  FATHOM_HD void add(Momentum& m, std::uint32_t j, const SolverBody& body, Vec3 target, Vec3 d) const {
    const Vec3 p = mass(body) * (body.linear - target);
    const Mat3 inertia = c_.inertia(j);
    m.mass += mass(body);
    m.first = mul_add(m.first, mass(body), d);
    m.linear += p;
    m.angular += inertia * body.angular + cross(d, p);
    m.inertia = m.inertia + inertia + mass(body) * lever(d);
  }

  /// The targets so far are relative to the base at rest.
  FATHOM_HD static void keep_momentum(const Momentum& m, Vec3 top, Piece& piece) {
    const Vec3 centre = (1.0f / m.mass) * m.first;
    piece.spin = inverse(m.inertia + -m.mass * lever(centre)) * (m.angular - cross(centre, m.linear));
    piece.top += mul_add(cross(piece.spin, top - centre), 1.0f / m.mass, m.linear);
  }

  FATHOM_HD void hold(const Piece& piece) const {
    float part = 1;
    go_down(piece, [&](std::uint32_t, const Link& l, const Gain& gain, const SolverBody&, Vec3) {
      part = part_possible(l, gain, piece.weight, part);
    });
    if (!(part > 0)) return;
    const auto turn = [&](std::uint32_t j, const SolverBody& b, Vec3 target) {
      c_.set_velocity(j, mul_add(b.linear, part, target - b.linear), mul_add(b.angular, part, piece.spin - b.angular));
    };
    const Vec3 base =
        go_down(piece, [&](std::uint32_t k, const Link& l, const Gain& gain, const SolverBody& above, Vec3 target) {
          c_.set_impulses(k, pushed(l, gain, part));
          turn(k + 1, above, target);
        });
    const SolverBody below = c_.body(piece.begin);
    if (below.inverse_mass > 0) turn(piece.begin, below, base);
  }

  /// Calls act(k, link, gain, upper body, its target) from the top; returns the base's target.
  template <class Act>
  FATHOM_HD Vec3 go_down(const Piece& piece, const Act& act) const {
    Gain gain;
    Vec3 target = piece.top, arm;
    SolverBody above = c_.body(piece.end);
    for (std::uint32_t k = piece.end; k-- > piece.begin;) {
      const SolverBody below = c_.body(k);
      const Link l = link(k, below, above);
      const Vec3 p = mass(above) * (target - above.linear);
      gain.angular += cross(arm - l.arm_above, gain.linear);
      gain.linear += p;
      gain.angular += c_.inertia(k + 1) * (piece.spin - above.angular) - cross(l.arm_above, p);
      arm = l.arm_below;
      act(k, l, gain, above, target);
      target = target - cross(piece.spin, l.arm_below - l.arm_above) - rise(l);
      above = below;
    }
    return target;
  }

  /// Normal impulse of point i: of all ways to share what the contact should give, the most even one.
  FATHOM_HD static Vec3 multipliers(const Link& l, const Gain& gain) {
    const ColumnContactState& s = l.state;
    Vec3 sum = s.up * Vec3{dot(gain.linear, l.axes.n), dot(gain.angular, l.axes.t1), dot(gain.angular, l.axes.t2)};
    for (int i = 0; i < max_manifold_points; ++i) {
      if (!l.touches[i]) continue;
      const float p = s.impulses.normal[i];
      sum += Vec3{p, s.points[i].y * p, -s.points[i].x * p};
    }
    return l.distribution * sum;
  }
  FATHOM_HD static float share(Vec3 multipliers, const PointRow& p) {
    return fma(-p.x, multipliers.z, fma(p.y, multipliers.y, multipliers.x));
  }

  /// The largest part of a change, `part` at most, that keeps |now + part·change| ≤ limit + part·limit_change.
  FATHOM_HD static float part_within(float now_1, float now_2, float change_1, float change_2, float limit,
                                     float limit_change, float part) {
    const float a = fma(change_1, change_1, change_2 * change_2) - limit_change * limit_change;
    const float b = fma(now_1, change_1, now_2 * change_2) - limit * limit_change;
    const float c = min(fma(now_1, now_1, now_2 * now_2) - limit * limit, 0.0f);
    if (fma(part, fma(part, a, 2 * b), c) <= 0) return part;
    const float root = b + fathom::sqrt(max(fma(-a, c, b * b), 0.0f));
    return root > 0 ? clamp(-c / root, 0.0f, part) : part;
  }

  FATHOM_HD static float part_possible(const Link& l, const Gain& gain, Vec3 weight, float part) {
    const ColumnContactState& s = l.state;
    const Vec3 m = multipliers(l, gain);
    for (int i = 0; i < max_manifold_points; ++i) {
      if (!l.touches[i]) continue;
      const float now = s.impulses.normal[i], change = share(m, s.points[i]) - now;
      if (fma(part, change, now) < 0) part = now / -change;
    }
    const float now = s.impulses.sum(), change = s.up * dot(gain.linear, l.axes.n);
    const float most = column_load * max(-s.up * dot(weight, l.axes.n), 0.0f);
    if (change > 0 && fma(part, change, now) > most) part = max(most - now, 0.0f) / change;
    const float mu = s.frame.friction, radius = s.frame.patch_radius;
    part = part_within(s.impulses.slide_1, s.impulses.slide_2, s.up * dot(gain.linear, l.axes.t1),
                       s.up * dot(gain.linear, l.axes.t2), mu * now, mu * change, part);
    return part_within(s.impulses.twist, 0, s.up * dot(gain.angular, l.axes.n), 0, mu * radius * now,
                       mu * radius * change, part);
  }

  FATHOM_HD ContactImpulses pushed(const Link& l, const Gain& gain, float part) const {
    const ColumnContactState& s = l.state;
    const Vec3 m = multipliers(l, gain);
    ContactImpulses p = s.impulses;
    for (int i = 0; i < max_manifold_points; ++i)
      if (l.touches[i]) p.normal[i] = max(fma(part, share(m, s.points[i]) - p.normal[i], p.normal[i]), 0.0f);
    const float scale = s.up * part;
    p.slide_1 = fma(scale, dot(gain.linear, l.axes.t1), p.slide_1);
    p.slide_2 = fma(scale, dot(gain.linear, l.axes.t2), p.slide_2);
    p.twist = fma(scale, dot(gain.angular, l.axes.n), p.twist);
    if (!pushes_out_) p.step += p.sum() - s.impulses.sum();
    return p;
  }

  const Column& c_;
  const std::uint32_t contacts_;
  const bool pushes_out_;
};

}  // namespace fathom
