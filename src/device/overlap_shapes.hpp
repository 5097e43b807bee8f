// The kernel that finds the bodies that many placed shapes touch, the same as World::overlap_shape's.
#pragma once

#include "device/asked_shapes.hpp"
#include "device/query_scene.hpp"
#include "exec/atomic.hpp"
#include "geometry/child_search.hpp"
#include "geometry/surface_cast.hpp"

namespace fathom::device {

/// A shape touches a body.
struct Overlap {
  std::uint32_t shape = 0;  ///< its number
  std::uint32_t slot = 0;
};

/// Writes all overlaps in any order. If there is no room for all, `count` is above `room`, and the search is
/// incomplete.
struct OverlapShapes {
  static constexpr std::uint32_t group_size = 64;
  QueryScene scene;
  QueryView view;
  const AskedShape* shapes;
  const Vec3* corners;
  Overlap* overlaps;
  std::uint32_t room;    ///< in `overlaps`
  std::uint32_t* count;  ///< zero before

  FATHOM_HD void operator()(std::uint32_t i) const {
    const PlacedShape placed = shapes[i].placed(corners);
    const BoxSlabs slabs({to_float(placed.position), to_float(placed.reach()), {}});
    constexpr float go_on = 1, stop = -1;  // fractions up to which the search goes on
    float limit = go_on;
    for (const QueryTree& tree : scene.trees)
      limit = visit_along(tree, slabs, limit, [&](std::uint32_t slot) {
        const QueryBody& body = scene.bodies[slot];
        if (!view.sees(body, slot) || !touches(placed, body.shape, scene.poses[slot])) return go_on;
        const std::uint32_t place = exec::atomic_add(*count, 1u);
        if (place >= room) return stop;
        overlaps[place] = {i, slot};
        return go_on;
      });
  }

 private:
  FATHOM_HD bool touches(const PlacedShape& placed, const QueryShape& shape, const Pose& pose) const {
    if (shape.type == ShapeType::compound) return touches_compound(placed, scene.compounds[shape.part], pose);
    if (shape.type == ShapeType::mesh || shape.type == ShapeType::height_field)
      return touches_surface(placed, scene.surfaces[shape.part], pose);
    return separation_of(placed, {scene.geometry(shape), pose}).touch();
  }

  FATHOM_HD bool touches_surface(const PlacedShape& placed, const SurfaceView& surface, const Pose& pose) const {
    const PlacedShape frame(Geometry{}, pose);
    return surface.any_in(LocalBox(frame, placed).grown(0), [&](std::uint32_t number) {
      const Triangle triangle = surface.triangle(number);
      return separation_of(placed_triangle(frame, triangle, placed.thinnest), placed).touch();
    });
  }

  FATHOM_HD bool touches_compound(const PlacedShape& placed, const QueryCompound& compound, const Pose& pose) const {
    const PlacedShape frame(Geometry{ShapeType::sphere}, pose);
    const auto touches_child = [&](std::uint32_t number) {
      const QueryChild& child = scene.children[compound.children + number];
      return separation_of(placed, {scene.geometry(child.shape), pose * child.pose}).touch();
    };
    return any_child_in(scene.compound_nodes + compound.nodes, scene.compound_leaves + compound.leaves,
                        LocalBox(frame, placed).grown(0), touches_child);
  }
};

}  // namespace fathom::device
