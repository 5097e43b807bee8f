// One body in contact through a substep. Included by the solver alone.
#pragma once

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include <array>

#include "dynamics/inverse_inertia.hpp"
#include "dynamics/rotation.hpp"
#include "native/solver.hpp"
#include "native/spin_lanes.hpp"
#include "world/body_table.hpp"

namespace fathom {

namespace native {
struct Vec3Q;
}
template <>
struct LanesOf<native::Vec3Q> {
  using Lane = float;
};

namespace native {

// Quads as vectors: linear and angular parts share the same operations, and the fourth elements stay zero.
namespace hn = hwy::HWY_NAMESPACE;
using QuadTag = hn::CappedTag<float, 4>;
using Quad = hn::Vec<QuadTag>;

/// A body's vector, as the laws of dynamics/integrate-inl.hpp use it.
struct Vec3Q {
  Quad quad;
};
HWY_INLINE Vec3Q operator+(Vec3Q a, Vec3Q b) { return {hn::Add(a.quad, b.quad)}; }
HWY_INLINE Vec3Q operator-(Vec3Q a, Vec3Q b) { return {hn::Sub(a.quad, b.quad)}; }
HWY_INLINE Vec3Q scale(float s, Vec3Q a) { return {hn::Mul(hn::Set(QuadTag(), s), a.quad)}; }
HWY_INLINE Vec3Q mul_add(Vec3Q a, float s, Vec3Q b) { return {hn::MulAdd(hn::Set(QuadTag(), s), b.quad, a.quad)}; }
HWY_INLINE bool is_zero(Vec3Q a) { return hn::AllTrue(QuadTag(), hn::Eq(a.quad, hn::Zero(QuadTag()))); }

/// `v`, whose fourth element is zero.
HWY_INLINE Vec3Q load(const Vec3& v) { return {hn::Load(QuadTag(), &v.x)}; }
/// `v`, ignoring its fourth element.
HWY_INLINE Vec3Q load_three(const Vec3& v) {
  return {hn::IfThenElseZero(hn::FirstN(QuadTag(), 3), hn::Load(QuadTag(), &v.x))};
}
HWY_INLINE void put(Vec3& to, Vec3Q value) { hn::Store(value.quad, QuadTag(), &to.x); }

/// NaN in some element if the body's velocity is not finite, else zeros. A velocity that is not finite stays so. While
/// it is finite, so is the body's movement.
HWY_INLINE Quad not_finite(const SolverBody& body) {
  const Quad sum = (load(body.linear) + load(body.angular)).quad;
  return hn::Sub(sum, sum);
}

/// Plain pointers, so that loops need not reload the arrays after every body.
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
  const std::uint8_t* flags;       ///< by slot

  /// Updates W before bounce sweeps, whose impulses it must not include.
  HWY_INLINE void carry(std::uint32_t slot) const {
    const SolverBody& body = bodies[slot];
    WarmStart& w = warm[slot];
    put(w.linear, carried(load(w.linear), load(body.linear), load(w.linear_reference)));
    put(w.angular, carried(load(w.angular), load(body.angular), load(w.angular_reference)));
  }

  HWY_INLINE void velocity(std::uint32_t slot, Carry carry) const {
    SolverBody& body = bodies[slot];
    if (body.inverse_mass == 0) return;
    const BodyMotion& m = motion[slot];
    WarmStart& w = warm[slot];
    // The reference excludes the warm start of the first substep, which a sweep applies.
    integrate(body.linear, m.acceleration, m.linear_damping, w.linear, w.linear_reference, carry);
    integrate(body.angular, m.angular_acceleration, m.angular_damping, w.angular, w.angular_reference, carry);
  }

  /// Moves the body by a substep, except the rotation of anisotropic bodies; returns true for those.
  HWY_INLINE bool move(std::uint32_t slot) const {
    SolverBody& body = bodies[slot];
    const bool is_cut = HWY_UNLIKELY(may_be_too_fast(body)) && slow_down_apart(body, warm[slot], limits);
    put(body.moved, mul_add(load(body.moved), h, is_cut ? load(body.linear) : mean(slot)));
    if (is_anisotropic(body)) return true;
    put(body.turned, mul_add(load(body.turned), h, load(body.angular)));
    return false;
  }
  HWY_INLINE void position(std::uint32_t slot) const {
    if (move(slot)) spin({&slot, 1});
  }
  void spin(std::span<const std::uint32_t> slots) const {
    spin_in_contact({table, bodies, warm, inertia, poses, any_swings ? flags : nullptr}, slots, h);
  }

 private:
  HWY_INLINE void integrate(Vec3& v, const Vec3& acceleration, float damping, Vec3& warm_start, Vec3& reference,
                            Carry carry) const {
    const Vec3Q now = load(v);
    const Vec3Q w = carry == Carry::nothing   ? Vec3Q{hn::Zero(QuadTag())}
                    : carry == Carry::to_date ? carried(load(warm_start), now, load(reference))
                                              : load(warm_start);
    const Vec3Q next = substep_velocity(now, load_three(acceleration), damping, h, w);
    put(warm_start, w);
    put(v, next);
    put(reference, next);
  }

  /// Mean velocity of a substep (m/s): that of a free body if no contact has acted (`has_flown`) or the body swings.
  HWY_INLINE Vec3Q mean(std::uint32_t slot) const {
    const WarmStart& w = warm[slot];
    const Vec3Q v = load(bodies[slot].linear);
    const Vec3Q acted{hn::Or((v - load(w.linear_reference)).quad, load(w.linear).quad)};
    if (!is_zero(acted) && !(any_swings && any_swings[slot])) return v;
    return mean_velocity(v, load_three(motion[slot].acceleration), h);
  }

  /// Rarely called. A static function of its own, so that loops keep BodyIntegration's members in registers.
  HWY_NOINLINE static bool slow_down_apart(SolverBody& body, WarmStart& warm, SpeedLimits limits) {
    return slow_down(body.linear, body.angular, warm, limits);
  }

  /// Cheaper than computing velocities' lengths: true above either limit, and for some bodies near one.
  HWY_INLINE bool may_be_too_fast(const SolverBody& body) const {
    const QuadTag d;
    const float least = limits.linear < limits.angular ? limits.linear : limits.angular;
    const Quad v = load(body.linear).quad, w = load(body.angular).quad;
    return !hn::AllFalse(d, hn::Gt(hn::MulAdd(v, v, hn::Mul(w, w)), hn::Set(d, 0.33f * least * least)));
  }
};

/// Integrates positions body by body. Collects bodies that need `spin`, to spin them side by side.
class PositionIntegration {
 public:
  explicit PositionIntegration(const BodyIntegration& of) : of_(of) {}

  HWY_INLINE void operator()(std::uint32_t slot) const {
    if (!of_.move(slot)) return;
    waiting_[count_++] = slot;
    if (count_ == spin_lanes) end();
  }
  /// Call after the last body.
  void end() const {
    of_.spin({waiting_.data(), count_});
    count_ = 0;
  }

 private:
  BodyIntegration of_;
  mutable std::array<std::uint32_t, spin_lanes> waiting_{};
  mutable std::size_t count_ = 0;
};

}  // namespace native
}  // namespace fathom
