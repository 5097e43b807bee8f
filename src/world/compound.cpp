#include <fathom/compound.hpp>
#include <fathom/error.hpp>
#include <string>

#include "geometry/compound_builder.hpp"
#include "math/text.hpp"
#include "math/vec3d.hpp"
#include "world/validate.hpp"

namespace fathom {
namespace {

void check_child(const ChildShape& child, const char* where) {
  if (!child.shape.is_convex())
    refuse(std::string(where) + ": the shape is no convex one; children are spheres, capsules, boxes and hulls");
  check_shape(child.shape, where);
  check_pose(child.pose, where);
  if (!is_finite(child.density) || child.density <= 0)
    refuse(std::string(where) + ": the density is " + text(to_double(child.density)) +
           "; it must be finite and greater than zero");
  if (child.material) check_material(*child.material, where);
}

}  // namespace

Shape compound(std::span<const ChildShape> children) {
  constexpr std::size_t most = 65536;
  if (children.empty()) refuse("compound: there are no children; give it at least one shape");
  if (children.size() > most)
    refuse("compound: there are " + std::to_string(children.size()) +
           " children; at most 65536 fit, divide them among several bodies");
  for (std::size_t i = 0; i < children.size(); ++i)
    check_child(children[i], ("compound: child " + std::to_string(i)).c_str());
  Shape shape;
  shape.type = ShapeType::compound;
  shape.compound = CompoundBuilder::build(children);
  return shape;
}

}  // namespace fathom
