// The rows of one contact, for the device, cells and single contacts. Pure, for host and device. The law is in
// dynamics/contact-inl.hpp.
#pragma once

#include <type_traits>

#include "dynamics/contact_manifold.hpp"
#include "dynamics/friction_by_direction.hpp"
#include "dynamics/inverse_inertia.hpp"
#include "dynamics/lane_scalar.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"

namespace fathom {

#define FATHOM_LANE_FUNCTION FATHOM_HD
#define FATHOM_LANE_LAMBDA
#include "dynamics/contact-inl.hpp"
#include "dynamics/contact_prepare-inl.hpp"
#include "dynamics/rolling-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

using ContactFrame = ContactFrameOf<float>;
using ContactAxes = ContactAxesOf<float>;
using ContactStep = ContactStepOf<float>;
using NormalMotion = NormalMotionOf<float>;
using PointRow = ContactPoint<float>;

/// Accumulated impulses of a contact over the substep.
struct alignas(16) ContactImpulses {
  float normal[max_manifold_points] = {};  ///< N·s, one per point
  float slide_1 = 0, slide_2 = 0;          ///< N·s along t1 and t2 = n × t1
  float twist = 0;                         ///< N·m·s about the normal
  float step = 0;                          ///< N·s along the normal, of all points over the step

  /// Zero impulses, except the step's sum so far.
  FATHOM_HD ContactImpulses cleared() const {
    ContactImpulses none;
    none.step = step;
    return none;
  }
  FATHOM_HD float sum() const { return ((normal[0] + normal[1]) + normal[2]) + normal[3]; }
};

/// Additional data of bouncing contacts.
struct alignas(8) BounceRow {
  float restitution = 0;
  float pull = 0;  ///< the bodies' relative acceleration along the normal (m/s²)
};

/// All rows of one contact, with the interface that the law expects. Loops over points have a constant length:
/// compilers unroll them and keep the rows in registers.
struct ContactRows {
  ContactFrame frame;
  PointRow points[max_manifold_points] = {};
  ContactImpulses impulses;
  BounceRow bounce;
  int count = 0;

  FATHOM_HD static constexpr int end() { return max_manifold_points; }
  FATHOM_HD bool has(int i) const { return i < count; }
  FATHOM_HD ContactAxes axes() const { return ContactAxes(frame); }
  FATHOM_HD const ContactResponse<float>& response() const { return frame.response; }
  FATHOM_HD const ContactFriction<float>& friction() const { return frame.friction; }
  FATHOM_HD const PointRow& point(int i) const { return points[i]; }
  FATHOM_HD float impulse(int i) const { return impulses.normal[i]; }
  FATHOM_HD FrictionImpulse<float> friction_impulse() const {
    return {impulses.slide_1, impulses.slide_2, impulses.twist};
  }
  FATHOM_HD bool may_bounce() const { return bounce.restitution > 0; }
  FATHOM_HD float restitution() const { return bounce.restitution; }
  FATHOM_HD float pull() const { return bounce.pull; }

  FATHOM_HD void set_impulse(int i, float impulse) { impulses.normal[i] = impulse; }
  FATHOM_HD void set_friction_impulse(const FrictionImpulse<float>& f) {
    impulses.slide_1 = f.slide_1, impulses.slide_2 = f.slide_2, impulses.twist = f.twist;
  }
  FATHOM_HD void set_frame(const ContactAxes& axes) {
    frame.normal = axes.n, frame.tangent = axes.t1, frame.arm_a = axes.arm_a, frame.arm_b = axes.arm_b;
  }
  FATHOM_HD void set_response(const ContactResponse<float>& k) { frame.response = k; }
  FATHOM_HD void set_friction(const ContactFriction<float>& f) { frame.friction = f; }
  FATHOM_HD void set_point(int i, const PointRow& p) { points[i] = p; }
};

/// One of the two bodies while a contact is solved. `Inertia` is the inverse inertia in world axes, as
/// `fathom::inverse_inertia` takes it.
template <class Inertia>
struct ContactBody {
  Vec3 linear, angular;
  float inverse_mass;
  Inertia inverse_inertia;
  Vec3 moved = {}, turned = {};  ///< since the step began (m, rad)
};

template <class Inertia>
struct ContactBodies {
  static constexpr bool only_pushes_b = false;
  ContactBody<Inertia> a, b;

  FATHOM_HD auto inverse_of_a() const { return fathom::inverse_inertia(a.inverse_mass, a.inverse_inertia); }
  FATHOM_HD auto inverse_of_b() const { return fathom::inverse_inertia(b.inverse_mass, b.inverse_inertia); }
};

/// What is known of a manifold's contact beside the manifold.
struct ContactOccasion {
  float overlap = 0;    ///< m of the depth that counts as touching
  bool round = false;   ///< one of the bodies is round (dynamics/rolling.hpp)
  float half_step = 0;  ///< s, see RoundContact
  float substeps = 1;   ///< in a step
};

/// A manifold between bodies at two poses.
template <class Inertia>
struct PosedManifold {
  const ContactManifold& m;
  const ContactOccasion& occasion;
  const ContactBodies<Inertia>& bodies;
  Mat3 rot_a, rot_b;
  Vec3 apart;  ///< m, from A's centre to B's

