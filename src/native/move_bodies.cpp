#include "native/move_bodies.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "dynamics/forces.hpp"
#include "dynamics/look_ahead.hpp"
#include "dynamics/rolling.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/sleep.hpp"
#include "geometry/support.hpp"
#include "native/lane_functions-inl.hpp"
#include "native/prefetch.hpp"
#include "native/quick_bounds.hpp"
#include "native/spin_lanes.hpp"

namespace fathom::native {

namespace {

using namespace HWY_NAMESPACE;  // lane_functions-inl.hpp, for this file's instruction set
#define FATHOM_LANE_FUNCTION HWY_INLINE
#define FATHOM_LANE_LAMBDA HWY_ATTR
#include "dynamics/bounds-inl.hpp"
#include "dynamics/limited-inl.hpp"
// Uses the headers above.
#include "dynamics/integrate-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
constexpr std::size_t width = hn::MaxLanes(D());

using Lanes = LaneItems<D>;

V set(float value) { return hn::Set(D(), value); }
Vec3V<V> set(Vec3 v) { return {set(v.x), set(v.y), set(v.z)}; }
Vec3V<V> zero3() { return {hn::Zero(D()), hn::Zero(D()), hn::Zero(D())}; }

/// Copies `from` to `to` in these lanes.
void take(hn::Mask<D> lanes, const Vec3V<V>& from, Vec3V<V>& to) {
  to = {hn::IfThenElse(lanes, from.x, to.x), hn::IfThenElse(lanes, from.y, to.y), hn::IfThenElse(lanes, from.z, to.z)};
}

// −0 becomes +0: the sign of a sum of zeros can depend on how lanes were grouped.
Vec3V<V> without_negative_zeros(Vec3V<V> v) { return v + zero3(); }

struct Motion : Flight<Vec3V<V>> {
  Vec3V<V> position;
  QuatV<V> rotation;
};
using Forces = FlightForces<Vec3V<V>>;

/// Vectors in lanes as arrays, for work lane by lane.
struct LaneVectors {
  HWY_ALIGN float at[3][width];

  explicit LaneVectors(Vec3V<V> v) {
    hn::Store(v.x, D(), at[0]), hn::Store(v.y, D(), at[1]), hn::Store(v.z, D(), at[2]);
  }
  Vec3V<V> lanes() const { return {hn::Load(D(), at[0]), hn::Load(D(), at[1]), hn::Load(D(), at[2])}; }
  Vec3 operator[](std::size_t i) const { return {at[0][i], at[1][i], at[2][i]}; }
  void set(std::size_t i, Vec3 v) { at[0][i] = v.x, at[1][i] = v.y, at[2][i] = v.z; }
};

/// Calls act(lane, slot) for lanes with a force from the application; returns whether there are any.
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

/// Acceleration of lanes with a force; the others have gravity only.
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

/// Forces on bodies without contacts, which are all dynamic.
Forces forces_on(const Lanes& lanes, const BodyTable& bodies, const BodyState& state, const MoveParameters& p) {
  const QuadV<V> flight = lanes.load(state.flight.data(), 0);
  const V h = set(p.dt / static_cast<float>(p.substeps));
  Forces f{scale(flight.x, set(p.gravity)), zero3(), damping_factor(flight.y, h), damping_factor(flight.z, h)};
  add_forces(lanes, bodies, state, p, f.acceleration, f.angular_acceleration);
  return f;
}

/// Lanes whose contacts did not touch moved freely, but the solver rounded their velocity in every substep: they get a
/// free body's velocity, without that rounding. All others have no residual.
void fly_on(const Lanes& lanes, BodyState& state, const MoveParameters& p, const Motion& before, Motion& m) {
  const D d;
  const QuadV<V> motion = lanes.load(state.motion.data(), 0);  // acceleration and linear damping
  Motion flown = before;
  accelerate(flown.linear, flown.residual, mul_add(before.residual, set(p.dt), motion.xyz()));
  auto free = hn::And(hn::Eq(motion.w, set(1.0f)),
                      may_have_flown(before.linear, m.linear, flown.linear, static_cast<float>(p.substeps)));
  m.residual = zero3();
  if (hn::AllFalse(d, free)) return;
  // As `has_flown`.
  const Vec3V<V> given = lanes.load(state.warm.data(), 0).xyz(), reference = lanes.load(state.warm.data(), 2).xyz();
  const auto none = [&](V w, V after, V start) { return hn::And(hn::Eq(w, hn::Zero(d)), hn::Eq(after, start)); };
  free = hn::And(free, none(given.x, m.linear.x, reference.x));
  free = hn::And(free, none(given.y, m.linear.y, reference.y));
  free = hn::And(free, none(given.z, m.linear.z, reference.z));
  take(free, flown.linear, m.linear);
  take(free, flown.residual, m.residual);
}

/// Rotations in lanes as arrays.
struct LaneRotations {
  HWY_ALIGN float at[4][width];

