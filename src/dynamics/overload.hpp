// Loads that sweeps alone cannot carry, and the inertia that they add to bodies. Pure, for host and device.
//
// A sweep passes on as much momentum as a contact's effective mass has at the approach speed, and the contact's spring
// yields in inverse proportion to that mass. A pebble under a boulder thus needs more sweeps in proportion to the mass
// ratio, and sinks in meanwhile. While a body lies still under such a load it is therefore solved with a
// correspondingly higher mass, though with its true weight: at rest the impulses are those of the true masses, and both
// convergence and stiffness are those of bodies that match their load. A body that stands on nothing keeps its own
// mass, and so its momentum. (Andrews, Teichmann and Kry, "Geometric Stiffness for Real-time Constrained Multibody
// Dynamics", Computer Graphics Forum 36(2), 2017, also add inertia in proportion to the load.)
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "dynamics/tuning.hpp"

namespace fathom {

/// Load beyond which sweeps alone are too soft for a contact, in units of the weight of its two bodies' effective mass.
/// A free-standing column of cubes on springs of angular frequency ω buckles like an elastic one at a height of about
/// 1.2 (d ω² / g)^⅓ cubes, where d is half a cube's edge and each contact carries twice as much as it has cubes above
/// (docs/solver.md); and a load compresses a contact, for which a thin body has no room. `stiffness` is ω² / g (1/m),
/// `half_thickness` that of the thinner body (m).
FATHOM_HD float sweep_load(float half_thickness, float stiffness) {
  const float x = half_thickness * stiffness;
  // A cube root by Newton's method from below: exact to 1 % between 1 and 10⁶, and the same on every target.
  float root = 1 + 0.02f * min(x, 4000.0f);
  for (int i = 0; i < 12; ++i) root = (2 * root + x / (root * root)) * (1.0f / 3);
  return min(buckling_load * root, thin_load * x);
}

/// Load beyond which a contact raises its bodies' inertia, in the unit of `sweep_load` and never below it: where its
/// spring yields by `inertia_compression` of the thinner body's half thickness. Sway of a stack of equal bodies needs
/// no inertia.
FATHOM_HD float inertia_load(float half_thickness, float stiffness) {
  return max(sweep_load(half_thickness, stiffness), inertia_compression * half_thickness * stiffness);
}

/// The lasting load (N·s) of a contact: its `impulse` over a step less the momentum that its two bodies gained from all
/// that acts on them. Otherwise a body whose inertia a load has raised would hit harder, and so seem to carry more.
FATHOM_HD float lasting_load(float impulse, float gained_a, float gained_b) {
  return max(impulse - (gained_a + gained_b), 0.0f);
}

/// Share of `push_out` (m/s) at which a contact pushes bodies out that have added inertia: the square of the true
/// effective mass over that in its rows, down to `loaded_push_out`. A spring that has grown stiffer while it was
/// compressed would otherwise throw its load up: a slab that is set down on balls of a thousandth of its mass, at 3.7
/// times its speed. The inverse masses (1/kg) are those of the rows, in which the inertia is `scale` times the body's
/// own; 0 for a body that cannot be pushed.
FATHOM_HD float push_out_share(float inverse_a, float scale_a, float inverse_b, float scale_b, float push_out) {
  const float share = (inverse_a + inverse_b) / fma(inverse_a, scale_a, inverse_b * scale_b);
  return share < 1 ? min(max(share * share, loaded_push_out / push_out), 1.0f) : 1.0f;
}

/// What contacts want for a body that stands on nothing, directly or through others.
inline constexpr float unsupported_inertia = 0.5f;

/// The inertia, as a factor on the body's own, that a contact with a lasting load of `ratio` times its `inertia_load`
/// wants for one of its bodies: the contact then yields a quarter as much as it otherwise would, however much it
/// carries. The lighter body gets most of it. `inverse_mass` is the body's true one, `inverse_sum` that of both (1/kg),
/// `heaviest` the mass (kg) of the heaviest body that it is in contact with, directly or through others, or 0 if it
/// stands on nothing: more than `max_inertia` times that is never useful, and pressed bodies that move about could hit
/// ever harder.
FATHOM_HD float wanted_inertia(float ratio, float inverse_mass, float inverse_sum, float heaviest) {
  if (!(heaviest > 0)) return unsupported_inertia;
  const float most = max(max_inertia * heaviest * inverse_mass, 1.0f);
  return clamp(fma(4 * (ratio - 1), inverse_mass / inverse_sum, 1.0f), 1.0f, most);
}

/// The vector, or one in its direction that is no longer than `most`.
FATHOM_HD Vec3 shortened(Vec3 v, float most) { return min(1.0f, most / max(length(v), 1e-20f)) * v; }

/// How a body is carried along as what it stands on changes its velocity.
struct CarriedAlong {
  Vec3 gained;        ///< m/s, as the step begins
  Vec3 acceleration;  ///< m/s², over the step
};

/// The velocity of what a body stands on changes by `change` (m/s) from the last step to this one, of length `dt` (s).
/// The body is treated as in the frame of its base: it has the change at once, and over the step it feels the inertial
/// force that takes it back, so that what contacts do not give is not given. Friction then works all step long. If the
/// base had a new velocity and the body the old one, the first substep would have to give the whole change: on a deck
/// that sways, friction would slip at a fraction of its limit and small stacks would tip. The force acts on the body's
/// own inertia; what a load has added (`inertia_scale`) is carried along free, or loads would slide off a truck that
/// pulls away. `fall` (m/s): what a fall gains in a step. Friction changes no velocity by much more than that, so
/// neither does this.
FATHOM_HD CarriedAlong carried_along(Vec3 change, float inertia_scale, float fall, float dt) {
  const Vec3 gained = shortened(change, fall);
  return {gained, (-1 / (inertia_scale * dt)) * gained};
}

/// How what a body stands on moves, from step to step.
struct BaseMotion {
  Vec3 velocity;                    ///< m/s, at the body's centre
  std::uint32_t step = 0xfffffffe;  ///< in which that was; at first, in none