  FATHOM_HD PosedManifold(const ContactManifold& manifold, const Pose& pose_a, const Pose& pose_b,
                          const ContactOccasion& of, const ContactBodies<Inertia>& both)
      : m(manifold),
        occasion(of),
        bodies(both),
        rot_a(to_matrix(pose_a.rotation)),
        rot_b(to_matrix(pose_b.rotation)),
        apart(pose_b.position - pose_a.position) {}

  FATHOM_HD static constexpr int end() { return max_manifold_points; }
  FATHOM_HD bool has(int i) const { return i < m.point_count(); }
  FATHOM_HD static constexpr bool used(int) { return true; }
  FATHOM_HD Vec3 normal() const { return rot_a * m.normal; }
  FATHOM_HD Vec3 tangent() const { return rot_a * m.tangent; }
  FATHOM_HD Vec3 between() const { return apart; }
  FATHOM_HD Vec3 on_a(int i) const { return rot_a * m.points[i].anchor_a; }
  FATHOM_HD Vec3 on_b(int i) const { return apart + rot_b * m.points[i].anchor_b; }
  FATHOM_HD float impulse(int i) const { return m.impulses[i]; }
  FATHOM_HD float friction() const { return m.friction; }
  FATHOM_HD FrictionImpulse<float> friction_impulse() const {
    return {m.friction_impulse[0], m.friction_impulse[1], m.twist_impulse};
  }
  FATHOM_HD void move_arms(Vec3 normal, float load, float gap, const ContactBodies<Inertia>&, Vec3& arm_a,
                           Vec3& arm_b) const {
    if (occasion.round)
      move_arms_midway<float>({occasion.half_step, occasion.substeps, m.curvature(), m.share_a()}, load, gap, bodies,
                              bodies, normal, arm_a, arm_b);
  }
};

/// Sets the rows of a manifold between bodies at `pose_a` and `pose_b`. Returns the nearest points' separation (m).
template <class Inertia>
FATHOM_HD float prepare_contact(const ContactManifold& m, const Pose& pose_a, const Pose& pose_b,
                                const ContactOccasion& occasion, const ContactBodies<Inertia>& bodies,
                                ContactRows& rows) {
  rows.count = m.point_count();
  rows.impulses = {};
  const float nearest =
      prepare_contact_rows(PosedManifold(m, pose_a, pose_b, occasion, bodies), occasion.overlap, bodies, rows);
  if (occasion.round) rows.frame.friction.patch_radius += m.spin_lever();
  return nearest - occasion.overlap;
}

/// Sets the effective masses in the rows to those between `bodies`, whose masses have changed.
template <class Inertia>
FATHOM_HD void weigh(const ContactBodies<Inertia>& bodies, ContactRows& rows) {
  const ContactAxes axes = rows.axes();
  rows.frame.response = contact_response(axes, bodies);
  for (int i = 0; i < max_manifold_points; ++i)
    if (rows.has(i)) rows.points[i].mass = mass_at(rows.frame.response, rows.points[i].x, rows.points[i].y);
  set_friction_masses(axes, bodies, rows.friction_impulse(), rows.impulses.sum(), rows.frame.friction);
}

/// Parameters of a sweep with this softness.
FATHOM_HD ContactStep contact_step(float inverse_substep, const Softness& softness, float push_out_velocity) {
  return {inverse_substep, softness.bias_rate, softness.mass_scale, softness.impulse_scale, push_out_velocity, 0};
}

/// What a contact's springs depend on besides the masses in its rows.
struct ContactHold {
  float held = 0;        ///< part of it that a direct solution holds (`stiffen`)
  float push_share = 1;  ///< `push_out_share`
  float jointed = 0;     ///< `jointed_part`
  bool pushes_fixed = false;

