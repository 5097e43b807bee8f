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
    {"drift", 500, 240, soft, tree, {0xb5b43af9ca94d423, 0x00c7bb58f2f305c6}, {0xa375b0bc0375d440, 0xdd4984c643aca38d}},
    {"layers", 500, 300, soft, tree, {0x9a059f58f3ba81d6, 0x9fda67ed312f1169}, {0xb061c12c9d390c37, 0xa55d5df51b7f1db1}},
    {"spread", 400, 240, soft, tree, {0x33300bb7781e4636, 0xc1c095d2eaf3b09a}, {0x9a2abd8fd3cec393, 0xc1c095d2eaf3b09a}},
    {"pyramid", 385, 240, soft, tree, {0x96480fe425575022, 0x18b2f79c339abe39}, {0xc508aafc571c6ef0, 0x075a0c40c73c3221}},
    {"columns", 60, 300, soft, tree, {0xde9918f3bc358b7a, 0x9b5977d72d31b4fc}, {0x321c4e4d374b2107, 0xc9c20f76f741f169}},
    {"stream", 200, 240, soft, tree, {0x091478dd99310d83, 0xbaf7f5852020169c}, {0x456c703a3863a436, 0x436afc6f00a12cad}},
    {"layers", 500, 300, soft, sweep, {0x9a059f58f3ba81d6, 0x06a9f8a7b33a6f41}, {0xb061c12c9d390c37, 0xa55d5df51b7f1db1}},
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
