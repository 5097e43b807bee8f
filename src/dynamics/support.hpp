// Direct solution of supports: how a structure at rest passes its load to the ground. Pure, for host and device.
//
// A sweep carries a change from one contact to the next, so a heavy load or a tall structure needs many sweeps, and
// meanwhile its contacts yield. But where every contact of a structure presses and none slips, the velocities are
// known: the bodies move as one with what they stand on. Only the distribution of impulses is unknown. The contact
// graph's levels (Guendelman, Bridson, Fedkiw, "Nonconvex Rigid Bodies with Stacking", SIGGRAPH 2003) order the work: a
// body's *supports* are its contacts with bodies nearer to the ground. From the top level down, each body asks its
// supports for the momentum that brings it, and all that it carries, to the common motion. Of all ways to share that
// among the points it takes the one that is least in proportion to what they already carry. Impulses that contacts
// cannot give, because they would pull or slip, are left out, and the structure goes the fraction of the way that
// leaves it the least kinetic energy. A solution therefore never adds energy, whatever it could not hold.
#pragma once

#include "dynamics/contact_rows.hpp"
#include "dynamics/overload.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// Distance (m) up to which points that do not press may still give impulses; `arm` leads from a body's centre.
FATHOM_HD float support_reach(Vec3 arm) { return min(max_support_reach, support_reach_share * length(arm)); }

/// Symmetric 6×6 matrix over (force, torque), or its Cholesky factor: the lower triangle by rows.
struct Triangle6 {
  float m[21] = {};

  FATHOM_HD static constexpr int index(int row, int column) { return row * (row + 1) / 2 + column; }
  FATHOM_HD float& operator()(int row, int column) { return m[index(row, column)]; }
  FATHOM_HD float operator()(int row, int column) const { return m[index(row, column)]; }
};

/// Momentum (N·s) and angular momentum about some point (N·m·s), or multipliers of rows over them.
struct Wrench {
  Vec3 force, torque;

  FATHOM_HD Wrench& operator+=(const Wrench& w) {
    force += w.force, torque += w.torque;
    return *this;
  }
};
FATHOM_HD Wrench operator-(const Wrench& w) { return {-w.force, -w.torque}; }

/// m += weight · r rᵀ
FATHOM_HD void add_row(Triangle6& m, const Wrench& r, float weight) {
  const float row[6] = {r.force.x, r.force.y, r.force.z, r.torque.x, r.torque.y, r.torque.z};
  for (int i = 0; i < 6; ++i) {
    const float scaled = weight * row[i];
    for (int j = 0; j <= i; ++j) m(i, j) = fma(scaled, row[j], m(i, j));
  }
}

/// Cholesky factor of a matrix scaled to a unit diagonal (Golub, Van Loan, "Matrix Computations", 4.2), so that a
/// body's size does not matter. False where it is nearly singular: no support resists some motion of the body.
FATHOM_HD bool factorise(const Triangle6& m, Triangle6& factor) {
  constexpr float min_pivot = 1e-4f;
  float scale[6];
  for (int i = 0; i < 6; ++i) {
    if (!(m(i, i) > 0)) return false;
    scale[i] = 1.0f / fathom::sqrt(m(i, i));
  }
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      float sum = m(i, j) * scale[i] * scale[j];
      for (int k = 0; k < j; ++k) sum = fma(-factor(i, k), factor(j, k), sum);
      if (i != j) {
        factor(i, j) = sum / factor(j, j);
      } else {
        if (!(sum > min_pivot)) return false;
        factor(i, i) = fathom::sqrt(sum);
      }
    }
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) factor(i, j) /= scale[i];
  return true;
}

/// The solution y of (factor · factorᵀ) y = w.
FATHOM_HD Wrench solve(const Triangle6& factor, const Wrench& w) {
  float y[6] = {w.force.x, w.force.y, w.force.z, w.torque.x, w.torque.y, w.torque.z};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) y[i] = fma(-factor(i, j), y[j], y[i]);
    y[i] /= factor(i, i);
  }
  for (int i = 5; i >= 0; --i) {
    for (int j = i + 1; j < 6; ++j) y[i] = fma(-factor(j, i), y[j], y[i]);
    y[i] /= factor(i, i);
  }
  return {{y[0], y[1], y[2]}, {y[3], y[4], y[5]}};
}

/// A contact through which a body rests on another; constant during a step.
struct SupportRows {
  Vec3 n, t1;                         ///< unit, world axes; n points from the contact's A to its B
  Vec3 arm_upper, arm_lower;          ///< m, from the centres of the upper and the lower body to c
  float x[max_manifold_points];       ///< m, of the points along t1, from c
  float y[max_manifold_points];       ///< m, along t2
  float weight[max_manifold_points];  ///< N·s: shares are proportional to it; 0 for a point that does not press
  float slide_weight;                 ///< N·s, weight of sliding along t1 and t2
  float twist_radius;                 ///< m, `patch_radius` of the contact's frame
  float friction;
  float up;        ///< 1 where B is the upper body, else −1
  float max_load;  ///< N·s, up to which a solution may raise the sum of the points' impulses

