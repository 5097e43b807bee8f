// Three-component vectors of lanes, and the 4×4 transposes between quads in memory and components in lanes.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_LANES_INL
#undef FATHOM_LANES_INL
#else
#define FATHOM_LANES_INL
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
struct Vec3V {
  V x, y, z;
};

template <class V>
HWY_INLINE Vec3V<V> operator+(Vec3V<V> a, Vec3V<V> b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
template <class V>
HWY_INLINE Vec3V<V> operator-(Vec3V<V> a, Vec3V<V> b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
template <class V>
HWY_INLINE Vec3V<V> scale(V s, Vec3V<V> a) {
  return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
/// a + s·b
template <class V>
HWY_INLINE Vec3V<V> mul_add(Vec3V<V> a, V s, Vec3V<V> b) {
  return {hn::MulAdd(s, b.x, a.x), hn::MulAdd(s, b.y, a.y), hn::MulAdd(s, b.z, a.z)};
}
/// a − s·b
template <class V>
HWY_INLINE Vec3V<V> mul_sub(Vec3V<V> a, V s, Vec3V<V> b) {
  return {hn::NegMulAdd(s, b.x, a.x), hn::NegMulAdd(s, b.y, a.y), hn::NegMulAdd(s, b.z, a.z)};
}
template <class V>
HWY_INLINE V dot(Vec3V<V> a, Vec3V<V> b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
template <class V>
HWY_INLINE Vec3V<V> cross(Vec3V<V> a, Vec3V<V> b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

template <class V>
struct SymMat3V {
  V xx, yy, zz, xy, xz, yz;
};
template <class V>
HWY_INLINE Vec3V<V> operator*(const SymMat3V<V>& m, Vec3V<V> v) {
  return {hn::MulAdd(m.xz, v.z, hn::MulAdd(m.xy, v.y, hn::Mul(m.xx, v.x))),
          hn::MulAdd(m.yz, v.z, hn::MulAdd(m.yy, v.y, hn::Mul(m.xy, v.x))),
          hn::MulAdd(m.zz, v.z, hn::MulAdd(m.yz, v.y, hn::Mul(m.xz, v.x)))};
}

/// Rotation matrix of unit quaternions, by columns; the same operations as `fathom::to_matrix` in fma form.
template <class V>
struct Mat3V {
  Vec3V<V> x, y, z;
};
template <class V>
HWY_INLINE Vec3V<V> operator*(const Mat3V<V>& m, Vec3V<V> v) {
  return mul_add(mul_add(scale(v.x, m.x), v.y, m.y), v.z, m.z);
}
template <class D, class V = hn::Vec<D>>
HWY_INLINE Mat3V<V> to_matrix(D d, V w, V x, V y, V z) {
  const V one = hn::Set(d, 1.0f);
  const V x2 = hn::Add(x, x), y2 = hn::Add(y, y), z2 = hn::Add(z, z);
  const V wx = hn::Mul(w, x2), wy = hn::Mul(w, y2), wz = hn::Mul(w, z2);
  const V xx = hn::Mul(x, x2), yy = hn::Mul(y, y2), zz = hn::Mul(z, z2);
  return {{hn::Sub(one, hn::Add(yy, zz)), hn::MulAdd(x, y2, wz), hn::MulSub(x, z2, wy)},
          {hn::MulSub(x, y2, wz), hn::Sub(one, hn::Add(xx, zz)), hn::MulAdd(y, z2, wx)},
          {hn::MulAdd(x, z2, wy), hn::MulSub(y, z2, wx), hn::Sub(one, hn::Add(xx, yy))}};
}

/// A rotation, like fathom::Quat.
template <class V>
struct QuatV {
  V w, x, y, z;
};
/// Hamilton product.
template <class V>
HWY_INLINE QuatV<V> operator*(const QuatV<V>& a, const QuatV<V>& b) {
  const auto component = [](V p, V q, V r, V s, V t, V u, V minus, V times) HWY_ATTR {
    return hn::NegMulAdd(minus, times, hn::MulAdd(t, u, hn::MulAdd(r, s, hn::Mul(p, q))));
  };
  return {hn::NegMulAdd(a.z, b.z, hn::NegMulAdd(a.y, b.y, hn::NegMulAdd(a.x, b.x, hn::Mul(a.w, b.w)))),
          component(a.w, b.x, a.x, b.w, a.y, b.z, a.z, b.y), component(a.w, b.y, a.y, b.w, a.z, b.x, a.x, b.z),
          component(a.w, b.z, a.z, b.w, a.x, b.y, a.y, b.x)};
}
template <class V>
HWY_INLINE QuatV<V> normalize(const QuatV<V>& q) {
  const V squared = hn::MulAdd(q.w, q.w, hn::MulAdd(q.x, q.x, hn::MulAdd(q.y, q.y, hn::Mul(q.z, q.z))));
  const V s = hn::Div(hn::Set(hn::DFromV<V>(), 1.0f), hn::Sqrt(squared));
  return {hn::Mul(s, q.w), hn::Mul(s, q.x), hn::Mul(s, q.y), hn::Mul(s, q.z)};
}

template <class V>
struct QuadV {
  V x, y, z, w;

  HWY_INLINE Vec3V<V> xyz() const { return {x, y, z}; }
};

/// Row k of the transposes: its j-th 128-bit block is the quad of lane 4·j + k.
template <class D>
HWY_INLINE hn::Vec<D> load_row(D d, const float* const* lanes, std::size_t k) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::Load(d, lanes[k]);
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, load_row(half, lanes + hn::MaxLanes(half), k), load_row(half, lanes, k));
  }
}

/// Loads a quad of floats for every lane and transposes: x of all lanes, y of all lanes, …
template <class D>
HWY_INLINE QuadV<hn::Vec<D>> load_quads(D d, const float* const* lanes) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    const float* q = lanes[0];
    return {hn::Set(d, q[0]), hn::Set(d, q[1]), hn::Set(d, q[2]), hn::Set(d, q[3])};
  } else {
    const hn::Repartition<double, D> dd;
    const auto r0 = load_row(d, lanes, 0), r1 = load_row(d, lanes, 1);
    const auto r2 = load_row(d, lanes, 2), r3 = load_row(d, lanes, 3);
    const auto xy01 = hn::BitCast(dd, hn::InterleaveLower(d, r0, r1)),
               xy23 = hn::BitCast(dd, hn::InterleaveLower(d, r2, r3));
    const auto zw01 = hn::BitCast(dd, hn::InterleaveUpper(d, r0, r1)),
               zw23 = hn::BitCast(dd, hn::InterleaveUpper(d, r2, r3));
    return {hn::BitCast(d, hn::InterleaveLower(dd, xy01, xy23)), hn::BitCast(d, hn::InterleaveUpper(dd, xy01, xy23)),
            hn::BitCast(d, hn::InterleaveLower(dd, zw01, zw23)), hn::BitCast(d, hn::InterleaveUpper(dd, zw01, zw23))};
  }
}

