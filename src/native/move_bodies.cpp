#include "native/move_bodies.hpp"

#include <algorithm>
#include <cstddef>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "dynamics/forces.hpp"
#include "dynamics/look_ahead.hpp"
#include "dynamics/restitution.hpp"
#include "dynamics/rolling.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/sleep.hpp"
#include "geometry/support.hpp"
#include "native/lanes-inl.hpp"
#include "native/prefetch.hpp"

namespace fathom::native {

namespace {

using namespace HWY_NAMESPACE;  // lanes-inl.hpp, for the instruction set this file is compiled for
using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
constexpr std::size_t width = hn::MaxLanes(D());

using Lanes = LaneItems<D>;

V set(float value) { return hn::Set(D(), value); }
Vec3V<V> set(Vec3 v) { return {set(v.x), set(v.y), set(v.z)}; }
Vec3V<V> zero3() { return {hn::Zero(D()), hn::Zero(D()), hn::Zero(D())}; }
Vec3V<V> min3(Vec3V<V> a, Vec3V<V> b) { return {hn::Min(a.x, b.x), hn::Min(a.y, b.y), hn::Min(a.z, b.z)}; }
Vec3V<V> max3(Vec3V<V> a, Vec3V<V> b) { return {hn::Max(a.x, b.x), hn::Max(a.y, b.y), hn::Max(a.z, b.z)}; }

struct QuatV {
  V w, x, y, z;
};

/// `fathom::exponential` in lanes, the same series, of at most half a turn.
QuatV exponential(Vec3V<V> phi) {
  const V x = hn::Mul(set(0.25f), dot(phi, phi));
  V c = hn::MulAdd(x, set(1.0f / 479001600.0f), set(-1.0f / 3628800.0f));
  for (const float k : {1.0f / 40320.0f, -1.0f / 720.0f, 1.0f / 24.0f, -0.5f, 1.0f}) c = hn::MulAdd(x, c, set(k));
  V s = hn::MulAdd(x, set(1.0f / 6227020800.0f), set(-1.0f / 39916800.0f));
  for (const float k : {1.0f / 362880.0f, -1.0f / 5040.0f, 1.0f / 120.0f, -1.0f / 6.0f, 1.0f})
    s = hn::MulAdd(x, s, set(k));
  const Vec3V<V> v = scale(hn::Mul(set(0.5f), s), phi);
  return {c, v.x, v.y, v.z};
}

QuatV product(QuatV a, QuatV b) {
  const auto component = [](V p, V q, V r, V s, V t, V u, V minus, V times) {
    return hn::NegMulAdd(minus, times, hn::MulAdd(t, u, hn::MulAdd(r, s, hn::Mul(p, q))));
  };
  return {hn::NegMulAdd(a.z, b.z, hn::NegMulAdd(a.y, b.y, hn::NegMulAdd(a.x, b.x, hn::Mul(a.w, b.w)))),
          component(a.w, b.x, a.x, b.w, a.y, b.z, a.z, b.y), component(a.w, b.y, a.y, b.w, a.z, b.x, a.x, b.z),
          component(a.w, b.z, a.z, b.w, a.x, b.y, a.y, b.x)};
}

QuatV normalised(QuatV q) {
  const V squared = hn::MulAdd(q.w, q.w, hn::MulAdd(q.x, q.x, hn::MulAdd(q.y, q.y, hn::Mul(q.z, q.z))));
  const V s = hn::Div(set(1.0f), hn::Sqrt(squared));
  return {hn::Mul(s, q.w), hn::Mul(s, q.x), hn::Mul(s, q.y), hn::Mul(s, q.z)};
}

/// `to` becomes `from` in some lanes.
void take(hn::Mask<D> lanes, const Vec3V<V>& from, Vec3V<V>& to) {
  to = {hn::IfThenElse(lanes, from.x, to.x), hn::IfThenElse(lanes, from.y, to.y), hn::IfThenElse(lanes, from.z, to.z)};
}

/// `fathom::limited` in lanes.
Vec3V<V> limited(Vec3V<V> v, float limit) {
  const auto fast = hn::Gt(dot(v, v), set(limit * limit));
  const V largest = hn::Max(hn::Abs(v.x), hn::Max(hn::Abs(v.y), hn::Abs(v.z)));
  const Vec3V<V> scaled{hn::Div(v.x, largest), hn::Div(v.y, largest), hn::Div(v.z, largest)};
  take(fast, scale(hn::Div(set(limit), hn::Sqrt(dot(scaled, scaled))), scaled), v);
  return v;
}

/// `fathom::within_half_a_turn` in lanes.
Vec3V<V> within_half_a_turn(Vec3V<V> phi) {
  const auto far = hn::Gt(dot(phi, phi), set(pi * pi));
  const V angle = hn::IfThenElse(far, hn::Sqrt(dot(phi, phi)), set(1.0f));
  const V turns = hn::Floor(hn::MulAdd(angle, set(0.15915494f), set(0.5f)));
  const V rest = hn::MulAdd(turns, set(1.7484556e-7f), hn::NegMulAdd(turns, set(6.2831855f), angle));
  const V kept = hn::IfThenElseZero(hn::Lt(angle, set(0x1p20f)), hn::Div(rest, angle));
  return scale(hn::IfThenElse(far, kept, set(1.0f)), phi);
}

// −0 becomes +0: which one a sum of zeros gives can depend on how lanes were grouped.
Vec3V<V> without_negative_zeros(Vec3V<V> v) { return v + zero3(); }

struct Motion {
  Vec3V<V> position, linear, angular;
  Vec3V<V> rest;  // of the linear velocity: what rounding has left out (`fathom::accelerate`)
  Vec3V<V> moved, turned;
  QuatV rotation;
};

/// `fathom::accelerate` in lanes.
void accelerate(Motion& m, Vec3V<V> change) {
  const Vec3V<V> next = m.linear + change;
  m.rest = change - (next - m.linear);
  m.linear = next;
}

/// Vectors in lanes as arrays, for what is done lane by lane.
struct LaneVectors {
  HWY_ALIGN float at[3][width];

