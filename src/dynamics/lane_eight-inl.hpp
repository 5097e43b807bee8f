// The eight-lane types and functions for code that is written for one lane and for eight (dynamics/joint_link-inl.hpp):
// what is a float, a Vec3 or a Mat3 elsewhere has eight lanes here. Functions round like their namesakes in
// fathom/math.hpp and dynamics/lane_scalar.hpp: each lane has the same bits as a scalar.
//
// Included in namespace fathom::wide (dynamics/lane_eight.hpp) and once per instruction set in namespaces of their own
// (native/mechanism_lanes.cpp). FATHOM_LANE_LAMBDA is defined.

using Real = Eight;
using Mask = EightInts;
using Flag = EightInts;
using AxisNumber = EightInts;
inline constexpr Flag all_set = {-1, -1, -1, -1, -1, -1, -1, -1};

#include "math/eight-inl.hpp"

// --- masks -------------------------------------------------------------------------------------------------------

inline Mask is_set(Flag f) { return f; }
inline Flag flag(Mask m) { return m; }
inline bool anywhere(Mask m) { return bits(m) != 0; }
inline bool everywhere(Mask m) { return bits(m) == 0xff; }
inline Mask inverted(Mask m) { return ~m; }
inline Mask both(Mask a, Mask b) { return a & b; }
inline Mask either(Mask a, Mask b) { return a | b; }
inline float first_lane(Real a) { return a[0]; }

// --- numbers -----------------------------------------------------------------------------------------------------

template <class L>
Real splat(float value) {
  return eight(value);
}
inline Real fma(float a, Real b, Real c) { return fma(eight(a), b, c); }
inline Real fma(Real a, Real b, float c) { return fma(a, b, eight(c)); }
inline Real clamp(Real a, Real lo, Real hi) { return min(max(a, lo), hi); }
inline Mask is_finite(Real a) { return a - a == eight(0.0f); }
inline Real mul_add(Real a, Real s, Real b) { return fma(s, b, a); }
inline Real mul_sub(Real a, Real s, Real b) { return fma(-s, b, a); }
inline Real root(Real a) { return sqrt(a); }
inline Real larger(Real a, Real b) { return max(a, b); }
inline Real smaller(Real a, Real b) { return min(a, b); }
inline Real magnitude(Real a) { return abs(a); }
/// Integer part of `a` >= 0.
inline Real whole(Real a) {
  return select(a < eight(0x1p23f), __builtin_convertvector(__builtin_convertvector(a, EightInts), Eight), a);
}
inline Real inverse_or_zero(Real a) { return select(a > eight(0.0f), 1.0f / a, eight(0.0f)); }
inline Real one_where_zero(Real a) { return select(a == eight(0.0f), eight(1.0f), eight(0.0f)); }
inline Mask is_above(Real a, Real b) { return a > b; }
inline Mask is_at_most(Real a, Real b) { return a <= b; }
inline bool any_above(Real a, Real b) { return anywhere(a > b); }
inline Real is_less(Real a, Real b) { return select(a < b, eight(1.0f), eight(0.0f)); }
inline Real choose(Real condition, Real a, Real b) { return select(condition != eight(0.0f), a, b); }

// --- vectors -----------------------------------------------------------------------------------------------------

struct Vec3 {
  Real x{}, y{}, z{};

  Real operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};
