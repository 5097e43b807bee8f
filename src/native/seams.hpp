// Seams between bodies that cannot be pushed, and between the children of a compound (collision/seam.hpp).
#pragma once

#include <cstdint>
#include <vector>

#include "collision/seam.hpp"
#include "native/body_state.hpp"
#include "native/bvh.hpp"
#include "native/fixed_tree.hpp"
#include "native/pieces.hpp"
#include "world/excluded_pairs.hpp"
#include "world/joint_table.hpp"

namespace fathom::native {

/// One of two touching bodies, with the child that touches, if it is a compound.
struct SeamSide {
  std::uint32_t slot;
  std::uint32_t child;
  const Piece& piece;
};

struct SeamNeighbours;

class Seams {
 public:
  Seams(const BodyTable& bodies, const BodyState& state, const JointTable& joints, const ExcludedPairs& excluded,
        float dt)
      : bodies_(bodies), state_(state), joints_(joints), excluded_(excluded), dt_(dt) {}

  /// Brings the trees up to date with the boxes of this step. `fixed` has all fixed bodies.
  void find(const FixedTree& fixed, ThreadPool& pool);

  /// The part of the manifold `m` of two pieces that counts, in the frame of piece A. A non-dynamic body is A.
  SeamManifold kept(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, float margin, const Manifold& m) const;
  /// The part that counts of a manifold of a surface, A, in its frame.
  Manifold kept_on_surface(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, const Manifold& m) const;
  /// Whether the body cannot be pushed and is not the only one.
  bool may_have(std::uint32_t a) const { return several_ && bodies_[a].motion != MotionType::dynamic; }
  std::size_t memory_bytes() const { return kinematic_.memory_bytes() + listed_.capacity() * sizeof(std::uint32_t); }

 private:
  SeamManifold kept_of_first(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, float margin,
                             const Manifold& m) const;
  void add_others(const SeamSide& a, const Pose& pose, const SeamSide& b, const Aabb& box,
                  SeamNeighbours& neighbours) const;
  void add_others_that_may_move(const SeamSide& a, const Pose& pose, const SeamSide& b, const Aabb& box,
                                SeamNeighbours& neighbours) const;
  Pose end_of(std::uint32_t slot) const;
  bool is_asked_about(std::uint32_t a, std::uint32_t b) const;
  bool may_rest_on(std::uint32_t slot, std::uint32_t neighbour) const;

  const BodyTable& bodies_;
  const BodyState& state_;
  const JointTable& joints_;
  const ExcludedPairs& excluded_;
  float dt_;  // s
  const FixedTree* fixed_ = nullptr;
  bool several_ = false;               // bodies that cannot be pushed
  Bvh kinematic_;                      // kinematic bodies, if there are several
  std::vector<std::uint32_t> listed_;  // those in `kinematic_`, ascending
};

}  // namespace fathom::native
