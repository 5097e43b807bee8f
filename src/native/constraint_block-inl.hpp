// A block of constraints in memory.
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

/// Stored separately, see BlockArray.
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

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
