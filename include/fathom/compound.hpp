// Several convex shapes as one: a vehicle, a chair, an asteroid decomposed into hulls.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/box_tree.hpp>
#include <fathom/export.hpp>
#include <fathom/math.hpp>
#include <fathom/shape.hpp>
#include <optional>
#include <span>
#include <vector>

namespace fathom {

/// One convex shape of a compound. Children may overlap; mass in an overlap counts twice.
struct ChildShape {
  Shape shape;  ///< sphere, capsule, box or hull
  /// Pose of the shape's centre of mass in the compound's coordinates (m); the rotation is normalised. A hull whose
  /// points are in these coordinates belongs at `Hull::offset`.
  Pose pose{};
  float density = 1;                   ///< relative to the other children, > 0: sets its share of the body's mass
  std::optional<Material> material{};  ///< overrides the body's
  /// Overrides the body's for this child. The filters of the two bodies must let them collide too.
  std::optional<Filter> filter{};
  std::uint64_t user_data = 0;  ///< belongs to the application
};

/// Children with their mass properties and a tree of their boxes. Immutable; shared by bodies.
class Compound {
 public:
  /// In the order given. Poses are in the compound's frame, whose origin is its centre of mass.
  std::span<const ChildShape> children() const { return children_; }
  /// Centre of mass in the coordinates of the children as given.
  Vec3 offset() const { return offset_; }
  /// Sum of the children's volumes (m³).
  float volume() const { return volume_; }
  /// Inertia about the centre of mass for unit mass (m²).
  const SymMat3& unit_inertia() const { return unit_inertia_; }
  /// Bounds of all children (m).
  FATHOM_HD const Aabb& bounds() const { return bounds_; }
  /// Distance of the farthest point from the centre of mass (m).
  FATHOM_HD float outer_radius() const { return outer_radius_; }
  /// Half the thickness of the thinnest child (m).
  float inner_radius() const { return inner_radius_; }
  /// Bounds of a child (m).
  const Aabb& bounds(std::uint32_t child) const { return boxes_[child]; }
  /// The tree of the children's boxes; its leaves are ranges of `leaves`.
  std::span<const BoxTreeNode> nodes() const { return nodes_; }
  std::span<const std::uint32_t> leaves() const { return leaves_; }  ///< children by leaf

 private:
  friend class CompoundBuilder;
  friend struct CompoundArchive;
  std::vector<ChildShape> children_;
  std::vector<Aabb> boxes_;  // by child
  std::vector<BoxTreeNode> nodes_;
  std::vector<std::uint32_t> leaves_;
  Aabb bounds_{};
  Vec3 offset_;
  SymMat3 unit_inertia_;
  float volume_ = 0, outer_radius_ = 0, inner_radius_ = 0;
};

/// A shape of up to 65,536 convex children, shifted so that its centre of mass is the origin; `Compound::offset` is the
/// shift. Throws `Error{invalid_argument}` if there are no children or too many, and for a child (named by its number)
/// that is not convex, or whose pose or density is out of range or not finite.
FATHOM_API Shape compound(std::span<const ChildShape> children);

}  // namespace fathom
