// The joint laws (src/dynamics) over a device's rows, with the interface that a sweep expects:
//     begin_without_impulses();  warm_start(bodies);  solve<pass>(bodies, h, ends_substep);
//     forget();  store(rows, ends_substep);
// `solve` returns a sum that is finite only if all results are; otherwise `forget` is called. `by_inertia`: bodies with
// a single inverse inertia have separate code, which is worthwhile for short rows.
#pragma once

#include "device/constraint_rows.hpp"
#include "device/joint_arrays.hpp"
#include "dynamics/ball_joint.hpp"
#include "dynamics/generic_joint.hpp"

namespace fathom::device {

struct BallJointSweep {
  static constexpr bool by_inertia = true;
  BallJointRow<float> row;

  FATHOM_HD_INLINED explicit BallJointSweep(const Quad* rows) : row(joint_of(rows)) {}
  FATHOM_HD_INLINED void begin_without_impulses() { row.impulse = row.moment_a = row.moment_b = {}; }
  FATHOM_HD_INLINED void forget() {
    begin_without_impulses();
    row.total = {};
  }
  template <class Bodies>
  FATHOM_HD_INLINED void warm_start(Bodies& bodies) {
    warm_start_ball_joint(row, bodies);
  }
  template <JointPass pass, class Bodies>
  FATHOM_HD_INLINED float solve(Bodies& bodies, float h, bool ends_substep) {
    return solve_ball_joint<pass>(row, bodies, h, ends_substep);
  }
  FATHOM_HD_INLINED void store(Quad* rows, bool ends_substep) const {
    store_joint_impulse(rows, row);
    if (ends_substep) store_joint_total(rows, row);
  }
};

struct GenericJointSweep {
  static constexpr bool by_inertia = false;
  GenericJointRow<float> row;
  JointUse use;
  JointReactions& reactions;

  FATHOM_HD_INLINED GenericJointSweep(const Quad* rows, const GenericJoint& joint, JointReactions& of)
      : row(generic_joint_of(rows, joint)), use(joint.use()), reactions(of) {
    load_reactions(reactions, joint.min_hit, use, row);
  }
  FATHOM_HD_INLINED void begin_without_impulses() {
    for (int i = 0; i < axis_count; ++i) row.hold[i] = row.drive[i] = 0;
    row.given = row.moment_a = row.moment_b = row.pulled = row.pulled_a = row.pulled_b = {};
  }
  FATHOM_HD_INLINED void forget() {
    begin_without_impulses();
    row.force = row.torque = {};
  }
  template <class Bodies>
  FATHOM_HD_INLINED void warm_start(Bodies& bodies) {
    warm_start_generic_joint(row, bodies);
  }
  template <JointPass pass, class Bodies>
  FATHOM_HD_INLINED float solve(Bodies& bodies, float h, bool ends_substep) {
    return solve_generic_joint<pass>(row, bodies, h, use, ends_substep);
  }
  FATHOM_HD_INLINED void store(Quad* rows, bool) const {
    store_generic_impulses(rows, row);
    store_reactions(reactions, row, use);
  }
};

struct CouplingSweep {
  static constexpr bool by_inertia = false;
  CouplingRow<float> row;

  FATHOM_HD_INLINED CouplingSweep(const Quad* rows, const GenericJoint& joint, const JointReactions& reactions)
      : row(coupling_of(rows, joint, reactions)) {}
  FATHOM_HD_INLINED void begin_without_impulses() {
    row.impulse = 0;
    row.given_a = row.given_b = row.moment_a = row.moment_b = {};
  }
  FATHOM_HD_INLINED void forget() {
    begin_without_impulses();
    row.force = row.torque = {};
  }
  template <class Bodies>
  FATHOM_HD_INLINED void warm_start(Bodies& bodies) {
    warm_start_coupling(row, bodies);
  }
  template <JointPass pass, class Bodies>
  FATHOM_HD_INLINED float solve(Bodies& bodies, float h, bool ends_substep) {
    return solve_coupling<pass>(row, bodies, h, ends_substep);
  }
  FATHOM_HD_INLINED void store(Quad* rows, bool) const { store_coupling_impulses(rows, row); }
};

}  // namespace fathom::device
