// What the queries of a kernel meet, in device memory: bodies and the tree to find them by.
#pragma once

#include "device/body_arrays.hpp"
#include "device/query_tree.hpp"
#include "geometry/query.hpp"
#include "terrain/triangles_along.hpp"
#include "world/many_queries.hpp"

namespace fathom::device {

/// Shape of a body or of a compound's child.
struct QueryShape {
  ShapeType type = ShapeType::box;
  float radius = 0;
  Vec3 half_extents;
  std::uint32_t part = 0;  ///< index of its hull, surface or compound
};

struct QueryBody {
  QueryShape shape;
  bool is_sensor = false;
  Filter filter;
};

struct QueryChild {
  QueryShape shape;
  Pose pose;  ///< in its compound
};

/// Where a compound's tree and children begin.
struct QueryCompound {
  std::uint32_t nodes = 0, leaves = 0, children = 0;
};

/// Which bodies a query sees.
struct QueryView {
  QuerySight sight;
  const std::uint32_t* ignored = nullptr;  ///< slots, ascending
  std::uint32_t ignored_count = 0;

  FATHOM_HD bool sees(const QueryBody& body, std::uint32_t slot) const {
    return sight.sees(body.filter, body.is_sensor) && !ignores(slot);
  }

 private:
  FATHOM_HD bool ignores(std::uint32_t slot) const {
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

struct QueryScene {
  static constexpr std::uint32_t tree_count = 3;
  QueryTree trees[tree_count];
  const QueryBody* bodies = nullptr;  ///< by slot, as are the poses
  const Pose* poses = nullptr;
  HullArrays hulls;
  const SurfaceView* surfaces = nullptr;
  const QueryCompound* compounds = nullptr;
  const BoxTreeNode* compound_nodes = nullptr;
  const std::uint32_t* compound_leaves = nullptr;
  const QueryChild* children = nullptr;

  FATHOM_HD Geometry geometry(const QueryShape& shape) const {
    Geometry g{shape.type, shape.radius, shape.half_extents};
    if (shape.type == ShapeType::hull) g.hull = hulls.view(shape.part);
    return g;
  }

  /// The first hit among bodies whose boxes the moving one meets. `meets(shape, pose, limit, hit)`: whether a body is
  /// hit up to the fraction `limit`. Of equal hits the body with the lowest slot wins.
  template <class Meets>
  FATHOM_HD BodyHit nearest(const QueryView& view, const BoxSlabs& slabs, const Meets& meets) const {
    BodyHit nearest;
    const auto visit = [&](std::uint32_t slot) {
      const QueryBody& body = bodies[slot];
      const float fraction = nearest.slot != BodyHit::nothing ? nearest.hit.fraction : 1.0f;
      if (!view.sees(body, slot)) return fraction;
      SurfaceHit hit;
      const bool is_nearer = meets(body.shape, poses[slot], limit_beyond(fraction), hit) &&
                             (hit.fraction < fraction || (hit.fraction == fraction && slot < nearest.slot));
      if (!is_nearer) return fraction;
      nearest = {slot, hit};
      return hit.fraction;
    };
    float limit = 1;
    for (const QueryTree& tree : trees) limit = visit_along(tree, slabs, limit, visit);
    return nearest;
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

/// Calls act(number, triangle) for a surface's triangles on a moving box's path (m, the surface's frame); it returns
/// the fraction up to which others count.
template <class Act>
FATHOM_HD void for_each_along(const SurfaceView& surface, Vec3 centre, Vec3 half, Vec3 way, const Act& act) {
  if (surface.heights)
    triangles_along(FieldView{surface}, centre, half, way, act);
  else
    triangles_along(
        surface.nodes, BoxWay(centre, half, way), [&](std::uint32_t number) { return surface.triangle(number); }, act);
}

}  // namespace fathom::device
