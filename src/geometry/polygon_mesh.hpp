// A closed polyhedron of polygons, made from a triangle hull by merging coplanar triangles.
#pragma once

#include <vector>

#include "geometry/triangle_hull.hpp"

namespace fathom {

struct PolygonMesh {
  struct HalfEdge {
    int next, previous, twin;
    int origin;
    int face;  ///< −1: the edge was merged away
  };
  struct Face {
    int edge;  ///< −1: the face was merged away
    int edge_count;
    Vec3d normal;  ///< outward, of unit length
    double offset;
  };
  std::vector<Vec3d> vertices;  ///< m; some may be left without an edge
  std::vector<HalfEdge> edges;
  std::vector<Face> faces;
};

/// Merges neighbours as long as all their vertices stay within a few times the hull's noise of a common plane and the
/// polygon stays convex. Vertices left with only two faces lie on a straight edge and are removed.
PolygonMesh merge_coplanar(const TriangleHull& hull);

}  // namespace fathom
