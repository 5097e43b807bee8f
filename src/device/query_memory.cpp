#include "device/query_memory.hpp"

#include <algorithm>
#include <unordered_map>

#include "check/check.hpp"

namespace fathom::device {

namespace {

QueryShape query_shape(const Geometry& shape, std::uint32_t part) {
  return {shape.type, shape.radius, shape.half_extents, part};
}

}  // namespace

QueryMemory::QueryMemory(exec::Memory& memory)
    : trees_{Tree(memory), Tree(memory), Tree(memory)},
      bodies_(memory),
      poses_(memory),
      compounds_(memory),
      nodes_(memory),
      leaves_(memory),
      children_(memory) {}

QueryScene QueryMemory::scene() const {
  QueryScene scene{.trees = {},
                   .bodies = bodies_.data(),
                   .poses = poses_.data(),
                   .hulls = hulls_,
                   .surfaces = surfaces_,
                   .compounds = compounds_.data(),
                   .compound_nodes = nodes_.data(),
                   .compound_leaves = leaves_.data(),
                   .children = children_.data()};
  for (std::size_t k = 0; k < trees_.size(); ++k) {
    scene.trees[k] = trees_[k].view;
    scene.trees[k].nodes = trees_[k].nodes.data(), scene.trees[k].leaves = trees_[k].leaves.data();
  }
  return scene;
}

QueryTree QueryMemory::view_of(const native::Bvh& tree) {
  QueryTree view;
  view.leaf_count = static_cast<std::uint32_t>(tree.size());
  if (tree.size() == 0) return view;
  FATHOM_ASSERT(tree.levels().size() <= QueryTree::max_levels);
  for (const native::Bvh::Level& level : tree.levels()) {
    view.first[view.level_count] = static_cast<std::uint32_t>(level.first);
    view.count[view.level_count++] = static_cast<std::uint32_t>(level.count);
  }
  return view;
}

void QueryMemory::list_leaves(const native::Bvh& tree, std::span<const std::uint32_t> stale, std::uint32_t* leaves) {
  std::ranges::transform(tree.leaves(), leaves, [&](std::uint32_t slot) {
    return std::ranges::binary_search(stale, slot) ? QueryTree::nobody : slot;
  });
}

/// Every compound that some body has, once.
void QueryMemory::list_bodies(const BodyTable& bodies, const HullMemory& hulls, const SurfaceMemory& surfaces) {
  compound_list_.clear(), node_list_.clear(), leaf_list_.clear(), child_list_.clear();
  std::unordered_map<const Compound*, std::uint32_t> compounds;
  QueryBody* const list = bodies_.image(bodies.slot_count());
  for (const BodyId id : bodies.living()) {
    const BodyInfo& info = bodies[id.index];
    const Geometry& shape = info.geometry;
    std::uint32_t part = 0;
    if (shape.type == ShapeType::hull) part = hulls.index_of(info.hull().get());
    if (shape.is_surface()) part = surfaces.index_of(&shape.surface());
    if (shape.is_compound()) {
      const auto [entry, is_new] =
          compounds.try_emplace(&shape.compound(), static_cast<std::uint32_t>(compounds.size()));
      if (is_new) list_compound(shape.compound(), hulls);
      part = entry->second;
    }
    list[id.index] = {query_shape(shape, part), info.is_sensor, info.filter};
  }
}

void QueryMemory::list_compound(const Compound& compound, const HullMemory& hulls) {
  compound_list_.push_back({static_cast<std::uint32_t>(node_list_.size()),
                            static_cast<std::uint32_t>(leaf_list_.size()),
                            static_cast<std::uint32_t>(child_list_.size())});
  node_list_.insert(node_list_.end(), compound.nodes().begin(), compound.nodes().end());
  leaf_list_.insert(leaf_list_.end(), compound.leaves().begin(), compound.leaves().end());
  for (const ChildShape& child : compound.children()) {
    const std::uint32_t part = child.shape.hull ? hulls.index_of(child.shape.hull.get()) : 0;
    child_list_.push_back({query_shape(geometry(child.shape), part), child.pose});
  }
}

}  // namespace fathom::device
