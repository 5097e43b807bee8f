#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/error.hpp>
#include <fathom/shape.hpp>
#include <limits>
#include <string>
#include <vector>

#include "geometry/hull_builder.hpp"
#include "math/eigen.hpp"
#include "math/text.hpp"
#include "math/vec3d.hpp"

namespace fathom {
namespace {

constexpr double pi_d = 3.14159265358979323846;

void require(bool condition, const std::string& where, float value, const char* remedy) {
  if (condition) return;
  throw Error(ErrorCode::invalid_argument, where + " is " + text(to_double(value)) + " m; " + remedy);
}

void require_positive(const std::string& where, float value) {
  require(is_finite(value) && value > 0, where, value, "it must be finite and greater than zero");
}

/// Single precision cannot resolve thinner shapes.
void require_thick(const std::string& where, float thickness, float largest) {
  require(thickness >= 1e-6f * largest, where, thickness, "it must be at least a millionth of the largest length");
}

double exact_volume(const Shape& shape) {
  const double r = to_double(shape.radius), ball = 4.0 / 3.0 * pi_d * r * r * r;
  const Vec3d h = to_double(shape.half_extents);
  switch (shape.type) {
    case ShapeType::sphere:
      return ball;
    case ShapeType::capsule:
      return ball + 2 * pi_d * r * r * h.z;
    case ShapeType::box:
      return 8 * h.x * h.y * h.z;
    case ShapeType::hull:
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      break;
  }
  if (shape.compound) return to_double(shape.compound->volume());
  return shape.hull ? to_double(shape.hull->volume()) : 0;
}

/// Farthest point from the centre (m).
float reach(const Shape& shape) {
  if (shape.hull) return shape.hull->outer_radius();
  return shape.radius + max_component(shape.half_extents);
}

/// Refuses what float cannot represent: a mass computed from the volume would be zero or infinite, or squares and cubes
/// of lengths in the separating-axis tests would overflow.
Shape checked(const Shape& shape, const char* where) {
  const double v = exact_volume(shape);
  if (v < to_double(std::numeric_limits<float>::min()) || v > to_double(std::numeric_limits<float>::max())) {
    throw Error(ErrorCode::degenerate_shape, std::string(where) + ": the volume is too " + (v < 1 ? "small" : "large") +
                                                 " for single precision; lengths are in metres");
  }
  constexpr float largest = 1e12f;
  if (!(reach(shape) <= largest))
    throw Error(ErrorCode::degenerate_shape, std::string(where) + ": it reaches " + text(to_double(reach(shape))) +
                                                 " m from its centre; 1e12 m is the most for single precision");
  return shape;
}

/// Diagonal of the inertia for unit mass.
Vec3d unit_moments(const Shape& shape) {
  const double r = to_double(shape.radius);
  const Vec3d h = to_double(shape.half_extents);
  switch (shape.type) {
    case ShapeType::sphere:
      return 0.4 * r * r * Vec3d{1, 1, 1};
    case ShapeType::capsule: {
      // Mass shares of the cylinder and the two half balls; the latter turn about their own centres of mass, 3r/8 from
      // the flat side, moved to the capsule's centre by Steiner's theorem.
      const double cylinder = 2 * h.z / (2 * h.z + 4.0 / 3.0 * r), balls = 1 - cylinder;
      const double across = cylinder * (r * r / 4 + h.z * h.z / 3) + balls * (0.4 * r * r + h.z * h.z + 0.75 * h.z * r);
      return {across, across, cylinder * r * r / 2 + balls * 0.4 * r * r};
    }
    case ShapeType::box:
      return (1.0 / 3.0) * Vec3d{h.y * h.y + h.z * h.z, h.x * h.x + h.z * h.z, h.x * h.x + h.y * h.y};
    case ShapeType::hull:
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      break;
  }
  return {};
}

/// Corners of a frustum of `sides` sides about z, whose cross-sections have the areas of circles of these radii.
std::vector<Vec3> frustum(float radius, float top_radius, float half_height, int sides, const std::string& maker) {
  if (sides < 3 || sides > 127)
    throw Error(ErrorCode::invalid_argument,
                maker + ": " + std::to_string(sides) + " sides; 3 to 127 are possible, 32 are the default");
  const double turn = 2 * pi_d / sides, corner = std::sqrt(turn / std::sin(turn));
  std::vector<Vec3> points;
  for (int k = 0; k < sides; ++k) {
    const double x = corner * std::cos(turn * k), y = corner * std::sin(turn * k);
    const double r = to_double(radius), top = to_double(top_radius);
    points.push_back(to_float(Vec3d{r * x, r * y, -to_double(half_height)}));
    if (top > 0) points.push_back(to_float(Vec3d{top * x, top * y, to_double(half_height)}));
  }
  if (top_radius <= 0) points.push_back({0, 0, half_height});
  return points;
}

SymMat3 scaled(float s, const SymMat3& m) { return {s * m.xx, s * m.yy, s * m.zz, s * m.xy, s * m.xz, s * m.yz}; }

}  // namespace

Shape sphere(float radius) {
  require_positive("fathom::sphere: radius", radius);
  return checked({ShapeType::sphere, radius}, "fathom::sphere");
}

Shape capsule(float radius, float half_length) {
  require_positive("fathom::capsule: radius", radius);
  require(is_finite(half_length) && half_length >= 0, "fathom::capsule: half_length", half_length,
          "it must be finite and not negative");
  const Shape shape = checked({ShapeType::capsule, radius, {0, 0, half_length}}, "fathom::capsule");
  require_thick("fathom::capsule: the radius", radius, half_length);
  return shape;
}

Shape box(Vec3 half_extents) {
  require_positive("fathom::box: half_extents.x", half_extents.x);
  require_positive("fathom::box: half_extents.y", half_extents.y);
  require_positive("fathom::box: half_extents.z", half_extents.z);
  const Shape shape = checked({ShapeType::box, 0, half_extents}, "fathom::box");
  require_thick("fathom::box: the smallest half extent", min_component(half_extents), max_component(half_extents));
  return shape;
}

Shape hull(std::span<const Vec3> points) {
  return checked({ShapeType::hull, 0, {}, std::make_shared<const Hull>(HullBuilder::build(points))}, "fathom::hull");
}

Shape rounded(const Shape& shape, float radius) {
  const std::string maker = "fathom::rounded";
  require(is_finite(radius) && radius >= 0, maker + ": radius", radius, "it must be finite and not negative");
  if (!shape.is_convex())
    throw Error(ErrorCode::invalid_argument, maker + ": the shape is a " +
                                                 (shape.is_surface() ? "surface" : "compound") +
                                                 "; spheres, capsules, boxes and hulls can be rounded" +
                                                 (shape.is_surface() ? "" : ", and so can a compound's children"));
  if (shape.type == ShapeType::sphere) return sphere(shape.radius + radius);
  if (shape.type == ShapeType::capsule) return capsule(shape.radius + radius, shape.half_extents.z);
  if (radius == 0) return shape;
  std::vector<Vec3> points;
  const Vec3 h = shape.half_extents;
  for (unsigned i = 0; i < 8 && !shape.hull; ++i)
    points.push_back({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z});
  if (shape.hull) {
    for (const Vec3 v : shape.hull->vertices()) points.push_back(v + shape.hull->offset());
    radius += shape.hull->radius();
  }
  return checked({ShapeType::hull, radius, {}, std::make_shared<const Hull>(HullBuilder::build(points, radius))},
                 maker.c_str());
}

Shape cylinder(float radius, float half_height, int sides) {
  require_positive("fathom::cylinder: radius", radius);
  require_positive("fathom::cylinder: half_height", half_height);
  return hull(frustum(radius, radius, half_height, sides, "fathom::cylinder"));
}

Shape cone(float radius, float height, float top_radius, int sides) {
  require_positive("fathom::cone: radius", radius);
  require_positive("fathom::cone: height", height);
  require(is_finite(top_radius) && top_radius >= 0, "fathom::cone: top_radius", top_radius,
          "it must be finite and not negative");
  return hull(frustum(radius, top_radius, 0.5f * height, sides, "fathom::cone"));
}

float volume(const Shape& shape) { return static_cast<float>(exact_volume(shape)); }

MassProperties mass_properties(const Shape& shape, float mass) {
  if (!is_finite(mass) || mass <= 0) {
    throw Error(ErrorCode::invalid_argument, "fathom::mass_properties: mass is " + text(to_double(mass)) +
                                                 " kg; it must be finite and greater than zero");
  }
  if (shape.is_surface())
    throw Error(ErrorCode::invalid_argument,
                "fathom::mass_properties: a surface has no mass; fixed and kinematic bodies need none");
  MassProperties result;
  result.mass = mass;
  if (shape.hull) {
    result.inertia = scaled(mass, shape.hull->unit_inertia());
  } else if (shape.compound) {
    result.inertia = scaled(mass, shape.compound->unit_inertia());
  } else {
    const Vec3 moments = to_float(to_double(mass) * unit_moments(shape));
    result.inertia = {moments.x, moments.y, moments.z, 0, 0, 0};
  }
  PrincipalFrame frame = principal_frame(result.inertia);
  // A needle's smallest moment drowns in the rounding of its largest and may even become negative.
  const float least = 1e-6f * frame.moments.z, missing = least - frame.moments.x;
  if ((shape.hull || shape.compound) && missing > 0) {
    result.inertia.xx += missing, result.inertia.yy += missing, result.inertia.zz += missing;
    frame.moments += Vec3{missing, missing, missing};
  }
  result.principal_moments = frame.moments;
  result.principal_rotation = frame.rotation;
  return result;
}

}  // namespace fathom
