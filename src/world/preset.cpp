// Sets of algorithms that go together.
#include <fathom/world.hpp>

namespace fathom {

void apply(Preset preset, WorldDef& def) {
  const WorldDef defaults;
  const bool published = preset == Preset::dissertation;
  const bool device = def.simulator == SimulatorKind::device;
  def.broad_phase = published ? BroadPhase::sweep : defaults.broad_phase;
  def.partition = published ? Partition::cells : defaults.partition;
  def.solver.method = published ? Solver::impulse : defaults.solver.method;
  def.solver.warm_start = !(published && device);
  // The bias depends only on penetration and Δt (equation 3.20); only the maximum speed of bodies limits it.
  def.solver.push_out_velocity = published ? def.solver.max_linear_speed : defaults.solver.push_out_velocity;
  if (published) def.sleep.enabled = false;
  def.ahead = published && device ? 2 : defaults.ahead;
}

}  // namespace fathom