  explicit LaneVectors(Vec3V<V> v) {
    hn::Store(v.x, D(), at[0]), hn::Store(v.y, D(), at[1]), hn::Store(v.z, D(), at[2]);
  }
  Vec3V<V> lanes() const { return {hn::Load(D(), at[0]), hn::Load(D(), at[1]), hn::Load(D(), at[2])}; }
  Vec3 operator[](std::size_t i) const { return {at[0][i], at[1][i], at[2][i]}; }
  void set(std::size_t i, Vec3 v) { at[0][i] = v.x, at[1][i] = v.y, at[2][i] = v.z; }
};

/// Calls act(lane, slot) for lanes on which a force of the application acts; returns whether there are any.
template <class Act>
bool for_each_forced(const Lanes& lanes, const BodyState& state, const MoveParameters& p, const Act& act) {
  bool any = false;
  for (std::size_t i = 0; p.forced && i < lanes.used; ++i) {
    const std::uint32_t slot = lanes.item(i);
    if (!(state.flags[slot] & has_force)) continue;
    any = true;
    act(i, slot);
  }
  return any;
}

/// Acceleration of lanes that have a force; the rest have gravity's alone.
void add_forces(const Lanes& lanes, const BodyTable& bodies, const BodyState& state, const MoveParameters& p,
                Vec3V<V>& linear, Vec3V<V>& angular) {
  LaneVectors v(linear), w(angular);
  const bool any = for_each_forced(lanes, state, p, [&](std::size_t i, std::uint32_t slot) {
    const Acceleration a = forced_acceleration(bodies[slot], state.poses[slot].rotation, state.forces[slot], v[i]);
    v.set(i, a.linear);
    w.set(i, a.angular);
  });
  if (any) linear = v.lanes(), angular = w.lanes();
}

/// All substeps of bodies without contacts, which are all dynamic. Without damping they are one, an exact parabola.
void integrate_free(const Lanes& lanes, const BodyTable& bodies, const BodyState& state, const MoveParameters& p,
                    Motion& m) {
  const V h = set(p.dt / static_cast<float>(p.substeps));
  const QuadV<V> flight = lanes.load(state.flight.data(), 0);
  Vec3V<V> acceleration = scale(flight.x, set(p.gravity)), angular_acceleration = zero3();
  add_forces(lanes, bodies, state, p, acceleration, angular_acceleration);
  const V linear_damping = hn::Div(set(1.0f), hn::MulAdd(h, flight.y, set(1.0f)));
  const V angular_damping = hn::Div(set(1.0f), hn::MulAdd(h, flight.z, set(1.0f)));
  m.moved = m.turned = zero3();
  for (int i = 0; i < p.substeps; ++i) {
    m.angular = mul_add(scale(angular_damping, m.angular), h, angular_acceleration);
    m.turned = mul_add(m.turned, h, m.angular);
  }
  const V dt = set(p.dt);
  Motion undamped = m;
  accelerate(undamped, mul_add(m.rest, dt, acceleration));
  undamped.moved = scale(dt, mul_add(undamped.linear, hn::Mul(set(-0.5f), dt), acceleration));
  const auto damped = hn::Ne(linear_damping, set(1.0f));
  if (!hn::AllFalse(D(), damped)) {
    const V back = hn::Mul(set(-0.5f), h);
    for (int i = 0; i < p.substeps; ++i) {
      m.linear = mul_add(scale(linear_damping, m.linear), h, acceleration);
      m.moved = mul_add(m.moved, h, mul_add(m.linear, back, acceleration));  // `mean_velocity` of what nothing touches
    }
    m.rest = zero3();
    take(damped, m.linear, undamped.linear);
    take(damped, m.rest, undamped.rest);
    take(damped, m.moved, undamped.moved);
  }
  m.linear = undamped.linear;
  m.rest = undamped.rest;
  m.moved = undamped.moved;
}

/// Lanes that contacts could have touched and did not have flown freely, the solver rounding their velocity in every
/// substep; they get the one of a flight without. All others have no rest.
void fly_on(const Lanes& lanes, BodyState& state, const MoveParameters& p, const Motion& before, Motion& m) {
  const D d;
  const auto untouched = [&](V after, V flown, V start, hn::Mask<D> and_this) {
    const V share = set(static_cast<float>(p.substeps) * 6e-8f);  // as in `may_have_flown`
    const V most = hn::Mul(share, hn::Add(hn::Abs(start), hn::Abs(flown)));
    return hn::And(and_this, hn::Le(hn::Abs(hn::Sub(after, flown)), most));
  };
  const QuadV<V> motion = lanes.load(state.motion.data(), 0);  // acceleration and linear damping
  Motion flown = before;
  accelerate(flown, mul_add(before.rest, set(p.dt), motion.xyz()));
  auto free = hn::Eq(motion.w, set(1.0f));
  free = untouched(m.linear.x, flown.linear.x, before.linear.x, free);
  free = untouched(m.linear.y, flown.linear.y, before.linear.y, free);
  free = untouched(m.linear.z, flown.linear.z, before.linear.z, free);
  m.rest = zero3();
  if (hn::AllFalse(d, free)) return;
  // W is what contacts gave in all substeps but the last, and the reference the velocity before they acted in that.
  const Vec3V<V> given = lanes.load(state.warm.data(), 0).xyz(), reference = lanes.load(state.warm.data(), 2).xyz();
  const auto none = [&](V w, V after, V start) { return hn::And(hn::Eq(w, hn::Zero(d)), hn::Eq(after, start)); };
  free = hn::And(free, none(given.x, m.linear.x, reference.x));
  free = hn::And(free, none(given.y, m.linear.y, reference.y));
  free = hn::And(free, none(given.z, m.linear.z, reference.z));
  take(free, flown.linear, m.linear);
  take(free, flown.rest, m.rest);
}

/// Bodies with several principal moments turn substep by substep; those in contact the solver has turned already.
template <bool in_contact>
void turn_anisotropic(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p,
                      const Motion& before, Motion& m) {
  if (!bodies.any_anisotropic()) return;
  bool any = false;
  for (std::size_t i = 0; i < lanes.used; ++i) any |= !bodies[lanes.item(i)].isotropic;
  if (!any) return;
  const D d;
  HWY_ALIGN float q[4][width], w[3][width];
  hn::Store(m.rotation.w, d, q[0]), hn::Store(m.rotation.x, d, q[1]), hn::Store(m.rotation.y, d, q[2]),
      hn::Store(m.rotation.z, d, q[3]);
  hn::Store(m.angular.x, d, w[0]), hn::Store(m.angular.y, d, w[1]), hn::Store(m.angular.z, d, w[2]);
  HWY_ALIGN float start[3][width];
  hn::Store(before.angular.x, d, start[0]), hn::Store(before.angular.y, d, start[1]),
      hn::Store(before.angular.z, d, start[2]);
  const float h = p.dt / static_cast<float>(p.substeps);
  for (std::size_t i = 0; i < lanes.used; ++i) {
    const std::uint32_t slot = lanes.item(i);
    const BodyInfo& info = bodies[slot];
    if (info.isotropic || state.flags[slot] & isolated) continue;
    Quat rotation = state.poses[slot].rotation;
    Vec3 angular;
    if constexpr (in_contact) {
      const Quat now = state.inertia[slot].rotation;
      angular = rotate(now, inverse_rotate(rotation, {w[0][i], w[1][i], w[2][i]}));
      rotation = now;
    } else {
      // Damping and torque change the angular velocity by the same amount in lanes; here it is spread over the
      // substeps.
      angular = fathom::limited({start[0][i], start[1][i], start[2][i]}, p.limits.angular);
      const Vec3 change = (1.0f / static_cast<float>(p.substeps)) * (Vec3{w[0][i], w[1][i], w[2][i]} - angular);
      for (int s = 0; s < p.substeps; ++s) {
        angular = fathom::limited(angular + change, p.limits.angular);
        step_torque_free(rotation, angular, info.inertia, info.inverse_inertia, h);
      }
    }
    angular = fathom::limited(angular, p.limits.angular);
    w[0][i] = angular.x, w[1][i] = angular.y, w[2][i] = angular.z;
    q[0][i] = rotation.w, q[1][i] = rotation.x, q[2][i] = rotation.y, q[3][i] = rotation.z;
  }
  m.rotation = {hn::Load(d, q[0]), hn::Load(d, q[1]), hn::Load(d, q[2]), hn::Load(d, q[3])};
  m.angular = {hn::Load(d, w[0]), hn::Load(d, w[1]), hn::Load(d, w[2])};
}

/// `fathom::rest_of_force` of lanes on which forces act. Bodies with several principal moments have turned already:
/// `turn` gets what their orientation still has to.
template <bool in_contact>
bool complete_forced(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p,
                     const Motion& before, Motion& m, Vec3V<V>& turn) {
  if (!p.forced) return false;
  const LaneVectors v0(before.linear), w0(before.angular), v(m.linear), w(m.angular);
  LaneVectors moved(m.moved), turned(m.turned), left(zero3());
  const float substeps = static_cast<float>(p.substeps);
  const bool any = for_each_forced(lanes, state, p, [&](std::size_t i, std::uint32_t slot) {
    const BodyInfo& info = bodies[slot];
    const Force& f = state.forces[slot];
    Acceleration a;
    bool is_parabola = true;
    if constexpr (in_contact) {
      const BodyMotion& motion = state.motion[slot];
      a = {motion.acceleration, motion.angular_acceleration};
      is_parabola = has_flown(state.warm[slot], state.solver_bodies()[slot].linear);
    } else {
      a = forced_acceleration(info, state.poses[slot].rotation, f, info.gravity_scale * p.gravity);
    }
    if (!(f.force == Vec3{}))
      moved.set(i, moved[i] + rest_of_force(v0[i], v[i], a.linear, is_parabola, p.dt, substeps));
    if (f.torque == Vec3{}) return;
    const Vec3 rest = rest_of_force(w0[i], w[i], a.angular, false, p.dt, substeps);
    LaneVectors& to = info.isotropic ? turned : left;
    to.set(i, to[i] + rest);
  });
  if (!any) return false;
  m.moved = moved.lanes();
  m.turned = turned.lanes();
  turn = left.lanes();
  return true;
}

/// `fathom::fat_box` in lanes.
void fatten(const Motion& m, V radius, const MoveParameters& p, Vec3V<V>& lower, Vec3V<V>& upper) {
  const V limit = hn::Mul(set(0.25f), radius), back = hn::Neg(limit);
  const Vec3V<V> way = scale(set(8.0f * p.dt), m.linear);
  const auto within = [&](V x) { return hn::Max(back, hn::Min(x, limit)); };
  const Vec3V<V> ahead{within(way.x), within(way.y), within(way.z)};
  const V margin = hn::Min(set(0.03f), hn::Mul(set(0.1f), radius));
  const Vec3V<V> grown{margin, margin, margin};
  lower = (lower - grown) + min3(ahead, zero3());
  upper = (upper + grown) + max3(ahead, zero3());
}

/// `motion_box` of lanes that are no boxes.
void bound_others(const Lanes& lanes, const BodyTable& bodies, const BodyState& state, const MoveParameters& p,
                  Vec3V<V>& lower, Vec3V<V>& upper) {
  const D d;
  HWY_ALIGN float corners[6][width];
  hn::Store(lower.x, d, corners[0]), hn::Store(lower.y, d, corners[1]), hn::Store(lower.z, d, corners[2]);
  hn::Store(upper.x, d, corners[3]), hn::Store(upper.y, d, corners[4]), hn::Store(upper.z, d, corners[5]);
  for (std::size_t i = 0; i < lanes.used; ++i) {
    const std::uint32_t slot = lanes.item(i);
    if (state.bounds[slot].is_box()) continue;
    const Aabb box = motion_box(bodies[slot], state.poses[slot], state.velocities[slot], p.dt);
    for (int axis = 0; axis < 3; ++axis) corners[axis][i] = box.lower[axis], corners[3 + axis][i] = box.upper[axis];
  }
  lower = {hn::Load(d, corners[0]), hn::Load(d, corners[1]), hn::Load(d, corners[2])};
  upper = {hn::Load(d, corners[3]), hn::Load(d, corners[4]), hn::Load(d, corners[5])};
}

// What is read and written of BodyBounds by quads.
static_assert(offsetof(BodyBounds, fat_box) == 24 && offsetof(BodyBounds, half_extents) == 48);

/// As fathom::half_speculative_margin.
V half_speculative_margin(V radius, float dt) {
  const V of_size = hn::Mul(set(0.05f), radius);
  return hn::Min(set(0.01f), hn::Add(of_size, set(0.5f * fall_within(dt))));
}

/// Lists those whose way has left the line that they began along by more than pairs are looked for beside it, and by a
/// good part of their thickness.
void note_strays(const Lanes& lanes, V radius, const BodyTable& bodies, const MoveParameters& p, const Motion& before,
                 const Motion& m) {
  const D d;
  const Vec3V<V> moved = m.position - before.position, way = scale(set(p.dt), before.linear);
  const V along = hn::Div(dot(moved, way), hn::Max(dot(way, way), set(1e-30f)));
  const V part = hn::Max(hn::Min(along, set(1.0f)), hn::Zero(d));
  const Vec3V<V> aside = mul_sub(moved, part, way);
  const V least = hn::Add(half_speculative_margin(radius, p.dt), set(fall_within(p.dt)));
  const V squared = dot(aside, aside);
  if (HWY_LIKELY(hn::AllTrue(d, hn::Le(squared, hn::Mul(least, least))))) return;
  HWY_ALIGN float far[width], q[4][width];
  hn::Store(squared, d, far);
  const LaneVectors begin(before.position);
  hn::Store(before.rotation.w, d, q[0]), hn::Store(before.rotation.x, d, q[1]);
  hn::Store(before.rotation.y, d, q[2]), hn::Store(before.rotation.z, d, q[3]);
  for (std::size_t i = 0; i < lanes.used; ++i) {
    const std::uint32_t slot = lanes.item(i);
    const float slow = slow_share * half_thickness(bodies[slot]);
    if (bodies[slot].motion != MotionType::dynamic || !(far[i] > slow * slow)) continue;
    const std::lock_guard lock(p.strays->mutex);
    p.strays->list.push_back({slot, {begin[i], 0, {q[0][i], q[1][i], q[2][i], q[3][i]}}});
  }
}

/// Boxes of the lanes' new motion; a fat box only where the old one is left.
template <bool in_contact>
void update_boxes(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p,
                  const Motion& before, const Motion& m) {
  const D d;
  BodyBounds* const bounds = state.bounds.data();
  const QuadV<V> second = lanes.load(bounds, 1), third = lanes.load(bounds, 2), shape = lanes.load(bounds, 3);
  const V radius = shape.w;
  if (p.strays && (in_contact || p.forced)) note_strays(lanes, radius, bodies, p, before, m);
  const Mat3V<V> r = to_matrix(d, m.rotation.w, m.rotation.x, m.rotation.y, m.rotation.z);
  const auto extent = [&](V x, V y, V z) {
    return hn::MulAdd(hn::Abs(x), shape.x, hn::MulAdd(hn::Abs(y), shape.y, hn::Mul(hn::Abs(z), shape.z)));
  };
  // The same box as `motion_box`, for boxes.
  const V turning = hn::Mul(hn::Min(hn::Mul(hn::Sqrt(dot(m.angular, m.angular)), set(p.dt)), set(1.0f)), radius);
  const V margin = hn::Add(turning, half_speculative_margin(radius, p.dt));
  const Vec3V<V> reach{hn::Add(extent(r.x.x, r.y.x, r.z.x), margin), hn::Add(extent(r.x.y, r.y.y, r.z.y), margin),
                       hn::Add(extent(r.x.z, r.y.z, r.z.z), margin)};
  const Vec3V<V> path = scale(set(p.dt), m.linear);
  Vec3V<V> lower = (m.position - reach) + min3(path, zero3()), upper = (m.position + reach) + max3(path, zero3());
  if (!hn::AllTrue(d, hn::Gt(shape.x, hn::Zero(d)))) bound_others(lanes, bodies, state, p, lower, upper);

  const Vec3V<V> fat_lower{second.z, second.w, third.x}, fat_upper{third.y, third.z, third.w};
  const auto is_within = [&](V outer_lower, V inner_lower, V inner_upper, V outer_upper) {
    return hn::And(hn::Le(outer_lower, inner_lower), hn::Le(inner_upper, outer_upper));
  };
  const auto left = hn::Not(hn::And(is_within(fat_lower.x, lower.x, upper.x, fat_upper.x),
                                    hn::And(is_within(fat_lower.y, lower.y, upper.y, fat_upper.y),
                                            is_within(fat_lower.z, lower.z, upper.z, fat_upper.z))));
  lanes.store(bounds, 0, {lower.x, lower.y, lower.z, upper.x});
  if (hn::AllFalse(d, left)) return lanes.store(bounds, 1, {upper.y, upper.z, second.z, second.w});

  Vec3V<V> new_lower = lower, new_upper = upper;
  fatten(m, radius, p, new_lower, new_upper);
  Vec3V<V> to_lower = fat_lower, to_upper = fat_upper;
  take(left, new_lower, to_lower);
  take(left, new_upper, to_upper);
  lanes.store(bounds, 1, {upper.y, upper.z, to_lower.x, to_lower.y});
  lanes.store(bounds, 2, {to_lower.z, to_upper.x, to_upper.y, to_upper.z});
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, left, bits);
  for (std::size_t i = 0; i < lanes.used; ++i)
    if (bits[i / 8] >> i % 8 & 1) state.flags[lanes.item(i)] |= box_changed;
}

template <bool in_contact>
void account_for_sleep(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p) {
  for (std::size_t i = 0; i < lanes.used; ++i) {
    const std::uint32_t slot = lanes.item(i);
    const BodyInfo& info = bodies[slot];
    Velocity& v = state.velocities[slot];
    const bool may_sleep = info.can_sleep && info.motion == MotionType::dynamic;
    Vec3 moved;
    if constexpr (in_contact) moved = state.solver_bodies()[slot].moved;
    const bool slow = may_sleep && is_slow(v, moved, info.radius, p.slow_below, p.dt);
    state.slow_time[slot] = slow ? state.slow_time[slot] + p.dt : 0.0f;
    if (in_contact && may_sleep && is_round(info.geometry.type) && !(state.flags[slot] & jointed))
      v.angular *= rest_factor(v, info.geometry.radius, p.slow_below, p.dt);
  }
}

/// m in a step; substeps at the limit add up to a little more than a step at it.
float most_moved(const MoveParameters& p) { return 1.01f * p.dt * p.limits.linear; }

/// Whether all lanes are finite and within the limits, and turn by no more than half a turn.
bool is_ordinary(const Motion& m, const MoveParameters& p) {
  const auto within = [](Vec3V<V> v, float most) { return hn::Le(dot(v, v), set(std::min(most * most, 3e38f))); };
  return hn::AllTrue(D(), hn::And(hn::And(within(m.linear, p.limits.linear), within(m.angular, p.limits.angular)),
                                  hn::And(within(m.moved, most_moved(p)), within(m.turned, pi))));
}

/// What those that are not need: velocities and movements are cut to the limits. Lanes with a state that is not finite
/// stay where they are, at rest, and get the flag `isolated`; returns how many.
HWY_NOINLINE std::size_t restrain(const Lanes& lanes, BodyState& state, const MoveParameters& p, Motion& m,
                                  Vec3V<V>& turn_left) {
  const D d;
  // One sum tells of any NaN or infinity among the terms.
  const auto sum = [](Vec3V<V> v) { return hn::Add(hn::Abs(v.x), hn::Add(hn::Abs(v.y), hn::Abs(v.z))); };
  const V scaled =
      hn::Mul(set(1e-3f), hn::Add(hn::Add(sum(m.linear), sum(m.angular)), hn::Add(sum(m.moved), sum(m.turned))));
  const auto finite = hn::Eq(hn::Sub(scaled, scaled), hn::Zero(d));
  // A rest of a velocity beyond all limits could be as large as any other.
  const auto keeps_rest = hn::Le(dot(m.linear, m.linear), set(p.limits.linear * p.limits.linear));
  const auto kept = [](hn::Mask<D> where, Vec3V<V> v) {
    return Vec3V<V>{hn::IfThenElseZero(where, v.x), hn::IfThenElseZero(where, v.y), hn::IfThenElseZero(where, v.z)};
  };
  m.linear = kept(finite, limited(m.linear, p.limits.linear));
  m.angular = kept(finite, limited(m.angular, p.limits.angular));
  // Not those that `is_ordinary` lets pass, or it would matter which bodies share a vector.
  const auto too_far = hn::Gt(dot(m.moved, m.moved), set(std::min(most_moved(p) * most_moved(p), 3e38f)));
  take(too_far, limited(m.moved, p.dt * p.limits.linear), m.moved);
  m.moved = kept(finite, m.moved);
  m.turned = kept(finite, within_half_a_turn(m.turned));
  turn_left = kept(finite, within_half_a_turn(turn_left));
  m.rest = kept(hn::And(finite, keeps_rest), m.rest);
  HWY_ALIGN float ok[width];
  hn::Store(hn::IfThenElseZero(finite, set(1.0f)), d, ok);
  std::size_t count = 0;
  for (std::size_t i = 0; i < lanes.used; ++i) {
    if (ok[i] != 0) continue;
    state.flags[lanes.item(i)] |= isolated;
    ++count;
  }
  return count;
}

/// Not those that have nothing left, which rounding would turn: it would matter which bodies share a vector.
void turn_further(Vec3V<V> turn, Motion& m) {
  const auto turns = hn::Gt(dot(turn, turn), hn::Zero(D()));
  const QuatV q = normalised(product(exponential(turn), m.rotation));
  m.rotation = {hn::IfThenElse(turns, q.w, m.rotation.w), hn::IfThenElse(turns, q.x, m.rotation.x),
                hn::IfThenElse(turns, q.y, m.rotation.y), hn::IfThenElse(turns, q.z, m.rotation.z)};
}

template <bool in_contact>
std::size_t move_lanes(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p) {
  Motion before, m;
  const QuadV<V> position = lanes.load(state.poses.data(), 0), q = lanes.load(state.poses.data(), 1);
  const QuadV<V> linear = lanes.load(state.velocities.data(), 0), angular = lanes.load(state.velocities.data(), 1);
  before.position = position.xyz();
  before.rotation = {q.x, q.y, q.z, q.w};
  before.linear = linear.xyz();
  before.angular = angular.xyz();
  before.rest = {linear.w, angular.w, position.w};
  m = before;
  if constexpr (in_contact) {
    const SolverBody* solver = state.solver_bodies();
    m.linear = lanes.load(solver, 0).xyz();
    m.angular = lanes.load(solver, 1).xyz();
    m.moved = lanes.load(solver, 2).xyz();
    m.turned = lanes.load(solver, 3).xyz();
    fly_on(lanes, state, p, before, m);
  } else {
    integrate_free(lanes, bodies, state, p, m);
  }
  Vec3V<V> turn_left = zero3();
  const bool forced = complete_forced<in_contact>(lanes, bodies, state, p, before, m, turn_left);
  std::size_t failed = 0;
  if (HWY_UNLIKELY(!is_ordinary(m, p))) {
    Motion restrained = m;
    failed = restrain(lanes, state, p, restrained, turn_left);
    m = restrained;
  }
  m.position = m.position + m.moved;
  m.rotation = normalised(product(exponential(m.turned), m.rotation));
  turn_anisotropic<in_contact>(lanes, bodies, state, p, before, m);
  if (forced) turn_further(turn_left, m);
  m.rest = without_negative_zeros(m.rest);
  m.linear = without_negative_zeros(m.linear);
  m.angular = without_negative_zeros(m.angular);
  m.position = without_negative_zeros(m.position);
  lanes.store(state.poses.data(), 0, {m.position.x, m.position.y, m.position.z, m.rest.z});
  lanes.store(state.poses.data(), 1, {m.rotation.w, m.rotation.x, m.rotation.y, m.rotation.z});
  lanes.store(state.velocities.data(), 0, {m.linear.x, m.linear.y, m.linear.z, m.rest.x});
  lanes.store(state.velocities.data(), 1, {m.angular.x, m.angular.y, m.angular.z, m.rest.y});
  update_boxes<in_contact>(lanes, bodies, state, p, before, m);
  if (p.sleeping) account_for_sleep<in_contact>(lanes, bodies, state, p);
  return failed;
}

template <bool in_contact>
void prefetch(std::uint32_t slot, BodyState& state) {
  prefetch_to_write(&state.poses[slot]);
  prefetch_to_write(&state.velocities[slot]);
  prefetch_to_write(&state.bounds[slot]);
  if (in_contact) prefetch_to_read(&state.solver_bodies()[slot]);
}

}  // namespace

template <bool in_contact>
std::size_t move_bodies(std::span<const std::uint32_t> slots, const BodyTable& bodies, BodyState& state,
                        const MoveParameters& p) {
  std::size_t failed = 0;
  for (std::size_t i = 0; i < slots.size(); i += width) {
    if (p.scattered)
      for (std::size_t k = i + width; k < std::min(i + 2 * width, slots.size()); ++k)
        prefetch<in_contact>(slots[k], state);
    const std::size_t used = slots.size() - i < width ? slots.size() - i : width;
    failed += move_lanes<in_contact>({slots.data() + i, used}, bodies, state, p);
  }
  return failed;
}

template std::size_t move_bodies<true>(std::span<const std::uint32_t>, const BodyTable&, BodyState&,
                                       const MoveParameters&);
template std::size_t move_bodies<false>(std::span<const std::uint32_t>, const BodyTable&, BodyState&,
                                        const MoveParameters&);

}  // namespace fathom::native
