// Contact constraints in vector lanes. One manifold is one lane; a colour's lanes share no body.
//
// A manifold's points share one normal, so their rows are written about one reference point c, the centroid of
// the points, in the frame (t1, t2, n): with u the relative velocity of the bodies at c and ω the relative
// angular velocity, a point at (x, y) in that frame approaches with
//     vn = u·n + y (ω·t1) − x (ω·t2),
// two floats a point instead of two anchors. Point impulses act on the three numbers (u·n, ω·t1, ω·t2) through
// a symmetric 3×3 matrix K, and only their sum (P along n, torques T1, T2) is applied to the bodies. The same
// rows applied to the bodies' movement since the step began give the separation in later substeps
// (first order in the rotation of one step; for a sphere exact, since its contact stays under the centre).
//
// Order within a sweep (Box2D v3, Box3D `contact_solver.c`): the soft sweep solves penetration alone; the relax
// sweep first friction, one 2-vector in a cone and one twist about n, then the points without bias.
//
// Lanes are independent and each goes through the same operations whatever the width, so results do not
// depend on the instruction set. Where a block skips work that would add zero to all its lanes, only the sign of
// a zero can differ, and states are published without negative zeros.

#define HWY_DISABLE_PCLMUL_AES
// Vectors of a length known at compile time alone: no SVE.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "native/solver_kernels.cpp"
#include "native/solver_kernels.hpp"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "dynamics/support.hpp"
#include "native/ball_joints-inl.hpp"
#include "native/constraint_block-inl.hpp"
#include "native/generic_joints-inl.hpp"
#include "native/lane_bodies-inl.hpp"
#include "native/prefetch.hpp"
#include "native/prepare-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

/// Accumulates the points' impulses of one sweep and carries their effect on the relative motion.
template <class D>
struct NormalRows {
  using V = hn::Vec<D>;
  V nn, n1, n2, k11, k12, k22;
  Twist3<V> motion, sum;

  HWY_INLINE NormalRows(const Block<D>& block, const Twist3<V>& velocity) : motion(velocity) {
    nn = block.get(k_nn), n1 = block.get(k_n1), n2 = block.get(k_n2);
    k11 = block.get(k_11), k12 = block.get(k_12), k22 = block.get(k_22);
    sum.n = sum.t1 = sum.t2 = hn::Zero(D());
  }
  HWY_INLINE void add(V impulse, V x, V y) {
    const V torque_1 = hn::Mul(y, impulse), torque_2 = hn::Neg(hn::Mul(x, impulse));
    sum.n = hn::Add(sum.n, impulse);
    sum.t1 = hn::Add(sum.t1, torque_1);
    sum.t2 = hn::Add(sum.t2, torque_2);
    motion.n = hn::MulAdd(n2, torque_2, hn::MulAdd(n1, torque_1, hn::MulAdd(nn, impulse, motion.n)));
    motion.t1 = hn::MulAdd(k12, torque_2, hn::MulAdd(k11, torque_1, hn::MulAdd(n1, impulse, motion.t1)));
    motion.t2 = hn::MulAdd(k22, torque_2, hn::MulAdd(k12, torque_1, hn::MulAdd(n2, impulse, motion.t2)));
  }
};

template <class B, class V>
HWY_INLINE void push_normal(B& bodies, const Frame<V>& f, const Twist3<V>& sum) {
  const Vec3V<V> torque = mul_add(scale(sum.t1, f.t1), sum.t2, f.t2);
  bodies.push(scale(sum.n, f.n), mul_add(torque, sum.n, f.lever_a), mul_add(torque, sum.n, f.lever_b));
}

template <class B, class V>
HWY_INLINE void push_tangential(B& bodies, const Frame<V>& f, V impulse_1, V impulse_2, V twist) {
  const Vec3V<V> impulse = mul_add(scale(impulse_1, f.t1), impulse_2, f.t2);
  const Vec3V<V> torque = scale(twist, f.n);
  bodies.push(impulse, torque + cross(f.arm_a, impulse), torque + cross(f.arm_b, impulse));
}

template <class D>
HWY_INLINE hn::Vec<D> total_impulse(const Block<D>& block, int count) {
  auto sum = block.get(Block<D>::point(0, point_impulse));
  for (int p = 1; p < count; ++p) sum = hn::Add(sum, block.get(Block<D>::point(p, point_impulse)));
  return sum;
}

