// Eight triangles of a surface side by side.
#pragma once

#include <cstring>

#include "collision/eight.hpp"
#include "terrain/surface_triangle.hpp"

namespace fathom {

/// Up to eight triangles.
struct EightTriangles {
  Hull::Eight corners[3] = {};
  Hull::Eight planes = {};  ///< with offsets in w
  alignas(32) std::uint32_t names[3][8] = {};
  int count = 0;

  /// A triangle in the surface's frame; `complete` follows when all are there.
  void add(const Triangle& t) {
    set_corners(t.corners, t.vertices);
    ++count;
  }
  /// As `SurfaceTriangle`, to the bit.
  void complete(Vec3 origin);

  void add(const SurfaceTriangle& t) {
    set_corners(t.corners, t.names);
    planes.x[count] = t.normal.x, planes.y[count] = t.normal.y, planes.z[count] = t.normal.z;
    planes.w[count++] = t.offset;
  }
  SurfaceTriangle at(int lane) const {
    SurfaceTriangle t;
    for (int k = 0; k < 3; ++k) {
      t.corners[k] = {corners[k].x[lane], corners[k].y[lane], corners[k].z[lane]};
      t.names[k] = names[k][lane];
    }
    t.normal = {planes.x[lane], planes.y[lane], planes.z[lane]}, t.offset = planes.w[lane];
    return t;
  }
  /// A bit for each triangle with a corner of this name.
  unsigned having(std::uint32_t name) const {
    const EightInts wanted = eight(static_cast<std::int32_t>(name));
    const auto same = [&](int k) {
      EightInts of_corners;
      std::memcpy(&of_corners, names[k], sizeof of_corners);
      return of_corners == wanted;
    };
    return bits(same(0) | same(1) | same(2)) & present();
  }
  /// A bit for each triangle.
  unsigned present() const { return (1u << count) - 1; }

 private:
  /// Of the triangle that comes next.
  void set_corners(const Vec3 (&of)[3], const std::uint32_t (&ids)[3]) {
    for (int k = 0; k < 3; ++k) {
      corners[k].x[count] = of[k].x, corners[k].y[count] = of[k].y, corners[k].z[count] = of[k].z;
      names[k][count] = ids[k];
    }
  }
};

}  // namespace fathom
