// A bounding volume hierarchy with eight children per node and no pointers.
//
// Leaves are sorted along a Morton curve (Lauterbach et al., "Fast BVH Construction on GPUs", 2009), then every eight
// neighbours share a node, every eight nodes a parent, and so on: node i of level k has the children 8i … 8i+7 of level
// k−1. Building is a radix sort and refitting one pass over arrays, so the native simulator refits whenever a box has
// moved and sorts again only when the boxes have drifted apart. A node stores its children's boxes by component:
// testing it takes six vector comparisons.
//
// Size leads the sort key: boxes much larger than the median (a sea floor) get subtrees of their own and do not bloat
// the nodes of small ones.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>
#include <span>
#include <vector>

#include "native/body_bounds.hpp"
#include "threads/thread_pool.hpp"
#include "world/archive.hpp"
#include "world/body_visitor.hpp"

namespace fathom::native {

class Bvh {
 public:
  static constexpr std::size_t width = 8;
  struct alignas(32) Node {
    float lower[3][width];
    float upper[3][width];
  };
  struct Level {
    std::size_t first;  // node
    std::size_t count;
  };

  /// Sorts `items` (indices into `bounds`) and builds the tree over their fat boxes.
  void build(std::span<const std::uint32_t> items, const BodyBounds* bounds, ThreadPool& pool);
  /// Recomputes all boxes of the tree in place.
  void refit(const BodyBounds* bounds, ThreadPool& pool);
  /// True if motion has made the nodes so loose that sorting again is worthwhile.
  bool is_loose() const { return area_ > 1.5 * area_when_built_; }

  /// Appends the items whose boxes overlap `box`; their order depends only on the tree.
  void overlap(const Aabb& box, std::vector<std::uint32_t>& found) const;

  /// Adjacent leaves that share a node two levels up.
  static constexpr std::size_t family = 64;
  /// Nodes of that level that boxes of a family may overlap, in the order in which `overlap` visits them. Searches
  /// start from these instead of the root.
  struct Nearby {
    static constexpr std::size_t most = 64;
    alignas(32) float lower[3][most], upper[3][most];
    std::uint32_t nodes[most];
    std::size_t count = 0;
    bool is_known = false;  ///< false if there are more, or if the tree is too small: `overlap` then starts at the root
  };
  /// Finds what leaves [number · family, (number + 1) · family) may overlap.
  void list_nearby(std::size_t number, Nearby& nearby) const;
  /// The same for a box of that family.
  void overlap(const Aabb& box, const Nearby& nearby, std::vector<std::uint32_t>& found) const;

  /// Visits items whose boxes the moving box meets up to the fraction `limit` of its path, in roughly the order in
  /// which it meets them. Each visit returns the new limit. Returns the last limit. bvh_visit.cpp
  float visit(const MovingBox& box, float limit, BodyVisitor& visitor) const;

  void save(ByteWriter& write) const { write(leaves_, area_when_built_); }
  /// Restores the saved leaf order over these boxes.
  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool);

  std::size_t size() const { return leaves_.size(); }
  /// All items in tree order.
  std::span<const std::uint32_t> leaves() const { return leaves_; }
  /// Level by level, the leaves' parents first.
  std::span<const Node> nodes() const { return nodes_; }
  std::span<const Level> levels() const { return levels_; }
  std::uint64_t times_built() const { return times_built_; }
  /// Number of changes so far.
  std::uint64_t version() const { return version_; }
  std::size_t memory_bytes() const;

 private:
  class Probe;
  struct Key {
    std::uint64_t code;
    std::uint32_t item;
  };

  /// Boxes with infinite bounds overlap the empty boxes of missing children.
  bool has_child(std::uint32_t level, std::size_t child) const {
    return child < (level > 0 ? levels_[level - 1].count : leaves_.size());
  }
  /// Calls visit(probe, node) for nodes of level `lowest` whose boxes meet `box`.
  template <class Visit>
  void descend(const Aabb& box, std::uint32_t lowest, const Visit& visit) const;
  std::uint32_t* list_leaves(const Probe& probe, std::size_t parent, std::uint32_t* end) const;
  void lay_out_levels();
  static void replace(Node& node, const Node& by);
  static void set_child(Node& node, std::size_t child, const Aabb& box);
  static Aabb box_of(const Node& node);
  double refit_parents(const BodyBounds* bounds, std::size_t begin, std::size_t end);
  void refit_level(std::size_t level, std::size_t begin, std::size_t end);
  void refit_subtree(const BodyBounds* bounds, std::size_t root);

  std::vector<std::uint32_t> leaves_;  // items in tree order
  std::vector<Node> nodes_;
  std::vector<Level> levels_;
  std::vector<Key> keys_, sorted_;
  std::vector<double> areas_;  // per two-level subtree
  std::uint64_t times_built_ = 0, version_ = 0;
  double area_ = 0;
  double area_when_built_ = 0;
};

}  // namespace fathom::native
