// The tree that queries search: bodies by their boxes, of any simulator.
//
// It is the queries' own, beside what a broad phase keeps: asking questions between two steps must not change the order
// in which the next step finds its pairs.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <vector>

#include "native/bvh.hpp"
#include "world/body_table.hpp"
#include "world/body_visitor.hpp"

namespace fathom::native {

class BodyTree {
 public:
  // What has changed since the last `refresh`. Bodies of this motion were added or removed; some were moved.
  void note_set(MotionType motion) { side(motion).set_changed = true; }
  void note_moved(MotionType motion) { side(motion).moved = true; }
  bool is_stale(MotionType motion) { return side(motion).moved || side(motion).set_changed; }

  /// Brings the tree up to date with the fat boxes in `bounds`, by slot.
  void refresh(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool);

  /// Of fixed bodies alone.
  void refresh_fixed(const BodyTable& bodies, const BodyBounds* bounds, ThreadPool& pool);

  /// Bodies that the box meets, as `Bvh::visit` does.
  void visit(const MovingBox& box, BodyVisitor& visitor) const;
  void visit_fixed(const MovingBox& box, BodyVisitor& visitor) const { fixed_.tree.visit(box, 1.0f, visitor); }

  std::size_t memory_bytes() const;

 private:
  struct Side {
    Bvh tree;
    std::vector<std::uint32_t> slots;
    bool set_changed = true, moved = true;
  };
  static void refresh(Side& side, const BodyBounds* bounds, ThreadPool& pool);
  void list(const BodyTable& bodies, std::initializer_list<Side*> sides);
  Side& side(MotionType motion) { return motion == MotionType::fixed ? fixed_ : moving_; }

  Side moving_, fixed_;
};

}  // namespace fathom::native
