#include "geometry/shape_cast.hpp"

namespace fathom {

std::optional<SurfaceHit> shape_cast(const PlacedShape& moving, Vec3 translation, const PlacedShape& still,
                                     double limit) {
  SurfaceHit hit;
  return meets_on_way(moving, translation, still, limit, hit) ? std::optional(hit) : std::nullopt;
}

}  // namespace fathom
