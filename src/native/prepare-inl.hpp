// From manifolds to blocks of constraints before the sweeps, and impulses back after them.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_PREPARE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_PREPARE_INL
#undef FATHOM_PREPARE_INL
#else
#define FATHOM_PREPARE_INL
#endif

#include <hwy/highway.h>

#include "dynamics/contact_rows.hpp"
#include "dynamics/look_ahead.hpp"
#include "dynamics/overlap.hpp"
#include "native/constraint_block-inl.hpp"
#include "native/prefetch.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

alignas(64) constexpr float zeros[64] = {};

/// Reads the manifolds of a block's lanes.
template <class D>
struct LaneContacts {
  using V = hn::Vec<D>;
  static constexpr std::size_t width = hn::MaxLanes(D());
  const float* manifold[width];
  const float* pose_a[width];
  const float* pose_b[width];
  const float* body_a[width];
  const float* body_b[width];
  const float* inertia_of_a[width];
  const float* inertia_of_b[width];
  HWY_ALIGN float counts[width];
  HWY_ALIGN float overlaps[width];
  HWY_ALIGN float held[width];
  HWY_ALIGN std::int32_t touch_bits[width];

  HWY_INLINE QuadV<V> quad(const float* const* objects, std::size_t offset) const {
    const float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = objects[i] + offset;
    return load_quads(D(), at);
  }
};

// An anisotropic body that can be pushed has a mass but no single inverse inertia.
HWY_INLINE bool is_anisotropic(const SolverBody& body) { return body.inverse_mass > 0 && body.inverse_inertia == 0; }

template <class D>
HWY_INLINE std::size_t locate_lanes(const Block<D>& block, const std::uint32_t* contact_indices,
                                    const Constrained& constrained, const BodiesView& view, LaneContacts<D>& lanes) {
  BlockHeader h;
  h.fixed_a = h.still_a = h.isotropic = true;
  std::size_t points_of_block = 0;
  bool any_round = false;
  for (std::size_t i = 0; i < Block<D>::width; ++i) {
    const std::uint32_t index = contact_indices[i];
    if (index == none) {
      block.manifold()[i] = none;
      block.a()[i] = block.b()[i] = none;
      lanes.manifold[i] = lanes.pose_a[i] = lanes.pose_b[i] = lanes.body_a[i] = lanes.body_b[i] = zeros;
      lanes.inertia_of_a[i] = lanes.inertia_of_b[i] = zeros;
      lanes.counts[i] = lanes.overlaps[i] = lanes.held[i] = 0;
      lanes.touch_bits[i] = 0;
      continue;
    }
    const Contact& c = constrained.contacts[index];
    const ContactManifold& m = constrained.manifolds[c.manifold];
    const SolverBody &a = view.bodies[c.a], &b = view.bodies[c.b];
    block.manifold()[i] = c.manifold;
    block.a()[i] = c.a;
    block.b()[i] = c.b;
    lanes.manifold[i] = reinterpret_cast<const float*>(&m);
    lanes.pose_a[i] = reinterpret_cast<const float*>(view.poses + c.a);
    lanes.pose_b[i] = reinterpret_cast<const float*>(view.poses + c.b);
    lanes.body_a[i] = reinterpret_cast<const float*>(&a);
    lanes.body_b[i] = reinterpret_cast<const float*>(&b);
    lanes.inertia_of_a[i] = is_anisotropic(a) ? reinterpret_cast<const float*>(view.inertias + c.a) : zeros;
    lanes.inertia_of_b[i] = is_anisotropic(b) ? reinterpret_cast<const float*>(view.inertias + c.b) : zeros;
    lanes.counts[i] = m.points[3].other;
    lanes.overlaps[i] = c.overlap();
    lanes.held[i] = 0;
    if (view.held) {
      if (view.levels[c.a] != view.levels[c.b])
        lanes.held[i] = max(c.fixed_a ? view.held[c.b] : min(view.held[c.a], view.held[c.b]), 0.0f);
      h.held = h.held || lanes.held[i] > 0;
    }
    h.lanes = static_cast<std::uint8_t>(i + 1);
    const int count = m.point_count();
    points_of_block += static_cast<std::size_t>(count);
    if (count > h.max_points) h.max_points = static_cast<std::uint8_t>(count);
    h.fixed_a = h.fixed_a && c.fixed_a;
    h.still_a = h.still_a && c.fixed_a && length_squared(a.linear) == 0 && length_squared(a.angular) == 0;
    h.isotropic = h.isotropic && !is_anisotropic(a) && !is_anisotropic(b);
    h.restitution = h.restitution || m.restitution > 0;
    any_round |= c.round;
    h.ahead = h.ahead || c.ahead;
    lanes.touch_bits[i] = static_cast<std::int32_t>(c.touch_bits());
  }
  h.round = any_round;
  block.header() = h;
  return points_of_block;
}