template <class D>
HWY_INLINE void store_row(D d, hn::Vec<D> row, float* const* lanes, std::size_t k, std::size_t used) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    if (k < used) hn::Store(row, d, lanes[k]);
  } else {
    const hn::Half<D> half;
    constexpr std::size_t n = hn::MaxLanes(half);
    store_row(half, hn::LowerHalf(half, row), lanes, k, used);
    store_row(half, hn::UpperHalf(half, row), lanes + n, k, used > n ? used - n : 0);
  }
}

/// The reverse of `load_quads`, for the first `used` lanes.
template <class D>
HWY_INLINE void store_quads(D d, QuadV<hn::Vec<D>> q, float* const* lanes, std::size_t used) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    if (used == 0) return;
    float* out = lanes[0];
    out[0] = hn::GetLane(q.x), out[1] = hn::GetLane(q.y), out[2] = hn::GetLane(q.z), out[3] = hn::GetLane(q.w);
  } else {
    const hn::Repartition<double, D> dd;
    const auto xy_lo = hn::BitCast(dd, hn::InterleaveLower(d, q.x, q.y)),
               xy_hi = hn::BitCast(dd, hn::InterleaveUpper(d, q.x, q.y));
    const auto zw_lo = hn::BitCast(dd, hn::InterleaveLower(d, q.z, q.w)),
               zw_hi = hn::BitCast(dd, hn::InterleaveUpper(d, q.z, q.w));
    store_row(d, hn::BitCast(d, hn::InterleaveLower(dd, xy_lo, zw_lo)), lanes, 0, used);
    store_row(d, hn::BitCast(d, hn::InterleaveUpper(dd, xy_lo, zw_lo)), lanes, 1, used);
    store_row(d, hn::BitCast(d, hn::InterleaveLower(dd, xy_hi, zw_hi)), lanes, 2, used);
    store_row(d, hn::BitCast(d, hn::InterleaveUpper(dd, xy_hi, zw_hi)), lanes, 3, used);
  }
}

/// Objects of neighbouring lanes, by index; lanes beyond the last repeat the first.
template <class D>
struct LaneItems {
  static constexpr std::size_t width = hn::MaxLanes(D());
  using V = hn::Vec<D>;

  const std::uint32_t* items;
  std::size_t used;

  std::uint32_t item(std::size_t lane) const { return items[lane < used ? lane : 0]; }

  template <class T>
  QuadV<V> load(const T* objects, std::size_t quad) const {
    const float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = reinterpret_cast<const float*>(objects + item(i)) + 4 * quad;
    return load_quads(D(), at);
  }
  template <class T>
  void store(T* objects, std::size_t quad, const QuadV<V>& value) const {
    float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = reinterpret_cast<float*>(objects + item(i)) + 4 * quad;
    store_quads(D(), value, at, used);
  }
};

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