  FATHOM_HD Vec3 t2() const { return cross(n, t1); }
  /// Point i, from c (m).
  FATHOM_HD Vec3 point(int i) const { return mul_add(x[i] * t1, y[i], t2()); }
  FATHOM_HD bool holds() const { return weight[0] + weight[1] + weight[2] + weight[3] > 0; }
};

/// Speed (m/s) at which a body moves against the common motion, at the end of `arm` (m) at most.
FATHOM_HD float support_speed(Vec3 linear, Vec3 angular, Vec3 arm) {
  return max(length(linear), length(angular) * length(arm));
}
/// Load (N·s in a substep of length h, in s) up to which a solution may press on one end `arm` (m) of a body. Arms are
/// those of the step's start. Opposite loads turn a body whose arms have changed, and with a load that alone would move
/// the body by a third of its arm within a substep they turn it by as much as they had changed. What is at rest bears
/// any load, as its arms do not change: `speed` is that of the faster body of the contact (`support_speed`), `fall`
/// what a fall gains in a substep (m/s). Sweeps may add more (`push_out_velocity`), and as the load lasts, the body's
/// inertia and so its limit grow (dynamics/overload.hpp).
FATHOM_HD float max_load(float inverse_mass, Vec3 arm, float speed, float fall, float h) {
  if (!(inverse_mass > 0)) return 1e30f;
  return max(moving_load, resting_load * fall / max(speed, 1e-9f)) * length(arm) / (h * inverse_mass);
}

/// Additional impulses of a contact: on the upper body along +n·up, N·s and N·m·s.
struct SupportChange {
  float normal[max_manifold_points];
  float slide_1, slide_2, twist;
  std::uint32_t left_out;  ///< a bit for each point that gives nothing at all
};

/// Points of a contact, m: along its tangents, and how far they are apart.
struct SupportPoints {
  float x[max_manifold_points] = {}, y[max_manifold_points] = {}, separation[max_manifold_points] = {};
  int count = 0;
};

/// A bit for each point that may take load: those that press, and those whose gap is within `support_reach` and exceeds
/// that of no other point by more than a small slope. A card that leans on one of its edges must not be held by the
/// other one: if it is 1 mm thick, that edge is 0.1 mm above the ground.
FATHOM_HD std::uint32_t touching_points(const SupportPoints& p, const ContactImpulses& impulses, Vec3 arm) {
  const float reach = support_reach(arm);
  std::uint32_t touches = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    bool is_near = p.separation[i] <= reach;
    for (int k = 0; k < max_manifold_points; ++k) {
      const float dx = p.x[i] - p.x[k], dy = p.y[i] - p.y[k], higher = max(p.separation[i] - p.separation[k], 0.0f);
      const float slope_squared = support_reach_share * support_reach_share;
      is_near &= k >= p.count || higher * higher <= slope_squared * fma(dx, dx, dy * dy);
    }
    if (i < p.count && (is_near || impulses.normal[i] > 0)) touches |= 1u << i;
  }
  return touches;
}

/// Weights of a contact's points. A body's own weight in a substep, `body_weight` (N·s), lets points that carry nothing
/// yet take load; `touches` has a bit for each point that may.
FATHOM_HD void weigh_points(SupportRows& r, const ContactImpulses& impulses, std::uint32_t touches, float body_weight) {
  const float base = fma(weight_of_contact, impulses.sum(), weight_of_body * body_weight);
  float sum = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    r.weight[i] = touches >> i & 1u ? impulses.normal[i] + base : 0.0f;
    sum += r.weight[i];
  }
  // Do not ask a slippery contact for more friction than it has.
  r.slide_weight = sum * min(2 * r.friction, 1.0f);
}

/// Adds the rows of a contact on its upper body to `m`, except the points that are left out.
FATHOM_HD void add_support(Triangle6& m, const SupportRows& r, std::uint32_t left_out) {
  for (int i = 0; i < max_manifold_points; ++i)
    if (r.weight[i] > 0 && !(left_out >> i & 1u)) add_row(m, {r.n, cross(r.arm_upper + r.point(i), r.n)}, r.weight[i]);
  const Vec3 t2 = r.t2();
  add_row(m, {r.t1, cross(r.arm_upper, r.t1)}, r.slide_weight);
  add_row(m, {t2, cross(r.arm_upper, t2)}, r.slide_weight);
  add_row(m, {Vec3{}, r.n}, r.slide_weight * r.twist_radius * r.twist_radius);
}