template <class V>
struct FrictionImpulses {
  V slide_1, slide_2, twist;
};

/// What `fathom::carried_arm` adds to the speed of an arm of bodies that move as they are told. Apart from the rest, so
/// that blocks without them pay nothing.
template <class D, class V = hn::Vec<D>>
HWY_NOINLINE Vec3V<V> carried_speed(Vec3V<V> arm, Vec3V<V> turned, Vec3V<V> angular, float lead) {
  const Vec3V<V> ahead = mul_add(turned, hn::Set(D(), lead), angular), along = cross(ahead, arm);
  return cross(angular, mul_add(along, hn::Set(D(), 0.5f), cross(ahead, along)));
}

/// Twist about the normal, then sliding, both limited by µ times `load`, the points' impulses (Coulomb's cone); returns
/// `old` brought up to date. `lead` (s): see `friction_lead`.
template <class D, class B, class V = hn::Vec<D>>
HWY_INLINE FrictionImpulses<V> solve_friction(const Block<D>& block, const Frame<V>& f, B& bodies, V load,
                                              const FrictionImpulses<V>& old, float lead) {
  const D d;
  const V limit = hn::Mul(block.get(friction), load);

  const V twist_limit = hn::Mul(limit, block.get(patch_radius));
  const V twist_speed = dot(f.n, bodies.b.angular - bodies.a.angular);
  const V wanted_twist = hn::NegMulAdd(block.get(twist_mass), twist_speed, old.twist);
  const V new_twist = hn::Max(hn::Neg(twist_limit), hn::Min(wanted_twist, twist_limit));
  const V twist = hn::Sub(new_twist, old.twist);
  // The twist's own effect on sliding at c, where c is not above a centre, is left to the next sweep's slide
  // only through the bodies' velocities, which are updated first.
  bodies.twist(scale(twist, f.n));

  Vec3V<V> slide =
      (bodies.b.linear + cross(bodies.b.angular, f.arm_b)) - (bodies.a.linear + cross(bodies.a.angular, f.arm_a));
  if (B::only_pushes_b && HWY_UNLIKELY(!block.header().still_a))
    slide = slide - carried_speed<D>(f.arm_a, bodies.a.turned, bodies.a.angular, lead);
  const V v1 = dot(f.t1, slide), v2 = dot(f.t2, slide);
  const V m11 = block.get(slide_11), m12 = block.get(slide_12), m22 = block.get(slide_22);
  const V wanted_1 = hn::Sub(old.slide_1, hn::MulAdd(m11, v1, hn::Mul(m12, v2)));
  const V wanted_2 = hn::Sub(old.slide_2, hn::MulAdd(m12, v1, hn::Mul(m22, v2)));
  const V size_squared = hn::MulAdd(wanted_1, wanted_1, hn::Mul(wanted_2, wanted_2));
  const auto slips = hn::Gt(size_squared, hn::Mul(limit, limit));
  const V size = hn::Sqrt(hn::Max(size_squared, hn::Set(d, 1e-30f)));
  const V shrink = hn::IfThenElse(slips, hn::Div(limit, size), hn::Set(d, 1.0f));
  const V new_1 = hn::Mul(wanted_1, shrink), new_2 = hn::Mul(wanted_2, shrink);
  push_tangential(bodies, f, hn::Sub(new_1, old.slide_1), hn::Sub(new_2, old.slide_2), hn::Zero(d));
  return {new_1, new_2, new_twist};
}

/// The same of a sweep, with the impulses accumulated in the block. Returns their sum, which tells whether all are
/// finite.
template <class D, class B>
HWY_INLINE hn::Vec<D> solve_friction(const Block<D>& block, const Frame<hn::Vec<D>>& f, B& bodies, float lead) {
  const FrictionImpulses<hn::Vec<D>> old{block.get(friction_impulse_1), block.get(friction_impulse_2),
                                         block.get(twist_impulse)};
  const auto now = solve_friction(block, f, bodies, total_impulse(block, block.header().max_points), old, lead);
  block.set(friction_impulse_1, now.slide_1);
  block.set(friction_impulse_2, now.slide_2);
  block.set(twist_impulse, now.twist);
  return hn::Add(now.twist, hn::Add(now.slide_1, now.slide_2));
}