  /// By how much (m/s) the velocity changes with this step, in which it is `now`. If it was not noted in the last step,
  /// the base was at rest if the body, which moves with `own` (m/s), is nearer to that, unless the base is too fast.
  FATHOM_HD Vec3 change_to(Vec3 now, Vec3 own, std::uint32_t this_step, float fall) {
    const bool is_known = step + 1 == this_step;
    const bool may_start = length_squared(now) <= fall * fall && length_squared(own) < length_squared(own - now);
    const Vec3 change = is_known ? now - velocity : may_start ? now : Vec3{};
    velocity = now, step = this_step;
    return change;
  }
};

/// Momentum that a body's added inertia has taken up across and around the direction of weight, where there is no load
/// to carry. It is given back over `owed_steps`, or small towers would swallow what hits, drags or turns them. Bodies
/// with joints owe none: their joints move the added part as a mechanism.
struct OwedMomentum {
  Vec3 linear, angular;  ///< m/s and rad/s: over the body's own mass and inertia

  FATHOM_HD bool any() const { return !(linear == Vec3{} && angular == Vec3{}); }
  /// What a body of this radius (m) with `scale` times its inertia gets back (m/s, rad/s) as a step begins; all if it
  /// has only its own. No part of it gains more than `fall` (m/s), which is what gravity adds in a step: bodies that
  /// heavy ones squeeze are owed far more than they could carry away.
  FATHOM_HD Velocity give(float scale, float radius, float fall) {
    const float part = scale > 1 ? 1.0f / owed_steps : 1.0f;
    Velocity v;
    v.linear = shortened((part / scale) * linear, fall), v.angular = shortened((part / scale) * angular, fall / radius);
    linear = (1 - part) * linear, angular = (1 - part) * angular;
    return v;
  }
  /// The body has changed its velocity by this much (m/s, rad/s) in a step, what it was given back included. `up`: the
  /// direction against gravity.
  FATHOM_HD void take(float scale, Vec3 linear_change, Vec3 angular_change, Vec3 up) {
    linear = mul_add(linear, scale - 1, linear_change - dot(linear_change, up) * up);
    angular = mul_add(angular, (scale - 1) * dot(angular_change, up), up);
    if (!is_finite(linear) || !is_finite(angular)) *this = {};
  }
};

/// Whether a body of this velocity (m/s), relative to what it rests on, lies still enough for inertia to be added.
FATHOM_HD bool is_settled(Vec3 velocity) { return length_squared(velocity) <= settled_speed * settled_speed; }

/// A body's inertia factor in the next step, where contacts want it to be `wanted`; 0 if none is overloaded. It grows
/// and falls slowly: a spring that is stiffer while it is compressed than while it expands gives bodies energy in every
/// cycle. A body that moves loses it soon, because its weight is the true one: with added inertia it would fall, slide
/// and slow down as if in weaker gravity.
FATHOM_HD float next_inertia_scale(float scale, float wanted, bool settled) {
  if (!settled) return max(moving_decay * scale, 1.0f);
  const float decay = wanted < 1 ? unloaded_decay : inertia_decay;
  return max(clamp(wanted, decay * scale, inertia_growth * scale), 1.0f);
}

}  // namespace fathom