/// The contact's share under the multipliers `y`, plus `renewal`. Returns true where a point would have to pull.
FATHOM_HD bool share_out(const SupportRows& r, const ContactImpulses& impulses, const SupportChange& renewal,
                         const Wrench& y, SupportChange& change) {
  bool pulls = false;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (change.left_out >> i & 1u) continue;
    const Vec3 lever = cross(r.arm_upper + r.point(i), r.n);
    change.normal[i] = fma(r.up * r.weight[i], dot(r.n, y.force) + dot(lever, y.torque), renewal.normal[i]);
    pulls |= r.weight[i] > 0 && impulses.normal[i] + change.normal[i] < 0;
  }
  const float weight = r.up * r.slide_weight;
  const Vec3 t2 = r.t2();
  change.slide_1 = fma(weight, dot(r.t1, y.force) + dot(cross(r.arm_upper, r.t1), y.torque), renewal.slide_1);
  change.slide_2 = fma(weight, dot(t2, y.force) + dot(cross(r.arm_upper, t2), y.torque), renewal.slide_2);
  change.twist = fma(weight * r.twist_radius * r.twist_radius, dot(r.n, y.torque), renewal.twist);
  return pulls;
}

/// Leaves out the points that would have to pull: they give up what they carry.
FATHOM_HD void leave_out(const SupportRows& r, const ContactImpulses& impulses, SupportChange& change) {
  for (int i = 0; i < max_manifold_points; ++i) {
    if (!(r.weight[i] > 0) || impulses.normal[i] + change.normal[i] >= 0) continue;
    change.left_out |= 1u << i;
    change.normal[i] = -impulses.normal[i];
  }
}

/// Limits a change to what a contact can give: it does not pull, its load stays below `max_load` unless it was higher
/// before, and friction stays in its cone.
FATHOM_HD void limit_change(const SupportRows& r, const ContactImpulses& impulses, SupportChange& change) {
  float before = 0, load = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    change.normal[i] = max(change.normal[i], -impulses.normal[i]);
    before += impulses.normal[i];
    load += impulses.normal[i] + change.normal[i];
  }
  if (load > r.max_load && load > before) {
    const float kept = max(r.max_load - before, 0.0f) / (load - before);
    for (float& normal : change.normal) normal *= kept;
    load = max(r.max_load, before);
  }
  const float limit = r.friction * load;
  const float slide_1 = impulses.slide_1 + change.slide_1, slide_2 = impulses.slide_2 + change.slide_2;
  const float squared = fma(slide_1, slide_1, slide_2 * slide_2);
  const float shrink = squared > limit * limit ? limit / fathom::sqrt(squared) : 1.0f;
  change.slide_1 = fma(slide_1, shrink, -impulses.slide_1);
  change.slide_2 = fma(slide_2, shrink, -impulses.slide_2);
  const float twist_limit = limit * r.twist_radius;
  change.twist = clamp(impulses.twist + change.twist, -twist_limit, twist_limit) - impulses.twist;
}

/// The wrench of a change on the upper body, about c.
FATHOM_HD Wrench wrench_of(const SupportRows& r, const SupportChange& change) {
  float sum = 0, sum_x = 0, sum_y = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    sum += change.normal[i];
    sum_x = fma(r.x[i], change.normal[i], sum_x);
    sum_y = fma(r.y[i], change.normal[i], sum_y);
  }
  const Vec3 t2 = r.t2();
  const Vec3 force = mul_add(mul_add(sum * r.n, change.slide_1, r.t1), change.slide_2, t2);
  const Vec3 torque = mul_add(mul_add(change.twist * r.n, sum_y, r.t1), -sum_x, t2);
  return {r.up * force, r.up * torque};
}
/// The same about a body's centre, from which `arm` (m) leads to c.
FATHOM_HD Wrench about_centre(const Wrench& w, Vec3 arm) { return {w.force, w.torque + cross(arm, w.force)}; }

/// Adds `part` of a change to the impulses.
FATHOM_HD void apply_change(const SupportRows& r, const SupportChange& change, float part, ContactImpulses& impulses) {
  const float before = impulses.sum();
  for (int i = 0; i < max_manifold_points; ++i)
    if (r.weight[i] > 0) impulses.normal[i] = max(fma(part, change.normal[i], impulses.normal[i]), 0.0f);
  impulses.slide_1 = fma(part, change.slide_1, impulses.slide_1);
  impulses.slide_2 = fma(part, change.slide_2, impulses.slide_2);
  impulses.twist = fma(part, change.twist, impulses.twist);
  impulses.step += impulses.sum() - before;
}

