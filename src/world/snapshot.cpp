// A world as bytes: World::save and World::restore.
//
// magic "FATHOMWS" · version (u32) · reserved (u32) · size of the rest (u64) · its XXH3 (u64) · definition, number of
// steps, bodies, joints, excluded pairs, joints broken in the last step, bodies in sensors, and the simulator's own
// state.
#include <fathom/world.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "world/archive.hpp"
#include "world/simulator.hpp"
#include "world/validate.hpp"

namespace fathom {

namespace {

constexpr std::uint64_t magic = 0x53574d4f48544146;  // "FATHOMWS"
constexpr std::uint32_t version = 30;
constexpr std::size_t head_size = 32;

/// A definition without what is specific to the machine: threads, device and log.
template <class Archive, class Def>
void archive_definition(Archive& a, Def& def) {
  a(def.simulator, def.gravity, def.dt, def.broad_phase, def.sweep_axis, def.partition, def.max_bodies);
  auto& s = def.solver;
  a(s.method, s.warm_start, s.direct_joints, s.substeps, s.iterations, s.marking_rounds, s.contact_hertz,
    s.contact_damping_ratio, s.push_out_velocity, s.restitution_threshold, s.max_linear_speed);
  a(def.sleep.enabled, def.sleep.linear_speed, def.sleep.time);
}

ByteReader checked(std::span<const std::byte> bytes) {
  ByteReader in(bytes, "snapshot");
  if (in.read<std::uint64_t>() != magic) in.fail("this is no snapshot of a world");
  const auto written_as = in.read<std::uint32_t>();
  if (written_as != version)
    in.fail("it has format version " + std::to_string(written_as) + ", this build reads version " +
            std::to_string(version) + "; use the build that wrote it");
  in.require(in.read<std::uint32_t>() == 0);
  const auto size = in.read<std::uint64_t>();
  const auto sum = in.read<std::uint64_t>();
  if (size != in.left())
    in.fail("it has " + std::to_string(in.left()) + " bytes of content instead of " + std::to_string(size) +
            "; it is truncated or altered");
  if (XXH3_64bits(bytes.data() + head_size, bytes.size() - head_size) != sum)
    in.fail("its checksum does not match its content; it was altered");
  return in;
}

}  // namespace

void World::save(std::vector<std::byte>& out) const {
  simulator_->callbacks.check_not_called("save");
  out.clear();
  ByteWriter write(out);
  write(magic, version, std::uint32_t{0}, std::uint64_t{0}, std::uint64_t{0});
  archive_definition(write, simulator_->def);
  write(simulator_->steps);
  simulator_->bodies.save(write);
  simulator_->joints.save(write);
  simulator_->excluded.save(write);
  write(simulator_->broken.of_step(simulator_->steps));
  simulator_->sensors.save(write, simulator_->steps);
  simulator_->save(write);
  const std::uint64_t size = out.size() - head_size;
  const std::uint64_t sum = XXH3_64bits(out.data() + head_size, out.size() - head_size);
  std::memcpy(out.data() + 16, &size, sizeof size);
  std::memcpy(out.data() + 24, &sum, sizeof sum);
}

void World::restore(std::span<const std::byte> bytes) {
  simulator_->callbacks.check_not_called("restore");
  ByteReader in = checked(bytes);
  WorldDef def = simulator_->def;
  archive_definition(in, def);
  in.require(def.simulator <= SimulatorKind::hybrid);
  try {
    check_world(def);
  } catch (const Error& error) {
    in.fail(error.what());
  }
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
  simulator_ = std::move(fresh);
}

}  // namespace fathom
