// Couplings in vector lanes: gathering, the law (dynamics/coupling-inl.hpp), scattering.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_COUPLINGS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_COUPLINGS_INL
#undef FATHOM_COUPLINGS_INL
#else
#define FATHOM_COUPLINGS_INL
#endif

#include <hwy/highway.h>

#include "native/generic_joints-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

#define FATHOM_LANE_FUNCTION HWY_INLINE
#define FATHOM_LANE_LAMBDA HWY_ATTR
#include "dynamics/coupling-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// Fields of a block of couplings, starting where those of generic joints do. A row's members are in their order.
enum CouplingField : int {
  coupling_start = surface_field_count,
  coupling_written = coupling_start + 8 + 12 + 4 + 2 * coupled_field_count + 1 + 5 + 3,
  coupling_forces = coupling_written + 1 + 4 + 12,
  coupling_field_count = coupling_forces + 6
};
static_assert(static_cast<int>(coupling_field_count) <= static_cast<int>(generic_field_count));

/// Visits the members of a row that sweeps write, in the order of fields.
template <class Row, class Visit>
HWY_INLINE void visit_written(Row& row, const Visit& visit) {
  visit(row.impulse);
  visit(row.angle_a.turns), visit(row.angle_a.angle), visit(row.angle_b.turns), visit(row.angle_b.angle);
  visit(row.given_a), visit(row.given_b), visit(row.moment_a), visit(row.moment_b);
  visit(row.force), visit(row.torque);
}
/// Visits those that sweeps only read.
template <class Row, class Visit>
HWY_INLINE void visit_read(Row& row, const Visit& visit) {
  visit(row.frame_a.w), visit(row.frame_a.v), visit(row.frame_b.w), visit(row.frame_b.v);
  visit(row.arm_a), visit(row.arm_b), visit(row.way_a), visit(row.way_b);
  visit(row.start_a.turns), visit(row.start_a.angle), visit(row.start_b.turns), visit(row.start_b.angle);
  const auto visit_end = [&](auto& end) HWY_ATTR {
    visit(end.from.w), visit(end.from.v), visit(end.turns), visit(end.rope), visit(end.share);
  };
  visit_end(row.coupling.a), visit_end(row.coupling.b);
  visit(row.coupling.tells_a);
  visit(row.bias_rate), visit(row.mass_scale), visit(row.impulse_scale), visit(row.rigid);
  visit(row.compliance);
  visit(row.lower), visit(row.upper), visit(row.limited);
}

template <class D>
struct FieldLoader {
  const Block<D>& block;
  mutable int field;

  HWY_INLINE void operator()(hn::Vec<D>& value) const { value = block.get(field++); }
  HWY_INLINE void operator()(Vec3V<hn::Vec<D>>& v) const { v = block.get3(field), field += 3; }
};
template <class D>
struct FieldStorer {
  const Block<D>& block;
  mutable int field;

  HWY_INLINE void operator()(const hn::Vec<D>& value) const { block.set(field++, value); }
  HWY_INLINE void operator()(const Vec3V<hn::Vec<D>>& v) const { block.set3(field, v), field += 3; }
};
/// One lane's fields.
template <class D>
struct CouplingLaneWriter {
  const Block<D>& block;
  std::size_t lane;
  mutable int field;

  HWY_INLINE void operator()(const float& value) const { block.at(field++)[lane] = value; }
  HWY_INLINE void operator()(const Vec3& v) const { (*this)(v.x), (*this)(v.y), (*this)(v.z); }
};
template <class D>
struct CouplingLaneReader {
  const Block<D>& block;
  std::size_t lane;
  mutable int field;

