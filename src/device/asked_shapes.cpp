#include "device/asked_shapes.hpp"

namespace fathom::device {

void AskedCorners::list(std::span<const ShapeCast> shapes) {
  first_.clear(), corners_.clear();
  const Hull* last = nullptr;
  for (const ShapeCast& cast : shapes) {
    const Hull* const hull = cast.shape->hull.get();
    if (!hull || hull == last) continue;
    last = hull;
    if (!first_.try_emplace(hull, static_cast<std::uint32_t>(corners_.size())).second) continue;
    corners_.insert(corners_.end(), hull->vertices().begin(), hull->vertices().end());
  }
}

void AskedCorners::write(std::span<const ShapeCast> shapes, AskedShape* to) const {
  const Hull* last = nullptr;
  std::uint32_t first = 0;
  for (const ShapeCast& cast : shapes) {
    const Geometry shape = geometry(*cast.shape);
    const Hull* const hull = cast.shape->hull.get();
    if (hull && hull != last) first = first_.at(hull), last = hull;
    *to++ = {shape.type, shape.radius,    shape.half_extents, hull ? first : 0, shape.hull.vertex_count,
             cast.pose,  cast.translation};
  }
}

}  // namespace fathom::device
