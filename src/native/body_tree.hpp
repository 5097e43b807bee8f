// The search tree of queries: bodies of any simulator by their boxes.
//
// Separate from the broad phase's trees: a query between two steps must not change the order in which the next step
// finds pairs.
#pragma once

#include <cstdint>
#include <vector>

#include "native/body_sides.hpp"
#include "world/body_table.hpp"
#include "world/body_visitor.hpp"

namespace fathom::native {

class BodyTree {
 public:
  // Changes since the last `refresh`.
  /// A body was added to the slot, or removed.
  void note_set(std::uint32_t slot) { note(set_changes_, slot); }
  void note_fixed_moved(std::uint32_t slot) { note(moved_fixed_, slot); }
  void note_others_moved() { others_moved_ = true; }
  /// Whether boxes of fixed bodies may have changed.
  bool may_have_new_fixed() const { return sides_.lists_all || !set_changes_.empty() || !moved_fixed_.empty(); }

  /// Brings the tree up to date with the fat boxes in `bounds`, by slot.
  void refresh(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool);

  /// Refreshes fixed bodies alone.
  void refresh_fixed(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool);

  const FixedTree& fixed() const { return sides_.fixed; }
  const Bvh& moving() const { return moving_; }

  /// Visits bodies whose boxes the moving box meets, as `Bvh::visit` does.
  void visit(const MovingBox& box, BodyVisitor& visitor) const;
  void visit_fixed(const MovingBox& box, BodyVisitor& visitor) const { sides_.fixed.visit(box, 1.0f, visitor); }

  std::size_t memory_bytes() const;

 private:
  void note(std::vector<std::uint32_t>& list, std::uint32_t slot);

  Bvh moving_;
  BodySides sides_;
  std::vector<std::uint32_t> set_changes_, moved_fixed_;  // slots; if there are too many, all bodies are listed
  bool set_changed_ = true, others_moved_ = true;         // bodies that move
};

}  // namespace fathom::native