enum class Pass { soft, relax, iterate };

/// `fathom::is_uneven` in lanes.
template <class V>
HWY_INLINE auto is_uneven(V inverse_mass_a, V inverse_mass_b) {
  const hn::DFromV<V> d;
  const V least = hn::Min(inverse_mass_a, inverse_mass_b), most = hn::Max(inverse_mass_a, inverse_mass_b);
  return hn::And(hn::Gt(least, hn::Zero(d)), hn::Gt(most, hn::Mul(hn::Set(d, uneven_ratio), least)));
}

/// Separations beyond the slop of lanes that are held.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V beyond_slop(const Block<D>& block, V separation) {
  const D d;
  const V slop =
      hn::Min(hn::Set(d, most_support_slop), hn::Mul(hn::Set(d, patch_radius_slop), block.get(patch_radius)));
  const V within = hn::Max(hn::Neg(slop), hn::Min(separation, slop));
  return hn::IfThenElse(hn::Gt(block.get(held_part), hn::Zero(d)), hn::Sub(separation, within), separation);
}

/// `fathom::stiffened` in lanes.
template <class V>
HWY_INLINE void stiffen(V held, V& bias_rate, V& mass_scale, V& impulse_scale) {
  const hn::DFromV<V> d;
  const V one = hn::Set(d, 1.0f), soft = hn::Sub(one, held), rate = hn::Set(d, support_push_out_rate);
  const auto is_held = hn::Gt(held, hn::Zero(d));
  bias_rate = hn::IfThenElse(is_held, hn::MulAdd(soft, hn::Sub(bias_rate, rate), rate), bias_rate);
  mass_scale = hn::IfThenElse(is_held, hn::MulAdd(soft, hn::Sub(mass_scale, one), one), mass_scale);
  impulse_scale = hn::IfThenElse(is_held, hn::Mul(soft, impulse_scale), impulse_scale);
}

/// One sweep over the points: soft with bias and push-out, relax without, or `iterate` with a plain velocity bias.
/// Returns the bodies' approach afterwards, which is finite only if their velocities were and the impulses are.
template <Pass pass, bool held, class D, class B>
HWY_INLINE hn::Vec<D> solve_points(const Block<D>& block, const Frame<hn::Vec<D>>& f, B& bodies,
                                   const SweepParameters& p, const Softness& softness) {
  using V = hn::Vec<D>;
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const V inverse_substep = hn::Set(d, p.inverse_substep);
  const V push_out = hn::Set(d, -p.push_out_velocity);
  V bias_rate = hn::Set(d, softness.bias_rate), mass_scale = hn::Set(d, softness.mass_scale);
  V impulse_scale = hn::Set(d, softness.impulse_scale);
  if constexpr (pass == Pass::soft) {
    if constexpr (held) stiffen(block.get(held_part), bias_rate, mass_scale, impulse_scale);
    const auto uneven = is_uneven(bodies.a.inverse_mass, bodies.b.inverse_mass);
    impulse_scale = hn::IfThenElse(uneven, hn::Mul(hn::Set(d, uneven_share), impulse_scale), impulse_scale);
  }

  NormalRows<D> rows(block, normal_motion(f, bodies.a.linear, bodies.a.angular, bodies.b.linear, bodies.b.angular));
  const Twist3<V> moved = normal_motion(f, bodies.a.moved, bodies.a.turned, bodies.b.moved, bodies.b.turned);
  const int count = block.header().max_points;
  for (int i = 0; i < count; ++i) {
    const V x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
    const V mass = block.get(Block<D>::point(i, point_mass)), old = block.get(Block<D>::point(i, point_impulse));
    V separation = hn::Add(block.get(Block<D>::point(i, point_separation)), at_point(moved, x, y));
    if constexpr (held) separation = beyond_slop(block, separation);
    const V speed = at_point(rows.motion, x, y);
    const auto apart = hn::Gt(separation, zero);
    // A point still apart may close its gap within the substep and no more: a speculative contact.
    const V gap_speed = hn::Mul(separation, inverse_substep);
    V wanted;
    if constexpr (pass == Pass::soft) {
      const V bias = hn::IfThenElse(apart, gap_speed, hn::Max(hn::Mul(bias_rate, separation), push_out));
      const V scaled = hn::Mul(mass, hn::IfThenElse(apart, one, mass_scale));
      const V kept = hn::NegMulAdd(hn::IfThenZeroElse(apart, impulse_scale), old, old);
      wanted = hn::NegMulAdd(scaled, hn::Add(speed, bias), kept);
    } else if constexpr (pass == Pass::relax) {
      wanted = hn::NegMulAdd(mass, hn::Add(speed, hn::IfThenElseZero(apart, gap_speed)), old);
    } else {
      const V bias = hn::IfThenElse(apart, gap_speed, hn::Max(hn::Mul(bias_rate, separation), push_out));
      wanted = hn::NegMulAdd(mass, hn::Add(speed, bias), old);
    }
    V impulse = hn::Max(wanted, zero);
    if (block.header().restitution) {
      // What will bounce keeps its speed until it is there: relaxing must not brake it in the air.
      if constexpr (pass == Pass::relax) {
        const auto in_the_air = hn::And(apart, hn::Gt(block.get(restitution), zero));
        impulse = hn::IfThenElse(in_the_air, hn::Min(impulse, old), impulse);
      }
    }
    block.set(Block<D>::point(i, point_impulse), impulse);
    rows.add(hn::Sub(impulse, old), x, y);
  }
  push_normal(bodies, f, rows.sum);
  return rows.motion.n;
}

