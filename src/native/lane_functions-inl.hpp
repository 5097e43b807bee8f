// What laws over a lane type L require of L, for vectors of lanes; dynamics/lane_scalar.hpp has the same for one lane.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_LANE_FUNCTIONS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_LANE_FUNCTIONS_INL
#undef FATHOM_LANE_FUNCTIONS_INL
#else
#define FATHOM_LANE_FUNCTIONS_INL
#endif

#include <hwy/highway.h>

#include "native/lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

template <class L>
using VecOf = Vec3V<L>;
template <class L>
using SymOf = SymMat3V<L>;
template <class Vec>
struct LanesOf;
template <class V>
struct LanesOf<Vec3V<V>> {
  using Lane = V;
  using Quaternion = QuatV<V>;
};
template <class Vec>
using LaneOf = typename LanesOf<Vec>::Lane;
template <class Vec>
using QuatOf = typename LanesOf<Vec>::Quaternion;
template <class L>
HWY_INLINE L splat(float value) {
  return hn::Set(hn::DFromV<L>(), value);
}
template <class V>
HWY_INLINE V mul_add(V a, V s, V b) {
  return hn::MulAdd(s, b, a);
}
template <class V>
HWY_INLINE V mul_sub(V a, V s, V b) {
  return hn::NegMulAdd(s, b, a);
}
template <class V>
HWY_INLINE V root(V a) {
  return hn::Sqrt(a);
}
template <class V>
HWY_INLINE V larger(V a, V b) {
  return hn::Max(a, b);
}
template <class V>
HWY_INLINE V smaller(V a, V b) {
  return hn::Min(a, b);
}
template <class V>
HWY_INLINE Vec3V<V> larger(Vec3V<V> a, Vec3V<V> b) {
  return {hn::Max(a.x, b.x), hn::Max(a.y, b.y), hn::Max(a.z, b.z)};
}
template <class V>
HWY_INLINE Vec3V<V> smaller(Vec3V<V> a, Vec3V<V> b) {
  return {hn::Min(a.x, b.x), hn::Min(a.y, b.y), hn::Min(a.z, b.z)};
}
template <class V>
HWY_INLINE V magnitude(V a) {
  return hn::Abs(a);
}
/// Integer part of `a`, which is not negative.
template <class V>
HWY_INLINE V whole(V a) {
  return hn::Floor(a);
}
template <class V>
HWY_INLINE V inverse_or_zero(V a) {
  const hn::DFromV<V> d;
  const V one = hn::Set(d, 1.0f);
  const auto positive = hn::Gt(a, hn::Zero(d));
  return hn::IfThenElseZero(positive, hn::Div(one, hn::IfThenElse(positive, a, one)));
}
template <class V>
HWY_INLINE V one_where_zero(V a) {
  const hn::DFromV<V> d;
  return hn::IfThenElseZero(hn::Eq(a, hn::Zero(d)), hn::Set(d, 1.0f));
}

template <class V>
HWY_INLINE auto is_above(V a, V b) {
  return hn::Gt(a, b);
}
template <class V>
HWY_INLINE auto is_at_most(V a, V b) {
  return hn::Le(a, b);
}
/// Whether any lane has a > b.
template <class V>
HWY_INLINE bool any_above(V a, V b) {
  return !hn::AllFalse(hn::DFromV<V>(), hn::Gt(a, b));
}
template <class M>
HWY_INLINE M both(M a, M b) {
  return hn::And(a, b);
}
template <class V, class M>
HWY_INLINE V select(M mask, V a, V b) {
  return hn::IfThenElse(mask, a, b);
}
template <class V, class M>
HWY_INLINE Vec3V<V> select(M mask, Vec3V<V> a, Vec3V<V> b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}

/// 1 or 0, for conditions that are stored.
template <class V>
HWY_INLINE V is_less(V a, V b) {
  return hn::IfThenElseZero(hn::Lt(a, b), hn::Set(hn::DFromV<V>(), 1.0f));
}
template <class V>
HWY_INLINE V choose(V condition, V a, V b) {
  return hn::IfThenElse(hn::Ne(condition, hn::Zero(hn::DFromV<V>())), a, b);
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