template <class D>
HWY_INLINE SymMat3V<hn::Vec<D>> load_inertia(const LaneContacts<D>& lanes, const float* const* objects,
                                             hn::Vec<D> isotropic) {
  const auto q0 = lanes.quad(objects, 0), q1 = lanes.quad(objects, 4);
  return {hn::Add(q0.x, isotropic), hn::Add(q0.y, isotropic), hn::Add(q0.z, isotropic), q0.w, q1.x, q1.y};
}

/// Accelerations of lanes' bodies; zero for those that forces do not move, which includes isolated ones.
template <class V>
HWY_INLINE Vec3V<V> load_acceleration(const std::uint32_t* slots, const BodiesView& view, V inverse_mass) {
  const hn::DFromV<V> d;
  constexpr std::size_t width = hn::MaxLanes(d);
  const float* at[width];
  for (std::size_t i = 0; i < width; ++i)
    at[i] = slots[i] == none ? zeros : reinterpret_cast<const float*>(view.motion + slots[i]);
  const Vec3V<V> a = load_quads(d, at).xyz();
  const auto moved = hn::Gt(inverse_mass, hn::Zero(d));
  return {hn::IfThenElseZero(moved, a.x), hn::IfThenElseZero(moved, a.y), hn::IfThenElseZero(moved, a.z)};
}

/// The lever of round contacts' spin, and `fathom::roll_row` where there is rolling resistance. Apart from the rest, so
/// that blocks without pay nothing.
template <class D>
HWY_NOINLINE void prepare_round(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained) {
  HWY_ALIGN float length[Block<D>::width] = {}, impulse[3][Block<D>::width] = {};
  for (std::size_t i = 0; i < block.header().lanes; ++i) {
    if (indices[i] == none) continue;
    const Contact& c = constrained.contacts[indices[i]];
    if (!c.round) continue;
    const ContactManifold& m = constrained.manifolds[c.manifold];
    block.at(patch_radius)[i] += m.round_lever();
    length[i] = m.rolling_length();
    block.header().rolls |= length[i] > 0;
    for (int axis = 0; axis < 3; ++axis) impulse[axis][i] = m.rolling_impulse()[axis];
  }
  if (!block.header().rolls) return;
  Frame<hn::Vec<D>> f;
  f.load(block);
  hn::Store(hn::Load(D(), length), D(), block.at(roll_length));
  const auto along_t1 = scale(hn::Load(D(), impulse[0]), f.t1);
  block.set3(roll_x, mul_add(mul_add(along_t1, hn::Load(D(), impulse[1]), f.t2), hn::Load(D(), impulse[2]), f.n));
}

/// `fathom::kept_impulse` goes back to the manifolds.
template <class D>
HWY_NOINLINE void store_rolling(const Block<D>& block, const Constrained& constrained) {
  Frame<hn::Vec<D>> f;
  f.load(block);
  const auto impulse = block.get3(roll_x);
  HWY_ALIGN float kept[3][Block<D>::width];
  hn::Store(dot(f.t1, impulse), D(), kept[0]);
  hn::Store(dot(f.t2, impulse), D(), kept[1]);
  hn::Store(dot(f.n, impulse), D(), kept[2]);
  for (std::size_t i = 0; i < block.header().lanes; ++i)
    if (block.at(roll_length)[i] > 0)
      constrained.manifolds[block.manifold()[i]].set_rolling_impulse({kept[0][i], kept[1][i], kept[2][i]});
}

