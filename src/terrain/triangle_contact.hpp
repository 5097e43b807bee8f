// Contact of one triangle of a surface with a convex shape.
//
// Everything is told in the surface's axes with the convex shape's centre as origin, so that surfaces of kilometres
// cost no precision. A triangle is solid behind: bodies touch its outside alone, and of the axes across its edges and
// corners only those count along which the surface beside it does not rise. A flat floor of many triangles then has no
// edges to catch on.
#pragma once

#include <fathom/mesh.hpp>
#include <vector>

#include "collision/box_hull.hpp"
#include "collision/manifold.hpp"
#include "collision/round_shapes.hpp"

namespace fathom {

/// A triangle as a hull with two faces: the first looks outward.
struct TriangleHull {
  Vec3 vertices[3];
  Hull::Plane planes[2];
  Hull::HalfEdge edges[6] = {{2, 0, 0}, {5, 1, 1}, {4, 1, 0}, {1, 2, 1}, {0, 2, 0}, {3, 0, 1}};
  std::uint16_t face_edges[2] = {0, 1};
  std::uint32_t names[3];  ///< of its vertices

  /// `origin`: where the other shape is, in the surface's frame.
  TriangleHull(const Triangle& triangle, Vec3 origin);

  Vec3 normal() const { return planes[0].normal; }
};

/// An edge of a polyhedron and the arc of normals across it, between those of its faces.
struct EdgeArc {
  Vec3 from, along;
  Vec3 of_left, of_right;  ///< across the edge, as its arc is: a normal between the faces' lies between these
  Vec3 middle;             ///< sum of the faces' normals
};

/// A convex shape that is met by triangles, turned into the surface's axes; its centre is the origin.
class TurnedShape {
 public:
  TurnedShape(const Geometry& shape, Quat rotation);
  TurnedShape(const TurnedShape&) = delete;
  TurnedShape& operator=(const TurnedShape&) = delete;

  bool is_round() const { return round_.radius > 0; }
  const RoundShape& round() const { return round_; }
  /// Of a box or a hull: in its own axes and turned.
  const HullView& hull() const { return hull_; }
  const HullView& turned() const { return turned_; }
  const std::vector<EdgeArc>& edges() const { return edges_; }  ///< of a box or a hull, turned
  Quat rotation() const { return rotation_; }
  float inner() const { return inner_; }  ///< m, half the least thickness
  float outer() const { return outer_; }  ///< m, largest coordinate

 private:
  Quat rotation_;
  RoundShape round_{{}, 0};
  BoxHull box_;
  HullView hull_, turned_;
  std::vector<Vec3> vertices_;
  std::vector<Hull::Plane> planes_;
  std::vector<EdgeArc> edges_;
  float inner_ = 0, outer_ = 0;
};

/// The surface around the triangles that are looked at.
class Surroundings {
 public:
  /// Whether the surface beside the triangle, where it shares the corners `tips` (a bit each) with others, rises above
  /// the plane across `axis` (unit, outward) through them.
  virtual bool rises(const TriangleHull& triangle, unsigned tips, Vec3 axis) const = 0;

 protected:
  ~Surroundings() = default;
};

/// The least separation of the manifold's points (m), of which there is one.
inline float nearest_of(const Manifold& m) {
  float nearest = m.points[0].separation;
  for (int i = 1; i < m.count; ++i) nearest = min(nearest, m.points[i].separation);
  return nearest;
}

struct TriangleContact {
  Manifold manifold;
  /// The shape reaches further behind the triangle than it is thick: most likely it touches another side of the
  /// surface there, and this one counts only where it touches no other.
  bool is_deep = false;
};

/// Where the triangle and the shape are nearer than `margin` (m); the normal points from the triangle to the shape.
/// None where the shape's centre lies further behind the triangle than half its inner radius.
TriangleContact collide_triangle(const TriangleHull& triangle, const TurnedShape& shape, float margin,
                                 const Surroundings& surroundings);

}  // namespace fathom
