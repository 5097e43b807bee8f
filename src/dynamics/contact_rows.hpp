// The rows of one contact constraint and the sweeps over them, one contact at a time. Pure, for host and device.
//
// A manifold's points share one normal, so their rows are written about one reference point c, the centroid of
// the points that touch or nearly do, in the frame (t1, t2, n): with u the relative velocity of the bodies at c and ω
// the relative angular velocity, a point at (x, y) in that frame approaches with
//     vn = u·n + y (ω·t1) − x (ω·t2),
// two floats a point instead of two anchors. Point impulses act on the three numbers (u·n, ω·t1, ω·t2) through
// a symmetric 3×3 matrix K, and only their sum (P along n, torques T1, T2) is applied to the bodies. The native
// simulator has the same in vector lanes (native/solver_kernels.cpp).
#pragma once

#include "dynamics/contact_manifold.hpp"
#include "dynamics/restitution.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"

namespace fathom {

/// Mean distance of a patch's area from its centre over that of its corners, which are the contact's points: pressure
/// is spread over the patch. For a square (√2 + ln(1 + √2)) / (3 √2) = 0.541, for a rectangle of 2 to 1 0.53, for a
/// line 0.5. A little more, because towers of narrow blocks turn on each other below 0.55 (docs/validation.md, Kapla).
inline constexpr float patch_share = 0.56f;

/// Points farther apart than the nearest one by more than this (m) are only expected to touch: friction does not act
/// there.
inline constexpr float friction_reach = 0.02f;

/// What all points of a contact share: six quads, of which a sweep without friction reads the first five.
struct alignas(16) ContactFrame {
  Vec3 normal;                         ///< unit, world axes, from A to B
  Vec3 tangent;                        ///< unit, perpendicular to the normal
  Vec3 arm_a;                          ///< from A's centre to c (m)
  Vec3 arm_b;                          ///< from B's centre to c (m)
  float nn, n1, n2, k11, k12, k22;     ///< K over (n, t1, t2)
  float friction;                      ///< Coulomb coefficient
  float patch_radius;                  ///< mean distance of the patch from c (m)
  float slide_11, slide_12, slide_22;  ///< inverse of the 2×2 matrix of sliding at c (kg)
  float twist_mass;                    ///< kg·m²
};
static_assert(sizeof(ContactFrame) == 96);

/// One point of a contact.
struct alignas(16) PointRow {
  float x = 0, y = 0;    ///< along t1 and t2, from c (m)
  float separation = 0;  ///< m, when the step began
  float mass = 0;        ///< effective mass (kg)
};

/// Accumulated impulses of a contact over the substep.
struct alignas(16) ContactImpulses {
  float normal[max_manifold_points] = {};  ///< N·s, one a point
  float slide_1 = 0, slide_2 = 0;          ///< N·s along t1 and t2 = n × t1
  float twist = 0;                         ///< N·m·s about the normal
  float step = 0;                          ///< N·s along the normal, of all points over the step

  /// None but the step's sum so far.
  FATHOM_HD ContactImpulses cleared() const {
    ContactImpulses none;
    none.step = step;
    return none;
  }
  FATHOM_HD float sum() const { return ((normal[0] + normal[1]) + normal[2]) + normal[3]; }
};

/// What bouncing needs beside.
struct alignas(8) BounceRow {
  float restitution = 0;
  float pull = 0;  ///< the bodies' relative acceleration along the normal (m/s²)
};

/// One of the two bodies while a contact is solved. `Inertia` is the inverse inertia in world axes: a float for
/// multiples of the identity, or SymMat3.
template <class Inertia>
struct ContactBody {
  Vec3 linear, angular;
  float inverse_mass;
  Inertia inverse_inertia;
};

/// (n·u, t1·ω, t2·ω) of velocities or of movements.
struct NormalMotion {
  float n, t1, t2;

  FATHOM_HD float at(float x, float y) const { return fma(-x, t2, fma(y, t1, n)); }
};

/// What a contact's sweeps take from its frame, in registers.
struct ContactAxes {
  Vec3 n, t1, t2, lever_a, lever_b;

