// The functions that laws over a lane type L require, for one lane: a float. Vectors of lanes have the same functions
// in native/lane_functions-inl.hpp. A mask is a bool here.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

template <class L>
using VecOf = Vec3;
/// Symmetric 3×3 matrices.
template <class L>
using SymOf = SymMat3;
/// The lane type of a vector, for laws over vectors.
template <class Vec>
struct LanesOf;
template <>
struct LanesOf<Vec3> {
  using Lane = float;
  using Quaternion = Quat;
};
template <class Vec>
using LaneOf = typename LanesOf<Vec>::Lane;
template <class Vec>
using QuatOf = typename LanesOf<Vec>::Quaternion;
template <class L>
FATHOM_HD L splat(float value) {
  return value;
}
FATHOM_HD Vec3 scale(float s, Vec3 a) { return s * a; }
/// a + s·b and a − s·b with a single rounding.
FATHOM_HD float mul_add(float a, float s, float b) { return fma(s, b, a); }
FATHOM_HD float mul_sub(float a, float s, float b) { return fma(-s, b, a); }
FATHOM_HD Vec3 mul_sub(Vec3 a, float s, Vec3 b) { return mul_add(a, -s, b); }
FATHOM_HD float root(float a) { return fathom::sqrt(a); }
FATHOM_HD float larger(float a, float b) { return max(a, b); }
FATHOM_HD float smaller(float a, float b) { return min(a, b); }
FATHOM_HD Vec3 larger(Vec3 a, Vec3 b) { return max(a, b); }
FATHOM_HD Vec3 smaller(Vec3 a, Vec3 b) { return min(a, b); }
FATHOM_HD float magnitude(float a) { return abs(a); }
/// Integer part of `a` >= 0.
FATHOM_HD float whole(float a) { return a < 0x1p23f ? static_cast<float>(static_cast<int>(a)) : a; }
FATHOM_HD float inverse_or_zero(float a) { return a > 0 ? 1.0f / a : 0.0f; }
FATHOM_HD float one_where_zero(float a) { return a == 0 ? 1.0f : 0.0f; }

FATHOM_HD bool is_above(float a, float b) { return a > b; }
FATHOM_HD bool is_at_most(float a, float b) { return a <= b; }
FATHOM_HD bool both(bool a, bool b) { return a && b; }
/// Whether any lane has a > b.
FATHOM_HD bool any_above(float a, float b) { return a > b; }
FATHOM_HD float select(bool mask, float a, float b) { return mask ? a : b; }
FATHOM_HD Vec3 select(bool mask, Vec3 a, Vec3 b) { return mask ? a : b; }

// Additional functions for code that is written for one lane and for eight (dynamics/joint_link-inl.hpp);
// dynamics/lane_eight.hpp has those for eight.

using Real = float;
using Mask = bool;
/// A stored mask, and the number of an axis: words as long as a Real, because lanes are separated word by word.
using Flag = std::int32_t;
using AxisNumber = std::int32_t;
inline constexpr Flag all_set = -1;

FATHOM_HD Mask is_set(Flag f) { return f != 0; }
FATHOM_HD Flag flag(Mask m) { return m ? -1 : 0; }
FATHOM_HD bool anywhere(Mask m) { return m; }
FATHOM_HD bool everywhere(Mask m) { return m; }
FATHOM_HD Mask inverted(Mask m) { return !m; }
FATHOM_HD Mask either(Mask a, Mask b) { return a || b; }
FATHOM_HD Flag select(bool mask, Flag a, Flag b) { return mask ? a : b; }
/// Of a value that is the same in all lanes.
FATHOM_HD float first_lane(float a) { return a; }
FATHOM_HD Vec3 unit_vector(float x, float y, float z) { return {x, y, z}; }

/// 1 or 0, for stored conditions.
FATHOM_HD float is_less(float a, float b) { return a < b ? 1.0f : 0.0f; }
FATHOM_HD float choose(float condition, float a, float b) { return condition != 0 ? a : b; }

}  // namespace fathom
