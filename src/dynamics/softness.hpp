// Coefficients of soft constraints and of material mixing.
#pragma once

#include <fathom/body.hpp>
#include <fathom/math.hpp>

namespace fathom {

struct Softness {
  float bias_rate = 0;      ///< 1/s of the separation that becomes velocity
  float mass_scale = 1;     ///< of the effective mass
  float impulse_scale = 0;  ///< part of the accumulated impulse given back in each sweep
};

/// A damped spring of `hertz` and `damping_ratio`, integrated implicitly over `h` seconds (Catto, "Soft
/// Constraints", GDC 2011; in this form Box2D v3's solver).
FATHOM_HD Softness make_soft(float hertz, float damping_ratio, float h) {
  const float omega = 2 * pi * hertz;
  const float a1 = 2 * damping_ratio + h * omega;
  const float a2 = h * omega * a1;
  const float a3 = 1 / (1 + a2);
  return {omega / a1, a2 * a3, a3};
}

/// The contact's coefficient from its two materials'; of two different rules the later one in CombineRule wins.
FATHOM_HD float combine(float a, float b, CombineRule rule_a, CombineRule rule_b) {
  switch (rule_a > rule_b ? rule_a : rule_b) {
    case CombineRule::average:
      return 0.5f * (a + b);
    case CombineRule::minimum:
      return min(a, b);
    case CombineRule::geometric_mean:
      return fathom::sqrt(a * b);
    case CombineRule::multiply:
      return a * b;
    case CombineRule::maximum:
      break;
  }
  return max(a, b);
}

}  // namespace fathom