  ContactAxes() = default;
  FATHOM_HD explicit ContactAxes(const ContactFrame& f)
      : n(f.normal),
        t1(f.tangent),
        t2(cross(f.normal, f.tangent)),
        lever_a(cross(f.arm_a, f.normal)),
        lever_b(cross(f.arm_b, f.normal)) {}

  FATHOM_HD NormalMotion motion(Vec3 linear_a, Vec3 angular_a, Vec3 linear_b, Vec3 angular_b) const {
    const Vec3 spin = angular_b - angular_a;
    return {dot(n, linear_b - linear_a) + (dot(lever_b, angular_b) - dot(lever_a, angular_a)), dot(t1, spin),
            dot(t2, spin)};
  }
};

/// Impulse and angular impulses (N·m·s) about each centre: plus on B, minus on A.
template <class Inertia>
FATHOM_HD void push(ContactBody<Inertia>& a, ContactBody<Inertia>& b, Vec3 impulse, Vec3 angular_a, Vec3 angular_b) {
  b.linear = mul_add(b.linear, b.inverse_mass, impulse);
  b.angular += b.inverse_inertia * angular_b;
  a.linear = mul_add(a.linear, -a.inverse_mass, impulse);
  a.angular -= a.inverse_inertia * angular_a;
}

template <class Inertia>
FATHOM_HD void push_normal(ContactBody<Inertia>& a, ContactBody<Inertia>& b, const ContactAxes& f,
                           const NormalMotion& sum) {
  const Vec3 torque = mul_add(sum.t1 * f.t1, sum.t2, f.t2);
  push(a, b, sum.n * f.n, mul_add(torque, sum.n, f.lever_a), mul_add(torque, sum.n, f.lever_b));
}

template <class Inertia>
FATHOM_HD void push_tangential(ContactBody<Inertia>& a, ContactBody<Inertia>& b, const ContactAxes& f,
                               const ContactFrame& frame, float impulse_1, float impulse_2, float twist) {
  const Vec3 impulse = mul_add(impulse_1 * f.t1, impulse_2, f.t2);
  const Vec3 torque = twist * f.n;
  push(a, b, impulse, torque + cross(frame.arm_a, impulse), torque + cross(frame.arm_b, impulse));
}

/// Frame, points and impulses to start from, of a manifold between bodies at `pose_a` and `pose_b`, of which `overlap`
/// (m) counts as touching; `round` where one of them is (dynamics/rolling.hpp). Returns how far the nearest points are
/// apart (m).
template <class Inertia>
FATHOM_HD float prepare_contact(const ContactManifold& m, const Pose& pose_a, const Pose& pose_b, float overlap,
                                bool round, const ContactBody<Inertia>& a, const ContactBody<Inertia>& b,
                                ContactFrame& f, PointRow points[max_manifold_points], ContactImpulses& impulses) {
  const Mat3 rot_a = to_matrix(pose_a.rotation), rot_b = to_matrix(pose_b.rotation);
  const Vec3 between = pose_b.position - pose_a.position;
  f.normal = rot_a * m.normal;
  f.tangent = rot_a * m.tangent;
  const Vec3 n = f.normal, t1 = f.tangent, t2 = cross(n, t1);
  const int count = m.point_count();
  Vec3 middle[max_manifold_points];
  Vec3 sum;
  float nearest = 1e30f;
  for (int i = 0; i < max_manifold_points; ++i) {
    impulses.normal[i] = 0;
    if (i >= count) continue;
    const Vec3 on_a = rot_a * m.points[i].anchor_a;
    const Vec3 on_b = between + rot_b * m.points[i].anchor_b;
    points[i].separation = dot(on_b - on_a, n) + overlap;
    impulses.normal[i] = m.impulses[i];
    middle[i] = 0.5f * (on_a + on_b);
    nearest = min(nearest, points[i].separation);
  }
  float near_count = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= count || !(points[i].separation <= nearest + friction_reach)) continue;
    sum += middle[i];
    near_count += 1.0f;
  }
  const float share = 1.0f / max(near_count, 1.0f);
  f.arm_a = share * sum;
  f.arm_b = f.arm_a - between;
  const Vec3 lever_a = cross(f.arm_a, n), lever_b = cross(f.arm_b, n);
  const float mass_sum = a.inverse_mass + b.inverse_mass;

  // K over (n, t1, t2).
  const Vec3 la = a.inverse_inertia * lever_a, lb = b.inverse_inertia * lever_b;
  const Vec3 turn_1 = (a.inverse_inertia * t1) + (b.inverse_inertia * t1);
  const Vec3 turn_2 = (a.inverse_inertia * t2) + (b.inverse_inertia * t2);
  const Vec3 lever_turn = la + lb;
  f.nn = mass_sum + (dot(lever_a, la) + dot(lever_b, lb));
  f.n1 = dot(t1, lever_turn);
  f.n2 = dot(t2, lever_turn);
  f.k11 = dot(t1, turn_1);
  f.k12 = dot(t2, turn_1);
  f.k22 = dot(t2, turn_2);

  float radius_sum = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= count) continue;
    const Vec3 from_c = middle[i] - f.arm_a;
    const float x = dot(from_c, t1), y = dot(from_c, t2);
    const float h_n = fma(-x, f.n2, fma(y, f.n1, f.nn));
    const float h_1 = fma(-x, f.k12, fma(y, f.k11, f.n1));
    const float h_2 = fma(-x, f.k22, fma(y, f.k12, f.n2));
    const float k = fma(-x, h_2, fma(y, h_1, h_n));
    points[i].x = x;
    points[i].y = y;
    points[i].mass = k > 0 ? 1.0f / k : 0.0f;
    if (points[i].separation <= nearest + friction_reach) radius_sum += fathom::sqrt(fma(x, x, y * y));
  }

  // Sliding: 2×2 over (t1, t2) at c. Twist: about n.
  const Vec3 a1 = cross(f.arm_a, t1), a2 = cross(f.arm_a, t2), b1 = cross(f.arm_b, t1), b2 = cross(f.arm_b, t2);
  const Vec3 ia1 = a.inverse_inertia * a1, ib1 = b.inverse_inertia * b1;
  const float s11 = mass_sum + (dot(a1, ia1) + dot(b1, ib1));
  const float s12 = dot(a2, ia1) + dot(b2, ib1);
  const float s22 = mass_sum + (dot(a2, a.inverse_inertia * a2) + dot(b2, b.inverse_inertia * b2));
  const float det = fma(-s12, s12, s11 * s22);
  const float inverse_det = det > 0 ? 1.0f / det : 0.0f;
  f.slide_11 = s22 * inverse_det;
  f.slide_12 = -(s12 * inverse_det);
  f.slide_22 = s11 * inverse_det;
  const float twist_k = dot(n, (a.inverse_inertia * n) + (b.inverse_inertia * n));
  f.twist_mass = twist_k > 0 ? 1.0f / twist_k : 0.0f;
  f.patch_radius = patch_share * (radius_sum * share) + (round ? m.round_lever() : 0.0f);
  f.friction = m.friction;
  impulses.slide_1 = m.friction_impulse[0];
  impulses.slide_2 = m.friction_impulse[1];
  impulses.twist = m.twist_impulse;
  impulses.step = 0;
  return nearest - overlap;
}

