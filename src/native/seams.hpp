// Seams between bodies that do not move, and between the children of a compound (collision/seam.hpp).
#pragma once

#include "collision/seam.hpp"
#include "native/body_state.hpp"
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
  const BodyTable& bodies;
  const BodyState& state;
  const JointTable& joints;
  const ExcludedPairs& excluded;
  const FixedTree* fixed = nullptr;  ///< null: fewer than two bodies are fixed

  /// The part of the manifold `m` of two pieces that counts, in the frame of piece A. A non-dynamic body is A.
  SeamManifold kept(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, float margin, const Manifold& m) const;
  /// The part that counts of a manifold of a surface, A, in its frame.
  Manifold kept_on_surface(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, const Manifold& m) const;
  /// Whether there are fixed bodies besides this one.
  bool may_have(std::uint32_t a) const { return fixed != nullptr && bodies[a].motion == MotionType::fixed; }

 private:
  SeamManifold kept_of_first(const SeamSide& a, const SeamSide& b, const Pose& b_in_a, float margin,
                             const Manifold& m) const;
  void add_fixed(std::uint32_t slot, const Pose& pose, const SeamSide& b, const Aabb& box,
                 SeamNeighbours& neighbours) const;
  bool is_asked_about(std::uint32_t a, std::uint32_t b) const;
  bool may_rest_on(std::uint32_t slot, std::uint32_t neighbour) const;
};

}  // namespace fathom::native
