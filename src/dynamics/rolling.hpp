// Friction that keeps round bodies from rolling and spinning forever. Pure, for host and device.
//
// A sphere or a capsule touches in a point, a real one in a small patch. The patch adds two couples:
//
// * Spin about the normal is braked by Coulomb's friction over the patch. For Hertz's pressure its couple is
//   3π/16 µ N a, a the patch's radius; a² = R d for a sphere of radius R that is pressed in by d (Johnson, "Contact
// * Rolling is braked because a material gives back less than is put into it: the normal force acts a little ahead of
//   the centre, by `Material::rolling_resistance` times R (Johnson, 9.4). It is off unless a material asks for it, and
//   its data is stored separately.
#pragma once

#include "dynamics/contact_manifold.hpp"
#include "dynamics/contact_rows.hpp"

namespace fathom {

FATHOM_HD bool is_round(ShapeType shape) { return shape == ShapeType::sphere || shape == ShapeType::capsule; }

/// Sets a round contact's shapes and couples: `radius` (m) is 0 for shapes that are not round. Once there is no
/// resistance any more, the impulse that it had is not carried on.
FATHOM_HD void set_round(ContactManifold& m, float radius_a, float radius_b, float resistance_a, float resistance_b) {
  const float largest = max(radius_a, radius_b), least = min(radius_a, radius_b);
  const float curvature = least > 0 ? least * largest / (least + largest) : largest;
  const float share_a = least > 0 ? radius_a / (radius_a + radius_b) : radius_a > 0 ? 0.0f : 1.0f;
  m.set_round(curvature, share_a, max(resistance_a, resistance_b) * largest);
  if (!(m.rolling_length() > 0)) m.set_rolling_impulse({});
}

/// The row of a contact's rolling resistance.
struct alignas(16) RollRow {
  Vec3 impulse;      ///< angular, accumulated over the substep (N·m·s, world axes): plus on B, minus on A
  float length = 0;  ///< m, by which the normal force acts ahead of the centre
};

FATHOM_HD RollRow roll_row(const ContactManifold& m, const ContactAxes& f) {
  const Vec3 i = m.rolling_impulse();
  return {mul_add(mul_add(i.x * f.t1, i.y, f.t2), i.z, f.n), m.rolling_length()};
}
FATHOM_HD Vec3 kept_impulse(const RollRow& row, const ContactAxes& f) {
  return {dot(f.t1, row.impulse), dot(f.t2, row.impulse), dot(f.n, row.impulse)};
}

}  // namespace fathom
