#include "native/box_pairs.hpp"

#include <algorithm>
#include <bit>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "collision/cache.hpp"
#include "collision/tolerance.hpp"
#include "native/lane_functions-inl.hpp"

namespace fathom::native {

namespace {

using namespace HWY_NAMESPACE;  // lane_functions-inl.hpp, for the instruction set this file is compiled for
#define FATHOM_LANE_FUNCTION HWY_INLINE
#include "dynamics/bounds-inl.hpp"
#undef FATHOM_LANE_FUNCTION
using D = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using Mask = hn::Mask<D>;
using Lanes = LaneItems<D>;
constexpr D d;
constexpr DI di;
constexpr std::size_t width = hn::MaxLanes(D());

V set(float value) { return hn::Set(d, value); }
V add(V a, V b) { return hn::Add(a, b); }
V sub(V a, V b) { return hn::Sub(a, b); }
V mul(V a, V b) { return hn::Mul(a, b); }
V max3(V a, V b, V c) { return hn::Max(hn::Max(a, b), c); }
V min3(V a, V b, V c) { return hn::Min(hn::Min(a, b), c); }

// Like fathom::cross, which rounds every product.
Vec3V<V> rounded_cross(Vec3V<V> a, Vec3V<V> b) {
  return {sub(mul(a.y, b.z), mul(a.z, b.y)), sub(mul(a.z, b.x), mul(a.x, b.z)), sub(mul(a.x, b.y), mul(a.y, b.x))};
}

struct PoseLanes {
  QuadV<V> position, turn;
};

PoseLanes relative(const Lanes& a, const Lanes& b, const BodyState& state) {
  const Pose* const poses = state.poses.data();
  const QuadV<V> position_a = a.load(poses, 0), turn_a = a.load(poses, 1);  // rotations are w, x, y, z
  const QuadV<V> position_b = b.load(poses, 0), turn_b = b.load(poses, 1);
  const V w = turn_a.x, bw = turn_b.x, bx = turn_b.y, by = turn_b.z, bz = turn_b.w;
  const Vec3V<V> u{hn::Neg(turn_a.y), hn::Neg(turn_a.z), hn::Neg(turn_a.w)};
  const Vec3V<V> between = position_b.xyz() - position_a.xyz();
  const Vec3V<V> t = scale(set(2.0f), rounded_cross(u, between));
  const Vec3V<V> position = mul_add(between, w, t) + rounded_cross(u, t);
  const V qw = sub(sub(sub(mul(w, bw), mul(u.x, bx)), mul(u.y, by)), mul(u.z, bz));
  const V qx = sub(add(add(mul(w, bx), mul(u.x, bw)), mul(u.y, bz)), mul(u.z, by));
  const V qy = add(add(sub(mul(w, by), mul(u.x, bz)), mul(u.y, bw)), mul(u.z, bx));
  const V qz = add(sub(add(mul(w, bz), mul(u.x, by)), mul(u.y, bx)), mul(u.z, bw));
  return {{position.x, position.y, position.z, hn::Zero(d)}, {qw, qx, qy, qz}};
}

V length(Vec3V<V> v) { return hn::Sqrt(dot(v, v)); }

V speculative_margin(const Lanes& a, const Lanes& b, const BodyState& state, V radius_a, V radius_b, float dt) {
  const Velocity* const velocities = state.velocities.data();
  const V h = set(dt), one = set(1.0f);
  const V approach = length(b.load(velocities, 0).xyz() - a.load(velocities, 0).xyz());
  const auto turning = [&](const Lanes& of, V radius) {
    return mul(hn::Min(mul(length(of.load(velocities, 1).xyz()), h), one), radius);
  };
  const V turnings = add(turning(a, radius_a), turning(b, radius_b));
  const V near = half_speculative_margin(hn::Min(radius_a, radius_b), dt);
  return add(add(mul(set(2.0f), near), mul(approach, h)), turnings);
}

/// `BoxPair` in lanes.
struct PairLanes {
  V ha[3], hb[3], t[3];
  V r[3][3], q[3][3];
  V face_a[3], face_b[3];
  V axis_tolerance, noise;
};

PairLanes make_pairs(const QuadV<V>& shape_a, const QuadV<V>& shape_b, const PoseLanes& b_in_a) {
  const QuadV<V>&position = b_in_a.position, &turn = b_in_a.turn;
  PairLanes p{{shape_a.x, shape_a.y, shape_a.z},
              {shape_b.x, shape_b.y, shape_b.z},
              {position.x, position.y, position.z},
              {},
              {},
              {},
              {},
              {},
              {}};
  const V v[3] = {turn.y, turn.z, turn.w}, two = set(2.0f);
  const V w2 = mul(two, turn.x);
  const V squares = add(add(mul(v[0], v[0]), mul(v[1], v[1])), mul(v[2], v[2]));
  const V diagonal = sub(set(1.0f), mul(two, squares));
  for (std::size_t i = 0; i < 3; ++i) {
    p.r[i][i] = add(mul(v[i], mul(two, v[i])), diagonal);
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const V even = mul(v[i], mul(two, v[j])), odd = mul(w2, v[k]);
    p.r[i][j] = sub(even, odd);
    p.r[j][i] = add(even, odd);
  }
  V distance[3];
  for (std::size_t i = 0; i < 3; ++i) {
    distance[i] = hn::Abs(p.t[i]);
    for (std::size_t j = 0; j < 3; ++j) p.q[i][j] = hn::Abs(p.r[i][j]);
  }
  const auto sum = [](V x, V y, V z) { return add(add(x, y), z); };
  for (std::size_t i = 0; i < 3; ++i) {
    const V reach_b = sum(mul(p.hb[0], p.q[i][0]), mul(p.hb[1], p.q[i][1]), mul(p.hb[2], p.q[i][2]));
    p.face_a[i] = sub(sub(distance[i], p.ha[i]), reach_b);
    const V across = sum(mul(p.t[0], p.r[0][i]), mul(p.t[1], p.r[1][i]), mul(p.t[2], p.r[2][i]));
    const V reach_a = sum(mul(p.ha[0], p.q[0][i]), mul(p.ha[1], p.q[1][i]), mul(p.ha[2], p.q[2][i]));
    p.face_b[i] = sub(sub(hn::Abs(across), p.hb[i]), reach_a);
  }
  const V smallest = hn::Min(min3(p.ha[0], p.ha[1], p.ha[2]), min3(p.hb[0], p.hb[1], p.hb[2]));
  const V reach =
      max3(sum(p.ha[0], p.hb[0], distance[0]), sum(p.ha[1], p.hb[1], distance[1]), sum(p.ha[2], p.hb[2], distance[2]));
  p.axis_tolerance =
      add(hn::Min(set(max_axis_tolerance), mul(set(axis_tolerance_share), smallest)), mul(set(axis_rounding), reach));
  p.noise = mul(set(separation_rounding), reach);
  return p;
}

/// An AxisCache as an integer.
VI code(int kind, int a, int b) {
  const AxisCache cache = make_cache(static_cast<AxisCache::Kind>(kind), a, b, true);
  return hn::Set(di, std::bit_cast<std::int32_t>(cache));
}

struct LargestFace {
  V separation;
  VI cache;
};
/// The first of equals, like `largest`.
LargestFace largest_face(const V* faces, VI first, VI second, VI third) {
  const auto choose = [](const LargestFace& x, const LargestFace& y) {
    const Mask is_x = hn::Ge(x.separation, y.separation);
    return LargestFace{hn::IfThenElse(is_x, x.separation, y.separation),
                       hn::IfThenElse(hn::RebindMask(di, is_x), x.cache, y.cache)};
  };
  return choose(choose({faces[0], first}, {faces[1], second}), {faces[2], third});
}

struct Separated {
  Mask lanes;
  VI caches;
};

/// Tests edge-edge axes where no face separates: the last step's separating pair of edges is kept, otherwise the pair
/// with the largest separation wins.
Separated separate_by_edges(const PairLanes& p, V margin, V face, VI before) {
  const VI kind = hn::And(before, hn::Set(di, 0xff)), by_edges = hn::Set(di, AxisCache::edges);
  const Mask had_edges = hn::RebindMask(d, hn::Eq(kind, by_edges));
  const V enough = add(face, mul(hn::IfThenElse(had_edges, set(0.5f), set(1.0f)), p.axis_tolerance));
  const V threshold = hn::Min(enough, margin), square = mul(threshold, hn::Abs(threshold));
  Mask any_above = hn::FirstN(d, 0), stays = any_above;
  V best = threshold;
  VI best_cache = before;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const V gap = hn::Abs(sub(mul(p.t[i2], p.r[i1][j]), mul(p.t[i1], p.r[i2][j])));
      const V reach_a = add(mul(p.ha[i1], p.q[i2][j]), mul(p.ha[i2], p.q[i1][j]));
      const V reach_b = add(mul(p.hb[j1], p.q[i][j2]), mul(p.hb[j2], p.q[i][j1]));
      const V scaled = sub(sub(gap, add(reach_a, reach_b)), p.noise);
      const V squared = add(mul(p.r[i1][j], p.r[i1][j]), mul(p.r[i2][j], p.r[i2][j]));
      any_above = hn::Or(any_above, hn::Gt(sub(mul(scaled, hn::Abs(scaled)), mul(square, squared)), hn::Zero(d)));
      const V separation =
          hn::IfThenElse(hn::Gt(squared, hn::Zero(d)), hn::Div(scaled, hn::Sqrt(squared)), set(-3e38f));
      const VI cache = code(AxisCache::edges, static_cast<int>(i), static_cast<int>(j));
      const Mask is_cached = hn::RebindMask(d, hn::Eq(before, cache));
      stays = hn::Or(stays, hn::And(is_cached, hn::Gt(separation, margin)));
      const Mask better = hn::Gt(separation, best);
      best = hn::IfThenElse(better, separation, best);
      best_cache = hn::IfThenElse(hn::RebindMask(di, better), cache, best_cache);
    }
  }
  const Mask apart = hn::And(any_above, hn::Gt(best, margin));
  return {hn::Or(stays, apart), hn::IfThenElse(hn::RebindMask(di, stays), before, best_cache)};
}

