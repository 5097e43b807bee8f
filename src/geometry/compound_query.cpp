#include "geometry/compound_query.hpp"

#include <algorithm>

#include "geometry/box_tree.hpp"
#include "geometry/child_search.hpp"
#include "geometry/local_box.hpp"
#include "geometry/separation.hpp"
#include "geometry/support.hpp"

namespace fathom {
namespace {

/// The compound's own frame, as a shape of zero size.
PlacedShape frame_of(const Pose& pose) { return {{ShapeType::sphere}, pose}; }

/// The first hit that `meet(geometry, pose, limit)` finds among the children on the box's path.
template <class Meet>
std::optional<SurfaceHit> first_child(const Compound& compound, const Pose& pose, const BoxWay& way, double limit,
                                      const Meet& meet) {
  SurfaceHit first;
  const auto meet_child = [&](std::uint32_t number, double end, SurfaceHit& hit) {
    const ChildShape& child = compound.children()[number];
    const std::optional<SurfaceHit> found = meet(geometry(child.shape), pose * child.pose, end);
    if (found) hit = *found;
    return found.has_value();
  };
  const bool any = meets_child(compound.nodes().data(), compound.leaves().data(), way, limit, meet_child, first);
  return any ? std::optional(first) : std::nullopt;
}

}  // namespace

void find_children(const Compound& compound, const Aabb& box, std::vector<std::uint32_t>& found) {
  search_box_tree(compound.nodes(), OverlapTest(box), [&](std::uint32_t leaf) {
    const std::uint32_t child = compound.leaves()[leaf];
    if (overlaps(compound.bounds(child), box)) found.push_back(child);
  });
}

std::optional<SurfaceHit> ray_cast_at_compound(const Compound& compound, const Pose& pose, const Ray& ray,
                                               double limit) {
  const PlacedShape frame = frame_of(pose);
  const BoxWay way(to_float(frame.to_local(to_double(ray.origin) - frame.position)), {},
                   to_float(frame.to_local(to_double(ray.translation))));
  return first_child(compound, pose, way, limit,
                     [&](const Geometry& child, const Pose& at, double end) { return ray_cast(child, at, ray, end); });
}

std::optional<SurfaceHit> shape_cast_at_compound(const PlacedShape& moving, Vec3 translation, const Compound& compound,
                                                 const Pose& pose, double limit) {
  const PlacedShape frame = frame_of(pose);
  const LocalBox box(frame, moving);
  const BoxWay way(to_float(box.centre), to_float(box.half), to_float(frame.to_local(to_double(translation))));
  return first_child(compound, pose, way, limit, [&](const Geometry& child, const Pose& at, double end) {
    return shape_cast(moving, translation, {child, at}, end);
  });
}

bool touches_compound(const PlacedShape& shape, const Compound& compound, const Pose& pose) {
  std::vector<std::uint32_t> found;
  find_children(compound, LocalBox(frame_of(pose), shape).grown(0), found);
  return std::ranges::any_of(found, [&](std::uint32_t number) {
    const ChildShape& child = compound.children()[number];
    return separation(shape, {geometry(child.shape), pose * child.pose}).touch();
  });
}

Aabb tight_bounds(const Geometry& shape, const Pose& pose) {
  if (!shape.is_compound()) return bounds(shape, pose);
  const std::span<const ChildShape> children = shape.compound().children();
  Aabb box = bounds(geometry(children[0].shape), pose * children[0].pose);
  for (const ChildShape& child : children) box = merged(box, bounds(geometry(child.shape), pose * child.pose));
  return box;
}

}  // namespace fathom
