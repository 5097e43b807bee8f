// A moving or resting shape against the triangles of a surface, one after the other, for host and device.
#pragma once

#include <fathom/mesh.hpp>

#include "geometry/local_box.hpp"
#include "geometry/shape_cast.hpp"

namespace fathom {

/// One triangle of a placed surface as a separate shape. Refers to the triangle's corners, which must outlive it.
FATHOM_HD PlacedShape placed_triangle(const PlacedShape& surface, const Triangle& triangle, double thinnest) {
  PlacedShape shape = surface;
  shape.hull.vertices = triangle.corners;
  shape.hull.vertex_count = 3;
  shape.radius = 0;
  shape.thinnest = thinnest;  // that of the other shape
  return shape;
}

/// Where a moving shape first touches a placed surface. A triangle that it leaves behind counts only if the two touch
/// at the start; of equally near triangles, that with the lowest number is hit.
class SurfaceCast {
 public:
  /// `surface`: its type and pose count, not its triangles.
  FATHOM_HD SurfaceCast(const PlacedShape& moving, Vec3 translation, const Geometry& surface, const Pose& pose,
                        double limit)
      : moving_(moving),
        translation_(translation),
        frame_(surface, pose),
        box_(frame_, moving),
        way_(frame_.to_local(to_double(translation))),
        limit_(limit) {}

  // The path of the shape's box in the surface's frame (m).
  FATHOM_HD Vec3 centre() const { return to_float(box_.centre); }
  FATHOM_HD Vec3 half() const { return to_float(box_.half); }
  FATHOM_HD Vec3 way() const { return to_float(way_); }

  /// Returns the fraction up to which other triangles count.
  FATHOM_HD float meet(std::uint32_t number, const Triangle& triangle) {
    const PlacedShape still = placed_triangle(frame_, triangle, moving_.thinnest);
    SurfaceHit hit;
    if (!meets(still, triangle, hit)) return search_limit(end());
    if (nearest_.triangle == no_triangle || hit.fraction < nearest_.fraction ||
        (hit.fraction == nearest_.fraction && number < nearest_.triangle)) {
      nearest_ = hit;
      nearest_.triangle = number;
    }
    return search_limit(end());
  }

  /// True: `hit` says where.
  FATHOM_HD bool hit(SurfaceHit& hit) const {
    hit = nearest_;
    return nearest_.triangle != no_triangle;
  }

 private:
  FATHOM_HD double end() const {
    return nearest_.triangle != no_triangle ? static_cast<double>(nearest_.fraction) : limit_;
  }
  FATHOM_HD bool meets(const PlacedShape& still, const Triangle& triangle, SurfaceHit& hit) const {
    const Vec3d a = to_double(triangle.corners[0]), b = to_double(triangle.corners[1]),
                c = to_double(triangle.corners[2]);
    const bool leaves = dot(cross(b - a, c - a), way_) > 0;
    if (!leaves) return meets_on_way(moving_, translation_, still, static_cast<double>(search_limit(end())), hit);
    const Separation s = separation_of(still, moving_);
    hit = SurfaceHit{0, to_float(still.position + s.on_a), {}, true};
    return s.touch();
  }

  const PlacedShape& moving_;
  Vec3 translation_;
  PlacedShape frame_;
  LocalBox box_;
  Vec3d way_;
  double limit_;
  SurfaceHit nearest_;
};

}  // namespace fathom