/// Of lanes whose bit is not set.
template <class D>
HWY_NOINLINE void forget_impulses(Block<D> block, const std::uint8_t* bits) {
  for (std::size_t i = 0; i < hn::MaxLanes(D()); ++i) {
    if (bits[i / 8] >> i % 8 & 1) continue;
    for (int p = 0; p < max_manifold_points; ++p) block.at(Block<D>::point(p, point_impulse))[i] = 0;
    for (const int field : {friction_impulse_1, friction_impulse_2, twist_impulse, step_impulse})
      block.at(field)[i] = 0;
  }
}

template <class D, class B>
HWY_INLINE void store_contact_bodies(const Block<D>& block, B& bodies, hn::Vec<D> sums) {
  store_bodies(block, bodies, sums, [&](const std::uint8_t* finite) HWY_ATTR { forget_impulses(block, finite); });
}

template <Pass pass, class D, bool fixed_a, bool isotropic, bool held = false>
HWY_INLINE void sweep_block(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  Bodies<D, fixed_a, isotropic> bodies;
  Frame<hn::Vec<D>> frame;
  bodies.load(block, all);
  frame.load(block);
  auto sums = hn::Zero(D());
  if constexpr (pass == Pass::iterate) sums = solve_friction(block, frame, bodies, p.friction_lead);
  const auto approach =
      solve_points<pass, held>(block, frame, bodies, p, fixed_a ? p.contacts.fixed : p.contacts.dynamic);
  sums = pass == Pass::soft ? approach : hn::Add(sums, approach);
  if constexpr (pass == Pass::relax) sums = hn::Add(sums, solve_friction(block, frame, bodies, p.friction_lead));
  if (pass == Pass::relax || p.ends_substep)
    block.set(step_impulse, hn::Add(block.get(step_impulse), total_impulse(block, block.header().max_points)));
  store_contact_bodies(block, bodies, sums);
}

/// `fathom::solve_rolling` in lanes; `warm` applies the impulses of the last step. Apart from the sweeps, because few
/// blocks have it.
template <bool warm, class D, bool fixed_a, bool isotropic>
HWY_INLINE void roll_block(const Block<D>& block, SolverBody* all) {
  using V = hn::Vec<D>;
  const D d;
  Bodies<D, fixed_a, isotropic> bodies;
  bodies.load(block, all);
  const Vec3V<V> old = block.get3(roll_x);
  if constexpr (warm) {
    bodies.twist(old);
  } else {
    const V limit = hn::Mul(block.get(roll_length), total_impulse(block, block.header().max_points));
    const Vec3V<V> spin = bodies.b.angular - bodies.a.angular;
    const V response = dot(spin, bodies.turn(spin));
    const auto turns = hn::Gt(response, hn::Zero(d));
    const V mass =
        hn::IfThenElseZero(turns, hn::Div(dot(spin, spin), hn::IfThenElse(turns, response, hn::Set(d, 1.0f))));
    const Vec3V<V> wanted = mul_sub(old, mass, spin);
    const V squared = dot(wanted, wanted), size = hn::Sqrt(hn::Max(squared, hn::Set(d, 1e-30f)));
    const auto rolls = hn::Gt(squared, hn::Mul(limit, limit));
    const Vec3V<V> now = scale(hn::IfThenElse(rolls, hn::Div(limit, size), hn::Set(d, 1.0f)), wanted);
    bodies.twist(now - old);
    const V sum = hn::Add(hn::Add(now.x, now.y), now.z);
    const auto ok = hn::Eq(hn::Sub(sum, sum), hn::Zero(d));
    block.set3(roll_x, {hn::IfThenElseZero(ok, now.x), hn::IfThenElseZero(ok, now.y), hn::IfThenElseZero(ok, now.z)});
    return store_contact_bodies(block, bodies, sum);
  }
  bodies.store(block.header().lanes);
}