/// Impulses of the last step act again at once (Catto, "Iterative Dynamics with Temporal Coherence", 2005).
template <class Inertia>
FATHOM_HD void warm_start_contact(const ContactFrame& frame, const ContactAxes& f, const PointRow* points, int count,
                                  const ContactImpulses& impulses, ContactBody<Inertia>& a, ContactBody<Inertia>& b) {
  NormalMotion sum{0, 0, 0};
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= count) continue;
    const float impulse = impulses.normal[i];
    sum.n += impulse;
    sum.t1 = fma(points[i].y, impulse, sum.t1);
    sum.t2 = fma(-points[i].x, impulse, sum.t2);
  }
  push_normal(a, b, f, sum);
  push_tangential(a, b, f, frame, impulses.slide_1, impulses.slide_2, impulses.twist);
}

/// Accumulates the points' impulses of one sweep and carries their effect on the relative motion.
struct NormalRows {
  NormalMotion motion, sum{0, 0, 0};

  FATHOM_HD void add(const ContactFrame& f, float impulse, float x, float y) {
    const float torque_1 = y * impulse, torque_2 = -(x * impulse);
    sum.n += impulse;
    sum.t1 += torque_1;
    sum.t2 += torque_2;
    motion.n = fma(f.n2, torque_2, fma(f.n1, torque_1, fma(f.nn, impulse, motion.n)));
    motion.t1 = fma(f.k12, torque_2, fma(f.k11, torque_1, fma(f.n1, impulse, motion.t1)));
    motion.t2 = fma(f.k22, torque_2, fma(f.k12, torque_1, fma(f.n2, impulse, motion.t2)));
  }
};

