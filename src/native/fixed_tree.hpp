// The tree of bodies that do not move, which may be millions while some come and go.
//
// What comes, and what is moved by hand, has a small tree of its own until that is worth sorting all of them anew;
// leaves of what has gone stay and do not count.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/bvh.hpp"

namespace fathom::native {

class FixedTree {
 public:
  /// All of them, ascending.
  void set_all(std::vector<std::uint32_t> slots);
  std::size_t size() const { return slots_.size(); }
  bool contains(std::uint32_t slot) const;
  void add(std::uint32_t slot);
  void remove(std::uint32_t slot);
  /// Its box is new.
  void note_moved(std::uint32_t slot);

  /// Takes what was noted into the trees.
  void refresh(const BodyBounds* bounds, ThreadPool& pool);
  /// Appends those whose boxes overlap `box`; their order depends on what came, went and moved, and when.
  void overlap(const Aabb& box, std::vector<std::uint32_t>& found) const;

  /// As `Bvh::visit`.
  float visit(const MovingBox& box, float limit, BodyVisitor& visitor) const;

  void save(ByteWriter& write) const;
  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool);
  std::size_t memory_bytes() const;

 private:
  /// The small tree is built for every body that comes, all of them once for so many that have.
  std::size_t max_late() const;
  void note_late(std::uint32_t slot);

  // All ascending.
  std::vector<std::uint32_t> slots_;
  std::vector<std::uint32_t> late_slots_;  // in `late_`
  std::vector<std::uint32_t> stale_;       // whose leaves in `tree_` do not count
  Bvh tree_, late_;
  bool sorts_all_ = true, sorts_late_ = true;  // in the next `refresh`
};

}  // namespace fathom::native