/// Impulses of the last step act again at once (Catto, "Iterative Dynamics with Temporal Coherence", 2005).
template <class D, bool fixed_a, bool isotropic>
HWY_INLINE void warm_start_block(const Block<D>& block, SolverBody* all) {
  using V = hn::Vec<D>;
  Bodies<D, fixed_a, isotropic> bodies;
  Frame<V> f;
  bodies.load(block, all);
  f.load(block);
  Twist3<V> sum{hn::Zero(D()), hn::Zero(D()), hn::Zero(D())};
  for (int i = 0; i < block.header().max_points; ++i) {
    const V impulse = block.get(Block<D>::point(i, point_impulse));
    sum.n = hn::Add(sum.n, impulse);
    sum.t1 = hn::MulAdd(block.get(Block<D>::point(i, point_y)), impulse, sum.t1);
    sum.t2 = hn::NegMulAdd(block.get(Block<D>::point(i, point_x)), impulse, sum.t2);
  }
  push_normal(bodies, f, sum);
  push_tangential(bodies, f, block.get(friction_impulse_1), block.get(friction_impulse_2), block.get(twist_impulse));
  bodies.store(block.header().lanes);
}

/// `fathom::leaving_speed` in lanes.
template <class V>
HWY_INLINE V leaving_speed(V speed, V separation, V e, V pull, V h, V threshold) {
  const hn::DFromV<V> d;
  const V zero = hn::Zero(d), no = hn::Set(d, -1.0f);
  const auto meets = hn::Le(hn::MulAdd(hn::MulAdd(pull, h, speed), h, separation), zero);
  const V gap = hn::Max(separation, zero);
  const V squared = hn::MulAdd(hn::Mul(hn::Set(d, -2.0f), pull), gap, hn::Mul(speed, speed));
  const V meeting = hn::IfThenElse(hn::Lt(speed, zero), hn::Neg(hn::Sqrt(hn::Max(squared, zero))), speed);
  const V e_meeting = hn::Mul(e, meeting);
  const V left = hn::MulAdd(hn::Mul(hn::Set(d, 2.0f), pull), gap, hn::Mul(e_meeting, e_meeting));
  return hn::IfThenElse(hn::And(meets, hn::Lt(meeting, hn::Neg(threshold))), hn::Sqrt(hn::Max(left, zero)), no);
}