/// Where a contact's arm (m) is to second order once its body has turned by the rotation vector `turned`. What rests on
/// something that turns as it is told has to go round with it within the step: on a tangent it would get half of
/// (ω Δt)² of its radius farther out in every step.
FATHOM_HD Vec3 carried_arm(Vec3 arm, Vec3 turned) {
  const Vec3 along = cross(turned, arm);
  return arm + mul_add(along, 0.5f, cross(turned, along));
}

/// Twist about the normal, then sliding, both limited by µ times the points' impulses (Coulomb's cone). `arm_a` (m) is
/// the frame's, or where a body that contacts cannot push carries it (`friction_lead`).
template <class Inertia>
FATHOM_HD void solve_friction(const ContactFrame& frame, const ContactAxes& f, Vec3 arm_a, ContactImpulses& impulses,
                              ContactBody<Inertia>& a, ContactBody<Inertia>& b) {
  const float limit = frame.friction * impulses.sum();
  const float twist_limit = limit * frame.patch_radius;
  const float wanted_twist = fma(-frame.twist_mass, dot(f.n, b.angular - a.angular), impulses.twist);
  const float new_twist = max(-twist_limit, min(wanted_twist, twist_limit));
  // The twist's effect on sliding at c comes through the bodies' velocities, which are updated first.
  const Vec3 torque = (new_twist - impulses.twist) * f.n;
  impulses.twist = new_twist;
  b.angular += b.inverse_inertia * torque;
  a.angular -= a.inverse_inertia * torque;

  const Vec3 slide = (b.linear + cross(b.angular, frame.arm_b)) - (a.linear + cross(a.angular, arm_a));
  const float v1 = dot(f.t1, slide), v2 = dot(f.t2, slide);
  const float wanted_1 = impulses.slide_1 - fma(frame.slide_11, v1, frame.slide_12 * v2);
  const float wanted_2 = impulses.slide_2 - fma(frame.slide_12, v1, frame.slide_22 * v2);
  const float size_squared = fma(wanted_1, wanted_1, wanted_2 * wanted_2);
  const float shrink = size_squared > limit * limit ? limit / fathom::sqrt(max(size_squared, 1e-30f)) : 1.0f;
  const float new_1 = wanted_1 * shrink, new_2 = wanted_2 * shrink;
  push_tangential(a, b, f, frame, new_1 - impulses.slide_1, new_2 - impulses.slide_2, 0.0f);
  impulses.slide_1 = new_1;
  impulses.slide_2 = new_2;
}

/// Whether all is finite that a sweep leaves of a contact. Where it is not, both bodies stay as they were and the
/// contact forgets its impulses: so nothing that is not finite gets from one body to another.
template <class Inertia>
FATHOM_HD bool is_sound(const ContactBody<Inertia>& a, const ContactBody<Inertia>& b, const ContactImpulses& impulses) {
  const auto sum = [](Vec3 v) { return v.x + v.y + v.z; };
  const float bodies = (sum(a.linear) + sum(a.angular)) + (sum(b.linear) + sum(b.angular));
  return is_finite(bodies + ((impulses.sum() + impulses.twist) + (impulses.slide_1 + impulses.slide_2)));
}

/// Rounds over the points of a contact that strike together.
inline constexpr int strike_rounds = 8;

enum class ContactPass { soft, relax, iterate };

/// What the sweeps need beside rows and bodies.
struct ContactStep {
  float inverse_substep = 0;    ///< 1/s
  Softness softness;            ///< of this contact
  float push_out_velocity = 0;  ///< m/s
  bool bounces = false;         ///< its restitution is above zero
  float slop = 0;               ///< m within which points are as if they just touched (`support_slop`)
};

/// What strikes need beside rows and bodies.
struct StrikeStep {
  float substep = 0;    ///< s
  float threshold = 0;  ///< m/s
};

