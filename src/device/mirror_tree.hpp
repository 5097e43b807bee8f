// The tree for queries of the device simulator: on the host, over the mirror's poses.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/body_tree.hpp"

namespace fathom::device {

class MirrorTree {
 public:
  // Notes changes; bodies that are not fixed always count as moved.
  void note_set(std::uint32_t slot) { tree_.note_set(slot); }
  void note_fixed_moved(std::uint32_t slot) { tree_.note_fixed_moved(slot); }

  /// Brings the tree up to date with bodies at these poses, by slot.
  void refresh(const BodyTable& bodies, std::span<const Pose> poses);
  const native::BodyTree& bodies() const { return tree_; }
  void visit(const MovingBox& box, BodyVisitor& visitor) const { tree_.visit(box, visitor); }

 private:
  native::BodyTree tree_;
  std::vector<native::BodyBounds> bounds_;
  ThreadPool pool_{1};
};

}  // namespace fathom::device