/// `fathom::strike_contact` in lanes.
template <class D, bool fixed_a, bool isotropic>
HWY_INLINE void strike_block(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  using V = hn::Vec<D>;
  const D d;
  Bodies<D, fixed_a, isotropic> bodies;
  Frame<V> f;
  bodies.load(block, all);
  f.load(block);
  NormalRows<D> rows(block, normal_motion(f, bodies.a.linear, bodies.a.angular, bodies.b.linear, bodies.b.angular));
  const Twist3<V> moved = normal_motion(f, bodies.a.moved, bodies.a.turned, bodies.b.moved, bodies.b.turned);
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), e = block.get(restitution), pulled = block.get(pull);
  const V h = hn::Set(d, p.substep), threshold = hn::Set(d, p.restitution_threshold);
  const int count = block.header().max_points;
  V leaving[max_manifold_points], hit[max_manifold_points];
  V struck = zero;
  for (int i = 0; i < count; ++i) {
    const V x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
    const V separation = hn::Add(block.get(Block<D>::point(i, point_separation)), at_point(moved, x, y));
    const auto strikes = hn::And(hn::Gt(e, zero), hn::Gt(block.get(Block<D>::point(i, point_mass)), zero));
    leaving[i] = hn::IfThenElse(
        strikes, leaving_speed(at_point(rows.motion, x, y), separation, e, pulled, h, threshold), hn::Set(d, -1.0f));
    struck = hn::Add(struck, hn::IfThenElseZero(hn::Ge(leaving[i], zero), one));
  }
  if (hn::AllFalse(d, hn::Gt(struck, zero))) return;
  p.struck->store(true, std::memory_order_relaxed);
  // Several points at once: begin with equal shares, so that what falls flat rises flat.
  const auto several = hn::Gt(struck, one);
  const V share = hn::Div(one, hn::IfThenElse(several, hn::Mul(rows.nn, struck), one));
  for (int i = 0; i < count; ++i) {
    const V x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
    const V mass = hn::IfThenElse(several, share, block.get(Block<D>::point(i, point_mass)));
    hit[i] =
        hn::IfThenElseZero(hn::Ge(leaving[i], zero), hn::Mul(mass, hn::Sub(leaving[i], at_point(rows.motion, x, y))));
  }
  for (int i = 0; i < count; ++i)
    rows.add(hit[i], block.get(Block<D>::point(i, point_x)), block.get(Block<D>::point(i, point_y)));
  for (int round = 0; !hn::AllFalse(d, several) && round < strike_rounds; ++round) {
    for (int i = 0; i < count; ++i) {
      const V x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
      const V left = hn::Sub(leaving[i], at_point(rows.motion, x, y));
      const V wanted = hn::Max(hn::MulAdd(block.get(Block<D>::point(i, point_mass)), left, hit[i]), zero);
      const V impulse = hn::IfThenElse(hn::And(several, hn::Ge(leaving[i], zero)), wanted, hit[i]);
      rows.add(hn::Sub(impulse, hit[i]), x, y);
      hit[i] = impulse;
    }
  }
  push_normal(bodies, f, rows.sum);
  const FrictionImpulses<V> none{zero, zero, zero};
  const FrictionImpulses<V> slid = solve_friction(block, f, bodies, rows.sum.n, none, 0.0f);
  block.set(step_impulse, hn::Add(block.get(step_impulse), rows.sum.n));
  store_contact_bodies(block, bodies, hn::Add(hn::Add(rows.motion.n, slid.twist), hn::Add(slid.slide_1, slid.slide_2)));
}

template <class D>
HWY_INLINE void prefetch_bodies(const Block<D>& block, const SolverBody* bodies) {
  const BlockHeader& h = block.header();
  for (std::size_t i = 0; i < h.lanes; ++i) prefetch_to_write(bodies + block.b()[i]);
  if (h.fixed_a) return;
  for (std::size_t i = 0; i < h.lanes; ++i) prefetch_to_write(bodies + block.a()[i]);
}

/// Calls act(block) for each of them, while the bodies of the next one come from wherever another thread has left them.
template <class D, class Act>
HWY_INLINE void for_blocks(BlockArray blocks, std::size_t begin, std::size_t end, const SolverBody* bodies,
                           const Act& act) {
  const std::size_t fetch_end = blocks.shared ? std::max(end, blocks.fetch_end) : 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (i + 1 < fetch_end) prefetch_bodies(block_at<D>(blocks, i + 1), bodies);
    act(block_at<D>(blocks, i));
  }
}

template <bool warm, class D>
HWY_NOINLINE void roll(const Block<D>& block, SolverBody* all) {
  by_bodies(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { roll_block<warm, D, fixed_a.value, isotropic.value>(block, all); });
}

/// Apart from the others, which would pay for it in registers.
template <Pass pass, class D>
HWY_NOINLINE void sweep_held(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  by_bodies(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { sweep_block<pass, D, fixed_a.value, isotropic.value, true>(block, all, p); });
}

constexpr JointPass joint_pass(Pass pass) {
  return pass == Pass::soft ? JointPass::soft : pass == Pass::relax ? JointPass::relax : JointPass::iterate;
}