HWY_INLINE ContactBody<SymMat3> contact_body(const BodiesView& view, std::uint32_t slot) {
  const SolverBody& s = view.bodies[slot];
  const WorldInertia* const w = is_anisotropic(s) ? view.inertias + slot : nullptr;
  const float i = s.inverse_inertia;
  return {s.linear, s.angular, s.inverse_mass,
          w ? SymMat3{w->xx, w->yy, w->zz, w->xy, w->xz, w->yz} : SymMat3{i, i, i, 0, 0, 0}};
}

template <class D>
HWY_INLINE std::uint16_t lane_bits(hn::Mask<D> mask) {
  HWY_ALIGN std::uint8_t bits[8] = {};
  hn::StoreMaskBits(D(), mask, bits);
  return static_cast<std::uint16_t>(bits[0] | bits[1] << 8);
}

/// Which lanes touched until now, and which are near enough to (`fathom::touch_distance`).
template <class D>
HWY_INLINE void note_touch_bits(const Block<D>& block, const LaneContacts<D>& lanes, hn::Vec<D> nearest) {
  const hn::RebindToSigned<D> di;
  const D d;
  const auto bits = hn::Load(di, lanes.touch_bits), one = hn::Set(di, 1);
  const auto in_touch = hn::And(bits, one), exponent = hn::Sub(in_touch, hn::ShiftRight<2>(bits));
  // A millimetre, halved or doubled.
  const auto millimetre = hn::BitCast(di, hn::Set(d, 0.001f));
  const auto distance = hn::BitCast(d, hn::Add(millimetre, hn::ShiftLeft<23>(exponent)));
  const auto is_set = [&](auto bit) { return hn::RebindMask(d, hn::Eq(bit, one)); };
  BlockHeader& h = block.header();
  h.near = lane_bits<D>(hn::Le(nearest, distance));
  h.in_touch = lane_bits<D>(is_set(in_touch));
  h.hits = lane_bits<D>(is_set(hn::And(hn::ShiftRight<1>(bits), one)));
}

/// Lanes whose manifolds were made where their bodies will meet. Few have one, so one after the other.
template <class D>
HWY_NOINLINE void prepare_ahead(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained,
                                const BodiesView& view) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    if (indices[lane] == none || !constrained.contacts[indices[lane]].ahead) continue;
    const Contact& c = constrained.contacts[indices[lane]];
    const ContactManifold& m = constrained.manifolds[c.manifold];
    ContactFrame f;
    PointRow points_of_lane[max_manifold_points];
    ContactImpulses impulses;
    const float nearest =
        prepare_contact_ahead(m, view.poses[c.a], view.poses[c.b], m.step_impulse, c.round, contact_body(view, c.a),
                              contact_body(view, c.b), f, points_of_lane, impulses);
    const bool is_near = nearest <= touch_distance(c.touch_halvings, c.in_touch);
    std::uint16_t& near = block.header().near;
    near = static_cast<std::uint16_t>((near & ~(1u << lane)) | static_cast<unsigned>(is_near) << lane);
    block.header().closing |= static_cast<std::uint16_t>(1u << lane);
    const auto set = [&](int field, float value) { block.at(field)[lane] = value; };
    const auto set3 = [&](int field, Vec3 v) { set(field, v.x), set(field + 1, v.y), set(field + 2, v.z); };
    set3(normal_x, f.normal), set3(tangent_x, f.tangent), set3(arm_a_x, f.arm_a), set3(arm_b_x, f.arm_b);
    set(k_nn, f.nn), set(k_n1, f.n1), set(k_n2, f.n2), set(k_11, f.k11), set(k_12, f.k12), set(k_22, f.k22);
    set(slide_11, f.slide_11), set(slide_12, f.slide_12), set(slide_22, f.slide_22);
    set(twist_mass, f.twist_mass), set(patch_radius, f.patch_radius);
    for (int i = 0; i < m.point_count(); ++i) {
      const PointRow& p = points_of_lane[i];
      set(Block<D>::point(i, point_x), p.x), set(Block<D>::point(i, point_y), p.y);
      set(Block<D>::point(i, point_separation), p.separation), set(Block<D>::point(i, point_mass), p.mass);
    }
    if (!block.header().restitution) continue;
    const auto acceleration = [&](std::uint32_t slot) {
      return view.bodies[slot].inverse_mass > 0 ? view.motion[slot].acceleration : Vec3{};
    };
    block.bounces[static_cast<std::size_t>(pull) * Block<D>::width + lane] =
        dot(f.normal, acceleration(c.b) - acceleration(c.a));
  }
}

