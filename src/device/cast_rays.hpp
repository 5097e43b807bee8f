// The kernel that casts many rays: for each the nearest hit, the same as World::cast_ray's bit for bit.
#pragma once

#include "device/query_scene.hpp"
#include "geometry/child_search.hpp"
#include "geometry/ray.hpp"

namespace fathom::device {

struct CastRays {
  static constexpr std::uint32_t group_size = 64;
  QueryScene scene;
  QueryView view;
  const Ray* rays;
  BodyHit* hits;

  FATHOM_HD void operator()(std::uint32_t i) const {
    const Ray ray = rays[i];
    const auto meets = [&](const QueryShape& shape, const Pose& pose, double limit, SurfaceHit& hit) {
      return meets_body(ray, shape, pose, limit, hit);
    };
    hits[i] = scene.nearest(view, BoxSlabs({ray.origin, {}, ray.translation}), meets);
  }

 private:
  FATHOM_HD bool meets_body(const Ray& ray, const QueryShape& shape, const Pose& pose, double limit,
                            SurfaceHit& hit) const {
    if (shape.type == ShapeType::compound) return meets_compound(ray, scene.compounds[shape.part], pose, limit, hit);
    if (shape.type == ShapeType::mesh || shape.type == ShapeType::height_field)
      return meets_surface(ray, scene.surfaces[shape.part], pose, limit, hit);
    return meets_convex(ray, scene.geometry(shape), pose, hit);
  }

  FATHOM_HD bool meets_surface(const Ray& ray, const SurfaceView& surface, const Pose& pose, double limit,
                               SurfaceHit& hit) const {
    SurfaceRay of_surface(ray, Geometry{}, pose, limit);
    for_each_along(surface, to_float(of_surface.local().origin), {}, to_float(of_surface.local().translation),
                   [&](std::uint32_t number, const Triangle& triangle) { return of_surface.meet(number, triangle); });
    return of_surface.hit(hit);
  }

  FATHOM_HD bool meets_compound(const Ray& ray, const QueryCompound& compound, const Pose& pose, double limit,
                                SurfaceHit& hit) const {
    const PlacedShape frame(Geometry{ShapeType::sphere}, pose);
    const BoxWay way(to_float(frame.to_local(to_double(ray.origin) - frame.position)), {},
                     to_float(frame.to_local(to_double(ray.translation))));
    const auto meet_child = [&](std::uint32_t number, double, SurfaceHit& of_child) {
      const QueryChild& child = scene.children[compound.children + number];
      return meets_convex(ray, scene.geometry(child.shape), pose * child.pose, of_child);
    };
    return meets_child(scene.compound_nodes + compound.nodes, scene.compound_leaves + compound.leaves, way, limit,
                       meet_child, hit);
  }
};

}  // namespace fathom::device
