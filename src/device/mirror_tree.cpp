#include "device/mirror_tree.hpp"

namespace fathom::device {

void MirrorTree::refresh(const BodyTable& bodies, std::span<const Pose> poses) {
  bounds_.resize(poses.size());
  tree_.note_others_moved();
  const bool fixed_too = tree_.may_have_new_fixed();
  for (const BodyId id : bodies.living()) {
    const BodyInfo& info = bodies[id.index];
    if (info.motion == MotionType::fixed && !fixed_too) continue;
    bounds_[id.index].fat_box = bounds(info.geometry, poses[id.index]);
  }
  tree_.refresh(bodies, bounds_.data(), pool_);
}

}  // namespace fathom::device