template <Pass pass, class D>
void sweep(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all, const SweepParameters& p) {
  for_blocks<D>(blocks, begin, end, all, [&](Block<D> block) HWY_ATTR {
    if (HWY_UNLIKELY(block.header().kind != ConstraintKind::contact)) {
      const bool ends_substep = pass == Pass::relax || p.ends_substep;
      return block.header().kind == ConstraintKind::ball_joint
                 ? sweep_joints<joint_pass(pass)>(block, all, p.substep, ends_substep)
                 : sweep_generic_joints<joint_pass(pass)>(block, all, p.substep, ends_substep);
    }
    if (pass != Pass::iterate && HWY_UNLIKELY(block.header().held)) {
      sweep_held<pass>(block, all, p);
      if (pass == Pass::relax && block.header().rolls) roll<false>(block, all);
      return;
    }
    by_bodies(block, [&](auto fixed_a, auto isotropic)
                         HWY_ATTR { sweep_block<pass, D, fixed_a.value, isotropic.value>(block, all, p); });
    if (pass != Pass::soft && block.header().rolls) roll<false>(block, all);
  });
}

template <class D>
void warm_start(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all) {
  for_blocks<D>(blocks, begin, end, all, [&](Block<D> block) HWY_ATTR {
    if (HWY_UNLIKELY(block.header().kind != ConstraintKind::contact))
      return block.header().kind == ConstraintKind::ball_joint ? warm_start_joints(block, all)
                                                               : warm_start_generic_joints(block, all);
    by_bodies(block, [&](auto fixed_a, auto isotropic)
                         HWY_ATTR { warm_start_block<D, fixed_a.value, isotropic.value>(block, all); });
    if (block.header().rolls) roll<true>(block, all);
  });
}

template <class D>
void clear(BlockArray blocks, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    const Block<D> block = block_at<D>(blocks, i);
    const auto zero = hn::Zero(D());
    if (block.header().kind != ConstraintKind::contact) {
      if (block.header().kind == ConstraintKind::ball_joint)
        clear_joints(block);
      else
        clear_generic_joints(block);
      continue;
    }
    for (int p = 0; p < max_manifold_points; ++p) block.set(block.point(p, point_impulse), zero);
    for (const int field : {friction_impulse_1, friction_impulse_2, twist_impulse}) block.set(field, zero);
    if (block.header().rolls) block.set3(roll_x, {zero, zero, zero});
  }
}

template <class D>
void strike(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all, const SweepParameters& p) {
  for_blocks<D>(blocks, begin, end, all, [&](Block<D> block) HWY_ATTR {
    if (!block.header().restitution) return;
    by_bodies(block, [&](auto fixed_a, auto isotropic)
                         HWY_ATTR { strike_block<D, fixed_a.value, isotropic.value>(block, all, p); });
  });
}

template <class D>
std::size_t prepare(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
                    const Constrained& constrained, const BodiesView& view) {
  constexpr std::size_t width = Block<D>::width;
  std::size_t count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (blocks.scattered) {
      for (std::size_t k = 0; i + 2 < end && k < width && lanes[(i + 2) * width + k] != none; ++k)
        prefetch_to_read(constrained.contacts + index_of(lanes[(i + 2) * width + k]));
      if (i + 1 < end) prefetch_lanes<D>(lanes + (i + 1) * width, constrained, view);
    }
    const Block<D> block = block_at<D>(blocks, i);
    const ConstraintRef* const refs = lanes + i * width;
    if (HWY_LIKELY(kind_of(*refs) == ConstraintKind::contact))
      count += prepare_contacts(block, refs, constrained, view);
    else if (kind_of(*refs) == ConstraintKind::ball_joint)
      prepare_joints(block, refs, constrained, view);
    else
      prepare_generic_joints(block, refs, constrained, view);
  }
  return count;
}

template <class D>
HWY_INLINE void prefetch_impulses(const Block<D>& block, const Constrained& constrained) {
  if (block.header().kind != ConstraintKind::contact) return;
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    const ContactManifold& m = constrained.manifolds[block.manifold()[lane]];
    prefetch_to_write(m.impulses);
    prefetch_to_write(&m.step_impulse);
  }
}

