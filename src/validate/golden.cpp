#include "validate/golden.hpp"

#include <array>
#include <deque>
#include <optional>
#include <string_view>

#include "scene/environments.hpp"
#include "validate/bodies.hpp"

namespace fathom::validate {
namespace {

using enum Solver;
using enum BroadPhase;

// Printed by `fathom validate --only golden`. A change of the solver's mathematics changes them all.
// clang-format off
constexpr std::array<Golden, 8> golden_runs{{
    {"drift", 500, 240, soft, tree, {0x4b2b8ddc43848d6d, 0xe8357c31a7feb00f}, {0xe7eea27effe1adcb, 0xbf043650367ce4bd}},
    {"layers", 500, 300, soft, tree, {0x5ceb7e3d8383050b, 0xf9671e917bca8aa9}, {0x96fd4cd645079eea, 0x1d0c8a8ee1087d39}},
    {"spread", 400, 240, soft, tree, {0x33300bb7781e4636, 0xc1c095d2eaf3b09a}, {0x9a2abd8fd3cec393, 0xc1c095d2eaf3b09a}},
    {"pyramid", 385, 240, soft, tree, {0xde5ec6d0d152be2d, 0x18b2f79c339abe39}, {0xb9b87265cfc72c5f, 0x075a0c40c73c3221}},
    {"columns", 60, 300, soft, tree, {0x775d025e3e1331f1, 0x8f70344ee02c5b0f}, {0x6cd4678d77edf377, 0x5227541b0461270b}},
    {"stream", 200, 240, soft, tree, {0x8f83c66d5cbfee9a, 0x2bd6c3c694470ca0}, {0x40b1bbc4d5adcc91, 0x684db3d1a5b3fa79}},
    {"layers", 500, 300, soft, sweep, {0x5ceb7e3d8383050b, 0xe8e9ac8770b73fc1}, {0x96fd4cd645079eea, 0x1d0c8a8ee1087d39}},
    {"layers", 500, 300, impulse, tree, {0x15018860e82da0c1, 0xd1f8fa61c338d851}, {0x114c9997a6b51992, 0x5bb6d772a45230a9}},
}};
// clang-format on

/// Columns of 20 boxes, cubic and flat ones, and a ball that hits the first.
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

/// Bodies rain on a floor, ten more in every step. The oldest are removed.
class Stream {
 public:
  Stream(World& world, std::int64_t bodies) : world_(world), most_(static_cast<std::size_t>(bodies)) {
    world_.add(floor_slab());
  }
  void prepare_step() {
    for (int i = 0; i < 10; ++i) living_.push_back(world_.add(next()));
    for (; living_.size() > most_; living_.pop_front()) world_.remove(living_.front());
  }

 private:
  /// From 0 to 1, exact in single precision.
  float unit() {
    state_ = 1664525 * state_ + 1013904223;
    return static_cast<float>(state_ >> 16) * 0x1p-16f;
  }
  BodyDef next() {
    const float size = 0.2f + 0.2f * unit(), x = 4 * unit() - 2, y = 4 * unit() - 2, kind = 3 * unit();
    const Shape shape = kind < 1   ? sphere(size)
                        : kind < 2 ? capsule(0.5f * size, 0.5f * size)
                                   : box({size, 0.2f, 0.3f});
    return body(shape, {x, y, 1 + 2 * unit()}, 1.0f, {.restitution = kind < 0.3f ? 0.5f : 0.0f});
  }

  World& world_;
  std::size_t most_;
  std::deque<BodyId> living_;
  std::uint32_t state_ = 1;
};

// FNV-1a, 64 bits.
void mix(std::uint64_t& hash, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) hash = (hash ^ (value >> shift & 0xff)) * 0x100000001b3u;
}

}  // namespace

std::span<const Golden> goldens() { return golden_runs; }

Hashes run_golden(const Golden& golden, const Setup& setup) {
  const Environment* environment = find_environment(golden.environment);
  const bool streams = std::string_view(golden.environment) == "stream";
  Scene scene = environment ? environment->make(golden.bodies) : streams ? Scene{} : columns(golden.bodies);
  WorldDef def = world_def(setup);
  def.gravity = scene.world.gravity;
  def.solver.method = golden.solver;
  def.broad_phase = golden.broad_phase;
  World world(def);
  SceneInstance instance(scene, world);
  std::optional<Stream> stream;
  if (streams) stream.emplace(world, golden.bodies);
  std::uint64_t events = 0xcbf29ce484222325u;
  for (int i = 0; i < golden.steps; ++i) {
    if (stream) stream->prepare_step();
    instance.prepare_step();
    world.step();
    for (const auto list : {world.contacts_begun(), world.contacts_ended()})
      for (const ContactEvent& event : list) mix(events, event.a.index), mix(events, event.b.index);
  }
  return {world.state_hash(), events};
}

}  // namespace fathom::validate