  explicit LaneRotations(const QuatV<V>& q) {
    hn::Store(q.w, D(), at[0]), hn::Store(q.x, D(), at[1]), hn::Store(q.y, D(), at[2]), hn::Store(q.z, D(), at[3]);
  }
  QuatV<V> lanes() const {
    return {hn::Load(D(), at[0]), hn::Load(D(), at[1]), hn::Load(D(), at[2]), hn::Load(D(), at[3])};
  }
  void set(std::size_t i, const Quat& q) { at[0][i] = q.w, at[1][i] = q.x, at[2][i] = q.y, at[3][i] = q.z; }
};

/// Rotations and spins (rad/s) of lanes.
struct LaneSpins {
  LaneRotations rotation;
  LaneVectors angular;
};

/// Where all substeps take the bodies of these lanes, which nothing touches; null in lanes of other bodies.
LaneSpins spun_freely(const std::array<const BodyInfo*, width>& bodies, const MoveParameters& p, const Motion& before,
                      const Forces& forces) {
  LaneSpins spun{LaneRotations(before.rotation), LaneVectors(before.angular)};
  const LaneVectors acceleration(forces.angular_acceleration);
  HWY_ALIGN float damping[width];
  hn::Store(forces.angular_damping, D(), damping);
  constexpr std::size_t at_once = std::min(width, spin_lanes);
  for (std::size_t first = 0; first < width; first += at_once) {
    FreeSpins spins{};
    const auto get = [&](const float(&from)[width], Eight& to) { std::memcpy(&to, from + first, 4 * at_once); };
    const auto put = [&](const Eight& from, float(&to)[width]) { std::memcpy(to + first, &from, 4 * at_once); };
    std::copy_n(bodies.begin() + first, at_once, spins.bodies.begin());
    for (std::size_t k = 0; k < 4; ++k) get(spun.rotation.at[k], spins.rotation[k]);
    for (std::size_t k = 0; k < 3; ++k) get(spun.angular.at[k], spins.angular[k]);
    for (std::size_t k = 0; k < 3; ++k) get(acceleration.at[k], spins.acceleration[k]);
    get(damping, spins.damping);
    spin_freely(spins, p.dt / static_cast<float>(p.substeps), p.substeps, p.limits.angular);
    for (std::size_t k = 0; k < 4; ++k) put(spins.rotation[k], spun.rotation.at[k]);
    for (std::size_t k = 0; k < 3; ++k) put(spins.angular[k], spun.angular.at[k]);
  }
  return spun;
}

/// Turns anisotropic bodies through all substeps. The solver has already turned those in contact (no `forces`).
void turn_anisotropic(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p,
                      const Motion& before, const Forces* forces, Motion& m) {
  std::array<const BodyInfo*, width> turning{};
  HWY_ALIGN float turns[width] = {};
  for (std::size_t i = 0; i < lanes.used; ++i) {
    const BodyInfo& info = bodies[lanes.item(i)];
    if (info.isotropic || state.flags[lanes.item(i)] & isolated) continue;
    turning[i] = &info, turns[i] = 1;
  }
  const D d;
  const auto is_turned = hn::Gt(hn::Load(d, turns), hn::Zero(d));
  if (hn::AllFalse(d, is_turned)) return;
  LaneSpins spun{LaneRotations(m.rotation), LaneVectors(m.angular)};
  if (forces) {
    spun = spun_freely(turning, p, before, *forces);
  } else {
    for (std::size_t i = 0; i < lanes.used; ++i) {
      if (!turning[i]) continue;
      const Quat start = state.poses[lanes.item(i)].rotation, now = state.inertia[lanes.item(i)].rotation;
      spun.rotation.set(i, now);
      spun.angular.set(i, rotate(now, inverse_rotate(start, spun.angular[i])));
    }
  }
  const QuatV<V> q = spun.rotation.lanes();
  m.rotation = {hn::IfThenElse(is_turned, q.w, m.rotation.w), hn::IfThenElse(is_turned, q.x, m.rotation.x),
                hn::IfThenElse(is_turned, q.y, m.rotation.y), hn::IfThenElse(is_turned, q.z, m.rotation.z)};
  take(is_turned, limited(spun.angular.lanes(), set(p.limits.angular)), m.angular);
}

/// `fathom::complete_forced` for lanes with forces. Anisotropic bodies turn separately: `turn` gets their remaining
/// rotation. `forces`: those of bodies without contacts, otherwise null.
bool complete_forced(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p,
                     const Motion& before, const Forces* forces, Motion& m, Vec3V<V>& turn) {
  const LaneVectors v0(before.linear), w0(before.angular), v(m.linear), w(m.angular);
  const LaneVectors linear(forces ? forces->acceleration : zero3()),
      angular(forces ? forces->angular_acceleration : zero3());
  LaneVectors moved(m.moved), turned(m.turned), left(zero3());
  const bool any = for_each_forced(lanes, state, p, [&](std::size_t i, std::uint32_t slot) {
    Acceleration a{linear[i], angular[i]};
    bool is_parabola = true;
    if (!forces) {
      const BodyMotion& motion = state.motion[slot];
      a = {motion.acceleration, motion.angular_acceleration};
      is_parabola = has_flown(state.warm[slot], state.solver_bodies()[slot].linear);
    }
    LaneVectors& turned_by = bodies[slot].isotropic ? turned : left;
    Vec3 way = moved[i], turning = turned_by[i];
    fathom::complete_forced(way, turning, state.forces[slot], a, v0[i], v[i], w0[i], w[i], is_parabola, p.dt,
                            static_cast<float>(p.substeps));
    moved.set(i, way);
    turned_by.set(i, turning);
  });
  if (!any) return false;
  m.moved = moved.lanes();
  m.turned = turned.lanes();
  turn = left.lanes();
  return true;
}

/// `motion_box` of lanes that are not boxes.
void bound_others(const Lanes& lanes, const BodyTable& bodies, const BodyState& state, const MoveParameters& p,
                  Vec3V<V>& lower, Vec3V<V>& upper) {
  const D d;
  HWY_ALIGN float corners[6][width];
  hn::Store(lower.x, d, corners[0]), hn::Store(lower.y, d, corners[1]), hn::Store(lower.z, d, corners[2]);
  hn::Store(upper.x, d, corners[3]), hn::Store(upper.y, d, corners[4]), hn::Store(upper.z, d, corners[5]);
  for (std::size_t i = 0; i < lanes.used; ++i) {
    const std::uint32_t slot = lanes.item(i);
    if (state.bounds[slot].is_box()) continue;
    const BodyInfo& info = bodies[slot];
    const Aabb tight = quick_bounds(info.geometry, state.poses[slot]);
    const Aabb box = fathom::motion_box(tight, info.radius, state.velocities[slot], p.dt);
    for (int axis = 0; axis < 3; ++axis) corners[axis][i] = box.lower[axis], corners[3 + axis][i] = box.upper[axis];
  }
  lower = {hn::Load(d, corners[0]), hn::Load(d, corners[1]), hn::Load(d, corners[2])};
  upper = {hn::Load(d, corners[3]), hn::Load(d, corners[4]), hn::Load(d, corners[5])};
}

// BodyBounds are read and written in quads.
static_assert(offsetof(BodyBounds, fat_box) == 24 && offsetof(BodyBounds, half_extents) == 48);

/// How far (m) bodies may leave their initial line of motion: as far beside it as pairs were searched. Zero for jointed
/// bodies: a joint may pull them through others in contact.
V allowed_aside(const Lanes& lanes, V radius, const BodyState& state, const MoveParameters& p) {
  const D d;
  const V beside = hn::Add(half_speculative_margin(radius, p.dt), set(fall_within(p.dt)));
  if (!p.jointed) return beside;
  HWY_ALIGN float allowed[width];
  hn::Store(beside, d, allowed);
  for (std::size_t i = 0; i < lanes.used; ++i)
    if (state.flags[lanes.item(i)] & jointed) allowed[i] = 0;
  return hn::Load(d, allowed);
}

/// Lists bodies that have left their initial line of motion by more than is allowed, and by a good part of their
/// thickness.
void note_strays(const Lanes& lanes, V radius, const BodyTable& bodies, const BodyState& state, const MoveParameters& p,
                 const Motion& before, const Motion& m) {
  const D d;
  const Vec3V<V> aside = aside_of(m.position - before.position, scale(set(p.dt), before.linear));
  const V allowed = allowed_aside(lanes, radius, state, p);
  const V squared = dot(aside, aside);
  const auto is_far = hn::Gt(squared, hn::Mul(allowed, allowed));
  if (HWY_LIKELY(hn::AllFalse(d, is_far))) return;
  HWY_ALIGN float far[width], q[4][width];
  hn::Store(hn::IfThenElseZero(is_far, squared), d, far);
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

/// Updates the boxes for the lanes' new motion; a fat box only if the body has left the old one.
template <bool in_contact>
void update_boxes(const Lanes& lanes, const BodyTable& bodies, BodyState& state, const MoveParameters& p,
                  const Motion& before, const Motion& m) {
  const D d;
  BodyBounds* const bounds = state.bounds.data();
  const QuadV<V> second = lanes.load(bounds, 1), third = lanes.load(bounds, 2), shape = lanes.load(bounds, 3);
  const V radius = shape.w;
  if (p.strays && (in_contact || p.forced)) note_strays(lanes, radius, bodies, state, p, before, m);
  const Mat3V<V> r = to_matrix(d, m.rotation.w, m.rotation.x, m.rotation.y, m.rotation.z);
  const auto extent = [&](V x, V y, V z) {
    return hn::MulAdd(hn::Abs(x), shape.x, hn::MulAdd(hn::Abs(y), shape.y, hn::Mul(hn::Abs(z), shape.z)));
  };
  // The same box as `motion_box`, for boxes.
  const V margin = reach_beyond_box(m.angular, radius, p.dt);
  const Vec3V<V> reach{hn::Add(extent(r.x.x, r.y.x, r.z.x), margin), hn::Add(extent(r.x.y, r.y.y, r.z.y), margin),
                       hn::Add(extent(r.x.z, r.y.z, r.z.z), margin)};
  const BoxOf<Vec3V<V>> swept_box =
      swept(BoxOf<Vec3V<V>>{m.position - reach, m.position + reach}, scale(set(p.dt), m.linear));
  Vec3V<V> lower = swept_box.lower, upper = swept_box.upper;
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

  const BoxOf<Vec3V<V>> fat = fat_box(radius, BoxOf<Vec3V<V>>{lower, upper}, m.linear, p.dt);
  Vec3V<V> to_lower = fat_lower, to_upper = fat_upper;
  take(left, fat.lower, to_lower);
  take(left, fat.upper, to_upper);
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

/// m per step. Substeps at the limit add up to slightly more than a step at the limit.
float max_moved(const MoveParameters& p) { return 1.01f * p.dt * p.limits.linear; }

/// Whether all lanes are finite and within the limits.
bool is_ordinary(const Motion& m, const MoveParameters& p) {
  const auto within = [](Vec3V<V> v, float most) { return hn::Le(dot(v, v), set(std::min(most * most, 3e38f))); };
  return hn::AllTrue(D(), hn::And(hn::And(within(m.linear, p.limits.linear), within(m.angular, p.limits.angular)),
                                  hn::And(within(m.moved, max_moved(p)), within(m.turned, 1e18f))));
}

/// For lanes that are not ordinary: clamps velocities and movements to the limits. Lanes with a state that is not
/// finite stay in place, at rest, and get the flag `isolated`; returns how many.
HWY_NOINLINE std::size_t restrain(const Lanes& lanes, BodyState& state, const MoveParameters& p, Motion& m,
                                  Vec3V<V>& turn_left) {
  const D d;
  // One sum detects any NaN or infinity among the terms.
  const auto sum = [](Vec3V<V> v) { return hn::Add(hn::Abs(v.x), hn::Add(hn::Abs(v.y), hn::Abs(v.z))); };
  const V scaled =
      hn::Mul(set(1e-3f), hn::Add(hn::Add(sum(m.linear), sum(m.angular)), hn::Add(sum(m.moved), sum(m.turned))));
  const auto finite = hn::Eq(hn::Sub(scaled, scaled), hn::Zero(d));
  // The residual of a velocity beyond the limits has no bound.
  const auto keeps_residual = hn::Le(dot(m.linear, m.linear), set(p.limits.linear * p.limits.linear));
  const auto kept = [](hn::Mask<D> where, Vec3V<V> v) {
    return Vec3V<V>{hn::IfThenElseZero(where, v.x), hn::IfThenElseZero(where, v.y), hn::IfThenElseZero(where, v.z)};
  };
  m.linear = kept(finite, limited(m.linear, set(p.limits.linear)));
  m.angular = kept(finite, limited(m.angular, set(p.limits.angular)));
  // Not for lanes that `is_ordinary` accepts, or the result would depend on which bodies share a vector.
  const auto too_far = hn::Gt(dot(m.moved, m.moved), set(std::min(max_moved(p) * max_moved(p), 3e38f)));
  take(too_far, limited(m.moved, set(p.dt * p.limits.linear)), m.moved);
  m.moved = kept(finite, m.moved);
  m.turned = kept(finite, m.turned);
  turn_left = kept(finite, turn_left);
  m.residual = kept(hn::And(finite, keeps_residual), m.residual);
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

/// Skips lanes with no rotation left: rounding would turn them, and results would depend on which bodies share a
/// vector.
void turn_further(Vec3V<V> turn, Motion& m) {
  const auto turns = hn::Gt(dot(turn, turn), hn::Zero(D()));
  const QuatV<V> q = turned(m.rotation, turn);
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
  before.residual = {linear.w, angular.w, position.w};
  m = before;
  Forces forces;
  if constexpr (in_contact) {
    const SolverBody* solver = state.solver_bodies();
    m.linear = lanes.load(solver, 0).xyz();
    m.angular = lanes.load(solver, 1).xyz();
    m.moved = lanes.load(solver, 2).xyz();
    m.turned = lanes.load(solver, 3).xyz();
    fly_on(lanes, state, p, before, m);
  } else {
    forces = forces_on(lanes, bodies, state, p);
    fly(m, forces, p.dt, p.substeps, p.limits.angular);
  }
  const Forces* const free_forces = in_contact ? nullptr : &forces;
  Vec3V<V> turn_left = zero3();
  const bool forced = p.forced && complete_forced(lanes, bodies, state, p, before, free_forces, m, turn_left);
  std::size_t failed = 0;
  if (HWY_UNLIKELY(!is_ordinary(m, p))) {
    Motion restrained = m;
    failed = restrain(lanes, state, p, restrained, turn_left);
    m = restrained;
  }
  m.position = m.position + m.moved;
  m.rotation = turned(m.rotation, m.turned);
  if (bodies.any_anisotropic()) turn_anisotropic(lanes, bodies, state, p, before, free_forces, m);
  if (forced) turn_further(turn_left, m);
  m.residual = without_negative_zeros(m.residual);
  m.linear = without_negative_zeros(m.linear);
  m.angular = without_negative_zeros(m.angular);
  m.position = without_negative_zeros(m.position);
  lanes.store(state.poses.data(), 0, {m.position.x, m.position.y, m.position.z, m.residual.z});
  lanes.store(state.poses.data(), 1, {m.rotation.w, m.rotation.x, m.rotation.y, m.rotation.z});
  lanes.store(state.velocities.data(), 0, {m.linear.x, m.linear.y, m.linear.z, m.residual.x});
  lanes.store(state.velocities.data(), 1, {m.angular.x, m.angular.y, m.angular.z, m.residual.y});
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
