// Collision shapes and their mass properties.
#pragma once

#include <cstdint>
#include <fathom/export.hpp>
#include <fathom/math.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace fathom {

class Compound;
class Hull;
class Surface;

/// Kinds of shape.
enum class ShapeType : std::uint8_t { sphere, capsule, box, hull, mesh, height_field, compound };

/// A convex shape or a compound of such shapes, centred at its centre of mass, or a triangle surface for bodies that
/// are not dynamic. Cheap to copy; hulls, surfaces and compounds are shared and immutable. Created by `sphere`,
/// `capsule`, `box`, `hull`, `cylinder`, `cone` and `rounded`, by `compound` (compound.hpp), and by `mesh` and
/// `height_field` (mesh.hpp), which check their arguments.
struct Shape {
  ShapeType type = ShapeType::box;             ///< which of the other fields count
  float radius = 0;                            ///< sphere, capsule; of a hull, `Hull::radius()` (m)
  Vec3 half_extents{0, 0, 0};                  ///< box (m); capsule: (0, 0, half the length of its segment)
  std::shared_ptr<const Hull> hull{};          ///< hull
  std::shared_ptr<const Surface> surface{};    ///< mesh, height field
  std::shared_ptr<const Compound> compound{};  ///< compound

  /// Whether it is a mesh or a height field.
  bool is_surface() const { return type == ShapeType::mesh || type == ShapeType::height_field; }
  /// Whether it is a sphere, a capsule, a box or a hull.
  bool is_convex() const { return !is_surface() && type != ShapeType::compound; }
};

// Each of these throws `Error{invalid_argument}` for a value that is out of range or not finite and
// `Error{degenerate_shape}` for a volume that single precision cannot hold.

/// Sphere of radius `radius` > 0 (m).
FATHOM_API Shape sphere(float radius);
/// Capsule along z: points within `radius` > 0 of the segment from −half_length to +half_length (m, 0 to 1e6 radii).
FATHOM_API Shape capsule(float radius, float half_length);
/// Box with the given half extents, each > 0 and at least a millionth of the largest (m).
FATHOM_API Shape box(Vec3 half_extents);
/// Convex hull of a point cloud (m). The hull is shifted so that its centre of mass is the origin; `Hull::offset` is
/// the shift. Coplanar triangles are merged into one polygon; differences of less than a few roundings of the largest
/// coordinate (about 10⁻⁶ of it) are ignored. Also throws `Error{degenerate_shape}` if the points span no volume (fewer
/// than 4, coincident, collinear or coplanar) or the hull would exceed 255 vertices, 255 faces or 1,024 half-edges,
/// naming the remedy.
FATHOM_API Shape hull(std::span<const Vec3> points);
/// Cylinder along z, `half_height` up and down from its centre (m, each > 0): a hull, a prism whose cross-section is a
/// regular polygon with `sides` (3 to 127) sides and the circle's area. Its mass is the cylinder's, and with 32 sides
/// its surface is within 0.4 % of the radius. It rests on its faces and does not start to roll on slopes of less than
/// π/`sides` (6° with 32); a `capsule` rolls on every slope.
FATHOM_API Shape cylinder(float radius, float half_height, int sides = 32);
/// Cone along z, `height` from its base to its tip (m, each > 0), or a frustum if `top_radius` (m, not negative) is
/// given: a hull with cross-sections like those of `cylinder`. The origin is its centre of mass, for a cone a quarter
/// of its height above the base; `Hull::offset` is its position relative to half height.
FATHOM_API Shape cone(float radius, float height, float top_radius = 0, int sides = 32);
/// The shape and everything within `radius` (m, finite, not negative) of it: a box, a hull, a cylinder or a cone with
/// rounded edges, all of whose extents grow by `radius`, or a larger sphere or capsule. Its volume and its inertia are
/// exact. Its centre of mass is the origin; `Hull::offset` still is relative to the original points. Also throws
/// `Error{invalid_argument}` for surfaces and compounds; round a compound's children instead.
FATHOM_API Shape rounded(const Shape& shape, float radius);

