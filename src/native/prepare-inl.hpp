// From manifolds to blocks of contacts before the sweeps, and impulses back afterwards.
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
#include "dynamics/overload.hpp"
#include "native/body_state.hpp"
#include "native/constraint_block-inl.hpp"
#include "native/contact_rows-inl.hpp"
#include "native/link_contacts.hpp"
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
  HWY_ALIGN float offsets[width];
  HWY_ALIGN float curvature[width];  // of round contacts, if the block has some; else 0
  HWY_ALIGN float share_a[width];
  HWY_ALIGN std::int32_t touch_bits[width];

  HWY_INLINE QuadV<V> quad(const float* const* objects, std::size_t offset) const {
    const float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = objects[i] + offset;
    return load_quads(D(), at);
  }
};

/// Bodies with joints keep the whole push-out velocity: torn joints press them into others (dynamics/torn_joint.hpp).
inline HWY_NOINLINE ContactHold hold_of(const Contact& c, const ContactManifold& m, const BodiesView& view) {
  ContactHold hold;
  hold.pushes_fixed = c.fixed_a;
  if (view.held && view.levels[c.a] != view.levels[c.b])
    hold.held = max(c.fixed_a ? view.held[c.b] : min(view.held[c.a], view.held[c.b]), 0.0f);
  const auto scale_of = [&](std::uint32_t slot) { return view.overloads ? view.overloads->inertia_scale(slot) : 1; };
  const float scale_a = c.fixed_a ? 1.0f : scale_of(c.a), scale_b = scale_of(c.b);
  const bool has_joints = view.swings && ((c.fixed_a ? 0 : view.flags[c.a]) | view.flags[c.b]) & jointed;
  if (has_joints && view.link_contacts->is_chosen(c.manifold)) {
    hold.held = 1;
  } else if (has_joints && max(scale_a, scale_b) <= 1 && !c.ahead) {
    const float inverse_sum = (c.fixed_a ? 0.0f : view.bodies[c.a].inverse_mass) + view.bodies[c.b].inverse_mass;
    hold.jointed = jointed_part(m.step_impulse, inverse_sum, view.def->dt * length(view.def->gravity));
  }
  if (!has_joints && view.overloads)
    hold.push_share = push_out_share(c.fixed_a ? 0.0f : view.bodies[c.a].inverse_mass, scale_a,
                                     view.bodies[c.b].inverse_mass, scale_b, view.def->solver.push_out_velocity);
  return hold;
}

/// Fills the fields that `contact_step` reads.
template <class D>
HWY_NOINLINE void store_own_softness(const Block<D>& block, const std::uint32_t* indices,
                                     const Constrained& constrained, const BodiesView& view) {
  const SolverSettings& settings = view.def->solver;
  const ContactSoftness softness = contact_softness(settings, view.def->dt / static_cast<float>(settings.substeps));
  for (std::size_t i = 0; i < Block<D>::width; ++i) {
    ContactHold hold;
    ContactStep step{};
    if (indices[i] != none) {
      const Contact& c = constrained.contacts[indices[i]];
      hold = hold_of(c, constrained.manifolds[c.manifold], view);
      step = soft_step(0, softness, settings.push_out_velocity, hold, c.fixed_a ? 0.0f : view.bodies[c.a].inverse_mass,
                       view.bodies[c.b].inverse_mass);
    }
    block.at(held_part)[i] = hold.held;
    block.at(own_bias_rate)[i] = step.bias_rate;
    block.at(own_mass_scale)[i] = step.mass_scale;
    block.at(own_impulse_scale)[i] = step.impulse_scale;
    block.at(own_push_out)[i] = step.push_out_velocity;
  }
}

