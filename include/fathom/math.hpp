// Vectors, quaternions, matrices, poses and boxes: plain structs for host and device code.
//
// Every function is explicit about its rounding, so all back ends give the same bits: contraction is off in this
// project, and `fma` is written where it is wanted. `cross` deliberately uses no fma: with it a × a would not be
// exactly zero.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#if defined(__CUDACC__)
#define FATHOM_HD __host__ __device__ inline
/// For long functions whose arguments must stay in registers.
#define FATHOM_HD_INLINED __host__ __device__ __forceinline__
#else
#define FATHOM_HD inline
#define FATHOM_HD_INLINED inline
#endif
/// For functions of a few operations. In large files g++ stops inlining them: the narrow phase of capsules then takes
/// 1.7 times as long.
#if defined(__CUDACC__)
#define FATHOM_HD_SHORT FATHOM_HD_INLINED
#elif defined(_MSC_VER)
#define FATHOM_HD_SHORT __forceinline
#else
#define FATHOM_HD_SHORT [[gnu::always_inline]] inline
#endif

namespace fathom {

/// π.
inline constexpr float pi = 3.14159265358979323846f;

// fma, sqrt and abs are templates to keep calls unambiguous under `using namespace` of both std and fathom: of two
// equally good overloads, the non-template one, std's, wins.

/// a·b + c with one rounding, on every target.
template <class = void>
FATHOM_HD float fma(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, c);
#else
  return std::fma(a, b, c);
#endif
}

/// The correctly rounded square root of `a`, from an estimate at most 3 units in the last place off (what SYCL requires
/// of a device): a Newton step, then Tuckerman's test of the neighbours. The signs of the residuals are exact, because
/// fma rounds once (Markstein, Computation of elementary functions on the IBM RISC System/6000, 1990).
template <class Estimate>
FATHOM_HD float correctly_rounded_sqrt(float a, Estimate estimate) {
  if (!(a > 0.0f && a < std::numeric_limits<float>::infinity()))
    return a == 0.0f || a > 0.0f ? a : std::numeric_limits<float>::quiet_NaN();  // ±0, infinity; NaN
  // For tiny values a residual could underflow.
  const bool is_tiny = a < 0x1p-96f;
  const float x = is_tiny ? a * 0x1p+64f : a;
  const float s = estimate(x);
  // 1 / s to one part in 300: enough to correct the estimate's error.
  const float guess = std::bit_cast<float>(0x7ef311c7u - std::bit_cast<std::uint32_t>(s));
  const float reciprocal = guess * (2.0f - s * guess);
  const float root = fma(fma(-s, s, x), 0.5f * reciprocal, s);
  const float below = std::bit_cast<float>(std::bit_cast<std::uint32_t>(root) - 1);
  const float above = std::bit_cast<float>(std::bit_cast<std::uint32_t>(root) + 1);
  const float rounded = fma(-below, root, x) <= 0.0f ? below : fma(-above, root, x) > 0.0f ? above : root;
  return is_tiny ? rounded * 0x1p-32f : rounded;
}

/// Square root, correctly rounded on every target (IEEE 754 roundTiesToEven).
template <class = void>
FATHOM_HD float sqrt(float a) {
#if defined(__CUDA_ARCH__)
  return __fsqrt_rn(a);
#elif defined(FATHOM_SYCL_SOURCE)
  // SYCL requires only 3 units in the last place; AdaptiveCpp uses sqrt.approx on NVIDIA.
  return correctly_rounded_sqrt(a, [](float x) { return std::sqrt(x); });
#else
  return std::sqrt(a);
#endif
}

/// Absolute value.
template <class = void>
FATHOM_HD_SHORT float abs(float a) {
#if defined(__CUDA_ARCH__)
  return fabsf(a);
#else
  return std::fabs(a);
#endif
}
/// The smaller of two numbers.
FATHOM_HD_SHORT float min(float a, float b) { return a < b ? a : b; }
/// The larger of two numbers.
FATHOM_HD_SHORT float max(float a, float b) { return a > b ? a : b; }
/// `a`, clamped to `lo` … `hi`.
FATHOM_HD_SHORT float clamp(float a, float lo, float hi) { return min(max(a, lo), hi); }

