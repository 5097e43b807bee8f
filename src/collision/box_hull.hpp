// A box as a hull: the general path for boxes against every other shape.
#pragma once

#include "geometry/geometry.hpp"

namespace fathom {

/// Faces 2·axis (positive side) and 2·axis + 1 (negative side); bits 0, 1, 2 of a vertex say whether it is on the
/// positive side of x, y, z; undirected edge 4·axis + (side of the next axis) + 2·(side of the one after that).
struct BoxHull {
  Vec3 vertices[8];
  Hull::Plane planes[6] = {{{1, 0, 0}, 0},  {{-1, 0, 0}, 0}, {{0, 1, 0}, 0},
                           {{0, -1, 0}, 0}, {{0, 0, 1}, 0},  {{0, 0, -1}, 0}};
  Hull::HalfEdge edges[24] = {{18, 0, 3}, {8, 1, 5},  {13, 2, 5}, {20, 3, 2}, {14, 4, 4}, {17, 5, 3},
                              {23, 6, 2}, {11, 7, 4}, {2, 0, 5},  {16, 2, 1}, {21, 4, 1}, {4, 6, 4},
                              {22, 1, 0}, {1, 3, 5},  {7, 5, 4},  {19, 7, 0}, {10, 0, 1}, {0, 4, 3},
                              {5, 1, 3},  {12, 5, 0}, {6, 2, 2},  {9, 6, 1},  {15, 3, 0}, {3, 7, 2}};
  std::uint16_t face_edges[6] = {12, 9, 3, 0, 4, 1};

  FATHOM_HD explicit BoxHull(Vec3 h) {
    for (int i = 0; i < 8; ++i) {
      vertices[i] = {(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z};
    }
    for (int i = 0; i < 6; ++i) planes[i].offset = h[i / 2];
  }
};

FATHOM_HD HullView view(const BoxHull& box) { return {box.vertices, box.edges, box.planes, box.face_edges, 8, 24, 6}; }

}  // namespace fathom