template <class D>
HWY_INLINE std::size_t locate_lanes(const Block<D>& block, const std::uint32_t* contact_indices,
                                    const Constrained& constrained, const BodiesView& view, LaneContacts<D>& lanes) {
  BlockHeader h;
  h.fixed_a = h.still_a = h.isotropic = true;
  std::size_t points_of_block = 0;
  bool any_round = false;
  const bool may_differ = view.may_differ();
  for (std::size_t i = 0; i < Block<D>::width; ++i) {
    const std::uint32_t index = contact_indices[i];
    if (index == none) {
      block.manifold()[i] = none;
      block.a()[i] = block.b()[i] = none;
      lanes.manifold[i] = lanes.pose_a[i] = lanes.pose_b[i] = lanes.body_a[i] = lanes.body_b[i] = zeros;
      lanes.inertia_of_a[i] = lanes.inertia_of_b[i] = zeros;
      lanes.counts[i] = lanes.offsets[i] = 0;
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
    lanes.counts[i] = m.point_count_as_float();
    lanes.offsets[i] = c.slack.offset();
    if (may_differ) h.own_softness = h.own_softness || hold_of(c, m, view).is_special();
    h.lanes = static_cast<std::uint8_t>(i + 1);
    const int count = m.point_count();
    points_of_block += static_cast<std::size_t>(count);
    if (count > h.max_points) h.max_points = static_cast<std::uint8_t>(count);
    h.fixed_a = h.fixed_a && c.fixed_a;
    h.still_a = h.still_a && c.fixed_a && length_squared(a.linear) == 0 && length_squared(a.angular) == 0;
    h.isotropic = h.isotropic && !is_anisotropic(a) && !is_anisotropic(b);
    h.restitution = h.restitution || m.restitution > 0;
    any_round |= c.round;
    h.surface = h.surface || c.on_moving_surface || c.by_direction;
    h.by_direction = h.by_direction || c.by_direction;
    h.ahead = h.ahead || c.ahead;
    lanes.touch_bits[i] = static_cast<std::int32_t>(c.touch_bits());
  }
  h.round = any_round;
  h.rare = h.own_softness || h.by_direction;
  block.header() = h;
  return points_of_block;
}

template <class D>
HWY_INLINE SymMat3V<hn::Vec<D>> load_inertia(const LaneContacts<D>& lanes, const float* const* objects,
                                             hn::Vec<D> isotropic) {
  const auto q0 = lanes.quad(objects, 0), q1 = lanes.quad(objects, 4);
  return {hn::Add(q0.x, isotropic), hn::Add(q0.y, isotropic), hn::Add(q0.z, isotropic), q0.w, q1.x, q1.y};
}

/// Accelerations of lanes' bodies; zero for those that forces do not move, including isolated ones.
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

/// The spin lever of round contacts, and `fathom::roll_row` for rolling resistance. Out of line, so that it costs other
/// blocks nothing.
template <class D>
HWY_NOINLINE void prepare_round(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained) {
  HWY_ALIGN float length[Block<D>::width] = {}, impulse[3][Block<D>::width] = {};
  for (std::size_t i = 0; i < block.header().lanes; ++i) {
    if (indices[i] == none) continue;
    const Contact& c = constrained.contacts[indices[i]];
    if (!c.round) continue;
    const ContactManifold& m = constrained.manifolds[c.manifold];
    block.at(patch_radius)[i] += m.spin_lever();
    length[i] = m.rolling_length();
    block.header().rolls |= length[i] > 0;
    for (int axis = 0; axis < 3; ++axis) impulse[axis][i] = m.rolling_impulse()[axis];
  }
  if (!block.header().rolls) return;
  const auto f = ContactRows<D>{block}.axes();
  hn::Store(hn::Load(D(), length), D(), block.at(roll_length));
  const auto along_t1 = scale(hn::Load(D(), impulse[0]), f.t1);
  block.set3(roll_x, mul_add(mul_add(along_t1, hn::Load(D(), impulse[1]), f.t2), hn::Load(D(), impulse[2]), f.n));
}

/// Sets the lanes' `ContactSurface`s. Out of line, so that it costs other blocks nothing.
template <class D>
HWY_NOINLINE void prepare_surfaces(const Block<D>& block, const std::uint32_t* indices,
                                   const Constrained& constrained) {
  const auto vec_at = [&](int field, std::size_t i) {
    return Vec3{block.at(field)[i], block.at(field + 1)[i], block.at(field + 2)[i]};
  };
  for (std::size_t i = 0; i < Block<D>::width; ++i) {
    const bool is_used = indices[i] != none, moves = is_used && constrained.contacts[indices[i]].on_moving_surface;
    ContactSurface surface;
    if (moves) surface.slide = surface_slide(*constrained.graph, indices[i]);
    if (is_used && constrained.contacts[indices[i]].by_direction) {
      const Vec3 normal = vec_at(normal_x, i);
      const FrictionEllipse ellipse = friction_ellipse(*constrained.graph, indices[i], normal);
      block.at(friction)[i] = ellipse.coefficient;
      surface.set_grain(ellipse, ContactAxes(normal, vec_at(tangent_x, i), {}, {}));
    }
    block.at(surface_x)[i] = surface.slide.x, block.at(surface_y)[i] = surface.slide.y;
    block.at(surface_z)[i] = surface.slide.z;
    block.at(grain_1)[i] = surface.grain_1, block.at(grain_2)[i] = surface.grain_2;
  }
}

/// Stores `fathom::kept_impulse` to the manifolds.
template <class D>
HWY_NOINLINE void store_rolling(const Block<D>& block, const Constrained& constrained) {
  const auto f = ContactRows<D>{block}.axes();
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
  return {s.linear, s.angular, s.inverse_mass,
          world_inertia<SymMat3>(view.inertias, slot, s.inverse_mass, s.inverse_inertia)};
}

template <class D>
HWY_INLINE std::uint16_t lane_bits(hn::Mask<D> mask) {
  HWY_ALIGN std::uint8_t bits[8] = {};
  hn::StoreMaskBits(D(), mask, bits);
  return static_cast<std::uint16_t>(bits[0] | bits[1] << 8);
}

/// Notes which lanes touched so far, and which are near enough to touch (`fathom::touch_distance`).
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

/// Lanes whose manifolds were made where their bodies will meet. Handled one by one, as they are few.
template <class D>
HWY_NOINLINE void prepare_ahead(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained,
                                const BodiesView& view) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    if (indices[lane] == none || !constrained.contacts[indices[lane]].ahead) continue;
    const Contact& c = constrained.contacts[indices[lane]];
    const ContactManifold& m = constrained.manifolds[c.manifold];
    fathom::ContactRows rows;
    const float nearest =
        prepare_contact_ahead(m, view.poses[c.a], view.poses[c.b], m.step_impulse, c.round,
                              ContactBodies<SymMat3>{contact_body(view, c.a), contact_body(view, c.b)}, rows);
    const bool is_near = nearest <= touch_distance(c.touch_halvings, c.in_touch);
    std::uint16_t& near = block.header().near;
    near = static_cast<std::uint16_t>((near & ~(1u << lane)) | static_cast<unsigned>(is_near) << lane);
    block.header().closing |= static_cast<std::uint16_t>(1u << lane);
    const auto set = [&](int field, float value) { block.at(field)[lane] = value; };
    const auto set3 = [&](int field, Vec3 v) { set(field, v.x), set(field + 1, v.y), set(field + 2, v.z); };
    const ContactFrame& f = rows.frame;
    const auto& k = f.response;
    const auto& friction_of = f.friction;
    set3(normal_x, f.normal), set3(tangent_x, f.tangent), set3(arm_a_x, f.arm_a), set3(arm_b_x, f.arm_b);
    set(k_nn, k.nn), set(k_n1, k.n1), set(k_n2, k.n2), set(k_11, k.k11), set(k_12, k.k12), set(k_22, k.k22);
    set(slide_11, friction_of.slide_11), set(slide_12, friction_of.slide_12), set(slide_22, friction_of.slide_22);
    set(twist_mass, friction_of.twist_mass), set(patch_radius, friction_of.patch_radius);
    for (int i = 0; i < rows.count; ++i) {
      const PointRow& p = rows.points[i];
      set(Block<D>::point(i, point_x), p.x), set(Block<D>::point(i, point_y), p.y);
      set(Block<D>::point(i, point_separation), p.separation), set(Block<D>::point(i, point_mass), p.mass);
    }
    if (!block.header().restitution) continue;
    const auto acceleration = [&](std::uint32_t slot) {
      return view.bodies[slot].inverse_mass > 0 ? view.motion[slot].acceleration : Vec3{};
    };
    block.bounces[static_cast<std::size_t>(BounceField::pull) * Block<D>::width + lane] =
        dot(f.normal, acceleration(c.b) - acceleration(c.a));
  }
}