/// False for infinities and NaN.
FATHOM_HD_SHORT bool is_finite(float a) { return a - a == 0.0f; }

/// Three numbers: a point, a direction, a velocity.
struct Vec3 {
  ///@{
  /// Components.
  float x = 0, y = 0, z = 0;
  ///@}

  /// Component 0, 1 or 2.
  FATHOM_HD float operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};

/// @cond
FATHOM_HD_SHORT Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
FATHOM_HD_SHORT Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FATHOM_HD_SHORT Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
FATHOM_HD_SHORT Vec3 operator*(float s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
FATHOM_HD_SHORT Vec3 operator*(Vec3 a, float s) { return s * a; }
FATHOM_HD_SHORT Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
FATHOM_HD_SHORT Vec3& operator-=(Vec3& a, Vec3 b) { return a = a - b; }
FATHOM_HD_SHORT Vec3& operator*=(Vec3& a, float s) { return a = s * a; }
FATHOM_HD_SHORT bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
/// @endcond

/// Dot product.
FATHOM_HD_SHORT float dot(Vec3 a, Vec3 b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }
/// Cross product.
FATHOM_HD_SHORT Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// a + s·b, one rounding per component.
FATHOM_HD_SHORT Vec3 mul_add(Vec3 a, float s, Vec3 b) { return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)}; }
/// Square of the length.
FATHOM_HD_SHORT float length_squared(Vec3 a) { return dot(a, a); }
/// Length.
FATHOM_HD_SHORT float length(Vec3 a) { return fathom::sqrt(dot(a, a)); }
/// Distance of two points.
FATHOM_HD float distance(Vec3 a, Vec3 b) { return length(a - b); }
/// Absolute values of the components.
FATHOM_HD_SHORT Vec3 abs(Vec3 a) { return {fathom::abs(a.x), fathom::abs(a.y), fathom::abs(a.z)}; }
/// Component-wise minimum.
FATHOM_HD_SHORT Vec3 min(Vec3 a, Vec3 b) { return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)}; }
/// Component-wise maximum.
FATHOM_HD_SHORT Vec3 max(Vec3 a, Vec3 b) { return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)}; }
/// The largest component.
FATHOM_HD_SHORT float max_component(Vec3 a) { return max(a.x, max(a.y, a.z)); }
/// The smallest component.
FATHOM_HD_SHORT float min_component(Vec3 a) { return min(a.x, min(a.y, a.z)); }
/// Whether all components are finite.
FATHOM_HD_SHORT bool is_finite(Vec3 a) { return is_finite(a.x) && is_finite(a.y) && is_finite(a.z); }

/// Unit vector along `a`, or `fallback` if `a` is shorter than 1e-18 m.
FATHOM_HD Vec3 normalize(Vec3 a, Vec3 fallback = {0, 0, 1}) {
  const float l = length(a);
  return l > 1e-18f ? (1.0f / l) * a : fallback;
}

/// A unit vector perpendicular to the unit vector `n`, chosen by n's smallest component.
FATHOM_HD Vec3 any_perpendicular(Vec3 n) {
  const Vec3 a = abs(n);
  const Vec3 axis = a.x <= a.y && a.x <= a.z ? Vec3{1, 0, 0} : a.y <= a.z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  return normalize(cross(n, axis));
}

/// Unit quaternion for a rotation; text and memory order is (w, x, y, z).
struct Quat {
  ///@{
  /// Components.
  float w = 1, x = 0, y = 0, z = 0;
  ///@}

  /// The vector part (x, y, z).
  FATHOM_HD Vec3 vector() const { return {x, y, z}; }
};

/// The inverse rotation.
FATHOM_HD_SHORT Quat conjugate(Quat q) { return {q.w, -q.x, -q.y, -q.z}; }
/// Dot product of the components.
FATHOM_HD_SHORT float dot(Quat a, Quat b) { return fma(a.w, b.w, fma(a.x, b.x, fma(a.y, b.y, a.z * b.z))); }
/// Whether all components are finite.
FATHOM_HD_SHORT bool is_finite(Quat q) { return is_finite(q.w) && is_finite(q.vector()); }

