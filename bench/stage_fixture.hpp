// A scene's bodies and contacts as the native simulator's stages see them, without a simulator.
#pragma once

#include "dynamics/manifold_update.hpp"
#include "native/broad_phase.hpp"
#include "native/contact_graph.hpp"
#include "native/narrow_phase.hpp"
#include "scene/environments.hpp"
#include "world/joint_table.hpp"

namespace fathom::native {

struct StageFixture {
  explicit StageFixture(Scene made) : scene(std::move(made)) {
    state.resize(scene.bodies.size());
    graph.resize(scene.bodies.size());
    for (const BodyDef& def : scene.bodies) {
      const std::uint32_t slot = bodies.add(def).index;
      const BodyInfo& info = bodies[slot];
      state.clear(slot);
      state.poses[slot] = def.pose;
      state.bounds[slot] = bounds_of(info, def.pose, {}, scene.world.dt);
      state.flags[slot] = static_cast<std::uint8_t>(box_changed | (info.motion == MotionType::fixed ? 0 : awake));
      changed.push_back(slot);
      if (info.motion == MotionType::dynamic) moving.push_back(slot);
    }
  }

  BroadPhaseInput input(bool set_changed) {
    const std::span<const std::uint32_t> unchanged;
    return {bodies, state, graph.pairs(), changed, true, set_changed ? std::span(std::as_const(changed)) : unchanged};
  }

  /// Finds all pairs, makes their manifolds and colours them, as a first step does.
  void make_contacts() {
    std::vector<std::vector<Pair>> found;
    found.resize(make_tree_broad_phase()->find(input(true), pool, found));
    for (const std::vector<Pair>& list : found) graph.add(list);
    std::vector<NewManifold> begun;
    for (std::uint32_t i = 0; i < graph.size(); ++i) update(i, begun);
    graph.make_manifolds(begun.size());
    for (const NewManifold& fresh : begun) {
      graph[fresh.contact].manifold = graph.new_manifold(static_cast<std::size_t>(&fresh - begun.data()));
      graph.mix_materials(graph[fresh.contact]);
      set_manifold(graph.manifold(graph[fresh.contact]), fresh.manifold, fresh.b_in_a);
      graph.colour(fresh.contact);
    }
    manifold_count = begun.size();
  }

  Change update(std::uint32_t contact, std::vector<NewManifold>& begun) {
    Contact& c = graph[contact];
    return update_contact(contact, c, c.touching() ? &graph.manifold(c) : nullptr,
                          {bodies, state, scene.world.dt, begun, fast, graph, ended, gone, has_new_parts, seams});
  }

  Scene scene;
  BodyTable bodies;
  JointTable joints;
  BodyState state;
  ContactGraph graph{bodies, state};
  ThreadPool pool{1};
  std::vector<std::uint32_t> changed;  // all slots
  std::vector<std::uint32_t> moving;   // slots of dynamic bodies
  std::size_t manifold_count = 0;
  std::vector<FastPair> fast;
  std::vector<std::uint32_t> ended, gone;  // for pairs with surfaces: there are none
  bool has_new_parts = false;
  ExcludedPairs excluded;
  Seams seams{bodies, state, joints, excluded, 1.0f / 60};  // empty
};

}  // namespace fathom::native
