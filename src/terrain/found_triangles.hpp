// The triangles of a surface that a search has found, and questions about which of them adjoin one another.
#pragma once

#include <vector>

#include "terrain/eight_triangles.hpp"

namespace fathom {

/// Memory for the indices of `FoundTriangles`; kept from search to search.
struct FoundIndex {
  std::vector<std::uint32_t> first, next;  ///< chains of corners with the same hash of their name
  std::vector<Aabb> boxes, of_many;        ///< of eights, and of `eights_per_box` of them
};

/// Triangles relative to a shape's centre, in an order that keeps neighbours together. A large shape on a fine surface
/// finds tens of thousands, each of which asks about its neighbours: from `few` eights on, indices answer.
class FoundTriangles {
 public:
  FoundTriangles(const std::vector<EightTriangles>& eights, FoundIndex& index) : eights_(eights), index_(index) {}

  // See `collide_triangle`.
  bool rises(const SurfaceTriangle& t, unsigned tips, Vec3 axis) const;
  bool is_nearer_elsewhere(Vec3 point, float depth, float tolerance) const;
  bool is_inside(Vec3 point, float depth) const;

 private:
  static constexpr std::size_t few = 16, eights_per_box = 16;

  /// Whether the surface goes on on all sides of the triangle's point nearest to `point`.
  bool continues_at(const SurfaceTriangle& t, Vec3 point) const;
  void index_corners() const;
  void index_boxes() const;
  std::size_t chain_of(std::uint32_t name) const;
  template <class Test>
  bool any_eight_near(const Aabb& box, const Test& test) const;

  const std::vector<EightTriangles>& eights_;
  FoundIndex& index_;
  mutable bool has_corners_ = false, has_boxes_ = false;
};

}  // namespace fathom
