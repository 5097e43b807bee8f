// What queries meet, in device memory: the search tree of the host's mirror, and the bodies that it was built for.
//
// Everything comes from the host's side, so queries see changes that no step has applied yet. It is copied for the
// first call of many after a step or a change.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "device/hull_memory.hpp"
#include "device/query_scene.hpp"
#include "device/staged_array.hpp"
#include "device/surface_memory.hpp"
#include "native/body_tree.hpp"

namespace fathom::device {

class QueryMemory {
 public:
  explicit QueryMemory(exec::Memory& memory);

  /// Bodies were added, removed or edited.
  void note_bodies() { bodies_are_current_ = false; }
  /// The search tree, or the poses that it was built for, are new.
  void note_poses() { poses_are_current_ = false; }

  /// Brings the device up to date; `poses` are pinned, by slot. The memories of hulls and surfaces must be current. No
  /// earlier copy may be under way.
  template <class D>
  void upload(D& device, const BodyTable& bodies, const native::BodyTree& tree, std::span<const Pose> poses,
              const HullMemory& hulls, const SurfaceMemory& surfaces) {
    if (!bodies_are_current_) {
      list_bodies(bodies, hulls, surfaces);
      bodies_.upload(device, bodies.slot_count());
      compounds_.upload(device, std::span<const QueryCompound>(compound_list_));
      nodes_.upload(device, std::span<const BoxTreeNode>(node_list_));
      leaves_.upload(device, std::span<const std::uint32_t>(leaf_list_));
      children_.upload(device, std::span<const QueryChild>(child_list_));
    }
    if (!poses_are_current_) {
      poses_.grow(poses.size());
      device.copy_to_device(poses_.data(), poses.data(), poses.size());
      upload(device, trees_[0], tree.moving(), {});
      upload(device, trees_[1], tree.fixed().tree(), tree.fixed().stale());
      upload(device, trees_[2], tree.fixed().late(), {});
    }
    bodies_are_current_ = poses_are_current_ = true;
    hulls_ = hulls.arrays(), surfaces_ = surfaces.views();
  }
  QueryScene scene() const;

 private:
  struct Tree {
    explicit Tree(exec::Memory& memory) : nodes(memory), leaves(memory) {}

    StagedArray<native::Bvh::Node> nodes;
    StagedArray<std::uint32_t> leaves;
    std::uint64_t version = 0;
    std::size_t stale = 0;
    QueryTree view;
  };

  template <class D>
  static void upload(D& device, Tree& tree, const native::Bvh& from, std::span<const std::uint32_t> stale) {
    if (tree.version == from.version() && tree.stale == stale.size()) return;
    tree.view = view_of(from);
    tree.nodes.upload(device, from.nodes());
    list_leaves(from, stale, tree.leaves.image(from.size()));
    tree.leaves.upload(device, from.size());
    tree.version = from.version(), tree.stale = stale.size();
  }
  static QueryTree view_of(const native::Bvh& tree);
  static void list_leaves(const native::Bvh& tree, std::span<const std::uint32_t> stale, std::uint32_t* leaves);
  void list_bodies(const BodyTable& bodies, const HullMemory& hulls, const SurfaceMemory& surfaces);
  void list_compound(const Compound& compound, const HullMemory& hulls);

  bool bodies_are_current_ = false, poses_are_current_ = false;
  std::array<Tree, QueryScene::tree_count> trees_;
  StagedArray<QueryBody> bodies_;
  exec::Buffer<Pose> poses_;
  StagedArray<QueryCompound> compounds_;
  StagedArray<BoxTreeNode> nodes_;
  StagedArray<std::uint32_t> leaves_;
  StagedArray<QueryChild> children_;
  std::vector<QueryCompound> compound_list_;
  std::vector<BoxTreeNode> node_list_;
  std::vector<std::uint32_t> leaf_list_;
  std::vector<QueryChild> child_list_;
  HullArrays hulls_;
  const SurfaceView* surfaces_ = nullptr;
};

}  // namespace fathom::device
