#include "geometry/compound_builder.hpp"

#include <algorithm>
#include <fathom/error.hpp>
#include <limits>
#include <string>

#include "geometry/box_tree.hpp"
#include "geometry/support.hpp"
#include "math/text.hpp"
#include "math/vec3d.hpp"

namespace fathom {
namespace {

/// Accumulates a symmetric matrix.
struct Tensor {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  void add(double s, const SymMat3& m) {
    xx += s * to_double(m.xx), yy += s * to_double(m.yy), zz += s * to_double(m.zz);
    xy += s * to_double(m.xy), xz += s * to_double(m.xz), yz += s * to_double(m.yz);
  }
  /// Adds a mass at a position, by Steiner's theorem.
  void add(double mass, Vec3d at) {
    xx += mass * (at.y * at.y + at.z * at.z), yy += mass * (at.x * at.x + at.z * at.z);
    zz += mass * (at.x * at.x + at.y * at.y);
    xy -= mass * at.x * at.y, xz -= mass * at.x * at.z, yz -= mass * at.y * at.z;
  }
  SymMat3 divided(double by) const {
    const auto f = [by](double v) { return static_cast<float>(v / by); };
    return {f(xx), f(yy), f(zz), f(xy), f(xz), f(yz)};
  }
};

double mass_of(const ChildShape& child) { return to_double(child.density) * to_double(volume(child.shape)); }

/// Distance (m) of the child's farthest point from the compound's centre.
float reach_of(const ChildShape& child) {
  const Geometry shape = geometry(child.shape);
  const Vec3 h = shape.half_extents;
  switch (shape.type) {
    case ShapeType::sphere:
      return length(child.pose.position) + shape.radius;
    case ShapeType::capsule:
      return max(length(transform(child.pose, h)), length(transform(child.pose, -h))) + shape.radius;
    case ShapeType::box: {
      // The farthest corner faces away from the compound's centre.
      const Vec3 to = inverse_rotate(child.pose.rotation, child.pose.position);
      return length(to + Vec3{to.x < 0 ? -h.x : h.x, to.y < 0 ? -h.y : h.y, to.z < 0 ? -h.z : h.z});
    }
    default:
      break;
  }
  float farthest = 0;
  for (const Vec3 v : child.shape.hull->vertices()) farthest = max(farthest, length(transform(child.pose, v)));
  return farthest + shape.radius;
}

void check_size(const Compound& compound) {
  const auto refuse = [](const std::string& what) { throw Error(ErrorCode::degenerate_shape, "compound: " + what); };
  if (!(compound.volume() >= std::numeric_limits<float>::min()) || !is_finite(compound.volume()))
    refuse("the volume of all children is too small or too large for single precision; lengths are in metres");
  if (!(compound.outer_radius() <= 1e12f))
    refuse("it reaches " + text(to_double(compound.outer_radius())) +
           " m from its centre; 1e12 m is the most for single precision");
  if (!(compound.inner_radius() >= 1e-6f * compound.outer_radius()))
    refuse("its thinnest child is " + text(2 * to_double(compound.inner_radius())) +
           " m thick; it must be at least a " + "millionth of the compound's size");
}

}  // namespace

std::shared_ptr<const Compound> CompoundBuilder::build(std::span<const ChildShape> children) {
  auto compound = std::make_shared<Compound>();
  compound->children_.assign(children.begin(), children.end());
  double mass = 0, all = 0;
  Vec3d moment;
  for (ChildShape& child : compound->children_) {
    child.pose.rotation = normalize(child.pose.rotation);
    child.pose.reserved = 0;
    mass += mass_of(child);
    all += to_double(volume(child.shape));
    moment += mass_of(child) * to_double(child.pose.position);
  }
  const Vec3d middle = (1 / mass) * moment;
  compound->offset_ = to_float(middle);
  compound->volume_ = static_cast<float>(all);
  Tensor inertia;
  for (ChildShape& child : compound->children_) {
    const Vec3d at = to_double(child.pose.position) - middle;
    child.pose.position = to_float(at);
    inertia.add(mass_of(child), rotated(to_matrix(child.pose.rotation), mass_properties(child.shape, 1).inertia));
    inertia.add(mass_of(child), at);
  }
  compound->unit_inertia_ = inertia.divided(mass);
  arrange(*compound);
  check_size(*compound);
  return compound;
}

void CompoundBuilder::arrange(Compound& compound) {
  compound.boxes_.clear();
  compound.outer_radius_ = 0;
  compound.inner_radius_ = std::numeric_limits<float>::max();
  for (const ChildShape& child : compound.children_) {
    const Geometry shape = geometry(child.shape);
    compound.outer_radius_ = max(compound.outer_radius_, reach_of(child));
    const bool is_round = shape.type == ShapeType::sphere || shape.type == ShapeType::capsule;
    compound.inner_radius_ = min(compound.inner_radius_, is_round ? shape.radius : min_component(shape.half_extents));
    compound.boxes_.push_back(bounds(shape, child.pose));
  }
  // Margin for the rounding of corners.
  const float rounding = 1e-6f * compound.outer_radius_;
  for (Aabb& box : compound.boxes_) box = grown(box, rounding);
  BoxTreeBuilder(
      compound.boxes_.size(), 2, [&](std::uint32_t child) { return compound.boxes_[child]; }, compound.nodes_,
      compound.leaves_);
  compound.bounds_ = {compound.nodes_[0].lower, compound.nodes_[0].upper};
}

}  // namespace fathom