/// Lanes of which a point approaches faster than a hit's threshold.
template <class D>
HWY_NOINLINE void note_closing(const Block<D>& block, const LaneContacts<D>& lanes, const Frame<hn::Vec<D>>& f,
                               hn::Vec<D> count, float threshold) {
  const D d;
  const auto velocity = normal_motion(f, lanes.quad(lanes.body_a, 0).xyz(), lanes.quad(lanes.body_a, 4).xyz(),
                                      lanes.quad(lanes.body_b, 0).xyz(), lanes.quad(lanes.body_b, 4).xyz());
  auto approach = hn::Zero(d);
  for (int i = 0; i < block.header().max_points; ++i) {
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    const auto x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
    approach = hn::IfThenElse(used, hn::Max(approach, hn::Neg(at_point(velocity, x, y))), approach);
  }
  block.header().closing = lane_bits<D>(hn::Gt(approach, hn::Set(d, threshold)));
}

/// Rows of one block: frame, arms, effective masses, impulses to start from. Returns the number of its points.
template <class D>
HWY_INLINE std::size_t prepare_contacts(const Block<D>& block, const std::uint32_t* indices,
                                        const Constrained& constrained, const BodiesView& view) {
  using V = hn::Vec<D>;
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  LaneContacts<D> lanes;
  const std::size_t point_count = locate_lanes(block, indices, constrained, view, lanes);

  // World frame of the manifold, relative to A's centre.
  const QuadV<V> q_a = lanes.quad(lanes.pose_a, 4), q_b = lanes.quad(lanes.pose_b, 4);
  const Mat3V<V> rot_a = to_matrix(d, q_a.x, q_a.y, q_a.z, q_a.w), rot_b = to_matrix(d, q_b.x, q_b.y, q_b.z, q_b.w);
  const Vec3V<V> between = lanes.quad(lanes.pose_b, 0).xyz() - lanes.quad(lanes.pose_a, 0).xyz();
  const QuadV<V> normal = lanes.quad(lanes.manifold, 0), tangent = lanes.quad(lanes.manifold, 4),
                 impulses = lanes.quad(lanes.manifold, 8), frictions = lanes.quad(lanes.manifold, 12);
  Frame<V> f;
  f.n = rot_a * normal.xyz();
  f.t1 = rot_a * tangent.xyz();
  f.t2 = cross(f.n, f.t1);

  const V count = hn::Load(d, lanes.counts), overlap = hn::Load(d, lanes.overlaps);
  Vec3V<V> middle[max_manifold_points];
  Vec3V<V> sum{zero, zero, zero};
  V nearest = hn::Set(d, 1e30f);
  const int max_points = block.header().max_points;
  for (int i = 0; i < max_points; ++i) {
    const QuadV<V> anchor_a = lanes.quad(lanes.manifold, 16 + 8 * static_cast<std::size_t>(i)),
                   anchor_b = lanes.quad(lanes.manifold, 20 + 8 * static_cast<std::size_t>(i));
    const Vec3V<V> on_a = rot_a * anchor_a.xyz();
    const Vec3V<V> on_b = between + rot_b * anchor_b.xyz();
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    const V separation = hn::Add(dot(on_b - on_a, f.n), overlap);
    block.set(Block<D>::point(i, point_separation), separation);
    const V impulse = i == 0 ? impulses.x : i == 1 ? impulses.y : i == 2 ? impulses.z : impulses.w;
    block.set(Block<D>::point(i, point_impulse), hn::IfThenElseZero(used, impulse));
    middle[i] = scale(hn::Set(d, 0.5f), on_a + on_b);
    nearest = hn::IfThenElse(used, hn::Min(nearest, separation), nearest);
  }
  block.header().overlaps = !hn::AllFalse(d, hn::Gt(overlap, zero));
  note_touch_bits(block, lanes, nearest);
  // Friction acts at the middle of the points that touch or nearly do.
  V weights[max_manifold_points];
  V near_count = zero;
  const V reach = hn::Add(nearest, hn::Set(d, friction_reach));
  for (int i = 0; i < max_points; ++i) {
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    const auto near = hn::And(used, hn::Le(block.get(Block<D>::point(i, point_separation)), reach));
    weights[i] = hn::IfThenElseZero(near, one);
    near_count = hn::Add(near_count, weights[i]);
    sum = mul_add(sum, weights[i], middle[i]);
  }
  const V share = hn::Div(one, hn::Max(near_count, one));
  f.arm_a = scale(share, sum);
  f.arm_b = f.arm_a - between;
  f.lever_a = cross(f.arm_a, f.n);
  f.lever_b = cross(f.arm_b, f.n);

  const QuadV<V> a2 = lanes.quad(lanes.body_a, 8), a3 = lanes.quad(lanes.body_a, 12);
  const QuadV<V> b2 = lanes.quad(lanes.body_b, 8), b3 = lanes.quad(lanes.body_b, 12);
  const SymMat3V<V> i_a = load_inertia<D>(lanes, lanes.inertia_of_a, a3.w),
                    i_b = load_inertia<D>(lanes, lanes.inertia_of_b, b3.w);
  const V mass_sum = hn::Add(a2.w, b2.w);

  // K over (n, t1, t2).
  const Vec3V<V> la = i_a * f.lever_a, lb = i_b * f.lever_b;
  const Vec3V<V> turn_1 = (i_a * f.t1) + (i_b * f.t1), turn_2 = (i_a * f.t2) + (i_b * f.t2);
  const V nn = hn::Add(mass_sum, hn::Add(dot(f.lever_a, la), dot(f.lever_b, lb)));
  const Vec3V<V> lever_turn = la + lb;
  const V n1 = dot(f.t1, lever_turn), n2 = dot(f.t2, lever_turn);
  const V k11 = dot(f.t1, turn_1), k12 = dot(f.t2, turn_1), k22 = dot(f.t2, turn_2);

  V radius_sum = zero;
  for (int i = 0; i < max_points; ++i) {
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    const Vec3V<V> from_c = middle[i] - f.arm_a;
    const V x = hn::IfThenElseZero(used, dot(from_c, f.t1)), y = hn::IfThenElseZero(used, dot(from_c, f.t2));
    const V h_n = hn::NegMulAdd(x, n2, hn::MulAdd(y, n1, nn));
    const V h_1 = hn::NegMulAdd(x, k12, hn::MulAdd(y, k11, n1));
    const V h_2 = hn::NegMulAdd(x, k22, hn::MulAdd(y, k12, n2));
    const V k = hn::NegMulAdd(x, h_2, hn::MulAdd(y, h_1, h_n));
    const auto solvable = hn::And(used, hn::Gt(k, zero));
    block.set(Block<D>::point(i, point_x), x);
    block.set(Block<D>::point(i, point_y), y);
    block.set(Block<D>::point(i, point_mass),
              hn::IfThenElseZero(solvable, hn::Div(one, hn::IfThenElse(solvable, k, one))));
    radius_sum = hn::MulAdd(weights[i], hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y))), radius_sum);
  }

  // Sliding: 2×2 over (t1, t2) at c. Twist: about n.
  const Vec3V<V> a1 = cross(f.arm_a, f.t1), a_2 = cross(f.arm_a, f.t2), b1 = cross(f.arm_b, f.t1),
                 b_2 = cross(f.arm_b, f.t2);
  const Vec3V<V> ia1 = i_a * a1, ib1 = i_b * b1;
  const V s11 = hn::Add(mass_sum, hn::Add(dot(a1, ia1), dot(b1, ib1)));
  const V s12 = hn::Add(dot(a_2, ia1), dot(b_2, ib1));
  const V s22 = hn::Add(mass_sum, hn::Add(dot(a_2, i_a * a_2), dot(b_2, i_b * b_2)));
  const V det = hn::NegMulAdd(s12, s12, hn::Mul(s11, s22));
  const auto regular = hn::Gt(det, zero);
  const V inverse_det = hn::IfThenElseZero(regular, hn::Div(one, hn::IfThenElse(regular, det, one)));
  const V twist_k = dot(f.n, (i_a * f.n) + (i_b * f.n));
  const auto twistable = hn::Gt(twist_k, zero);

  block.set3(normal_x, f.n);
  block.set3(tangent_x, f.t1);
  block.set3(arm_a_x, f.arm_a);
  block.set3(arm_b_x, f.arm_b);
  block.set(k_nn, nn), block.set(k_n1, n1), block.set(k_n2, n2);
  block.set(k_11, k11), block.set(k_12, k12), block.set(k_22, k22);
  block.set(friction, normal.w);
  block.set(friction_impulse_1, frictions.x);
  block.set(friction_impulse_2, frictions.y);
  block.set(twist_impulse, frictions.z);
  block.set(step_impulse, zero);
  block.set(slide_11, hn::Mul(s22, inverse_det));
  block.set(slide_12, hn::Neg(hn::Mul(s12, inverse_det)));
  block.set(slide_22, hn::Mul(s11, inverse_det));
  block.set(twist_mass, hn::IfThenElseZero(twistable, hn::Div(one, hn::IfThenElse(twistable, twist_k, one))));
  block.set(patch_radius, hn::Mul(hn::Set(d, patch_share), hn::Mul(radius_sum, share)));
  if (block.header().held) block.set(held_part, hn::Load(d, lanes.held));
  if (!block.header().isotropic) {
    block.set_inertia(inertia_a, i_a);
    block.set_inertia(inertia_b, i_b);
  }
  if (block.header().restitution) {
    block.set(restitution, tangent.w);
    block.set(pull, dot(f.n, load_acceleration(block.b(), view, b2.w) - load_acceleration(block.a(), view, a2.w)));
  }
  if (view.any_fast) note_closing(block, lanes, f, count, constrained.touches.hit_threshold);
  if (block.header().round) prepare_round(block, indices, constrained);
  if (block.header().ahead) prepare_ahead(block, indices, constrained, view);
  return point_count;
}

