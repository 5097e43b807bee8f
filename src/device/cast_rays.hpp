// The kernel that casts many rays: for each the nearest hit, the same as World::cast_ray's bit for bit.
#pragma once

#include "device/body_arrays.hpp"
#include "device/ray_tree.hpp"
#include "geometry/child_search.hpp"
#include "geometry/ray.hpp"
#include "terrain/triangles_along.hpp"
#include "world/many_rays.hpp"

namespace fathom::device {

/// Shape of a body or of a compound's child.
struct RayShape {
  ShapeType type = ShapeType::box;
  float radius = 0;
  Vec3 half_extents;
  std::uint32_t part = 0;  ///< index of its hull, surface or compound
};

struct RayBody {
  RayShape shape;
  bool is_sensor = false;
  Filter filter;
};

struct RayChild {
  RayShape shape;
  Pose pose;  ///< in its compound
};

/// Where a compound's tree and children begin.
struct RayCompound {
  std::uint32_t nodes = 0, leaves = 0, children = 0;
};

/// What rays meet, in device memory.
struct RayScene {
  static constexpr std::uint32_t tree_count = 3;
  RayTree trees[tree_count];
  const RayBody* bodies = nullptr;  ///< by slot, as are the poses
  const Pose* poses = nullptr;
  HullArrays hulls;
  const SurfaceView* surfaces = nullptr;
  const RayCompound* compounds = nullptr;
  const BoxTreeNode* compound_nodes = nullptr;
  const std::uint32_t* compound_leaves = nullptr;
  const RayChild* children = nullptr;

  FATHOM_HD Geometry geometry(const RayShape& shape) const {
    Geometry g{shape.type, shape.radius, shape.half_extents};
    if (shape.type == ShapeType::hull) g.hull = hulls.view(shape.part);
    return g;
  }
};

/// A SurfaceView that is a height field, as `triangles_along` wants it.
struct FieldView {
  const SurfaceView& view;

  FATHOM_HD std::uint32_t columns() const { return view.columns; }
  FATHOM_HD std::uint32_t rows() const { return view.rows; }
  FATHOM_HD float cell_x() const { return view.cell_x; }
  FATHOM_HD float cell_y() const { return view.cell_y; }
  FATHOM_HD bool is_hole(std::uint32_t cell) const { return view.is_hole(cell); }
  FATHOM_HD Triangle triangle(std::uint32_t number) const { return view.triangle(number); }
};

struct CastRays {
  static constexpr std::uint32_t group_size = 64;
  RayScene scene;
  QuerySight sight;
  const std::uint32_t* ignored;  ///< slots, ascending
  std::uint32_t ignored_count;
  const Ray* rays;
  RayHit* hits;

  FATHOM_HD void operator()(std::uint32_t i) const {
    const Ray ray = rays[i];
    const RaySlabs slabs(ray);
    RayHit nearest;
    float limit = 1;
    for (const RayTree& tree : scene.trees)
      limit = visit_along(tree, slabs, limit, [&](std::uint32_t slot) { return meet(ray, slot, nearest); });
    hits[i] = nearest;
  }

 private:
  /// Returns the fraction up to which other bodies count.
  FATHOM_HD float meet(const Ray& ray, std::uint32_t slot, RayHit& nearest) const {
    const RayBody& body = scene.bodies[slot];
    const float fraction = nearest.slot != RayHit::nothing ? nearest.hit.fraction : 1.0f;
    if (!sight.sees(body.filter, body.is_sensor) || is_ignored(slot)) return fraction;
    SurfaceHit hit;
    const bool is_nearer = meets_body(ray, body.shape, scene.poses[slot], limit_beyond(fraction), hit) &&
                           (hit.fraction < fraction || (hit.fraction == fraction && slot < nearest.slot));
    if (!is_nearer) return fraction;
    nearest = {slot, hit};
    return hit.fraction;
  }

  FATHOM_HD bool meets_body(const Ray& ray, const RayShape& shape, const Pose& pose, double limit,
                            SurfaceHit& hit) const {
    if (shape.type == ShapeType::compound) return meets_compound(ray, scene.compounds[shape.part], pose, limit, hit);
    if (shape.type == ShapeType::mesh || shape.type == ShapeType::height_field)
      return meets_surface(ray, scene.surfaces[shape.part], pose, limit, hit);
    return meets_convex(ray, scene.geometry(shape), pose, hit);
  }

  FATHOM_HD bool meets_surface(const Ray& ray, const SurfaceView& surface, const Pose& pose, double limit,
                               SurfaceHit& hit) const {
    SurfaceRay of_surface(ray, Geometry{}, pose, limit);
    const Vec3 origin = to_float(of_surface.local().origin), way = to_float(of_surface.local().translation);
    const auto act = [&](std::uint32_t number, const Triangle& triangle) { return of_surface.meet(number, triangle); };
    if (surface.heights)
      triangles_along(FieldView{surface}, origin, {}, way, act);
    else
      triangles_along(
          surface.nodes, BoxWay(origin, {}, way), [&](std::uint32_t number) { return surface.triangle(number); }, act);
    return of_surface.hit(hit);
  }

  FATHOM_HD bool meets_compound(const Ray& ray, const RayCompound& compound, const Pose& pose, double limit,
                                SurfaceHit& hit) const {
    const PlacedShape frame(Geometry{ShapeType::sphere}, pose);
    const BoxWay way(to_float(frame.to_local(to_double(ray.origin) - frame.position)), {},
                     to_float(frame.to_local(to_double(ray.translation))));
    const auto meet_child = [&](std::uint32_t number, double, SurfaceHit& of_child) {
      const RayChild& child = scene.children[compound.children + number];
      return meets_convex(ray, scene.geometry(child.shape), pose * child.pose, of_child);
    };
    return meets_child(scene.compound_nodes + compound.nodes, scene.compound_leaves + compound.leaves, way, limit,
                       meet_child, hit);
  }

  FATHOM_HD bool is_ignored(std::uint32_t slot) const {
    std::uint32_t begin = 0, end = ignored_count;
    while (begin < end) {
      const std::uint32_t middle = begin + (end - begin) / 2;
      if (ignored[middle] == slot) return true;
      if (ignored[middle] < slot)
        begin = middle + 1;
      else
        end = middle;
    }
    return false;
  }
};

}  // namespace fathom::device
