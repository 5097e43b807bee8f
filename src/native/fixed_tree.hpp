// The tree of fixed bodies, which may number millions while a few come and go.
//
// Added and edited bodies go into a small tree of their own, until there are enough of them to sort all again. Leaves
// of removed bodies stay and do not count.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/bvh.hpp"

namespace fathom::native {

class FixedTree {
 public:
  /// All fixed bodies, ascending.
  void set_all(std::vector<std::uint32_t> slots);
  std::size_t size() const { return slots_.size(); }
  bool contains(std::uint32_t slot) const;
  void add(std::uint32_t slot);
  void remove(std::uint32_t slot);
  /// The body's box is new.
  void note_moved(std::uint32_t slot);

  /// Brings the trees up to date.
  void refresh(const BodyBounds* bounds, ThreadPool& pool);
  /// Appends the bodies whose boxes overlap `box`; their order depends on the history of additions, removals and moves.
  void overlap(const Aabb& box, std::vector<std::uint32_t>& found) const;

  /// Like `Bvh::visit`.
  float visit(const MovingBox& box, float limit, BodyVisitor& visitor) const;

  // Its trees, for those who search them on their own: most bodies, except those in `stale`, and those
  // that were added or moved later.
  const Bvh& tree() const { return tree_; }
  const Bvh& late() const { return late_; }
  std::span<const std::uint32_t> stale() const { return stale_; }

  void save(ByteWriter& write) const;
  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool);
  std::size_t memory_bytes() const;

 private:
  /// The small tree is rebuilt for each added body, the whole once per this many.
  std::size_t max_late() const;
  void note_late(std::uint32_t slot);

  // All ascending.
  std::vector<std::uint32_t> slots_;
  std::vector<std::uint32_t> late_slots_;  // in `late_`
  std::vector<std::uint32_t> stale_;       // slots whose leaves in `tree_` do not count
  Bvh tree_, late_;
  bool sorts_all_ = true, sorts_late_ = true;  // in the next `refresh`
};

}  // namespace fathom::native
