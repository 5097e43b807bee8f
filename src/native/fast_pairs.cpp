// Pairs that move fast for their size (dynamics/look_ahead.hpp). In a file of their own, or the compiler would call
// what every contact needs where it is inlined now: the functions of poses.
#include "native/native_simulator.hpp"

namespace fathom::native {

Change NarrowPhase::take_fast(std::uint32_t index, Contact& c, const Manifold& fresh, const Inspection& seen,
                              ContactManifold* manifold) const {
  const BodyInfo &a = bodies[c.a], &b = bodies[c.b];
  const LookAhead found = look_ahead({a.geometry, a.radius, state.poses[c.a], state.velocities[c.a]},
                                     {b.geometry, b.radius, state.poses[c.b], state.velocities[c.b]}, fresh,
                                     seen.margin, min(half_thickness(a), half_thickness(b)), dt);
  if (found.is_fast && c.fixed_a) {
    const Pose &pose_a = state.poses[c.a], &pose_b = state.poses[c.b];
    fast.push_back({index, c.a, c.b, pose_a, pose_b, found.first});
  }
  if (found.ahead == Ahead::meets) return put(index, c, found.manifold, found.b_in_a, found.time, manifold);
  return put(index, c, found.ahead == Ahead::nothing ? Manifold{} : fresh, seen.b_in_a, -1, manifold);
}

/// What came out inside or behind something fixed goes as far as its way was free, and on in the next step.
void NativeSimulator::hold_back_fast() {
  const SpeedLimits limits =
      speed_limits(def.solver.max_linear_speed, def.dt / static_cast<float>(def.solver.substeps));
  for (const std::size_t block : fast_blocks_)
    for (const FastPair& pair : blocks_[block].fast) {
      if ((state_.flags[pair.b] & (awake | isolated)) != awake) continue;
      const BodyInfo &a = bodies[pair.a], &b = bodies[pair.b];
      const Pose end = state_.poses[pair.b];
      Velocity v = state_.velocities[pair.b];
      const FreeWay way = free_way({a.geometry, a.radius, pair.pose_a, state_.velocities[pair.a]},
                                   {b.geometry, b.radius, pair.pose_b, v}, state_.poses[pair.a], end, pair.first,
                                   min(half_thickness(a), half_thickness(b)), def.dt);
      if (way.is_free) continue;
      v.linear = limited(way.linear, limits.linear);
      place(pair.b, end_of(way, pair.pose_b, end, def.dt), v);
      const Contact& c = graph_[pair.contact];
      if (c.touching()) graph_.manifold(c).forget_build();
    }
}

}  // namespace fathom::native
