// The bodies of a block's lanes: loading, applying impulses, storing.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_LANE_BODIES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_LANE_BODIES_INL
#undef FATHOM_LANE_BODIES_INL
#else
#define FATHOM_LANE_BODIES_INL
#endif

#include <hwy/highway.h>

#include <type_traits>

#include "native/constraint_block-inl.hpp"
#include "native/lane_functions-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

#define FATHOM_LANE_FUNCTION HWY_INLINE
#include "dynamics/inverse_inertia-inl.hpp"
#undef FATHOM_LANE_FUNCTION

/// Bodies of a block's lanes. Index `none` addresses the all-zero entry before the array's first, which is never
/// written.
template <class D>
struct LaneBodies {
  using V = hn::Vec<D>;
  static constexpr std::size_t width = hn::MaxLanes(D());

  float* lanes[width];
  Vec3V<V> linear, angular, moved, turned;
  V inverse_mass, inverse_inertia;

  HWY_INLINE void locate(SolverBody* bodies, const std::uint32_t* slots) {
    for (std::size_t i = 0; i < width; ++i)
      lanes[i] = reinterpret_cast<float*>(bodies + static_cast<std::ptrdiff_t>(static_cast<std::int32_t>(slots[i])));
  }
  HWY_INLINE QuadV<V> quad(std::size_t k) const {
    const float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = lanes[i] + 4 * k;
    return load_quads(D(), at);
  }
  HWY_INLINE void load_velocities() {
    linear = quad(0).xyz();
    angular = quad(1).xyz();
  }
  HWY_INLINE void load_movement() {
    const QuadV<V> m = quad(2), t = quad(3);
    moved = m.xyz(), inverse_mass = m.w;
    turned = t.xyz(), inverse_inertia = t.w;
  }
  HWY_INLINE void load_masses() { inverse_mass = quad(2).w, inverse_inertia = quad(3).w; }
  HWY_INLINE void clear() {
    const V zero = hn::Zero(D());
    linear = angular = moved = turned = {zero, zero, zero};
    inverse_mass = inverse_inertia = zero;
  }
  HWY_INLINE void store_velocities(std::size_t used) const {
    const V zero = hn::Zero(D());
    float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = lanes[i];
    store_quads(D(), {linear.x, linear.y, linear.z, zero}, at, used);
    for (std::size_t i = 0; i < width; ++i) at[i] = lanes[i] + 4;
    store_quads(D(), {angular.x, angular.y, angular.z, zero}, at, used);
  }
};

/// The two bodies of a block. What their kind allows to skip is decided at compile time.
template <class D, bool fixed_a, bool isotropic>
struct Bodies {
  using V = hn::Vec<D>;
  static constexpr bool only_pushes_b = fixed_a, all_isotropic = isotropic;
  LaneBodies<D> a, b;
  SymMat3V<V> inertia_of_a, inertia_of_b;

  HWY_INLINE void load(const Block<D>& block, SolverBody* all) {
    b.locate(all, block.b());
    b.load_velocities();
    b.load_movement();
    if (fixed_a && block.header().still_a) {
      a.clear();
    } else {
      a.locate(all, block.a());
      a.load_velocities();
      a.load_movement();
    }
    if constexpr (!isotropic) {
      inertia_of_b = block.get_inertia(inertia_b);
      if constexpr (!fixed_a) inertia_of_a = block.get_inertia(inertia_a);
    }
  }
  using Spin = std::conditional_t<isotropic, V, const SymMat3V<V>&>;
  HWY_INLINE InverseInertia<V, Spin> inverse_of_a() const {
    if constexpr (isotropic)
      return {a.inverse_mass, a.inverse_inertia};
    else
      return {a.inverse_mass, inertia_of_a};
  }
  HWY_INLINE InverseInertia<V, Spin> inverse_of_b() const {
    if constexpr (isotropic)
      return {b.inverse_mass, b.inverse_inertia};
    else
      return {b.inverse_mass, inertia_of_b};
  }
  HWY_INLINE void store(std::size_t used) const {
    b.store_velocities(used);
    if constexpr (!fixed_a) a.store_velocities(used);
  }
};

/// The two bodies of a block of any kind, for constraints that cost far more than `Bodies` could save: one function
/// instead of four. Such blocks always contain their bodies' inertias.
template <class D>
struct AnyBodies : Bodies<D, false, false> {
  bool fixed_a;

  HWY_INLINE void load(const Block<D>& block, SolverBody* all) {
    fixed_a = block.header().fixed_a;
    Bodies<D, false, false>::load(block, all);
  }
  HWY_INLINE void store(std::size_t used) const {
    this->b.store_velocities(used);
    if (!fixed_a) this->a.store_velocities(used);
  }
};

/// Stores the bodies' velocities. A constraint with a body that is not finite, or that would make one so, changes
/// neither body and drops its impulses, so that NaN does not spread between bodies: if some lanes' `sums` are not
/// finite, forget(bits) gets a bit for each of the other lanes.
template <class D, class B, class Forget>
HWY_INLINE void store_bodies(const Block<D>& block, B& bodies, hn::Vec<D> sums, const Forget& forget) {
  HWY_ALIGN float nowhere[8];
  const auto ok = hn::Eq(hn::Sub(sums, sums), hn::Zero(D()));
  if (HWY_UNLIKELY(!hn::AllTrue(D(), ok))) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(D(), ok, bits);
    for (std::size_t i = 0; i < hn::MaxLanes(D()); ++i) {
      if (bits[i / 8] >> i % 8 & 1) continue;
      bodies.b.lanes[i] = nowhere;
      if constexpr (!B::only_pushes_b) bodies.a.lanes[i] = nowhere;
    }
    forget(bits);
  }
  bodies.store(block.header().lanes);
}

/// Calls `act` with the block's properties as compile-time constants.
template <class D, class Act>
HWY_INLINE void by_bodies(const Block<D>& block, const Act& act) {
  const BlockHeader& h = block.header();
  if (h.isotropic) {
    if (h.fixed_a)
      act(std::true_type(), std::true_type());
    else
      act(std::false_type(), std::true_type());
  } else {
    if (h.fixed_a)
      act(std::true_type(), std::false_type());
    else
      act(std::false_type(), std::false_type());
  }
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