std::uint32_t bits(Mask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < (width + 7) / 8; ++i) bits |= std::uint32_t{bytes[i]} << 8 * i;
  return bits;
}

}  // namespace

std::uint32_t separate_boxes(const BoxPairs& pairs, float dt, const BodyState& state, Pose* b_in_a, AxisCache* caches) {
  static_assert(sizeof(AxisCache) == sizeof(std::int32_t));
  const BodyBounds* const bounds = state.bounds.data();
  std::uint32_t indices[width];
  for (std::uint32_t i = 0; i < width; ++i) indices[i] = i;
  std::uint32_t all = 0;
  for (std::size_t first = 0; first < pairs.count; first += width) {
    const std::size_t used = std::min(width, pairs.count - first);
    const Lanes a{pairs.a + first, used}, b{pairs.b + first, used};
    const PoseLanes poses = relative(a, b, state);
    Lanes{indices, used}.store(b_in_a + first, 0, poses.position);
    Lanes{indices, used}.store(b_in_a + first, 1, poses.turn);
    const QuadV<V> shape_a = a.load(bounds, 3), shape_b = b.load(bounds, 3);
    const V margin = speculative_margin(a, b, state, shape_a.w, shape_b.w, dt);
    const PairLanes p = make_pairs(shape_a, shape_b, poses);
    const LargestFace face_a = largest_face(p.face_a, code(AxisCache::face_a, 0, 0), code(AxisCache::face_a, 1, 0),
                                            code(AxisCache::face_a, 2, 0));
    const LargestFace face_b = largest_face(p.face_b, code(AxisCache::face_b, 0, 0), code(AxisCache::face_b, 0, 1),
                                            code(AxisCache::face_b, 0, 2));
    const Mask by_a = hn::Gt(face_a.separation, margin), by_b = hn::Gt(face_b.separation, margin);
    Mask apart = hn::Or(by_a, by_b);
    HWY_ALIGN std::int32_t before[width] = {}, after[width];
    for (std::size_t i = 0; i < used; ++i) before[i] = std::bit_cast<std::int32_t>(caches[first + i]);
    VI cache = hn::IfThenElse(hn::RebindMask(di, by_a), face_a.cache, face_b.cache);
    if (!hn::AllTrue(d, apart)) {
      const V face = hn::Max(face_a.separation, face_b.separation);
      const Separated by_edges = separate_by_edges(p, margin, face, hn::Load(di, before));
      cache = hn::IfThenElse(hn::RebindMask(di, apart), cache, by_edges.caches);
      apart = hn::Or(apart, by_edges.lanes);
    }
    hn::Store(cache, di, after);
    const std::uint32_t separated = bits(hn::And(apart, hn::FirstN(d, used)));
    for (std::size_t i = 0; i < used; ++i)
      if (separated >> i & 1) caches[first + i] = std::bit_cast<AxisCache>(after[i]);
    all |= separated << first;
  }
  return all;
}

}  // namespace fathom::native
