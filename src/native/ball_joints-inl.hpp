// Ball joints in vector lanes: gathering, the law (dynamics/ball_joint-inl.hpp), scattering.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_BALL_JOINTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_BALL_JOINTS_INL
#undef FATHOM_BALL_JOINTS_INL
#else
#define FATHOM_BALL_JOINTS_INL
#endif

#include <hwy/highway.h>

#include "dynamics/tuning.hpp"
#include "native/constraint_block-inl.hpp"
#include "native/lane_bodies-inl.hpp"
#include "native/lane_functions-inl.hpp"
#include "native/prepare-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

#define FATHOM_LANE_FUNCTION HWY_INLINE
#define FATHOM_LANE_LAMBDA HWY_ATTR
#include "dynamics/ball_joint-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// Fields of a block of joints. Inertia tensors are at the same offsets as in contact blocks, so that bodies load the
/// same way.
enum JointField : int {
  joint_arm_a = 0,
  joint_arm_b = 3,
  joint_gap = 6,
  joint_impulse = 9,
  joint_total = 12,
  joint_moment_a = 15,
  joint_moment_b = 18,
  joint_pull = 21,
  joint_bias_rate = 24,
  joint_mass_scale,
  joint_impulse_scale,
  joint_rigid,
  joint_most,
  joint_compliance,
  joint_field_count
};
static_assert(static_cast<int>(joint_field_count) <= static_cast<int>(inertia_a));

template <class D, class V = hn::Vec<D>>
HWY_INLINE BallJointRow<V> load_joint(const Block<D>& block) {
  return {block.get3(joint_arm_a),     block.get3(joint_arm_b),        block.get3(joint_gap),
          block.get3(joint_impulse),   block.get3(joint_total),        block.get3(joint_moment_a),
          block.get3(joint_moment_b),  block.get3(joint_pull),         block.get(joint_bias_rate),
          block.get(joint_mass_scale), block.get(joint_impulse_scale), block.get(joint_rigid),
          block.get(joint_most),       block.get(joint_compliance)};
}

/// Stores what sweeps change.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void store_joint(const Block<D>& block, const BallJointRow<V>& row) {
  block.set3(joint_impulse, row.impulse), block.set3(joint_total, row.total);
  block.set3(joint_moment_a, row.moment_a), block.set3(joint_moment_b, row.moment_b);
}

/// Lanes of vectors, filled one lane at a time.
template <class D>
struct LaneVec3 {
  HWY_ALIGN float at[3][hn::MaxLanes(D())] = {};

  HWY_INLINE void set(std::size_t lane, Vec3 v) { at[0][lane] = v.x, at[1][lane] = v.y, at[2][lane] = v.z; }
  HWY_INLINE Vec3V<hn::Vec<D>> lanes() const {
    return {hn::Load(D(), at[0]), hn::Load(D(), at[1]), hn::Load(D(), at[2])};
  }
};

template <class D>
HWY_INLINE void load_joint_bodies(const Block<D>& block, std::size_t lane, const Joint& joint, const BodiesView& view) {
  BlockHeader& h = block.header();
  const SolverBody &a = view.bodies[joint.a], &b = view.bodies[joint.b];
  h.fixed_a = h.fixed_a && joint.fixed_a;
  h.still_a = h.still_a && joint.fixed_a && length_squared(a.linear) == 0 && length_squared(a.angular) == 0;
  h.isotropic = h.isotropic && !is_anisotropic(a) && !is_anisotropic(b);
  block.a()[lane] = joint.a;
  block.b()[lane] = joint.b;
}

/// Inverse inertias per lane, for blocks with an anisotropic body.
template <class D>
HWY_INLINE void load_joint_inertias(const Block<D>& block, const BodiesView& view) {
  const auto set = [&](int field, std::size_t lane, std::uint32_t slot) {
    SymMat3 m;
    if (slot != none) {
      const SolverBody& body = view.bodies[slot];
      m = world_inertia<SymMat3>(view.inertias, slot, body.inverse_mass, body.inverse_inertia);
    }
    const float elements[] = {m.xx, m.yy, m.zz, m.xy, m.xz, m.yz};
    for (int k = 0; k < 6; ++k) block.at(field + k)[lane] = elements[k];
  };
  for (std::size_t lane = 0; lane < Block<D>::width; ++lane) {
    set(inertia_a, lane, block.a()[lane]);
    set(inertia_b, lane, block.b()[lane]);
  }
}

HWY_INLINE Vec3 swing_acceleration(const BodiesView& view, std::uint32_t slot) {
  return view.swings[slot] ? view.motion[slot].acceleration : Vec3{};
}