/// One sweep over the points: soft with bias and push-out, relax without, or `iterate` with a plain velocity bias.
/// `moved` is the movement since the step began (see ContactAxes::motion).
template <ContactPass pass, class Inertia>
FATHOM_HD void solve_points(const ContactFrame& frame, const PointRow* points, int count, const ContactStep& step,
                            const ContactAxes& f, const NormalMotion& moved, ContactImpulses& impulses,
                            ContactBody<Inertia>& a, ContactBody<Inertia>& b) {
  NormalRows rows{f.motion(a.linear, a.angular, b.linear, b.angular)};
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= count) continue;
    const PointRow& p = points[i];
    const float old = impulses.normal[i];
    float separation = p.separation + moved.at(p.x, p.y);
    separation -= clamp(separation, -step.slop, step.slop);
    const float speed = rows.motion.at(p.x, p.y);
    const bool apart = separation > 0;
    // A point still apart may close its gap within the substep and no more: a speculative contact.
    const float gap_speed = separation * step.inverse_substep;
    float bias = apart ? gap_speed : 0.0f, mass = p.mass, kept = old;
    if (!apart && pass != ContactPass::relax) bias = max(step.softness.bias_rate * separation, -step.push_out_velocity);
    if (!apart && pass == ContactPass::soft) {
      mass = p.mass * step.softness.mass_scale;
      kept = fma(-step.softness.impulse_scale, old, old);
    }
    float impulse = max(fma(-mass, speed + bias, kept), 0.0f);
    // What will bounce keeps its speed until it is there: relaxing must not brake it in the air.
    if (pass == ContactPass::relax && apart && step.bounces) impulse = min(impulse, old);
    impulses.normal[i] = impulse;
    rows.add(frame, impulse - old, p.x, p.y);
  }
  push_normal(a, b, f, rows.sum);
}

/// Points that would meet within the substep, faster than the threshold, leave with e times that speed, at once:
/// Newton's law, before velocities are integrated, one contact after the other. Says whether any did.
template <class Inertia>
FATHOM_HD bool strike_contact(const ContactFrame& frame, const ContactAxes& f, const PointRow* points, int count,
                              const BounceRow& bounce, const StrikeStep& step, const NormalMotion& moved,
                              ContactImpulses& impulses, ContactBody<Inertia>& a, ContactBody<Inertia>& b) {
  NormalRows rows{f.motion(a.linear, a.angular, b.linear, b.angular)};
  float leaving[max_manifold_points];
  ContactImpulses hit;
  float struck = 0;
  for (int i = 0; i < max_manifold_points; ++i) {
    leaving[i] = -1;
    if (i >= count) continue;
    const float separation = points[i].separation + moved.at(points[i].x, points[i].y);
    leaving[i] = leaving_speed(rows.motion.at(points[i].x, points[i].y), separation, bounce.restitution, bounce.pull,
                               step.substep, step.threshold);
    if (leaving[i] >= 0) struck += 1.0f;
  }
  if (struck == 0) return false;
  // Several points at once: begin with equal shares, so that what falls flat rises flat.
  const float share = 1.0f / (frame.nn * struck);
  for (int i = 0; i < max_manifold_points; ++i) {
    if (leaving[i] < 0) continue;
    const PointRow& p = points[i];
    hit.normal[i] = (struck > 1.0f ? share : p.mass) * (leaving[i] - rows.motion.at(p.x, p.y));
  }
  for (int i = 0; i < max_manifold_points; ++i)
    if (leaving[i] >= 0) rows.add(frame, hit.normal[i], points[i].x, points[i].y);
  for (int round = 0; struck > 1.0f && round < strike_rounds; ++round)
    for (int i = 0; i < max_manifold_points; ++i) {
      if (leaving[i] < 0) continue;
      const PointRow& p = points[i];
      const float impulse = max(fma(p.mass, leaving[i] - rows.motion.at(p.x, p.y), hit.normal[i]), 0.0f);
      rows.add(frame, impulse - hit.normal[i], p.x, p.y);
      hit.normal[i] = impulse;
    }
  push_normal(a, b, f, rows.sum);
  solve_friction(frame, f, frame.arm_a, hit, a, b);
  impulses.step += rows.sum.n;
  return true;
}

}  // namespace fathom
