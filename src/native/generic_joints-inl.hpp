// Generic joints in vector lanes: gathering, the law (dynamics/generic_joint-inl.hpp), scattering.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_GENERIC_JOINTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_GENERIC_JOINTS_INL
#undef FATHOM_GENERIC_JOINTS_INL
#else
#define FATHOM_GENERIC_JOINTS_INL
#endif

#include <hwy/highway.h>

#include "native/ball_joints-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

#define FATHOM_LANE_FUNCTION HWY_INLINE
#define FATHOM_LANE_LAMBDA HWY_ATTR
#include "dynamics/angle-inl.hpp"
#include "dynamics/generic_rows-inl.hpp"
// Its dependencies are included above.
#include "dynamics/generic_joint-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// Fields of a block of generic joints, after those of contacts, so that inertia tensors are at the same offsets.
enum GenericField : int {
  generic_frame_a = surface_field_count,  // w first
  generic_frame_b = generic_frame_a + 4,
  generic_arm_a = generic_frame_b + 4,
  generic_arm_b = generic_arm_a + 3,
  generic_gap = generic_arm_b + 3,
  generic_pull = generic_gap + 3,
  generic_bias_rate = generic_pull + 3,
  generic_mass_scale,
  generic_impulse_scale,
  generic_distance,
  generic_cone,
  generic_is_soft,
  generic_min_hit,
  generic_axes,
  generic_hold = generic_axes + axis_count * axis_field_count,
  generic_drive = generic_hold + axis_count,
  generic_given = generic_drive + axis_count,
  generic_moment_a = generic_given + 3,
  generic_moment_b = generic_moment_a + 3,
  generic_force = generic_moment_b + 3,
  generic_torque = generic_force + 3,
  generic_pulled = generic_torque + 3,  // if the header says that some lane moves
  generic_pulled_a = generic_pulled + 3,
  generic_pulled_b = generic_pulled_a + 3,
  generic_bounce = generic_pulled_b + 3,  // if the header says that some lane reacts
  generic_rate = generic_bounce + axis_count,
  generic_field_count = generic_rate + axis_count
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE GenericAxis<V> load_axis(const Block<D>& block, int axis) {
  const int first = generic_axes + axis * axis_field_count;
  return {block.get(first),     block.get(first + 1), block.get(first + 2), block.get(first + 3),
          block.get(first + 4), block.get(first + 5), block.get(first + 6), block.get(first + 7),
          block.get(first + 8), block.get(first + 9), block.get(first + 10)};
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void load_generic_joint(const Block<D>& block, GenericJointRow<V>& row) {
  row.frame_a = {block.get(generic_frame_a), block.get3(generic_frame_a + 1)};
  row.frame_b = {block.get(generic_frame_b), block.get3(generic_frame_b + 1)};
  row.arm_a = block.get3(generic_arm_a), row.arm_b = block.get3(generic_arm_b);
  row.gap = block.get3(generic_gap), row.pull = block.get3(generic_pull);
  row.bias_rate = block.get(generic_bias_rate), row.mass_scale = block.get(generic_mass_scale);
  row.impulse_scale = block.get(generic_impulse_scale);
  row.distance = block.get(generic_distance), row.cone = block.get(generic_cone);
  row.is_soft = block.get(generic_is_soft);
  for (int i = 0; i < axis_count; ++i) {
    row.axes[i] = load_axis(block, i);
    row.hold[i] = block.get(generic_hold + i), row.drive[i] = block.get(generic_drive + i);
  }
  row.given = block.get3(generic_given);
  row.moment_a = block.get3(generic_moment_a), row.moment_b = block.get3(generic_moment_b);
  row.force = block.get3(generic_force), row.torque = block.get3(generic_torque);
  if (block.header().moves) {
    row.pulled = block.get3(generic_pulled);
    row.pulled_a = block.get3(generic_pulled_a), row.pulled_b = block.get3(generic_pulled_b);
  }
  if (!block.header().reacts) return;
  row.min_hit = block.get(generic_min_hit);
  for (int i = 0; i < axis_count; ++i)
    row.bounce[i] = block.get(generic_bounce + i), row.rate[i] = block.get(generic_rate + i);
}

/// Stores what sweeps change.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void store_generic_joint(const Block<D>& block, const GenericJointRow<V>& row) {
  for (int i = 0; i < axis_count; ++i)
    block.set(generic_hold + i, row.hold[i]), block.set(generic_drive + i, row.drive[i]);
  block.set3(generic_given, row.given);
  block.set3(generic_moment_a, row.moment_a), block.set3(generic_moment_b, row.moment_b);
  block.set3(generic_force, row.force), block.set3(generic_torque, row.torque);
  if (block.header().moves) {
    block.set3(generic_pulled, row.pulled);
    block.set3(generic_pulled_a, row.pulled_a), block.set3(generic_pulled_b, row.pulled_b);
  }
  if (!block.header().reacts) return;
  for (int i = 0; i < axis_count; ++i)
    block.set(generic_bounce + i, row.bounce[i]), block.set(generic_rate + i, row.rate[i]);
}

/// Writes one lane's fields in sequence.
template <class D>
struct LaneWriter {
  const Block<D>& block;
  std::size_t lane;
  int field;