/// Fetches what a block will be made of: other threads have written most of it. The contacts themselves come a block
/// earlier.
template <class D>
HWY_INLINE void prefetch_lanes(const std::uint32_t* lanes, const Constrained& constrained, const BodiesView& view) {
  for (std::size_t i = 0; i < Block<D>::width && lanes[i] != none; ++i) {
    if (kind_of(lanes[i]) != ConstraintKind::contact) return;
    const Contact& c = constrained.contacts[lanes[i]];
    const auto* const manifold = reinterpret_cast<const std::byte*>(constrained.manifolds + c.manifold);
    for (std::size_t line = 0; line < sizeof(ContactManifold); line += 64) prefetch_to_read(manifold + line);
    prefetch_to_read(view.poses + c.a);
    prefetch_to_read(view.poses + c.b);
  }
}

template <class D>
HWY_INLINE void watch_loads(const Block<D>& block, const LoadWatch& watch) {
  const D d;
  const auto speed = hn::Mul(block.get(step_impulse), block.get(k_nn));
  if (hn::AllFalse(d, hn::Gt(speed, hn::Set(d, watch.least)))) return;
  HWY_ALIGN float speeds[Block<D>::width];
  hn::Store(speed, d, speeds);
  for (std::size_t i = 0; i < block.header().lanes; ++i)
    if (speeds[i] > watch.least && block.manifold()[i] != none)
      watch.look_at(block.a()[i], block.b()[i], block.at(step_impulse)[i]);
}