/// Leaves out joints of mechanisms that are solved directly.
template <class D>
HWY_NOINLINE void prepare_joints(const Block<D>& block, const ConstraintRef* refs, const Constrained& constrained,
                                 const BodiesView& view) {
  using V = hn::Vec<D>;
  constexpr std::size_t width = Block<D>::width;
  BlockHeader& h = block.header();
  h = {};
  h.kind = ConstraintKind::ball_joint;
  h.fixed_a = h.still_a = h.isotropic = true;
  LaneVec3<D> anchor_a, anchor_b, between, impulse, pull, vector_a, vector_b;
  HWY_ALIGN float w_a[width], w_b[width], softness[6][width] = {};
  for (std::size_t lane = 0; lane < width; ++lane) {
    block.a()[lane] = block.b()[lane] = block.manifold()[lane] = none;
    w_a[lane] = w_b[lane] = 1;
  }
  std::size_t lane = 0;
  for (std::size_t i = 0; i < width && refs[i] != none; ++i) {
    const std::uint32_t index = index_of(refs[i]);
    if (view.direct && view.direct[index]) continue;
    const Joint& joint = constrained.joints[index];
    const Pose &a = view.poses[joint.a], &b = view.poses[joint.b];
    block.manifold()[lane] = refs[i];
    anchor_a.set(lane, joint.anchor_a), anchor_b.set(lane, joint.anchor_b);
    between.set(lane, b.position - a.position);
    const Vec3 last = constrained.joint_impulses[index].last;
    impulse.set(lane, start_share(length_squared(last), joint.max_start) * last);
    pull.set(lane, swing_acceleration(view, joint.b) - swing_acceleration(view, joint.a));
    vector_a.set(lane, a.rotation.vector()), vector_b.set(lane, b.rotation.vector());
    w_a[lane] = a.rotation.w, w_b[lane] = b.rotation.w;
    softness[0][lane] = joint.softness.bias_rate;
    softness[1][lane] = joint.softness.mass_scale;
    softness[2][lane] = joint.softness.impulse_scale;
    softness[3][lane] = joint.rigid ? 1.0f : 0.0f;
    softness[4][lane] = joint.max_impulse;
    softness[5][lane] = joint.softness.compliance;
    load_joint_bodies(block, lane, joint, view);
    h.lanes = static_cast<std::uint8_t>(++lane);
  }
  if (lane == 0) return;
  if (!h.isotropic) load_joint_inertias(block, view);
  const D d;
  BallJointRow<V> row;
  prepare_ball_joint<V>({hn::Load(d, w_a), vector_a.lanes()}, {hn::Load(d, w_b), vector_b.lanes()}, between.lanes(),
                        anchor_a.lanes(), anchor_b.lanes(), impulse.lanes(), row);
  block.set3(joint_arm_a, row.arm_a), block.set3(joint_arm_b, row.arm_b), block.set3(joint_gap, row.gap);
  store_joint(block, row);
  block.set3(joint_pull, pull.lanes());
  for (int k = 0; k < 6; ++k) block.set(joint_bias_rate + k, hn::Load(d, softness[k]));
}

/// Zeroes the impulses of lanes whose bit is not set.
template <class D>
HWY_NOINLINE void forget_joint_impulses(const Block<D>& block, const std::uint8_t* bits) {
  for (std::size_t i = 0; i < hn::MaxLanes(D()); ++i) {
    if (bits[i / 8] >> i % 8 & 1) continue;
    for (int k = 0; k < 3; ++k)
      for (const int field : {joint_impulse, joint_total, joint_moment_a, joint_moment_b}) block.at(field + k)[i] = 0;
  }
}

template <JointPass pass, class D>
HWY_NOINLINE void sweep_joints(const Block<D>& block, SolverBody* all, float h, bool ends_substep) {
  if (block.header().lanes == 0) return;
  by_bodies(block, [&](auto fixed_a, auto isotropic) HWY_ATTR {
    Bodies<D, fixed_a.value, isotropic.value> bodies;
    bodies.load(block, all);
    BallJointRow<hn::Vec<D>> row = load_joint(block);
    const auto sum = solve_ball_joint<pass>(row, bodies, hn::Set(D(), h), ends_substep);
    store_joint(block, row);
    store_bodies(block, bodies, sum,
                 [&](const std::uint8_t* finite) HWY_ATTR { forget_joint_impulses(block, finite); });
  });
}

template <class D>
HWY_NOINLINE void warm_start_joints(const Block<D>& block, SolverBody* all) {
  if (block.header().lanes == 0) return;
  by_bodies(block, [&](auto fixed_a, auto isotropic) HWY_ATTR {
    Bodies<D, fixed_a.value, isotropic.value> bodies;
    bodies.load(block, all);
    BallJointRow<hn::Vec<D>> row = load_joint(block);
    warm_start_ball_joint(row, bodies);
    store_joint(block, row);
    bodies.store(block.header().lanes);
  });
}

template <class D>
HWY_NOINLINE void clear_joints(const Block<D>& block) {
  const auto zero = hn::Zero(D());
  for (const int field : {joint_impulse, joint_moment_a, joint_moment_b}) block.set3(field, {zero, zero, zero});
}

template <class D>
HWY_NOINLINE void store_joints(const Block<D>& block, const Constrained& constrained) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    const auto vector = [&](int field) {
      return Vec3{block.at(field)[lane], block.at(field + 1)[lane], block.at(field + 2)[lane]};
    };
    constrained.joint_impulses[index_of(block.manifold()[lane])] = {vector(joint_impulse), vector(joint_total)};
  }
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