  FATHOM_HD bool is_special() const { return held > 0 || push_share < 1 || jointed > 0; }
};

/// To what part (0 to 1) a contact with jointed bodies counts as one that moves more than it knows: by its load, as the
/// change of velocity (m/s) that its `impulse` (N·s) of the last step would give to its own bodies over what a `fall`
/// gains in a step (m/s). In steps of a `jointed_steps`th, which is how the device stores it. 0 without gravity: then a
/// load has no measure.
inline constexpr int jointed_steps = 3;
FATHOM_HD float jointed_part(float impulse, float inverse_mass_sum, float fall) {
  if (!(fall > 0)) return 0;
  const float load = impulse * inverse_mass_sum / fall;
  const float part = clamp((load - jointed_load) / jointed_load, 0.0f, 1.0f);
  return static_cast<float>(static_cast<int>(fma(part, static_cast<float>(jointed_steps), 0.5f))) *
         (1.0f / jointed_steps);
}

/// Parameters of a soft sweep over a contact. The inverse masses (1/kg) are those in its rows, 0 for A if
/// `pushes_fixed`.
///
/// Its rows do not know what moves with jointed bodies through their joints: a plate that is welded to a wall carries
/// as if it had infinite mass. If a contact moves R times the mass that it knows, the gap x follows D³x + a D²x + k (1
/// + s) Dx + k s b x = 0 as with joints (`rigid_joint_rate`), with k = 1/R. That is stable for all R where a (1 + s) >
/// s b. Springs against fixed bodies are too stiff for it from R = 25 on, and those that give back half as much from R
/// = 8.
FATHOM_HD ContactStep soft_step(float inverse_substep, const ContactSoftness& contacts, float push_out_velocity,
                                const ContactHold& hold, float inverse_mass_a, float inverse_mass_b) {
  const float push_out = hold.push_share * push_out_velocity;
  ContactStep step = contact_step(inverse_substep, hold.pushes_fixed ? contacts.fixed : contacts.dynamic, push_out);
  stiffen_uneven(inverse_mass_a, inverse_mass_b, step);
  if (hold.jointed > 0) {
    const Softness& soft = contacts.dynamic;
    step.bias_rate = fma(hold.jointed, soft.bias_rate - step.bias_rate, step.bias_rate);
    step.mass_scale = fma(hold.jointed, soft.mass_scale - step.mass_scale, step.mass_scale);
    step.impulse_scale = fma(hold.jointed, soft.impulse_scale - step.impulse_scale, step.impulse_scale);
  }
  if (hold.held > 0) stiffen(hold.held, step);
  return step;
}

/// Data of a contact that few have: its surfaces move, or their friction depends on direction. Stored apart from the
/// other rows.
struct ContactSurface {
  Vec3 slide;                      ///< added to B's sliding velocity against A (m/s, world axes)
  float grain_1 = 0, grain_2 = 0;  ///< along t1 and t2 (dynamics/friction_by_direction.hpp)

  FATHOM_HD void set_grain(const FrictionEllipse& ellipse, const ContactAxes& axes) {
    grain_1 = dot(ellipse.grain, axes.t1), grain_2 = dot(ellipse.grain, axes.t2);
  }
};

/// How a contact's surface changes its friction, if it has such data.
struct SurfaceEffect {
  const ContactSurface* surface = nullptr;

  FATHOM_HD Vec3 operator()(Vec3 slide) const { return surface ? slide + surface->slide : slide; }
  FATHOM_HD bool limits_by_direction() const { return surface && (surface->grain_1 != 0 || surface->grain_2 != 0); }
  FATHOM_HD FrictionImpulse<float> limited(float most, const FrictionImpulse<float>& wanted,
                                           const FrictionImpulse<float>&) const {
    return limited_to_ellipse(surface->grain_1, surface->grain_2, most, wanted);
  }
};

/// The same, with `carried_slide` where A is kinematic.
template <class Inertia>
struct CarriedBySides : SurfaceEffect {
  const ContactBodies<Inertia>& bodies;
  const ContactAxes& axes;
  bool moves_as_told;
  float lead;

  FATHOM_HD CarriedBySides(SurfaceEffect effect, const ContactBodies<Inertia>& both, const ContactAxes& of_contact,
                           bool as_told, float time)
      : SurfaceEffect(effect), bodies(both), axes(of_contact), moves_as_told(as_told), lead(time) {}
  FATHOM_HD Vec3 operator()(Vec3 slide) const {
    return SurfaceEffect::operator()(moves_as_told ? slide + carried_slide<float>(bodies, axes, lead) : slide);
  }
};

/// One sweep over a contact's points and friction, in the order of the pass; `held`: see `solve_points`.
template <ContactPass pass, bool held, class Inertia>
FATHOM_HD_INLINED void sweep_contact(ContactRows& rows, const ContactAxes& axes, ContactBodies<Inertia>& bodies,
                                     const ContactStep& step, const CarriedBySides<Inertia>& carried) {
  if constexpr (pass == ContactPass::iterate) sweep_friction(rows, axes, bodies, carried);
  solve_points<pass, held>(rows, axes, bodies, step);
  // In the relax pass friction comes last: the impulses then carry the load alone, without the spring's part.
  if constexpr (pass == ContactPass::relax) sweep_friction(rows, axes, bodies, carried);
}

/// Whether all results of a sweep over a contact are finite. If not, both bodies keep their velocities and the contact
/// forgets its impulses, so that NaN and infinity do not spread from one body to another.
template <class Inertia>
FATHOM_HD bool is_sound(const ContactBodies<Inertia>& bodies, const ContactImpulses& impulses) {
  const auto sum = [](Vec3 v) { return v.x + v.y + v.z; };
  const float all = (sum(bodies.a.linear) + sum(bodies.a.angular)) + (sum(bodies.b.linear) + sum(bodies.b.angular));
  return is_finite(all + ((impulses.sum() + impulses.twist) + (impulses.slide_1 + impulses.slide_2)));
}

}  // namespace fathom