/// Notes lanes with a point that approaches faster than the hit threshold.
template <class D>
HWY_NOINLINE void note_closing(const Block<D>& block, const LaneContacts<D>& lanes, float threshold) {
  const D d;
  const ContactRows<D> rows{block};
  const auto velocity = rows.axes().motion(lanes.quad(lanes.body_a, 0).xyz(), lanes.quad(lanes.body_a, 4).xyz(),
                                           lanes.quad(lanes.body_b, 0).xyz(), lanes.quad(lanes.body_b, 4).xyz());
  const auto count = hn::Load(d, lanes.counts);
  auto approach = hn::Zero(d);
  for (int i = 0; i < rows.end(); ++i) {
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    const auto p = rows.point(i);
    approach = hn::IfThenElse(used, hn::Max(approach, hn::Neg(velocity.at(p.x, p.y))), approach);
  }
  block.header().closing = lane_bits<D>(hn::Gt(approach, hn::Set(d, threshold)));
}

/// The bodies of a block's lanes as the step begins.
template <class D>
struct LaneMotion {
  using V = hn::Vec<D>;
  struct Side {
    Vec3V<V> linear, angular;
    V inverse_mass;

    HWY_INLINE Side(const LaneContacts<D>& lanes, const float* const* bodies)
        : linear(lanes.quad(bodies, 0).xyz()),
          angular(lanes.quad(bodies, 4).xyz()),
          inverse_mass(lanes.quad(bodies, 8).w) {}
  };
  Side a, b;