/// The part of its impulses that a contact gives up for redistribution (`support_renewal`).
FATHOM_HD SupportChange given_up(const ContactImpulses& impulses) {
  SupportChange change{};
  for (int i = 0; i < max_manifold_points; ++i) change.normal[i] = -support_renewal * impulses.normal[i];
  change.slide_1 = -support_renewal * impulses.slide_1;
  change.slide_2 = -support_renewal * impulses.slide_2;
  change.twist = -support_renewal * impulses.twist;
  return change;
}

/// Distributes a body's demand among its supports. `Supports` gives access to them:
///
///     int count();  const SupportRows& rows(k);  ContactImpulses impulses(k);  SupportChange& change(k);
///
/// `factor` is that of all rows. Returns what the body gets, about its centre.
template <class Supports>
FATHOM_HD Wrench ask_supports(Supports& supports, const Triangle6& factor, const Wrench& demand) {
  const int count = supports.count();
  Wrench rest = demand;
  for (int k = 0; k < count; ++k) {
    const SupportRows& r = supports.rows(k);
    supports.change(k).left_out = 0;
    rest += -about_centre(wrench_of(r, given_up(supports.impulses(k))), r.arm_upper);
  }
  Triangle6 of_fewer;
  const Triangle6* current = &factor;
  for (int round = 0;; ++round) {
    const Wrench y = solve(*current, rest);
    bool pulls = false;
    for (int k = 0; k < count; ++k) {
      const ContactImpulses now = supports.impulses(k);
      pulls |= share_out(supports.rows(k), now, given_up(now), y, supports.change(k));
    }
    if (!pulls || round == support_rounds) break;
    rest = demand;
    Triangle6 m;
    for (int k = 0; k < count; ++k) {
      const SupportRows& r = supports.rows(k);
      const ContactImpulses now = supports.impulses(k);
      SupportChange& change = supports.change(k);
      leave_out(r, now, change);
      SupportChange gone = given_up(now);
      for (int i = 0; i < max_manifold_points; ++i)
        if (change.left_out >> i & 1u) gone.normal[i] = change.normal[i];
      rest += -about_centre(wrench_of(r, gone), r.arm_upper);
      add_support(m, r, change.left_out);
    }
    if (!factorise(m, of_fewer)) break;
    current = &of_fewer;
  }
  Wrench got;
  for (int k = 0; k < count; ++k) {
    const SupportRows& r = supports.rows(k);
    limit_change(r, supports.impulses(k), supports.change(k));
    got += about_centre(wrench_of(r, supports.change(k)), r.arm_upper);
  }
  return got;
}

/// The fraction of a change, 0 to 1, that leaves the least kinetic energy: `slope` is Σ u·ΔP over all bodies, where u
/// are their velocities relative to the common motion and ΔP their changes of momentum; `curvature` is Σ Δu·ΔP.
FATHOM_HD float best_part(float slope, float curvature) {
  return curvature > 0 ? clamp(-slope / curvature, 0.0f, 1.0f) : 0.0f;
}

/// Twice the kinetic energy (J) that a part of a change leaves of `energy`.
FATHOM_HD float energy_left(float part, float slope, float curvature, float energy) {
  return fma(part, fma(part, curvature, 2 * slope), energy);
}

/// Whether a part of a change is worth making. One that leaves most of the energy holds nothing, but shares loads out
/// again, along the shortest ways down: it takes the thrust from an arch, which sweeps find.
FATHOM_HD bool is_worth_making(float part, float slope, float curvature, float energy) {
  return part > 0 && energy_left(part, slope, curvature, energy) <= (1 - min_support_effect) * energy;
}

/// The largest part of a change, 0 to 1, that keeps a body of `mass` (kg) calm, or as calm as it was. The least energy
/// of a whole structure is not enough: what one contact of a heavy body cannot hold is little to that body, and throws
/// a light one. `energy` is twice the body's kinetic energy relative to the common motion (J); `slope` and `curvature`
/// are the body's own terms of `best_part`.
FATHOM_HD float calm_part(float energy, float slope, float curvature, float mass) {
  const float room = max(2 * calm_body_energy * mass - energy, 0.0f);
  if (!(fma(2.0f, slope, curvature) > room)) return 1;
  // The positive root of curvature p² + 2 slope p = room, without cancellation.
  const float root = fathom::sqrt(fma(slope, slope, curvature * room));
  const float part = slope > 0 ? room / (slope + root) : (root - slope) / curvature;
  return min(part, 1.0f);
}

/// How far a solution that leaves bodies of `mass` (kg) twice the kinetic energy `energy` (J) holds them, 0 to 1: not
/// at all where they still move at `unheld_share` of the speed `fall` (m/s) that a fall gains in a substep. Springs
/// that yield must damp what a solution does not hold.
FATHOM_HD float part_held(float energy, float mass, float fall) {
  const float unheld = unheld_share * fall;
  return 1 - min(fathom::sqrt(max(energy, 0.0f) / (mass * unheld * unheld)), 1.0f);
}

}  // namespace fathom
