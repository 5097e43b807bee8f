// Builds and searches trees of boxes over the parts of meshes and compounds.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <fathom/box_tree.hpp>
#include <span>
#include <tuple>
#include <vector>

#include "geometry/box_way.hpp"
#include "math/eight.hpp"
#include "math/vec3d.hpp"

namespace fathom {

/// Builds a tree over parts 0 … count − 1 with bounds box_of(part).
template <class BoxOf>
class BoxTreeBuilder {
 public:
  /// Overwrites `nodes`. Leaves contain up to `leaf_size` parts, numbered in the order written to `order`.
  BoxTreeBuilder(std::size_t count, std::size_t leaf_size, const BoxOf& box_of, std::vector<BoxTreeNode>& nodes,
                 std::vector<std::uint32_t>& order)
      : leaf_size_(leaf_size), box_of_(box_of), nodes_(nodes), order_(order) {
    items_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) items_[i] = {centre(box_of(i)), i};
    nodes_.clear();
    nodes_.reserve(2 * count / leaf_size + 1);
    order_.clear();
    order_.reserve(count);
    add_node(0, count);
    nodes_.shrink_to_fit();
  }

 private:
  /// A part to insert. The centre of its box decides where it goes.
  struct Item {
    Vec3 centre;
    std::uint32_t part;
  };

  Aabb box_of(std::size_t begin, std::size_t end) const {
    Aabb box = box_of_(items_[begin].part);
    for (std::size_t i = begin + 1; i < end; ++i) box = merged(box, box_of_(items_[i].part));
    return box;
  }

  // Splits at the median along the longest side of the centres' box: logarithmic depth for any distribution.
  void add_node(std::size_t begin, std::size_t end) {
    const std::size_t node = nodes_.size();
    const Aabb box = box_of(begin, end);
    nodes_.push_back({box.lower, 0, box.upper, 0});
    if (end - begin <= leaf_size_) {
      nodes_[node].next = static_cast<std::uint32_t>(order_.size());
      nodes_[node].count = static_cast<std::uint32_t>(end - begin);
      for (std::size_t i = begin; i < end; ++i) order_.push_back(items_[i].part);
      return;
    }
    Aabb centres{items_[begin].centre, items_[begin].centre};
    for (std::size_t i = begin; i < end; ++i) centres = merged(centres, {items_[i].centre, items_[i].centre});
    const Vec3 size = centres.upper - centres.lower;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    // All leaves but the last are full.
    const std::size_t half = (end - begin + 1) / 2, middle = begin + (half + leaf_size_ - 1) / leaf_size_ * leaf_size_;
    const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [axis](const Item& a, const Item& b) {
      return std::tuple(a.centre[axis], a.part) < std::tuple(b.centre[axis], b.part);
    });
    add_node(begin, middle);
    nodes_[node].next = static_cast<std::uint32_t>(nodes_.size());
    add_node(middle, end);
  }

  std::size_t leaf_size_;
  const BoxOf& box_of_;
  std::vector<BoxTreeNode>& nodes_;
  std::vector<std::uint32_t>& order_;
  std::vector<Item> items_;
};

/// Whether boxes overlap a given one: six parallel comparisons, no branch.
class OverlapTest {
 public:
  explicit OverlapTest(const Aabb& box)
      : limits_{box.upper.x, box.upper.y, box.upper.z, 0, -box.lower.x, -box.lower.y, -box.lower.z, 0} {}

  bool overlaps(const BoxTreeNode& node) const {
    Eight box;
    static_assert(sizeof node == sizeof box && offsetof(BoxTreeNode, upper) == 4 * sizeof(float));
    std::memcpy(&box, &node, sizeof box);
    return is_within_limits(turned(box));
  }
  /// The bounds of three points.
  bool overlaps(Vec3 a, Vec3 b, Vec3 c) const {
    return is_within_limits(min(min(turned(twice(a)), turned(twice(b))), turned(twice(c))));
  }

 private:
  static Eight twice(Vec3 v) { return Eight{v.x, v.y, v.z, 0, v.x, v.y, v.z, 0}; }
  /// Negates the upper bounds, to compare them like lower ones.
  static Eight turned(Eight box) {
    constexpr std::int32_t sign = std::numeric_limits<std::int32_t>::min();
    return (Eight)((EightInts)box ^ EightInts{0, 0, 0, 0, sign, sign, sign, sign});
  }
  bool is_within_limits(Eight turned_box) const {
    constexpr unsigned coordinates = 0x77;
    return (bits(turned_box <= limits_) & coordinates) == coordinates;
  }

  Eight limits_;
};

/// Calls act(i) for the parts in leaves that overlap the box; i is the part's number in the order of leaves.
template <class Act>
void search_box_tree(std::span<const BoxTreeNode> nodes, const OverlapTest& box, const Act& act) {
  std::uint32_t waiting[deepest_box_tree];
  int count = 0;
  std::uint32_t node = 0;
  for (;;) {
    const BoxTreeNode& n = nodes[node];
    if (box.overlaps(n)) {
      if (n.count == 0) {
        waiting[count++] = n.next;
        ++node;
        continue;
      }
      for (std::uint32_t i = n.next; i < n.next + n.count; ++i) act(i);
    }
    if (count == 0) return;
    node = waiting[--count];
  }
}

}  // namespace fathom