template <class D>
void store(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
           const Constrained& constrained, float overlap_kept, const LoadWatch& watch) {
  constexpr std::size_t ahead = 2;
  for (std::size_t i = begin; i < end; ++i) {
    if (blocks.scattered && i + ahead < end) prefetch_impulses(block_at<D>(blocks, i + ahead), constrained);
    const Block<D> block = block_at<D>(blocks, i);
    if (HWY_LIKELY(block.header().kind == ConstraintKind::contact))
      store_contacts(block, lanes + i * Block<D>::width, constrained, overlap_kept, watch);
    else if (block.header().kind == ConstraintKind::ball_joint)
      store_joints(block, constrained);
    else
      store_generic_joints(block, constrained);
  }
}

template <class D>
SolverKernels make_kernels(const char* name) {
  return {name,
          static_cast<int>(Block<D>::width),
          Block<D>::bytes_up_to(field_count),
          Block<D>::bytes_up_to(inertia_a),
          Block<D>::bytes_up_to(rolling_field_count),
          Block<D>::bytes_up_to(generic_field_count),
          bounce_field_count * Block<D>::width,
          prepare<D>,
          warm_start<D>,
          clear<D>,
          sweep<Pass::soft, D>,
          sweep<Pass::relax, D>,
          strike<D>,
          sweep<Pass::iterate, D>,
          store<D>};
}

SolverKernels wide() { return make_kernels<hn::ScalableTag<float>>(hwy::TargetName(HWY_TARGET)); }
SolverKernels single() { return make_kernels<hn::CappedTag<float, 1>>("single"); }

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cstring>
#include <vector>

namespace fathom::native {

namespace {

// Widest first. Chosen here rather than by Highway's own dispatch, so that only its headers are needed.
std::vector<SolverKernels> runnable_kernels() {
  std::vector<SolverKernels> list;
#if HWY_TARGETS & HWY_AVX3
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    list.push_back(N_AVX3::wide());
#endif
  list.push_back(HWY_STATIC_DISPATCH(wide)());
  list.push_back(HWY_STATIC_DISPATCH(single)());
  return list;
}

const std::vector<SolverKernels>& all_kernels() {
  static const std::vector<SolverKernels> list = runnable_kernels();
  return list;
}

const SolverKernels* selected = nullptr;

}  // namespace

void LoadWatch::look_at(std::uint32_t a, std::uint32_t b, float impulse) const {
  // Those that the solver has are of the inertia that loads have added.
  const auto inverse_mass = [this](std::uint32_t slot) {
    return bodies[slot].inverse_mass > 0 ? (*table)[slot].inverse_mass : 0.0f;
  };
  const float inverse_a = inverse_mass(a), inverse_b = inverse_mass(b), sum = inverse_a + inverse_b;
  float thinner = 1e30f;
  if (inverse_a > 0) thinner = min(thinner, half_thickness((*table)[a]));
  if (inverse_b > 0) thinner = min(thinner, half_thickness((*table)[b]));
  const float stiffer = inverse_a > 0 && inverse_b > 0 ? stiffness : fixed_stiffness_ratio * stiffness;
  if (!(impulse * sum > sweep_load(thinner, stiffer) * unit)) return;
  if (length_squared(bodies[b].linear - bodies[a].linear) > loaded_speed * loaded_speed) return;
  const auto gained = [this](std::uint32_t slot, float inverse) {
    const Vec3 change = bodies[slot].linear - before[slot].linear;
    return inverse > 0 ? length(change) / bodies[slot].inverse_mass : 0.0f;
  };
  const float load = lasting_load(impulse, gained(a, inverse_a), gained(b, inverse_b)) * sum / unit;
  const float ratio = load / inertia_load(thinner, stiffer);
  const auto wanted = [&](std::uint32_t slot, float inverse) {
    return slot < heaviest.size() ? wanted_inertia(ratio, inverse, sum, heaviest[slot]) : 1.0f;
  };
  if (inverse_a > 0) overloads->note(a, wanted(a, inverse_a));
  if (inverse_b > 0) overloads->note(b, wanted(b, inverse_b));
}

const SolverKernels& wide_kernels() { return selected ? *selected : all_kernels().front(); }
const SolverKernels& single_kernels() { return all_kernels().back(); }

bool select_kernels(const char* name) {
  selected = nullptr;
  if (!name) return true;
  for (const SolverKernels& kernels : all_kernels())
    if (std::strcmp(kernels.name, name) == 0) selected = &kernels;
  return selected != nullptr;
}

}  // namespace fathom::native
#endif
