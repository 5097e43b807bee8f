// The kernel that casts many shapes: for each the nearest hit, the same as World::cast_shape's bit for bit.
#pragma once

#include "device/asked_shapes.hpp"
#include "device/query_scene.hpp"
#include "geometry/child_search.hpp"
#include "geometry/surface_cast.hpp"

namespace fathom::device {

struct CastShapes {
  static constexpr std::uint32_t group_size = 64;
  QueryScene scene;
  QueryView view;
  const AskedShape* shapes;
  const Vec3* corners;
  BodyHit* hits;

  FATHOM_HD void operator()(std::uint32_t i) const {
    const Vec3 translation = shapes[i].translation;
    const PlacedShape moving = shapes[i].placed(corners);
    const MovingBox box{to_float(moving.position), to_float(moving.reach()), translation};
    const auto meets = [&](const QueryShape& shape, const Pose& pose, double limit, SurfaceHit& hit) {
      return meets_body(moving, translation, shape, pose, limit, hit);
    };
    hits[i] = scene.nearest(view, BoxSlabs(box), meets);
  }

 private:
  FATHOM_HD bool meets_body(const PlacedShape& moving, Vec3 translation, const QueryShape& shape, const Pose& pose,
                            double limit, SurfaceHit& hit) const {
    if (shape.type == ShapeType::compound)
      return meets_compound(moving, translation, scene.compounds[shape.part], pose, limit, hit);
    if (shape.type == ShapeType::mesh || shape.type == ShapeType::height_field)
      return meets_surface(moving, translation, scene.surfaces[shape.part], pose, limit, hit);
    return meets_on_way(moving, translation, {scene.geometry(shape), pose}, limit, hit);
  }

  FATHOM_HD bool meets_surface(const PlacedShape& moving, Vec3 translation, const SurfaceView& surface,
                               const Pose& pose, double limit, SurfaceHit& hit) const {
    SurfaceCast cast(moving, translation, Geometry{}, pose, limit);
    for_each_along(surface, cast.centre(), cast.half(), cast.way(),
                   [&](std::uint32_t number, const Triangle& triangle) { return cast.meet(number, triangle); });
    return cast.hit(hit);
  }

  FATHOM_HD bool meets_compound(const PlacedShape& moving, Vec3 translation, const QueryCompound& compound,
                                const Pose& pose, double limit, SurfaceHit& hit) const {
    const PlacedShape frame(Geometry{ShapeType::sphere}, pose);
    const LocalBox box(frame, moving);
    const BoxWay way(to_float(box.centre), to_float(box.half), to_float(frame.to_local(to_double(translation))));
    const auto meet_child = [&](std::uint32_t number, double end, SurfaceHit& of_child) {
      const QueryChild& child = scene.children[compound.children + number];
      return meets_on_way(moving, translation, {scene.geometry(child.shape), pose * child.pose}, end, of_child);
    };
    return meets_child(scene.compound_nodes + compound.nodes, scene.compound_leaves + compound.leaves, way, limit,
                       meet_child, hit);
  }
};

}  // namespace fathom::device
