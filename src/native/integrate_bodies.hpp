// What a substep does to one body in contact. Included by the solver alone.
#pragma once

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "dynamics/rotation.hpp"
#include "dynamics/solver_body.hpp"
#include "dynamics/speed_limits.hpp"
#include "native/solver.hpp"
#include "world/body_table.hpp"

namespace fathom::native {

// Quads as vectors: linear and angular parts go through the same operations, and the fourth elements stay zero.
namespace hn = hwy::HWY_NAMESPACE;
using QuadTag = hn::CappedTag<float, 4>;
using Quad = hn::Vec<QuadTag>;

HWY_INLINE Quad load(const Vec3& quad) { return hn::Load(QuadTag(), &quad.x); }
HWY_INLINE void put(Vec3& quad, Quad value) { hn::Store(value, QuadTag(), &quad.x); }

/// NaN in some element where a body's velocity is not finite, else zeros. It never becomes so again, and while it is,
/// what the body has moved is finite too.
HWY_INLINE Quad not_finite(const SolverBody& body) {
  const Quad sum = hn::Add(load(body.linear), load(body.angular));
  return hn::Sub(sum, sum);
}

/// v ← damping · v + h · acceleration + W.
HWY_INLINE void integrate(Vec3& v, const Vec3& acceleration, float damping, float h, Vec3& warm, Vec3& reference,
                          Carry carry) {
  const QuadTag d;
  const Quad now = load(v);
  const Quad a = hn::IfThenElseZero(hn::FirstN(d, 3), load(acceleration));  // its fourth element is the damping
  const Quad w = carry == Carry::nothing   ? hn::Zero(d)
                 : carry == Carry::to_date ? hn::Add(load(warm), hn::Sub(now, load(reference)))
                                           : load(warm);
  const Quad next = hn::Add(hn::MulAdd(hn::Set(d, h), a, hn::Mul(hn::Set(d, damping), now)), w);
  put(warm, w);
  put(v, next);
  put(reference, next);
}

/// `fathom::mean_velocity` of a body in contact, or of one that swings.
HWY_INLINE Quad mean_velocity(const SolverBody& body, const BodyMotion& motion, const WarmStart& warm, bool swings,
                              float h) {
  const QuadTag d;
  const Quad v = load(body.linear);
  const Quad acted = hn::Or(hn::Sub(v, load(warm.linear_reference)), load(warm.linear));
  if (!hn::AllTrue(d, hn::Eq(acted, hn::Zero(d))) && !swings) return v;
  return hn::NegMulAdd(hn::Set(d, 0.5f * h), hn::IfThenElseZero(hn::FirstN(d, 3), load(motion.acceleration)), v);
}

/// What is cut of a velocity beyond the limits is no contact's doing. Returns whether the linear one was. Rare, and a
/// function of its own without `this`, so that loops keep what they know of BodyIntegration in registers.
HWY_NOINLINE inline bool slow_down(SolverBody& body, WarmStart& warm, SpeedLimits limits) {
  const Vec3 linear = limited(body.linear, limits.linear), angular = limited(body.angular, limits.angular);
  warm.linear_reference += linear - body.linear;
  warm.angular_reference += angular - body.angular;
  const bool is_cut = !(linear == body.linear);
  body.linear = linear;
  body.angular = angular;
  return is_cut;
}

/// Plain pointers, so that loops need not look for the arrays again after every body.
struct BodyIntegration {
  const BodyTable& table;
  SolverBody* bodies;
  const BodyMotion* motion;
  WarmStart* warm;
  WorldInertia* inertia;
  const Pose* poses;
  float h;  ///< s, a substep
  SpeedLimits limits;
  const std::uint8_t* any_swings;  ///< by slot; null where there are no joints

  /// W brought up to date, which strikes are not to be part of.
  HWY_INLINE void carry(std::uint32_t slot) const {
    const SolverBody& body = bodies[slot];
    WarmStart& w = warm[slot];
    put(w.linear, hn::Add(load(w.linear), hn::Sub(load(body.linear), load(w.linear_reference))));
    put(w.angular, hn::Add(load(w.angular), hn::Sub(load(body.angular), load(w.angular_reference))));
  }

  HWY_INLINE void velocity(std::uint32_t slot, Carry carry) const {
    SolverBody& body = bodies[slot];
    if (body.inverse_mass == 0) return;
    const BodyMotion& m = motion[slot];
    WarmStart& w = warm[slot];
    // The reference leaves the warm start out in the first substep, where a sweep applies it.
    integrate(body.linear, m.acceleration, m.linear_damping, h, w.linear, w.linear_reference, carry);
    integrate(body.angular, m.angular_acceleration, m.angular_damping, h, w.angular, w.angular_reference, carry);
  }

  HWY_INLINE void position(std::uint32_t slot) const {
    const QuadTag d;
    SolverBody& body = bodies[slot];
    const bool is_cut = HWY_UNLIKELY(may_be_too_fast(body)) && slow_down(body, warm[slot], limits);
    const bool swings = any_swings && any_swings[slot];
    const Quad mean = is_cut ? load(body.linear) : mean_velocity(body, motion[slot], warm[slot], swings, h);
    put(body.moved, hn::MulAdd(hn::Set(d, h), mean, load(body.moved)));
    if (body.inverse_mass > 0 && body.inverse_inertia == 0) {
      // Anisotropic: the torque-free turn also changes the angular velocity, which is no contact's doing.
      const BodyInfo& info = table[slot];
      const Vec3 before = body.angular;
      body.turned += step_torque_free_in_contact(inertia[slot].rotation, poses[slot].rotation, body.angular,
                                                 info.inertia, info.inverse_inertia, h);
      warm[slot].angular_reference += body.angular - before;
    } else {
      put(body.turned, hn::MulAdd(hn::Set(d, h), load(body.angular), load(body.turned)));
    }
  }

 private:
  /// Cheaper than the velocities' lengths: true for all that are beyond a limit, and some that are near.
  HWY_INLINE bool may_be_too_fast(const SolverBody& body) const {
    const QuadTag d;
    const float least = limits.linear < limits.angular ? limits.linear : limits.angular;
    const Quad v = load(body.linear), w = load(body.angular);
    return !hn::AllFalse(d, hn::Gt(hn::MulAdd(v, v, hn::Mul(w, w)), hn::Set(d, 0.33f * least * least)));
  }
};

}  // namespace fathom::native
