#include "geometry/any_query.hpp"

#include <algorithm>

#include "geometry/compound_query.hpp"
#include "geometry/separation.hpp"
#include "geometry/surface_query.hpp"

namespace fathom {

std::optional<SurfaceHit> shape_cast_at(const PlacedShape& moving, Vec3 translation, const Geometry& shape,
                                        const Pose& pose, double limit) {
  if (shape.is_compound()) return shape_cast_at_compound(moving, translation, shape.compound(), pose, limit);
  return shape.is_surface() ? shape_cast_at_surface(moving, translation, shape, pose, limit)
                            : shape_cast(moving, translation, {shape, pose}, limit);
}

bool touches(const PlacedShape& placed, const Geometry& shape, const Pose& pose) {
  if (shape.is_compound()) return touches_compound(placed, shape.compound(), pose);
  return shape.is_surface() ? touches_surface(placed, shape, pose) : separation(placed, {shape, pose}).touch();
}

namespace {

/// Whether act(child, pose) is true for any child of the compound.
template <class Act>
bool any_child(const Geometry& compound, const Pose& pose, const Act& act) {
  return std::ranges::any_of(compound.compound().children(),
                             [&](const ChildShape& child) { return act(geometry(child.shape), pose * child.pose); });
}

}  // namespace

bool touch(const Geometry& a, const Pose& pose_a, const Geometry& b, const Pose& pose_b) {
  if (a.is_surface()) return !b.is_surface() && touch(b, pose_b, a, pose_a);
  if (!a.is_compound()) return touches({a, pose_a}, b, pose_b);
  return any_child(a, pose_a, [&](const Geometry& child, const Pose& at) { return touch(child, at, b, pose_b); });
}

bool touch_on_way(const Geometry& a, const Pose& pose_a, Vec3 translation, const Geometry& b, const Pose& pose_b) {
  if (a.is_surface()) return !b.is_surface() && touch_on_way(b, pose_b, -translation, a, pose_a);
  if (!a.is_compound()) return shape_cast_at({a, pose_a}, translation, b, pose_b, 1).has_value();
  return any_child(a, pose_a, [&](const Geometry& child, const Pose& at) {
    return touch_on_way(child, at, translation, b, pose_b);
  });
}

}  // namespace fathom