inline Vec3 unit_vector(float x, float y, float z) { return {eight(x), eight(y), eight(z)}; }
inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(Real s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec3 operator*(float s, const Vec3& a) { return eight(s) * a; }
inline Vec3& operator+=(Vec3& a, const Vec3& b) { return a = a + b; }
inline Vec3& operator-=(Vec3& a, const Vec3& b) { return a = a - b; }
inline Mask operator==(const Vec3& a, const Vec3& b) { return (a.x == b.x) & (a.y == b.y) & (a.z == b.z); }
inline Vec3 scale(Real s, const Vec3& a) { return s * a; }
inline Real dot(const Vec3& a, const Vec3& b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec3 mul_add(const Vec3& a, Real s, const Vec3& b) {
  return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)};
}
inline Vec3 mul_sub(const Vec3& a, Real s, const Vec3& b) { return mul_add(a, -s, b); }
inline Real length_squared(const Vec3& a) { return dot(a, a); }
inline Real length(const Vec3& a) { return sqrt(dot(a, a)); }
inline Vec3 select(Mask mask, const Vec3& a, const Vec3& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
inline Vec3 normalize(const Vec3& a) {
  const Real l = length(a);
  return select(l > eight(1e-18f), (1.0f / l) * a, unit_vector(0, 0, 1));
}

// --- quaternions -------------------------------------------------------------------------------------------------

struct Quat {
  Real w, x, y, z;

  Vec3 vector() const { return {x, y, z}; }
};
inline Quat conjugate(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }
inline Real dot(const Quat& a, const Quat& b) { return fma(a.w, b.w, fma(a.x, b.x, fma(a.y, b.y, a.z * b.z))); }
inline Quat operator*(const Quat& a, const Quat& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline Quat select(Mask mask, const Quat& a, const Quat& b) {
  return {select(mask, a.w, b.w), select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
inline Quat normalize(const Quat& q) {
  const Real l = sqrt(dot(q, q)), s = 1.0f / l, zero = eight(0.0f);
  return select(l > eight(1e-18f), Quat{s * q.w, s * q.x, s * q.y, s * q.z}, {eight(1.0f), zero, zero, zero});
}
inline Vec3 rotate(const Quat& q, const Vec3& v) {
  const Vec3 u = q.vector(), t = 2.0f * cross(u, v);
  return mul_add(v, q.w, t) + cross(u, t);
}
inline Vec3 inverse_rotate(const Quat& q, const Vec3& v) { return rotate(conjugate(q), v); }

// --- matrices ----------------------------------------------------------------------------------------------------

struct Mat3 {
  Vec3 x, y, z;  ///< columns

  Real operator()(int row, int column) const { return column == 0 ? x[row] : column == 1 ? y[row] : z[row]; }
};
inline Vec3 operator*(const Mat3& m, const Vec3& v) { return mul_add(mul_add(v.x * m.x, v.y, m.y), v.z, m.z); }
inline Mat3 operator*(const Mat3& a, const Mat3& b) { return {a * b.x, a * b.y, a * b.z}; }
inline Mat3 operator+(const Mat3& a, const Mat3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Mat3 transpose(const Mat3& m) { return {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}}; }
inline Vec3 transpose_mul(const Mat3& m, const Vec3& v) { return {dot(m.x, v), dot(m.y, v), dot(m.z, v)}; }

struct SymMat3 {
  Real xx, yy, zz, xy, xz, yz;
};
inline Vec3 operator*(const SymMat3& m, const Vec3& v) {
  return {fma(m.xz, v.z, fma(m.xy, v.y, m.xx * v.x)), fma(m.yz, v.z, fma(m.yy, v.y, m.xy * v.x)),
          fma(m.zz, v.z, fma(m.yz, v.y, m.xz * v.x))};
}
inline Mat3 to_matrix(const SymMat3& m) { return {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}}; }
inline SymMat3 rotated(const Mat3& r, const SymMat3& m) {
  const Mat3 rm = r * to_matrix(m);
  const auto element = [&](int i, int j) { return fma(rm.z[i], r.z[j], fma(rm.y[i], r.y[j], rm.x[i] * r.x[j])); };
  return {element(0, 0), element(1, 1), element(2, 2), element(0, 1), element(0, 2), element(1, 2)};
}

// --- laws over lanes ---------------------------------------------------------------------------------------------

template <class L>
using VecOf = Vec3;
template <class L>
using SymOf = SymMat3;
template <class Vec>
using LaneOf = Real;
template <class Vec>
using QuatOf = Quat;

#define FATHOM_LANE_FUNCTION inline
#include "dynamics/limited-inl.hpp"
// Depends on the include above.
#include "dynamics/integrate-inl.hpp"
// Depends on the include above.
#include "dynamics/angle-inl.hpp"
// Depends on the include above.
#include "dynamics/inverse_inertia-inl.hpp"
// Depends on the include above.
#include "dynamics/ball_joint-inl.hpp"
// Depends on the include above.
#include "dynamics/generic_rows-inl.hpp"
// Depends on the include above.
#include "dynamics/rotation-inl.hpp"
#undef FATHOM_LANE_FUNCTION