/// Mass (kg) and rotational inertia about the centre of mass (kg·m²).
struct MassProperties {
  float mass = 0;           ///< kg
  SymMat3 inertia;          ///< in the body's axes
  Vec3 principal_moments;   ///< ascending eigenvalues of `inertia`
  Quat principal_rotation;  ///< rotates principal axes to the body's axes
};

/// Volume of the shape (m³); 0 for a surface.
FATHOM_API float volume(const Shape& shape);
/// Exact mass properties of a solid of uniform density with the total mass `mass` > 0 (kg). Throws
/// `Error{invalid_argument}` for any other mass, and for a surface, which has none.
FATHOM_API MassProperties mass_properties(const Shape& shape, float mass);

/// A convex polyhedron as half-edges, readable for drawing, and everything within a radius of it. Built by `hull` and
/// `rounded`.
class FATHOM_API Hull {
 public:
  /// The plane of a face.
  struct Plane {
    Vec3 normal;       ///< outward unit normal
    float offset = 0;  ///< dot(normal, point) of the face's points
  };
  /// The half-edges of a face run counter-clockwise seen from outside. Twins are adjacent: edge e has the twin e ^ 1,
  /// and the undirected edges are the pairs (2k, 2k + 1).
  struct HalfEdge {
    std::uint16_t next = 0;   ///< the next half-edge of the face
    std::uint8_t origin = 0;  ///< the vertex it starts at
    std::uint8_t face = 0;    ///< the face it belongs to
  };

  /// Eight vertices, or planes with their offsets in w, side by side for vector instructions.
  struct alignas(32) Eight {
    ///@{
    /// Components of the eight.
    float x[8], y[8], z[8], w[8];
    ///@}
  };

  std::span<const Vec3> vertices() const { return vertices_; }  ///< m, from the centre of mass
  std::span<const HalfEdge> edges() const { return edges_; }    ///< two for each edge
  std::span<const Plane> planes() const { return planes_; }     ///< one for each face
  /// For each face one of its half-edges.
  std::span<const std::uint16_t> face_edges() const { return face_edges_; }
  /// For each vertex the first half-edge that starts at it.
  std::span<const std::uint16_t> vertex_edges() const { return vertex_edges_; }
  /// The vertices again, in eights; the last eight are padded with the first vertex.
  std::span<const Eight> vertex_eights() const { return vertex_eights_; }
  /// The planes again, in eights.
  std::span<const Eight> plane_eights() const { return plane_eights_; }
  /// Everything within this distance of the polyhedron belongs to the shape, too (m); 0 for one that is not rounded.
  float radius() const { return radius_; }
  /// Centre of mass in the coordinates of the original points.
  Vec3 offset() const { return offset_; }
  /// Volume (m³).
  float volume() const { return volume_; }
  /// Inertia about the centre of mass for unit mass (m²).
  const SymMat3& unit_inertia() const { return unit_inertia_; }
  /// Distance of the farthest point from the centre of mass (m).
  float outer_radius() const { return outer_radius_; }
  /// Distance of the nearest face from the centre of mass (m).
  float inner_radius() const { return inner_radius_; }
  /// Largest coordinate of a vertex (m).
  float largest_coordinate() const { return largest_coordinate_; }

 private:
  friend class HullBuilder;
  friend struct HullArchive;
  void arrange();  ///< computes what follows from vertices, edges and planes alone
  std::vector<Vec3> vertices_;
  std::vector<HalfEdge> edges_;
  std::vector<Plane> planes_;
  std::vector<std::uint16_t> face_edges_;
  std::vector<std::uint16_t> vertex_edges_;
  std::vector<Eight> vertex_eights_, plane_eights_;
  Vec3 offset_;
  float radius_ = 0;
  float volume_ = 0;
  SymMat3 unit_inertia_;
  float outer_radius_ = 0;
  float inner_radius_ = 0;
  float largest_coordinate_ = 0;
};

}  // namespace fathom
