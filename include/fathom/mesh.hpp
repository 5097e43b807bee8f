// Triangle surfaces for fixed and kinematic bodies: meshes and height fields.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/box_tree.hpp>
#include <fathom/export.hpp>
#include <fathom/math.hpp>
#include <fathom/shape.hpp>
#include <memory>
#include <span>
#include <vector>

namespace fathom {

/// One triangle of a surface.
struct Triangle {
  Vec3 corners[3];                 ///< m, in the surface's frame; counter-clockwise seen from outside
  std::uint32_t vertices[3] = {};  ///< ids of the corners; triangles that share a vertex share its id
};

/// Materials of a surface's parts, in place of its body's: ice on a lake, a belt in a floor.
struct SurfaceMaterials {
  std::span<const Material> list = {};  ///< up to 256; empty: everything has the body's
  /// Which of `list` each triangle of a mesh has, in the order given, or each cell (i, j) of a height field, index
  /// j · (columns − 1) + i.
  std::span<const std::uint8_t> numbers = {};
};

/// Receives the triangles along a path.
class TriangleVisitor {
 public:
  /// Returns the fraction of the path up to which it wants more triangles.
  virtual float visit(std::uint32_t triangle) = 0;

 protected:
  ~TriangleVisitor() = default;
};

/// Common base of meshes and height fields. Immutable; shared by bodies. Triangles are one-sided: bodies collide only
/// with the side that their normals point to; the other side is solid.
class FATHOM_API Surface {
 public:
  virtual ~Surface() = default;

  /// Bounds of all triangles (m).
  FATHOM_HD const Aabb& bounds() const { return bounds_; }
  /// Triangles have the indices 0 … triangle_count() − 1.
  virtual std::uint32_t triangle_count() const = 0;
  /// False for holes of a height field.
  virtual bool has(std::uint32_t triangle) const = 0;
  /// A triangle's corners and their ids.
  virtual Triangle triangle(std::uint32_t triangle) const = 0;
  /// Appends the triangles whose bounds meet `box` (m, the surface's frame), in an order of the surface's choice.
  virtual void find(const Aabb& box, std::vector<std::uint32_t>& found) const = 0;
  /// Visits the triangles whose bounds a moving box meets, given by its start centre, half extents and translation (m,
  /// the surface's frame). Nearer triangles roughly come first; rounding may add some but omits none.
  virtual void find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const = 0;
  /// Memory in use.
  virtual std::size_t memory_bytes() const = 0;

  /// The materials that its triangles have in place of the body's; empty if they have none. A surface velocity is in
  /// the surface's axes.
  std::span<const Material> materials() const { return materials_; }
  /// Which of `materials` each triangle of a mesh or cell of a height field has.
  std::span<const std::uint8_t> material_numbers() const { return material_numbers_; }
  /// Which of `materials` a triangle has; 0 if there are none.
  std::uint32_t material_of(std::uint32_t triangle) const {
    return material_numbers_.empty() ? 0 : material_numbers_[triangle / triangles_per_number_];
  }

 protected:
  /// `triangles_per_number`: successive triangles that share one of `material_numbers`.
  explicit Surface(std::uint32_t triangles_per_number) : triangles_per_number_(triangles_per_number) {}

  Aabb bounds_{};  ///< see `bounds`

 private:
  friend struct SurfaceArchive;
  friend class MeshBuilder;
  friend class HeightFieldBuilder;
  std::uint32_t triangles_per_number_;
  std::vector<Material> materials_;
  std::vector<std::uint8_t> material_numbers_;
};

/// An arbitrary set of triangles. At most 40 bytes per triangle if vertices are shared, and one more with materials.
class FATHOM_API TriangleMesh final : public Surface {
 public:
  TriangleMesh() : Surface(1) {}
  using Node = BoxTreeNode;  ///< of the tree over its triangles

  /// m, in the mesh's frame; vertices at equal positions are merged.
  std::span<const Vec3> vertices() const { return vertices_; }
  /// Three vertices per triangle. Triangles are sorted in space, not in the order given.
  std::span<const std::uint32_t> indices() const { return indices_; }
  std::span<const Node> nodes() const { return nodes_; }  ///< of the tree, whose leaves are ranges of triangles

