// The configuration keys that are world settings.
#pragma once

#include <string_view>

#include "engine/config.hpp"

namespace fathom::engine {

/// Calls `visit(key, in_settings, in_world)` for each; both are generic lambdas from the whole to the value.
template <class Visit>
void for_each_world_key(Visit visit) {
#define FATHOM_WORLD_KEY(key, member) \
  visit(                              \
      "simulator." #key, [](auto& s) -> auto& { return s.key; }, [](auto& w) -> auto& { return w.member; })
  FATHOM_WORLD_KEY(kind, simulator);
  FATHOM_WORLD_KEY(device, device);
  FATHOM_WORLD_KEY(device_ahead, ahead);
  FATHOM_WORLD_KEY(threads, threads);
  FATHOM_WORLD_KEY(dt, dt);
  FATHOM_WORLD_KEY(gravity, gravity);
  FATHOM_WORLD_KEY(max_bodies, max_bodies);
  FATHOM_WORLD_KEY(broad_phase, broad_phase);
  FATHOM_WORLD_KEY(sweep_axis, sweep_axis);
  FATHOM_WORLD_KEY(partition, partition);
  FATHOM_WORLD_KEY(solver, solver.method);
  FATHOM_WORLD_KEY(warm_start, solver.warm_start);
  FATHOM_WORLD_KEY(direct_joints, solver.direct_joints);
  FATHOM_WORLD_KEY(substeps, solver.substeps);
  FATHOM_WORLD_KEY(iterations, solver.iterations);
  FATHOM_WORLD_KEY(marking_rounds, solver.marking_rounds);
  FATHOM_WORLD_KEY(contact_hertz, solver.contact_hertz);
  FATHOM_WORLD_KEY(contact_damping_ratio, solver.contact_damping_ratio);
  FATHOM_WORLD_KEY(push_out_velocity, solver.push_out_velocity);
  FATHOM_WORLD_KEY(restitution_threshold, solver.restitution_threshold);
  FATHOM_WORLD_KEY(max_linear_speed, solver.max_linear_speed);
  FATHOM_WORLD_KEY(sleep, sleep.enabled);
  FATHOM_WORLD_KEY(sleep_linear_speed, sleep.linear_speed);
  FATHOM_WORLD_KEY(sleep_time, sleep.time);
#undef FATHOM_WORLD_KEY
}

}  // namespace fathom::engine
