// A world as bytes: World::save and World::restore.
//
// Sealed (world/sealed_bytes.hpp): definition, number of steps, bodies, joints, excluded pairs, joints broken in the
// last step, bodies in sensors, and the simulator's own state.
#include <fathom/world.hpp>

#include "world/sealed_bytes.hpp"
#include "world/simulator.hpp"
#include "world/validate.hpp"

namespace fathom {

namespace {

constexpr SealKind snapshot_kind{0x53574d4f48544146, 36, "snapshot", "snapshot of a world"};  // "FATHOMWS"

/// A definition without what is specific to the machine: threads, device and log.
template <class Archive, class Def>
void archive_definition(Archive& a, Def& def) {
  a(def.simulator, def.gravity, def.dt, def.broad_phase, def.sweep_axis, def.partition, def.max_bodies);
  auto& s = def.solver;
  a(s.method, s.warm_start, s.direct_joints, s.substeps, s.iterations, s.marking_rounds, s.contact_hertz,
    s.contact_damping_ratio, s.push_out_velocity, s.restitution_threshold, s.max_linear_speed);
  a(def.sleep.enabled, def.sleep.linear_speed, def.sleep.time);
}

}  // namespace

void World::save(std::vector<std::byte>& out) const {
  simulator_->callbacks.check_not_called("save");
  begin_sealed(snapshot_kind, out);
  ByteWriter write(out);
  archive_definition(write, simulator_->def);
  write(simulator_->steps);
  simulator_->bodies.save(write);
  simulator_->joints.save(write);
  simulator_->excluded.save(write);
  write(simulator_->broken.of_step(simulator_->steps));
  simulator_->sensors.save(write, simulator_->steps);
  simulator_->save(write);
  seal(out);
}

void World::restore(std::span<const std::byte> bytes) {
  simulator_->callbacks.check_not_called("restore");
  ByteReader in = unsealed(bytes, snapshot_kind);
  WorldDef def = simulator_->def;
  archive_definition(in, def);
  in.require(def.simulator <= SimulatorKind::hybrid);
  in.require_valid([&] { check_world(def); });
  std::unique_ptr<Simulator> fresh = make_simulator(def);
  in(fresh->steps);
  fresh->profile.step = fresh->steps;
  fresh->bodies.restore(in);
  fresh->joints.restore(in, fresh->bodies);
  fresh->excluded.restore(in, fresh->bodies);
  std::vector<JointBreak> broken;
  in(broken);
  fresh->broken.add(broken);
  fresh->sensors.restore(in);
  fresh->restore(in);
  in.require(in.left() == 0);
  fresh->callbacks = std::move(simulator_->callbacks);
  fresh->callbacks_changed();
  simulator_ = std::move(fresh);
}

}  // namespace fathom
