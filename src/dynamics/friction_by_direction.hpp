// Friction that depends on direction (`Material::friction_axis`). Pure, for host and device.
//
// The sliding impulses that a contact can give fill an ellipse in its plane. Its larger semi-axis is Coulomb's limit;
// the vector `grain` points along it, with a length of 1 − the quotient of the semi-axes: zero stands for a circle.
#pragma once

#include <fathom/body.hpp>
#include <fathom/math.hpp>

#include "dynamics/softness.hpp"

namespace fathom {

/// The friction of one of two surfaces.
struct SideFriction {
  float across = 0, along = 0;  ///< coefficients across `axis` and along it
  Vec3 axis;                    ///< unit, world axes; zero: `across` in all directions
  CombineRule rule = CombineRule::geometric_mean;

  /// Coefficient along a unit vector of the contact's plane.
  FATHOM_HD float towards(Vec3 direction) const {
    const float cosine = dot(axis, direction);
    return fma(along - across, cosine * cosine, across);
  }
  /// Largest coefficient in any direction.
  FATHOM_HD float largest() const { return axis == Vec3{} ? across : max(across, along); }
};

/// The material's axis, rotated to world axes by `rotation`.
FATHOM_HD SideFriction side_friction(float across, float along, CombineRule rule, Vec3 axis, Quat rotation) {
  return {across, along, axis == Vec3{} ? axis : rotate(rotation, axis), rule};
}

/// The smallest coefficient of a contact with this grain, as a part of the largest.
FATHOM_HD float smallest_friction(float grain_1, float grain_2) {
  return 1 - fathom::sqrt(fma(grain_1, grain_1, grain_2 * grain_2));
}

struct FrictionEllipse {
  float coefficient = 0;  ///< along the larger semi-axis
  Vec3 grain;             ///< world axes, in the contact's plane
};

/// The ellipse of two surfaces that touch with this unit normal. Their coefficients combine along the axis of the one
/// whose friction depends more on direction in the contact's plane, and across it.
FATHOM_HD FrictionEllipse friction_ellipse(const SideFriction& a, const SideFriction& b, Vec3 normal) {
  const Vec3 in_a = mul_add(a.axis, -dot(a.axis, normal), normal), in_b = mul_add(b.axis, -dot(b.axis, normal), normal);
  const float of_a = abs(a.along - a.across) * length_squared(in_a),
              of_b = abs(b.along - b.across) * length_squared(in_b);
  const Vec3 projected = of_a >= of_b ? in_a : in_b;
  // An axis along the normal leaves no direction; within rounding of that, any will do.
  const Vec3 axis = length_squared(projected) > 1e-8f ? normalize(projected) : any_perpendicular(normal);
  const Vec3 aside = cross(normal, axis);
  const float along = combine(a.towards(axis), b.towards(axis), a.rule, b.rule),
              across = combine(a.towards(aside), b.towards(aside), a.rule, b.rule);
  const float most = max(along, across);
  if (!(most > 0)) return {0, {}};
  return {most, (1 - min(along, across) / most) * (along >= across ? axis : aside)};
}

}  // namespace fathom