/// Contacts whose bodies began inside each other: a part of the overlap has faded in the step that ends.
template <class D>
HWY_NOINLINE void fade_overlaps(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained,
                                float overlap_kept) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    if (indices[lane] == none) continue;
    Contact& c = constrained.contacts[indices[lane]];
    if (!(c.overlap() > 0)) continue;
    float nearest = 1e30f;
    for (int i = 0; i < constrained.manifolds[c.manifold].point_count(); ++i)
      nearest = min(nearest, block.at(Block<D>::point(i, point_separation))[lane]);
    c.recycle_distance = -faded_overlap(c.overlap(), nearest - c.overlap(), overlap_kept);
  }
}

/// Lanes that touch now and did not, or the other way round, and those that may have hit.
template <class D>
HWY_NOINLINE void note_touches(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained,
                               unsigned changed, unsigned touching, unsigned hitting) {
  const TouchWatch& watch = constrained.touches;
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    if (indices[lane] == none) continue;
    if (changed >> lane & 1) watch.changes->note(indices[lane], touching >> lane & 1);
    if (!(hitting >> lane & 1)) continue;
    Contact& c = constrained.contacts[indices[lane]];
    const auto get = [&](int field) { return block.at(field)[lane]; };
    const auto get3 = [&](int field) { return Vec3{get(field), get(field + 1), get(field + 2)}; };
    ContactFrame frame{};
    frame.normal = get3(normal_x), frame.tangent = get3(tangent_x);
    frame.arm_a = get3(arm_a_x), frame.arm_b = get3(arm_b_x);
    const ContactManifold& m = constrained.manifolds[c.manifold];
    PointRow rows[max_manifold_points];
    float impulses[max_manifold_points];
    for (int i = 0; i < m.point_count(); ++i) {
      impulses[i] = get(Block<D>::point(i, point_impulse));
      rows[i] = {get(Block<D>::point(i, point_x)), get(Block<D>::point(i, point_y)),
                 get(Block<D>::point(i, point_separation)), 0};
    }
    watch.note_hit(indices[lane], c, m, frame, rows, impulses, get(step_impulse) > 0);
  }
}

