#include "validate/golden.hpp"

#include <array>

#include "scene/environments.hpp"
#include "validate/bodies.hpp"

namespace fathom::validate {
namespace {

using enum Solver;
using enum BroadPhase;

// Made by `fathom validate --only golden`; a change of the solver's mathematics changes them all.
// clang-format off
constexpr std::array<Golden, 7> table{{
    {"drift", 500, 240, soft, tree, {0x796950276f29cbf5, 0x6bdd38b0471d431d}, {0x9bd00a52c62e3b0f, 0x97ba5ef10ff77a15}},
    {"layers", 500, 300, soft, tree, {0xb407b782a8b9b1f1, 0xf9671e917bca8aa9}, {0xdb5e767c809ca0ab, 0xf9671e917bca8aa9}},
    {"spread", 400, 240, soft, tree, {0x9b9b77892c86cf05, 0xc1c095d2eaf3b09a}, {0x7ed943e80a840e2b, 0xc1c095d2eaf3b09a}},
    {"pyramid", 385, 240, soft, tree, {0x59888c5f788c9708, 0x18b2f79c339abe39}, {0x494352ae582a2a75, 0x075a0c40c73c3221}},
    {"columns", 60, 300, soft, tree, {0x6dfe1cd6317bc33d, 0x04def7795bb58237}, {0x0fe7d09d989ce687, 0xc1ae1c84b635b9c4}},
    {"layers", 500, 300, soft, sweep, {0xb407b782a8b9b1f1, 0x505297b24d6b8e41}, {0xdb5e767c809ca0ab, 0xf9671e917bca8aa9}},
    {"layers", 500, 300, impulse, tree, {0x8e48afa6f13cf1c2, 0xf9671e917bca8aa9}, {0xc04b069560466903, 0xf9671e917bca8aa9}},
}};
// clang-format on

/// Columns of 20 boxes, cubes and flat ones, and a ball that strikes the first.
Scene columns(std::int64_t bodies) {
  Scene scene;
  scene.bodies.push_back(floor_slab());
  for (std::int64_t i = 0; i < bodies; ++i) {
    const std::int64_t column = i / 20, storey = i % 20;
    const float half_height = column % 2 ? 0.2f : 0.5f;
    scene.bodies.push_back(
        body(box({0.5f, 0.5f, half_height}), {3.0f * static_cast<float>(column), 0.01f * static_cast<float>(storey % 3),
                                              half_height * (1.0f + 2.0f * static_cast<float>(storey))}));
  }
  scene.bodies.push_back(body(sphere(0.5f), {-6, 0, 6}, 5.0f));
  scene.bodies.back().velocity.linear = {6, 0, 3};
  return scene;
}

// FNV-1a, 64 bits.
void mix(std::uint64_t& hash, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) hash = (hash ^ (value >> shift & 0xff)) * 0x100000001b3u;
}

}  // namespace

std::span<const Golden> goldens() { return table; }

Hashes run_golden(const Golden& golden, const Setup& setup) {
  const Environment* environment = find_environment(golden.environment);
  Scene scene = environment ? environment->make(golden.bodies) : columns(golden.bodies);
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