  HWY_INLINE explicit LaneMotion(const LaneContacts<D>& lanes) : a(lanes, lanes.body_a), b(lanes, lanes.body_b) {}
};

/// Reads what `move_arms_midway` wants of the block's round contacts.
template <class D>
HWY_NOINLINE void locate_round(LaneContacts<D>& lanes, const std::uint32_t* indices, const Constrained& constrained) {
  for (std::size_t i = 0; i < Block<D>::width; ++i) {
    lanes.curvature[i] = lanes.share_a[i] = 0;
    if (indices[i] == none || !constrained.contacts[indices[i]].round) continue;
    const ContactManifold& m = constrained.manifolds[constrained.contacts[indices[i]].manifold];
    lanes.curvature[i] = m.curvature(), lanes.share_a[i] = m.share_a();
  }
}

/// The manifolds of a block's lanes at their bodies' poses, as `prepare_contact_rows` reads them; `round`: some are of
/// round contacts.
template <class D, bool round>
struct PosedManifolds {
  using V = hn::Vec<D>;
  const LaneContacts<D>& lanes;
  const BodiesView& view;
  int max_points;
  Mat3V<V> rot_a, rot_b;
  Vec3V<V> apart;
  QuadV<V> normals, tangents, impulses, frictions;

  HWY_INLINE PosedManifolds(const LaneContacts<D>& of, int most, const BodiesView& bodies)
      : lanes(of),
        view(bodies),
        max_points(most),
        rot_a(rotation(of.quad(of.pose_a, 4))),
        rot_b(rotation(of.quad(of.pose_b, 4))),
        apart(of.quad(of.pose_b, 0).xyz() - of.quad(of.pose_a, 0).xyz()),
        normals(of.quad(of.manifold, 0)),
        tangents(of.quad(of.manifold, 4)),
        impulses(of.quad(of.manifold, 8)),
        frictions(of.quad(of.manifold, 12)) {}

