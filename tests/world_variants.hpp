// The ways to simulate a world that tests of features common to all of them go through.
#pragma once

#include <fathom/world.hpp>
#include <ostream>

#include "world_fixture.hpp"

namespace fathom::test {

struct Variant {
  const char* name;
  SimulatorKind simulator = SimulatorKind::native;
  Partition partition = Partition::colours;
  Solver solver = Solver::soft;
  BroadPhase broad_phase = BroadPhase::tree;

  friend std::ostream& operator<<(std::ostream& out, const Variant& v) { return out << v.name; }
};

inline constexpr Variant all_variants[] = {
    {"native"},
    {"native_impulse", SimulatorKind::native, Partition::colours, Solver::impulse},
    {"native_cells", SimulatorKind::native, Partition::cells},
    {"hybrid", SimulatorKind::hybrid},
    {"device", SimulatorKind::device},
    {"device_impulse", SimulatorKind::device, Partition::colours, Solver::impulse},
    {"device_cells", SimulatorKind::device, Partition::cells},
};

/// With sleeping on.
inline WorldDef sleepy_world(const Variant& variant, int threads = 1) {
  WorldDef def;
  def.simulator = variant.simulator;
  def.device = test_device();
  def.partition = variant.partition;
  def.solver.method = variant.solver;
  def.broad_phase = variant.broad_phase;
  def.threads = threads;
  return def;
}
inline WorldDef quiet_world(const Variant& variant, int threads = 1) {
  WorldDef def = sleepy_world(variant, threads);
  def.sleep.enabled = false;
  return def;
}

}  // namespace fathom::test