  std::uint32_t triangle_count() const override { return static_cast<std::uint32_t>(indices_.size() / 3); }
  bool has(std::uint32_t triangle) const override { return triangle < triangle_count(); }
  Triangle triangle(std::uint32_t triangle) const override;
  void find(const Aabb& box, std::vector<std::uint32_t>& found) const override;
  void find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const override;
  std::size_t memory_bytes() const override;

 private:
  friend class MeshBuilder;
  friend struct SurfaceArchive;
  std::vector<Vec3> vertices_;
  std::vector<std::uint32_t> indices_;
  std::vector<Node> nodes_;
};

/// The definition of a height field. Samples lie on a grid in the plane z = 0 of the surface's frame, the first at
/// its origin; sample (i, j) is at x = i · cell_x, y = j · cell_y and has the index j · columns + i.
struct HeightFieldDef {
  std::uint32_t columns = 0;       ///< samples along x, at least 2
  std::uint32_t rows = 0;          ///< samples along y, at least 2
  float cell_x = 1;                ///< m between samples along x, > 0
  float cell_y = 1;                ///< m between samples along y, > 0
  std::span<const float> heights;  ///< m, columns · rows values
  /// Whether cell (i, j), index j · (columns − 1) + i, is a hole. Empty: no holes.
  std::span<const bool> holes = {};
  SurfaceMaterials materials = {};  ///< of its cells
};

/// Heights over a grid, two triangles per cell, solid below. About 2 bytes per triangle, and half a byte more with
/// materials.
class FATHOM_API HeightField final : public Surface {
 public:
  HeightField() : Surface(2) {}
  std::uint32_t columns() const { return columns_; }           ///< samples along x
  std::uint32_t rows() const { return rows_; }                 ///< samples along y
  float cell_x() const { return cell_x_; }                     ///< m between samples along x
  float cell_y() const { return cell_y_; }                     ///< m between samples along y
  std::span<const float> heights() const { return heights_; }  ///< m, rows along x
  /// Whether a cell, index j · (columns − 1) + i, has no ground.
  bool is_hole(std::uint32_t cell) const { return !holes_.empty() && (holes_[cell / 64] >> cell % 64 & 1) != 0; }

  std::uint32_t triangle_count() const override { return 2 * (columns_ - 1) * (rows_ - 1); }
  bool has(std::uint32_t triangle) const override { return triangle < triangle_count() && !is_hole(triangle / 2); }
  Triangle triangle(std::uint32_t triangle) const override;
  void find(const Aabb& box, std::vector<std::uint32_t>& found) const override;
  void find_along(Vec3 centre, Vec3 half, Vec3 translation, TriangleVisitor& visitor) const override;
  std::size_t memory_bytes() const override;

 private:
  friend class HeightFieldBuilder;
  friend struct SurfaceArchive;
  Vec3 sample(std::uint32_t i, std::uint32_t j) const;
  void measure();
  std::uint32_t columns_ = 0, rows_ = 0;
  float cell_x_ = 1, cell_y_ = 1;
  std::vector<float> heights_;
  std::vector<std::uint64_t> holes_;
};

/// Triangle mesh for fixed and kinematic bodies: `indices` has three vertices per triangle, counter-clockwise seen from
/// outside. Vertices at equal positions are merged, so bodies do not catch on the edges between their triangles;
/// zero-area triangles are dropped. The mesh need be neither closed nor manifold. The body's frame is the vertices'
/// own: no centre of mass is computed. Throws `Error{invalid_argument}` for coordinates that are not finite or beyond
/// 10⁶ m, for indices out of range or not in threes, and for materials that are invalid, missing or not one number per
/// triangle; `Error{degenerate_shape}` if no triangle is left.
FATHOM_API Shape mesh(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices,
                      const SurfaceMaterials& materials = {});

/// Height field for fixed and kinematic bodies. Throws `Error{invalid_argument}` for fewer than 2 × 2 or more than 2³⁰
/// samples, spans of the wrong size, cell sizes that are not positive, heights that are not finite or beyond 10⁶ m, and
/// materials as for meshes.
FATHOM_API Shape height_field(const HeightFieldDef& def);

}  // namespace fathom
