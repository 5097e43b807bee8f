// Shapes in the form that simulators use: plain structs for host and device code.
#pragma once

#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>

namespace fathom {

/// Read-only view of a hull's arrays, wherever they live.
struct HullView {
  const Vec3* vertices = nullptr;
  const Hull::HalfEdge* edges = nullptr;
  const Hull::Plane* planes = nullptr;
  const std::uint16_t* face_edges = nullptr;
  int vertex_count = 0;
  int edge_count = 0;           ///< half-edges
  std::int16_t face_count = 0;  // short, so that a body's constant data fill whole cache lines (BodyInfo)
  bool is_for_team = false;     ///< all work-items of a team (math/team.hpp) search it together
  float inner = 0;              ///< half the shape's least width, about (m)
  float outer = 0;              ///< largest coordinate of a vertex (m); 0: this and `inner` are unknown
  float radius = 0;             ///< everything within it of the polyhedron belongs to the shape, too (m)
  // Optional accelerators (may be null); they do not change results.
  const std::uint16_t* vertex_edges = nullptr;
  const Hull::Eight* vertex_eights = nullptr;
  const Hull::Eight* plane_eights = nullptr;
};

inline HullView view(const Hull& hull) {
  return {hull.vertices().data(),
          hull.edges().data(),
          hull.planes().data(),
          hull.face_edges().data(),
          static_cast<int>(hull.vertices().size()),
          static_cast<int>(hull.edges().size()),
          static_cast<std::int16_t>(hull.planes().size()),
          false,
          hull.inner_radius(),
          hull.largest_coordinate(),
          hull.radius(),
          hull.vertex_edges().data(),
          hull.vertex_eights().data(),
          hull.plane_eights().data()};
}

/// A shape without ownership.
struct Geometry {
  ShapeType type = ShapeType::box;
  float radius = 0;  ///< sphere, capsule, hull
  Vec3 half_extents{
      0, 0, 0};  ///< box; capsule: z is half its segment's length; hull, compound: the inner radius in all components
  HullView hull = {};           ///< hull
  const void* parts = nullptr;  ///< object behind `surface` or `compound`

  FATHOM_HD bool is_surface() const { return type == ShapeType::mesh || type == ShapeType::height_field; }
  FATHOM_HD bool is_compound() const { return type == ShapeType::compound; }
  /// For a mesh or a height field.
  FATHOM_HD const Surface& surface() const { return *static_cast<const Surface*>(parts); }
  /// For a compound.
  FATHOM_HD const Compound& compound() const { return *static_cast<const Compound*>(parts); }
  FATHOM_HD bool is_convex() const { return !is_surface() && !is_compound(); }
};

inline Geometry geometry(const Shape& shape) {
  if (shape.is_surface()) return {shape.type, 0, {}, {}, shape.surface.get()};
  if (shape.compound) {
    const float inner = shape.compound->inner_radius();
    return {shape.type, 0, {inner, inner, inner}, {}, shape.compound.get()};
  }
  if (!shape.hull) return {shape.type, shape.radius, shape.half_extents};
  const float inner = shape.hull->inner_radius();
  return {shape.type, shape.radius, {inner, inner, inner}, view(*shape.hull)};
}

}  // namespace fathom
