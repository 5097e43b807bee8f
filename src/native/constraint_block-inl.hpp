// A block of constraints in memory, and the frame its rows are written in.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_CONSTRAINT_BLOCK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_CONSTRAINT_BLOCK_INL
#undef FATHOM_CONSTRAINT_BLOCK_INL
#else
#define FATHOM_CONSTRAINT_BLOCK_INL
#endif

#include <hwy/highway.h>

#include "native/constraint_fields.hpp"
#include "native/lanes-inl.hpp"
#include "native/solver_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

/// Kept apart, see BlockArray.
enum BounceField : int {
  restitution,
  pull,  // relative acceleration along the normal
  bounce_field_count
};

template <class D>
struct Block {
  static constexpr std::size_t width = hn::MaxLanes(D());
  static constexpr std::size_t bytes_up_to(std::size_t field) {
    return (block_header_bytes + (block_indices + field) * width * 4 + 63) / 64 * 64;
  }
  using V = hn::Vec<D>;

  std::byte* base;
  float* bounces;  // null where nothing bounces

  HWY_INLINE BlockHeader& header() const { return *reinterpret_cast<BlockHeader*>(base); }
  HWY_INLINE std::uint32_t* a() const { return reinterpret_cast<std::uint32_t*>(base + block_header_bytes); }
  HWY_INLINE std::uint32_t* b() const { return a() + width; }
  HWY_INLINE std::uint32_t* manifold() const { return a() + 2 * width; }
  HWY_INLINE float* at(int field) const {
    return reinterpret_cast<float*>(base + block_header_bytes) +
           (block_indices + static_cast<std::size_t>(field)) * width;
  }
  HWY_INLINE V get(int field) const { return hn::Load(D(), at(field)); }
  HWY_INLINE void set(int field, V v) const { hn::Store(v, D(), at(field)); }
  HWY_INLINE V get(BounceField field) const { return hn::Load(D(), bounces + static_cast<std::size_t>(field) * width); }
  HWY_INLINE void set(BounceField field, V v) const {
    hn::Store(v, D(), bounces + static_cast<std::size_t>(field) * width);
  }
  HWY_INLINE Vec3V<V> get3(int field) const { return {get(field), get(field + 1), get(field + 2)}; }
  HWY_INLINE void set3(int field, Vec3V<V> v) const { set(field, v.x), set(field + 1, v.y), set(field + 2, v.z); }
  HWY_INLINE SymMat3V<V> get_inertia(int field) const {
    return {get(field), get(field + 1), get(field + 2), get(field + 3), get(field + 4), get(field + 5)};
  }
  HWY_INLINE void set_inertia(int field, const SymMat3V<V>& m) const {
    set(field, m.xx), set(field + 1, m.yy), set(field + 2, m.zz), set(field + 3, m.xy), set(field + 4, m.xz),
        set(field + 5, m.yz);
  }
  HWY_INLINE static int point(int p, PointField f) { return point_field(p, f); }
};

template <class D>
HWY_INLINE Block<D> block_at(BlockArray array, std::size_t i) {
  return {array.blocks + i * array.stride,
          array.bounces ? array.bounces + i * bounce_field_count * Block<D>::width : nullptr};
}

/// The frame of a manifold and its lever arms.
template <class V>
struct Frame {
  Vec3V<V> n, t1, t2, arm_a, arm_b;
  Vec3V<V> lever_a, lever_b;  // arm × n

  template <class D>
  HWY_INLINE void load(const Block<D>& block) {
    n = block.get3(normal_x);
    t1 = block.get3(tangent_x);
    t2 = cross(n, t1);
    arm_a = block.get3(arm_a_x);
    arm_b = block.get3(arm_b_x);
    lever_a = cross(arm_a, n);
    lever_b = cross(arm_b, n);
  }
};

/// (n·u, t1·ω, t2·ω) of velocities or of movements.
template <class V>
struct Twist3 {
  V n, t1, t2;
};

template <class V>
HWY_INLINE Twist3<V> normal_motion(const Frame<V>& f, Vec3V<V> linear_a, Vec3V<V> angular_a, Vec3V<V> linear_b,
                                   Vec3V<V> angular_b) {
  const V along = hn::Add(dot(f.n, linear_b - linear_a), hn::Sub(dot(f.lever_b, angular_b), dot(f.lever_a, angular_a)));
  const Vec3V<V> spin = angular_b - angular_a;
  return {along, dot(f.t1, spin), dot(f.t2, spin)};
}

template <class V>
HWY_INLINE V at_point(const Twist3<V>& w, V x, V y) {
  return hn::NegMulAdd(x, w.t2, hn::MulAdd(y, w.t1, w.n));
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
