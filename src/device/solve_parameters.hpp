// Coefficients of the solver on a device.
#pragma once

#include <fathom/world.hpp>

#include "dynamics/softness.hpp"
#include "dynamics/speed_limits.hpp"
#include "dynamics/tuning.hpp"

namespace fathom::device {

struct SolveParameters {
  float h = 0;  ///< s, a substep
  std::uint32_t substeps = 4;
  std::uint32_t sweeps_before = 1;  ///< sweeps per substep before positions move
  std::uint32_t sweeps_after = 1;   ///< and after they move
  bool soft = true;
  bool warm_start = true;  ///< if not, every substep begins without impulses
  ContactSoftness contacts;
  float stiffness = 0;  ///< of contacts between movable bodies (1/s²); 0: no supports are solved directly
  float push_out_velocity = 0, restitution_threshold = 0;
  float friction_lead = 0;  ///< s
  SpeedLimits limits;
};

/// Coefficients of both solvers, the same as in the native simulator.
inline SolveParameters solve_parameters(const WorldDef& def) {
  const SolverSettings& s = def.solver;
  SolveParameters p;
  p.substeps = static_cast<std::uint32_t>(s.substeps);
  p.h = def.dt / static_cast<float>(s.substeps);
  p.push_out_velocity = s.push_out_velocity;
  p.limits = speed_limits(s.max_linear_speed, p.h);
  p.restitution_threshold = bounce_threshold(def, p.h);
  p.friction_lead = friction_lead(s, p.h);
  p.soft = s.method == Solver::soft;
  p.warm_start = s.warm_start;
  if (p.soft) {
    p.contacts = contact_softness(s, p.h);
    const float omega = 2 * pi * contact_hertz(s, p.h);
    if (def.partition == Partition::colours) p.stiffness = omega * omega;
  } else {
    p.sweeps_before = static_cast<std::uint32_t>(s.iterations);
    p.sweeps_after = 0;
    p.contacts.dynamic.bias_rate = p.contacts.fixed.bias_rate = baumgarte / p.h;
  }
  return p;
}

}  // namespace fathom::device
