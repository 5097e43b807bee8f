// Contact rows in vector lanes: the law (dynamics/contact-inl.hpp), and how it accesses a block.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_CONTACT_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_CONTACT_ROWS_INL
#undef FATHOM_CONTACT_ROWS_INL
#else
#define FATHOM_CONTACT_ROWS_INL
#endif

#include <hwy/highway.h>

#include "dynamics/softness.hpp"
#include "native/constraint_block-inl.hpp"
#include "native/lane_bodies-inl.hpp"
#include "native/lane_functions-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

#define FATHOM_LANE_FUNCTION HWY_INLINE
#define FATHOM_LANE_LAMBDA HWY_ATTR
#include "dynamics/contact-inl.hpp"
#include "dynamics/contact_prepare-inl.hpp"
#include "dynamics/rolling-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

/// What sweeps read is loaded where needed, so that bodies can stay in registers.
template <class D>
struct ContactRows {
  using V = hn::Vec<D>;
  const Block<D>& block;

  HWY_INLINE int end() const { return block.header().max_points; }
  /// Lanes with fewer points have zero masses there.
  HWY_INLINE static constexpr bool has(int) { return true; }
  HWY_INLINE ContactAxesOf<V> axes() const {
    return {block.get3(normal_x), block.get3(tangent_x), block.get3(arm_a_x), block.get3(arm_b_x)};
  }
  HWY_INLINE ContactResponse<V> response() const {
    return {block.get(k_nn), block.get(k_n1), block.get(k_n2), block.get(k_11), block.get(k_12), block.get(k_22)};
  }
  HWY_INLINE ContactFriction<V> friction() const {
    return {block.get(native::friction), block.get(patch_radius), block.get(slide_11),
            block.get(slide_12),         block.get(slide_22),     block.get(twist_mass)};
  }
  HWY_INLINE ContactPoint<V> point(int i) const {
    return {block.get(Block<D>::point(i, point_x)), block.get(Block<D>::point(i, point_y)),
            block.get(Block<D>::point(i, point_separation)), block.get(Block<D>::point(i, point_mass))};
  }
  HWY_INLINE V impulse(int i) const { return block.get(Block<D>::point(i, point_impulse)); }
  HWY_INLINE FrictionImpulse<V> friction_impulse() const {
    return {block.get(friction_impulse_1), block.get(friction_impulse_2), block.get(twist_impulse)};
  }
  HWY_INLINE bool may_bounce() const { return block.header().restitution; }
  HWY_INLINE V restitution() const { return block.get(BounceField::restitution); }
  HWY_INLINE V pull() const { return block.get(BounceField::pull); }

  HWY_INLINE void set_impulse(int i, V impulse) const { block.set(Block<D>::point(i, point_impulse), impulse); }
  HWY_INLINE void set_friction_impulse(const FrictionImpulse<V>& f) const {
    block.set(friction_impulse_1, f.slide_1), block.set(friction_impulse_2, f.slide_2);
    block.set(twist_impulse, f.twist);
  }
  HWY_INLINE void set_frame(const ContactAxesOf<V>& axes) const {
    block.set3(normal_x, axes.n), block.set3(tangent_x, axes.t1);
    block.set3(arm_a_x, axes.arm_a), block.set3(arm_b_x, axes.arm_b);
  }
  HWY_INLINE void set_response(const ContactResponse<V>& k) const {
    block.set(k_nn, k.nn), block.set(k_n1, k.n1), block.set(k_n2, k.n2);
    block.set(k_11, k.k11), block.set(k_12, k.k12), block.set(k_22, k.k22);
  }
  HWY_INLINE void set_friction(const ContactFriction<V>& f) const {
    block.set(native::friction, f.coefficient), block.set(patch_radius, f.patch_radius);
    block.set(slide_11, f.slide_11), block.set(slide_12, f.slide_12), block.set(slide_22, f.slide_22);
    block.set(twist_mass, f.twist_mass);
  }
  HWY_INLINE void set_point(int i, const ContactPoint<V>& p) const {
    block.set(Block<D>::point(i, point_x), p.x), block.set(Block<D>::point(i, point_y), p.y);
    block.set(Block<D>::point(i, point_separation), p.separation), block.set(Block<D>::point(i, point_mass), p.mass);
  }
};

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