/// Hamilton product: the rotation b followed by the rotation a.
FATHOM_HD_SHORT Quat operator*(Quat a, Quat b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/// The quaternion scaled to unit length; the identity if it has no direction.
FATHOM_HD Quat normalize(Quat q) {
  const float l = fathom::sqrt(dot(q, q));
  if (!(l > 1e-18f)) return {};
  const float s = 1.0f / l;
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}

/// Vector `v` rotated by unit quaternion `q`: v + 2w(q×v) + 2q×(q×v).
FATHOM_HD_SHORT Vec3 rotate(Quat q, Vec3 v) {
  const Vec3 u = q.vector();
  const Vec3 t = 2.0f * cross(u, v);
  return mul_add(v, q.w, t) + cross(u, t);
}
/// Vector `v` rotated by the inverse of unit quaternion `q`.
FATHOM_HD_SHORT Vec3 inverse_rotate(Quat q, Vec3 v) { return rotate(conjugate(q), v); }

/// 3×3 matrix by columns.
struct Mat3 {
  ///@{
  /// Columns.
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  ///@}

  /// The element at this row and column, counted from 0.
  FATHOM_HD float operator()(int row, int column) const { return column == 0 ? x[row] : column == 1 ? y[row] : z[row]; }
};

/// @cond
FATHOM_HD_SHORT Vec3 operator*(const Mat3& m, Vec3 v) { return mul_add(mul_add(v.x * m.x, v.y, m.y), v.z, m.z); }
FATHOM_HD Mat3 operator*(const Mat3& a, const Mat3& b) { return {a * b.x, a * b.y, a * b.z}; }
FATHOM_HD Mat3 operator+(const Mat3& a, const Mat3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
FATHOM_HD Mat3 operator*(float s, const Mat3& a) { return {s * a.x, s * a.y, s * a.z}; }
/// @endcond
/// Transpose.
FATHOM_HD Mat3 transpose(const Mat3& m) {
  return {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
}
/// transpose(m)·v.
FATHOM_HD Vec3 transpose_mul(const Mat3& m, Vec3 v) { return {dot(m.x, v), dot(m.y, v), dot(m.z, v)}; }
/// Determinant.
FATHOM_HD float determinant(const Mat3& m) { return dot(m.x, cross(m.y, m.z)); }
/// Inverse by cofactors; all zeros if the determinant is zero.
FATHOM_HD Mat3 inverse(const Mat3& m) {
  const float det = determinant(m);
  const float s = det != 0.0f ? 1.0f / det : 0.0f;
  return transpose(Mat3{s * cross(m.y, m.z), s * cross(m.z, m.x), s * cross(m.x, m.y)});
}
/// Absolute values of the elements.
FATHOM_HD Mat3 abs(const Mat3& m) { return {abs(m.x), abs(m.y), abs(m.z)}; }

/// Rotation matrix of a unit quaternion.
FATHOM_HD Mat3 to_matrix(Quat q) {
  const float xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
  const float xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
  const float wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {{1 - 2 * (yy + zz), 2 * (xy + wz), 2 * (xz - wy)},
          {2 * (xy - wz), 1 - 2 * (xx + zz), 2 * (yz + wx)},
          {2 * (xz + wy), 2 * (yz - wx), 1 - 2 * (xx + yy)}};
}

/// Symmetric 3×3 matrix: inertia tensors and their inverses.
struct SymMat3 {
  ///@{
  /// Elements.
  float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  ///@}

  friend bool operator==(const SymMat3&, const SymMat3&) = default;
};
/// @cond
FATHOM_HD_SHORT Vec3 operator*(const SymMat3& m, Vec3 v) {
  return {fma(m.xz, v.z, fma(m.xy, v.y, m.xx * v.x)), fma(m.yz, v.z, fma(m.yy, v.y, m.xy * v.x)),
          fma(m.zz, v.z, fma(m.yz, v.y, m.xz * v.x))};
}
FATHOM_HD SymMat3 operator*(float s, const SymMat3& m) {
  return {s * m.xx, s * m.yy, s * m.zz, s * m.xy, s * m.xz, s * m.yz};
}
/// @endcond
/// As a full matrix.
FATHOM_HD Mat3 to_matrix(const SymMat3& m) { return {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}}; }
/// r · m · transpose(r): a tensor rotated by r.
FATHOM_HD SymMat3 rotated(const Mat3& r, const SymMat3& m) {
  const Mat3 rm = r * to_matrix(m);
  const auto element = [&](int i, int j) { return fma(rm.z[i], r.z[j], fma(rm.y[i], r.y[j], rm.x[i] * r.x[j])); };
  return {element(0, 0), element(1, 1), element(2, 2), element(0, 1), element(0, 2), element(1, 2)};
}

/// Rigid transform: x ↦ rotation·x + position. 32 bytes: two aligned 16-byte loads.
struct alignas(16) Pose {
  Vec3 position{};     ///< m
  float reserved = 0;  ///< reserved for the simulators
  Quat rotation{};     ///< unit quaternion
};
/// Transforms a point from the body's frame to the world.
FATHOM_HD_SHORT Vec3 transform(const Pose& p, Vec3 v) { return rotate(p.rotation, v) + p.position; }
/// Transforms a point from the world to the body's frame.
FATHOM_HD_SHORT Vec3 inverse_transform(const Pose& p, Vec3 v) { return inverse_rotate(p.rotation, v - p.position); }
/// `b` in the frame of `a`: inverse(a)·b.
FATHOM_HD_SHORT Pose relative(const Pose& a, const Pose& b) {
  return {inverse_rotate(a.rotation, b.position - a.position), 0, conjugate(a.rotation) * b.rotation};
}
/// @cond
FATHOM_HD_SHORT Pose operator*(const Pose& a, const Pose& b) {
  return {transform(a, b.position), 0, a.rotation * b.rotation};
}
/// @endcond
/// Whether position and rotation are finite.
FATHOM_HD_SHORT bool is_finite(const Pose& p) { return is_finite(p.position) && is_finite(p.rotation); }

/// Velocity of a body, in world axes.
struct alignas(16) Velocity {
  Vec3 linear{};        ///< m/s, of the centre of mass
  float reserved0 = 0;  ///< reserved for the simulators
  Vec3 angular{};       ///< rad/s
  float reserved1 = 0;  ///< reserved for the simulators
};

/// Axis-aligned bounding box.
struct Aabb {
  ///@{
  /// Its corners (m).
  Vec3 lower, upper;
  ///@}
};
/// Whether they overlap or touch.
FATHOM_HD bool overlaps(const Aabb& a, const Aabb& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y && b.lower.y <= a.upper.y &&
         a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}
/// Whether `outer` contains `inner`.
FATHOM_HD bool contains(const Aabb& outer, const Aabb& inner) {
  return outer.lower.x <= inner.lower.x && outer.lower.y <= inner.lower.y && outer.lower.z <= inner.lower.z &&
         outer.upper.x >= inner.upper.x && outer.upper.y >= inner.upper.y && outer.upper.z >= inner.upper.z;
}
/// The smallest box around both.
FATHOM_HD Aabb merged(const Aabb& a, const Aabb& b) { return {min(a.lower, b.lower), max(a.upper, b.upper)}; }
/// The box enlarged by a margin (m) on all sides.
FATHOM_HD Aabb grown(const Aabb& a, float margin) {
  const Vec3 m{margin, margin, margin};
  return {a.lower - m, a.upper + m};
}
/// Its centre.
FATHOM_HD Vec3 centre(const Aabb& a) { return 0.5f * (a.lower + a.upper); }
/// Half its edge lengths.
FATHOM_HD Vec3 half_extents(const Aabb& a) { return 0.5f * (a.upper - a.lower); }
/// Its surface area (m²).
FATHOM_HD float surface_area(const Aabb& a) {
  const Vec3 e = a.upper - a.lower;
  return 2.0f * (e.x * e.y + e.y * e.z + e.z * e.x);
}

}  // namespace fathom