  HWY_INLINE void operator()(float value) { block.at(field++)[lane] = value; }
  HWY_INLINE void operator()(Vec3 v) { (*this)(v.x), (*this)(v.y), (*this)(v.z); }
  HWY_INLINE void operator()(const fathom::UnitQuat<float>& q) { (*this)(q.w), (*this)(q.v); }
};

template <class D>
HWY_NOINLINE void write_generic_lane(const Block<D>& block, std::size_t lane, const fathom::GenericJointRow<float>& row,
                                     const GenericJoint& joint, const GenericImpulse& impulse) {
  LaneWriter<D> write{block, lane, generic_frame_a};
  write(row.frame_a), write(row.frame_b);
  write(row.arm_a), write(row.arm_b), write(row.gap), write(row.pull);
  write(joint.softness.bias_rate), write(joint.softness.mass_scale), write(joint.softness.impulse_scale);
  write(joint.distance), write(joint.cone), write(joint.is_soft), write(joint.min_hit);
  for (const fathom::GenericAxis<float>& a : joint.axes) {
    write(a.locked), write(a.limited), write(a.lower), write(a.upper), write(a.target);
    write(a.approach), write(a.velocity), write(a.compliance), write(a.most);
    write(a.restitution), write(a.armature);
  }
  for (const float hold : impulse.hold) write(hold);
  for (const float drive : impulse.drive) write(drive);
  if (joint.reacts == 0) return;
  write.field = generic_rate;
  for (const float rate : row.rate) write(rate);
}

/// Leaves out joints of mechanisms that are solved directly.
template <class D>
HWY_NOINLINE void prepare_generic_joints(const Block<D>& block, const ConstraintRef* refs,
                                         const Constrained& constrained, const BodiesView& view) {
  constexpr std::size_t width = Block<D>::width;
  const auto zero = hn::Zero(D());
  BlockHeader& h = block.header();
  h = {};
  h.kind = ConstraintKind::generic_joint;
  h.fixed_a = h.still_a = h.isotropic = true;
  for (std::size_t lane = 0; lane < width; ++lane) block.a()[lane] = block.b()[lane] = block.manifold()[lane] = none;
  std::size_t lane = 0;
  for (std::size_t i = 0; i < width && refs[i] != none; ++i) {
    const std::uint32_t index = index_of(refs[i]);
    if (view.direct && view.direct[index]) continue;
    // Only where sweeps will read the block, which has 9 KB.
    if (lane == 0)
      for (int field = generic_frame_a; field < generic_field_count; ++field) block.set(field, zero);
    const Joint& joint = constrained.joints[index];
    const GenericJoint& generic = constrained.generic_joints[index];
    const Pose &a = view.poses[joint.a], &b = view.poses[joint.b];
    const auto unit = [](const Pose& pose) { return fathom::UnitQuat<float>{pose.rotation.w, pose.rotation.vector()}; };
    block.manifold()[lane] = refs[i];
    fathom::GenericJointRow<float> row{};
    fathom::prepare_generic_joint<float>(unit(a), unit(b), b.position - a.position, generic.on_a, generic.on_b,
                                         joint.anchor_a, joint.anchor_b, row);
    row.pull = swing_acceleration(view, joint.b) - swing_acceleration(view, joint.a);
    if (generic.reacts != 0) begin_rates(row, generic, view.bodies[joint.a], view.bodies[joint.b]);
    write_generic_lane(block, lane, row, generic, started(constrained.generic_impulses[index], joint.max_start));
    load_joint_bodies(block, lane, joint, view);
    h.moves = h.moves || generic.moves != 0;
    h.reacts = h.reacts || generic.reacts != 0;
    h.lanes = static_cast<std::uint8_t>(++lane);
  }
  if (lane == 0) return;
  load_joint_inertias(block, view);
}

/// Zeroes the impulses of lanes whose bit is not set.
template <class D>
HWY_NOINLINE void forget_generic_impulses(const Block<D>& block, const std::uint8_t* bits) {
  for (std::size_t i = 0; i < hn::MaxLanes(D()); ++i) {
    if (bits[i / 8] >> i % 8 & 1) continue;
    for (int field = generic_hold; field < generic_field_count; ++field) block.at(field)[i] = 0;
  }
}

HWY_INLINE JointUse use_of(const BlockHeader& h) { return {h.moves, h.reacts}; }

template <JointPass pass, class D>
HWY_NOINLINE void sweep_generic_joints(const Block<D>& block, SolverBody* all, float h, bool ends_substep) {
  if (block.header().lanes == 0) return;
  AnyBodies<D> bodies;
  bodies.load(block, all);
  GenericJointRow<hn::Vec<D>> row;
  load_generic_joint(block, row);
  const auto sum = solve_generic_joint<pass>(row, bodies, hn::Set(D(), h), use_of(block.header()), ends_substep);
  store_generic_joint(block, row);
  store_bodies(block, bodies, sum,
               [&](const std::uint8_t* finite) HWY_ATTR { forget_generic_impulses(block, finite); });
}

template <class D>
HWY_NOINLINE void warm_start_generic_joints(const Block<D>& block, SolverBody* all) {
  if (block.header().lanes == 0) return;
  AnyBodies<D> bodies;
  bodies.load(block, all);
  GenericJointRow<hn::Vec<D>> row;
  load_generic_joint(block, row);
  warm_start_generic_joint(row, bodies);
  store_generic_joint(block, row);
  bodies.store(block.header().lanes);
}

template <class D>
HWY_NOINLINE void clear_generic_joints(const Block<D>& block) {
  const auto zero = hn::Zero(D());
  for (int field = generic_hold; field < generic_force; ++field) block.set(field, zero);
}

template <class D>
HWY_NOINLINE void store_generic_joints(const Block<D>& block, const Constrained& constrained) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    const auto vector = [&](int field) {
      return Vec3{block.at(field)[lane], block.at(field + 1)[lane], block.at(field + 2)[lane]};
    };
    GenericImpulse& impulse = constrained.generic_impulses[index_of(block.manifold()[lane])];
    for (int i = 0; i < axis_count; ++i) {
      impulse.hold[i] = block.at(generic_hold + i)[lane];
      impulse.drive[i] = block.at(generic_drive + i)[lane];
    }
    impulse.force = vector(generic_force), impulse.torque = vector(generic_torque);
  }
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
