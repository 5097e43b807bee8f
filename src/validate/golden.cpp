#include "validate/golden.hpp"

#include <array>

#include "scene/environments.hpp"

namespace fathom::validate {
namespace {

using enum Solver;
using enum BroadPhase;

// Made by `fathom validate --only golden`; a change of the solver's mathematics changes them all.
constexpr std::array<Golden, 6> table{{
    {"drift", 500, 240, soft, tree, 0x359d24a6d8c68d05, 0x02683d5ac104a71f},
    {"layers", 500, 300, soft, tree, 0xc68c4d84b1f88900, 0x79a210637e916a29},
    {"spread", 400, 240, soft, tree, 0x87c50afd3cc5afb7, 0xf3859a8eab1d656e},
    {"pyramid", 385, 240, soft, tree, 0x86a6b9740cd7df4a, 0x9c6021bb0d5e97f9},
    {"layers", 500, 300, soft, sweep, 0xc68c4d84b1f88900, 0x4a91ab9a2cb59da1},
    {"layers", 500, 300, impulse, tree, 0xf3a945c3ba6b200a, 0x79a210637e916a29},
}};

// FNV-1a, 64 bits.
void mix(std::uint64_t& hash, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) hash = (hash ^ (value >> shift & 0xff)) * 0x100000001b3u;
}

}  // namespace

std::span<const Golden> goldens() { return table; }

Hashes run_golden(const Golden& golden, const Setup& setup) {
  Scene scene = find_environment(golden.environment)->make(golden.bodies);
  WorldDef def = world_def(setup);
  def.gravity = scene.world.gravity;
  def.solver.method = golden.solver;
  def.broad_phase = golden.broad_phase;
  World world(def);
  SceneInstance instance(scene, world);
  std::uint64_t events = 0xcbf29ce484222325u;
  for (int i = 0; i < golden.steps; ++i) {
    instance.prepare_step();
    world.step();
    for (const auto list : {world.contacts_begun(), world.contacts_ended()})
      for (const ContactEvent& event : list) mix(events, event.a.index), mix(events, event.b.index);
  }
  return {world.state_hash(), events};
}

}  // namespace fathom::validate