/// Impulses go back to the manifolds, and what a step leaves of overlaps to the contacts.
template <class D>
HWY_INLINE void store_contacts(const Block<D>& block, const ConstraintRef* refs, const Constrained& constrained,
                               float overlap_kept, const LoadWatch& watch) {
  const std::size_t used = block.header().lanes;
  float* impulses[Block<D>::width] = {};
  float* friction_impulses[Block<D>::width] = {};
  for (std::size_t lane = 0; lane < used; ++lane) {
    ContactManifold& m = constrained.manifolds[block.manifold()[lane]];
    impulses[lane] = m.impulses;
    friction_impulses[lane] = m.friction_impulse;
  }
  QuadV<hn::Vec<D>> q{hn::Zero(D()), hn::Zero(D()), hn::Zero(D()), hn::Zero(D())};
  const unsigned pressed = lane_bits<D>(hn::Gt(block.get(step_impulse), hn::Zero(D())));
  const BlockHeader& h = block.header();
  const unsigned touching = pressed | h.near, changed = touching ^ h.in_touch, hitting = (pressed & h.closing) | h.hits;
  if (changed | hitting) note_touches(block, refs, constrained, changed, touching, hitting);
  const int count = h.max_points;
  q.x = block.get(Block<D>::point(0, point_impulse));
  if (count > 1) q.y = block.get(Block<D>::point(1, point_impulse));
  if (count > 2) q.z = block.get(Block<D>::point(2, point_impulse));
  if (count > 3) q.w = block.get(Block<D>::point(3, point_impulse));
  store_quads(D(), q, impulses, used);
  store_quads(
      D(),
      {block.get(friction_impulse_1), block.get(friction_impulse_2), block.get(twist_impulse), block.get(step_impulse)},
      friction_impulses, used);
  if (block.header().overlaps) fade_overlaps(block, refs, constrained, overlap_kept);
  if (block.header().rolls) store_rolling(block, constrained);
  if (watch.overloads) watch_loads(block, watch);
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