  HWY_INLINE void operator()(float& value) const { value = block.at(field++)[lane]; }
  HWY_INLINE void operator()(Vec3& v) const { (*this)(v.x), (*this)(v.y), (*this)(v.z); }
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE void load_coupling(const Block<D>& block, CouplingRow<V>& row) {
  visit_read(row, FieldLoader<D>{block, coupling_start});
  visit_written(row, FieldLoader<D>{block, coupling_written});
}

template <class D>
HWY_NOINLINE void prepare_couplings(const Block<D>& block, const ConstraintRef* refs, const Constrained& constrained,
                                    const BodiesView& view) {
  constexpr std::size_t width = Block<D>::width;
  const auto zero = hn::Zero(D());
  BlockHeader& h = block.header();
  h = {};
  h.kind = ConstraintKind::coupling;
  h.fixed_a = h.still_a = h.isotropic = true;
  for (std::size_t lane = 0; lane < width; ++lane) block.a()[lane] = block.b()[lane] = block.manifold()[lane] = none;
  for (int field = coupling_start; field < coupling_field_count; ++field) block.set(field, zero);
  std::size_t lane = 0;
  for (; lane < width && refs[lane] != none; ++lane) {
    const std::uint32_t index = index_of(refs[lane]);
    const Joint& joint = constrained.joints[index];
    const auto row = prepared_coupling(constrained.generic_joints[index], joint.anchor_a, joint.anchor_b,
                                       view.poses[joint.a], view.poses[joint.b], constrained.generic_impulses[index]);
    block.manifold()[lane] = refs[lane];
    visit_read(row, CouplingLaneWriter<D>{block, lane, coupling_start});
    visit_written(row, CouplingLaneWriter<D>{block, lane, coupling_written});
    load_joint_bodies(block, lane, joint, view);
  }
  h.lanes = static_cast<std::uint8_t>(lane);
  load_joint_inertias(block, view);
}

/// Zeroes the written fields of lanes whose bit is not set.
template <class D>
HWY_NOINLINE void forget_couplings(const Block<D>& block, const std::uint8_t* bits) {
  for (std::size_t i = 0; i < hn::MaxLanes(D()); ++i) {
    if (bits[i / 8] >> i % 8 & 1) continue;
    for (int field = coupling_written; field < coupling_field_count; ++field) block.at(field)[i] = 0;
  }
}

template <class D, class Act>
HWY_INLINE void with_couplings(const Block<D>& block, SolverBody* all, const Act& act) {
  if (block.header().lanes == 0) return;
  AnyBodies<D> bodies;
  bodies.load(block, all);
  CouplingRow<hn::Vec<D>> row;
  load_coupling(block, row);
  act(row, bodies);
}

template <JointPass pass, class D>
HWY_NOINLINE void sweep_couplings(const Block<D>& block, SolverBody* all, float h, bool ends_substep) {
  with_couplings(block, all, [&](auto& row, auto& bodies) HWY_ATTR {
    const auto sum = solve_coupling<pass>(row, bodies, hn::Set(D(), h), ends_substep);
    visit_written(row, FieldStorer<D>{block, coupling_written});
    store_bodies(block, bodies, sum, [&](const std::uint8_t* finite) HWY_ATTR { forget_couplings(block, finite); });
  });
}

template <class D>
HWY_NOINLINE void warm_start_couplings(const Block<D>& block, SolverBody* all) {
  with_couplings(block, all, [&](auto& row, auto& bodies) HWY_ATTR {
    warm_start_coupling(row, bodies);
    visit_written(row, FieldStorer<D>{block, coupling_written});
    bodies.store(block.header().lanes);
  });
}

template <class D>
HWY_NOINLINE void clear_couplings(const Block<D>& block) {
  const auto zero = hn::Zero(D());
  block.set(coupling_written, zero);
  for (int field = coupling_written + 5; field < coupling_forces; ++field) block.set(field, zero);
}

template <class D>
HWY_NOINLINE void store_couplings(const Block<D>& block, const Constrained& constrained) {
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    fathom::CouplingRow<float> row{};
    visit_written(row, CouplingLaneReader<D>{block, lane, coupling_written});
    constrained.generic_impulses[index_of(block.manifold()[lane])] = impulse_of(row);
  }
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