  HWY_INLINE int end() const { return max_points; }
  HWY_INLINE static constexpr bool has(int) { return true; }
  HWY_INLINE auto used(int i) const { return hn::Gt(hn::Load(D(), lanes.counts), hn::Set(D(), static_cast<float>(i))); }
  HWY_INLINE Vec3V<V> normal() const { return rot_a * normals.xyz(); }
  HWY_INLINE Vec3V<V> tangent() const { return rot_a * tangents.xyz(); }
  HWY_INLINE Vec3V<V> between() const { return apart; }
  HWY_INLINE Vec3V<V> on_a(int i) const { return rot_a * anchor(i, 0).xyz(); }
  HWY_INLINE Vec3V<V> on_b(int i) const { return apart + rot_b * anchor(i, 4).xyz(); }
  HWY_INLINE V impulse(int i) const {
    return i == 0 ? impulses.x : i == 1 ? impulses.y : i == 2 ? impulses.z : impulses.w;
  }
  HWY_INLINE V friction() const { return normals.w; }
  HWY_INLINE V restitution() const { return tangents.w; }
  HWY_INLINE FrictionImpulse<V> friction_impulse() const { return {frictions.x, frictions.y, frictions.z}; }
  template <class Masses>
  HWY_INLINE void move_arms(Vec3V<V> normal, V load, V gap, const Masses& masses, Vec3V<V>& arm_a,
                            Vec3V<V>& arm_b) const {
    if constexpr (round) {
      const D d;
      const V curvature = hn::Load(d, lanes.curvature);
      const V half = hn::IfThenElseZero(hn::Gt(curvature, hn::Zero(d)), hn::Set(d, view.half_step));
      move_arms_midway<V>({half, hn::Set(d, view.substeps), curvature, hn::Load(d, lanes.share_a)}, load, gap,
                          LaneMotion<D>(lanes), masses, normal, arm_a, arm_b);
    }
  }

 private:
  HWY_INLINE static Mat3V<V> rotation(const QuadV<V>& q) { return to_matrix(D(), q.x, q.y, q.z, q.w); }
  HWY_INLINE QuadV<V> anchor(int i, std::size_t side) const {
    return lanes.quad(lanes.manifold, 16 + side + 8 * static_cast<std::size_t>(i));
  }
};

/// Inverse masses and inertias of a block's lanes.
template <class D>
struct LaneMasses {
  using V = hn::Vec<D>;
  using Inertia = InverseInertia<V, SymMat3V<V>>;
  static constexpr bool only_pushes_b = false;
  Inertia a, b;

  HWY_INLINE explicit LaneMasses(const LaneContacts<D>& lanes)
      : a{lanes.quad(lanes.body_a, 8).w, load_inertia<D>(lanes, lanes.inertia_of_a, lanes.quad(lanes.body_a, 12).w)},
        b{lanes.quad(lanes.body_b, 8).w, load_inertia<D>(lanes, lanes.inertia_of_b, lanes.quad(lanes.body_b, 12).w)} {}

  HWY_INLINE const Inertia& inverse_of_a() const { return a; }
  HWY_INLINE const Inertia& inverse_of_b() const { return b; }
};

/// Prepares the rows of a block whose lanes have been located.
template <bool round, class D>
HWY_INLINE void prepare_located(const Block<D>& block, const LaneContacts<D>& lanes, const std::uint32_t* indices,
                                const Constrained& constrained, const BodiesView& view) {
  const D d;
  const PosedManifolds<D, round> manifolds(lanes, block.header().max_points, view);
  const LaneMasses<D> masses(lanes);
  const auto offset = hn::Load(d, lanes.offsets);
  ContactRows<D> rows{block};
  const auto nearest = prepare_contact_rows(manifolds, offset, masses, rows);
  block.set(step_impulse, hn::Zero(d));
  block.header().has_offsets = !hn::AllTrue(d, hn::Eq(offset, hn::Zero(d)));
  block.header().deep = !hn::AllFalse(d, hn::Lt(nearest, hn::Set(d, -view.min_deep)));
  note_touch_bits(block, lanes, nearest);
  if (HWY_UNLIKELY(block.header().rare)) store_own_softness(block, indices, constrained, view);
  if (!block.header().isotropic) {
    block.set_inertia(inertia_a, masses.a.spin);
    block.set_inertia(inertia_b, masses.b.spin);
  }
  if (block.header().restitution) {
    block.set(BounceField::restitution, manifolds.restitution());
    block.set(BounceField::pull, dot(block.get3(normal_x), load_acceleration(block.b(), view, masses.b.mass) -
                                                               load_acceleration(block.a(), view, masses.a.mass)));
  }
  if (view.any_fast) note_closing(block, lanes, constrained.touches.hit_threshold);
  if constexpr (round) prepare_round(block, indices, constrained);
  if (block.header().ahead) prepare_ahead(block, indices, constrained, view);
  if (block.header().surface) prepare_surfaces(block, indices, constrained);
}

/// Out of line, so that it costs other blocks nothing.
template <class D>
HWY_NOINLINE void prepare_with_round(const Block<D>& block, LaneContacts<D>& lanes, const std::uint32_t* indices,
                                     const Constrained& constrained, const BodiesView& view) {
  locate_round(lanes, indices, constrained);
  prepare_located<true>(block, lanes, indices, constrained, view);
}

/// Prepares the rows of one block. Returns the number of its points.
template <class D>
HWY_INLINE std::size_t prepare_contacts(const Block<D>& block, const std::uint32_t* indices,
                                        const Constrained& constrained, const BodiesView& view) {
  LaneContacts<D> lanes;
  const std::size_t point_count = locate_lanes(block, indices, constrained, view, lanes);
  if (block.header().round)
    prepare_with_round(block, lanes, indices, constrained, view);
  else
    prepare_located<false>(block, lanes, indices, constrained, view);
  return point_count;
}

/// Prefetches the sources of a block, most of which other threads wrote. The contacts themselves are fetched one block
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
HWY_INLINE Vec3 slide_of(const Block<D>& block, std::size_t lane) {
  if (!block.header().surface) return {};
  return {block.at(surface_x)[lane], block.at(surface_y)[lane], block.at(surface_z)[lane]};
}

/// Depth of the deepest point at the start of the step (m).
template <class D>
HWY_INLINE float depth_of(const Block<D>& block, std::size_t lane, const Constrained& constrained, const Contact& c) {
  float nearest = 1e30f;
  for (int i = 0; i < constrained.manifolds[c.manifold].point_count(); ++i)
    nearest = min(nearest, block.at(Block<D>::point(i, point_separation))[lane]);
  return c.slack.offset() - nearest;
}

template <class D>
HWY_INLINE void watch_loads(const Block<D>& block, const LoadWatch& watch) {
  const D d;
  const auto speed = hn::Mul(block.get(step_impulse), block.get(k_nn));
  if (hn::AllFalse(d, hn::Gt(speed, hn::Set(d, watch.least)))) return;
  HWY_ALIGN float speeds[Block<D>::width];
  hn::Store(speed, d, speeds);
  for (std::size_t i = 0; i < block.header().lanes; ++i) {
    if (!(speeds[i] > watch.least) || block.manifold()[i] == none) continue;
    const float impulse = block.at(step_impulse)[i];
    bool is_linked = false;
    if (watch.link_contacts) {
      const Vec3 normal{block.at(normal_x)[i], block.at(normal_y)[i], block.at(normal_z)[i]};
      is_linked = watch.link_contacts->is_chosen(block.manifold()[i]);
      if (is_linked && !watch.link_contacts->adds_inertia(block.manifold()[i], normal)) continue;
    }
    watch.look_at(block.a()[i], block.b()[i], impulse, slide_of(block, i), is_linked);
  }
}

/// Fades the overlaps of contacts whose bodies began inside each other, and changes the lifts of those that a load
/// presses deep.
template <class D>
HWY_NOINLINE void change_offsets(const Block<D>& block, const std::uint32_t* indices, const Constrained& constrained,
                                 float overlap_kept, const LoadWatch& watch) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    if (indices[lane] == none) continue;
    Contact& c = constrained.contacts[indices[lane]];
    const float overlap = c.slack.overlap(), lift = c.slack.lift(), depth = depth_of(block, lane, constrained, c);
    if (overlap > 0) {
      c.slack = Slack::of_overlap(faded_overlap(overlap, -depth, overlap_kept));
      continue;
    }
    const float next = watch.next_lift(lift, c.a, c.b, depth, block.at(step_impulse)[lane], slide_of(block, lane));
    if (lift > 0 || (next > lift_gone && !c.ahead)) c.slack = Slack::of_lift(next);
  }
}

/// Notes lanes that began or stopped touching, and those that may have hit.
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
    const ContactFrame frame{get3(normal_x), get3(tangent_x), get3(arm_a_x), get3(arm_b_x), {}, {}};
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

/// Stores impulses to the manifolds, and the step's offsets to the contacts.
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
  if (h.has_offsets || h.deep) change_offsets(block, refs, constrained, overlap_kept, watch);
  if (h.rolls) store_rolling(block, constrained);
  if (watch.overloads) watch_loads(block, watch);
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
