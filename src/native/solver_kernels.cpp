// Constraints in vector lanes: one constraint per lane. The constraints of a colour share no body. The law of contacts
// is in dynamics/contact-inl.hpp, those of joints beside it.
//
// Lanes are independent, and each lane's operations do not depend on the width, so results do not depend on the
// instruction set. If a block skips work that would add zero to all its lanes, only the sign of a zero can differ, and
// states are published without negative zeros.

#define HWY_DISABLE_PCLMUL_AES
// Only vectors with a length known at compile time: no SVE.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "native/solver_kernels.cpp"
#include "native/solver_kernels.hpp"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "dynamics/lift.hpp"
#include "dynamics/overload.hpp"
#include "native/ball_joints-inl.hpp"
#include "native/constraint_block-inl.hpp"
#include "native/contact_rows-inl.hpp"
#include "native/couplings-inl.hpp"
#include "native/generic_joints-inl.hpp"
#include "native/lane_bodies-inl.hpp"
#include "native/link_contacts.hpp"
#include "native/prefetch.hpp"
#include "native/prepare-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

/// `carried_slide` of lanes with a kinematic A. Out of line, so that it costs other blocks nothing.
template <class B, class V>
HWY_NOINLINE Vec3V<V> carried_slide_of_moving(const ContactAxesOf<V>& axes, const B& bodies, float lead) {
  const hn::DFromV<V> d;
  const auto& a = bodies.a;
  const auto moves =
      hn::Or(hn::Gt(dot(a.linear, a.linear), hn::Zero(d)), hn::Gt(dot(a.angular, a.angular), hn::Zero(d)));
  const Vec3V<V> sum = carried_slide<V>(bodies, axes, hn::Set(d, lead));
  return {hn::IfThenElseZero(moves, sum.x), hn::IfThenElseZero(moves, sum.y), hn::IfThenElseZero(moves, sum.z)};
}

/// `limited_to_ellipse`, out of line, so that it costs other blocks nothing; `otherwise` in lanes without a direction,
/// whose bits must not depend on their neighbours.
template <class D, class V = hn::Vec<D>>
HWY_NOINLINE FrictionImpulse<V> limited_by_direction(const Block<D>& block, V most, FrictionImpulse<V> wanted,
                                                     FrictionImpulse<V> otherwise) {
  const V g1 = block.get(grain_1), g2 = block.get(grain_2);
  const FrictionImpulse<V> limited = limited_to_ellipse(g1, g2, most, wanted);
  const auto has_grain = is_above(mul_add(g2 * g2, g1, g1), splat<V>(0.0f));
  return {select(has_grain, limited.slide_1, otherwise.slide_1), select(has_grain, limited.slide_2, otherwise.slide_2),
          wanted.twist};
}

/// Adds the slides of lanes on moving surfaces; they are zero in others.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Vec3V<V> with_surfaces(const Block<D>& block, Vec3V<V> slide) {
  if (HWY_UNLIKELY(block.header().surface)) return slide + block.get3(surface_x);
  return slide;
}

/// How a block's `ContactSurface`s change its friction where that may depend on direction.
template <class D, class Carry>
struct CarriedByDirection {
  using V = hn::Vec<D>;
  const Block<D>& block;
  const Carry& carry;

  HWY_INLINE Vec3V<V> operator()(Vec3V<V> slide) const { return carry(slide); }
  HWY_INLINE bool limits_by_direction() const { return block.header().by_direction; }
  HWY_INLINE FrictionImpulse<V> limited(V most, const FrictionImpulse<V>& wanted,
                                        const FrictionImpulse<V>& otherwise) const {
    return limited_by_direction(block, most, wanted, otherwise);
  }
};

/// `lead` (s): see `friction_lead`; `rare`: friction may depend on direction.
template <bool rare, class D, class B, class V = hn::Vec<D>>
HWY_INLINE V sweep_friction(const Block<D>& block, const ContactAxesOf<V>& axes, B& bodies, float lead) {
  ContactRows<D> rows{block};
  const auto carry = [&](Vec3V<V> slide) HWY_ATTR {
    if (B::only_pushes_b && HWY_UNLIKELY(!block.header().still_a))
      slide = slide + carried_slide_of_moving(axes, bodies, lead);
    return with_surfaces(block, slide);
  };
  if constexpr (rare)
    return sweep_friction(rows, axes, bodies, CarriedByDirection<D, decltype(carry)>{block, carry});
  else
    return sweep_friction(rows, axes, bodies, carry);
}

/// Zeroes the impulses of lanes whose bit is not set.
template <class D>
HWY_NOINLINE void forget_impulses(Block<D> block, const std::uint8_t* bits) {
  for (std::size_t i = 0; i < hn::MaxLanes(D()); ++i) {
    if (bits[i / 8] >> i % 8 & 1) continue;
    for (int p = 0; p < max_manifold_points; ++p) block.at(Block<D>::point(p, point_impulse))[i] = 0;
    for (const int field : {friction_impulse_1, friction_impulse_2, twist_impulse, step_impulse})
      block.at(field)[i] = 0;
  }
}

template <class D, class B>
HWY_INLINE void store_contact_bodies(const Block<D>& block, B& bodies, hn::Vec<D> sums) {
  store_bodies(block, bodies, sums, [&](const std::uint8_t* finite) HWY_ATTR { forget_impulses(block, finite); });
}

/// Parameters of a block's sweep; `own`: lanes have their own softness.
template <ContactPass pass, bool own, class D, class B, class V = hn::Vec<D>>
HWY_INLINE ContactStepOf<V> contact_step(const Block<D>& block, const B& bodies, const SweepParameters& p) {
  const D d;
  const Softness& s = B::only_pushes_b ? p.contacts.fixed : p.contacts.dynamic;
  ContactStepOf<V> step{hn::Set(d, p.inverse_substep), hn::Set(d, s.bias_rate),         hn::Set(d, s.mass_scale),
                        hn::Set(d, s.impulse_scale),   hn::Set(d, p.push_out_velocity), hn::Zero(d)};
  if constexpr (own)
    step.slop = hn::IfThenElseZero(hn::Gt(block.get(held_part), hn::Zero(d)), support_slop(block.get(patch_radius)));
  if constexpr (own && pass == ContactPass::soft) {
    step.bias_rate = block.get(own_bias_rate), step.mass_scale = block.get(own_mass_scale);
    step.impulse_scale = block.get(own_impulse_scale), step.push_out_velocity = block.get(own_push_out);
  } else if constexpr (pass == ContactPass::soft) {
    stiffen_uneven(bodies.a.inverse_mass, bodies.b.inverse_mass, step);
  }
  return step;
}

/// `rare`: lanes have their own softness, and may have a friction that depends on direction.
template <ContactPass pass, class D, bool fixed_a, bool isotropic, bool rare = false>
HWY_INLINE void sweep_block(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  Bodies<D, fixed_a, isotropic> bodies;
  bodies.load(block, all);
  ContactRows<D> rows{block};
  const auto axes = rows.axes();
  auto sums = hn::Zero(D());
  if constexpr (pass == ContactPass::iterate) sums = sweep_friction<rare>(block, axes, bodies, p.friction_lead);
  const auto approach = solve_points<pass, rare>(rows, axes, bodies, contact_step<pass, rare>(block, bodies, p));
  sums = pass == ContactPass::soft ? approach : hn::Add(sums, approach);
  if constexpr (pass == ContactPass::relax)
    sums = hn::Add(sums, sweep_friction<rare>(block, axes, bodies, p.friction_lead));
  if (pass == ContactPass::relax || p.ends_substep)
    block.set(step_impulse, hn::Add(block.get(step_impulse), total_impulse<hn::Vec<D>>(rows)));
  store_contact_bodies(block, bodies, sums);
}

/// Rolling resistance; `warm` applies the last step's impulses. Separate from the sweeps, because few blocks have it.
template <bool warm, class D, bool fixed_a, bool isotropic>
HWY_INLINE void roll_block(const Block<D>& block, SolverBody* all) {
  using V = hn::Vec<D>;
  Bodies<D, fixed_a, isotropic> bodies;
  bodies.load(block, all);
  const Vec3V<V> old = block.get3(roll_x);
  if constexpr (warm) {
    twist_apart(bodies, old);
    bodies.store(block.header().lanes);
  } else {
    const V load = total_impulse<V>(ContactRows<D>{block});
    const Vec3V<V> now = solve_rolling(bodies, block.get(roll_length), load, old);
    const V sum = hn::Add(hn::Add(now.x, now.y), now.z);
    const auto ok = hn::Eq(hn::Sub(sum, sum), hn::Zero(D()));
    block.set3(roll_x, {hn::IfThenElseZero(ok, now.x), hn::IfThenElseZero(ok, now.y), hn::IfThenElseZero(ok, now.z)});
    store_contact_bodies(block, bodies, sum);
  }
}

template <class D, bool fixed_a, bool isotropic>
HWY_INLINE void warm_start_block(const Block<D>& block, SolverBody* all) {
  Bodies<D, fixed_a, isotropic> bodies;
  bodies.load(block, all);
  warm_start_contact<hn::Vec<D>>(ContactRows<D>{block}, bodies);
  bodies.store(block.header().lanes);
}

template <class D, bool fixed_a, bool isotropic>
HWY_INLINE void bounce_block(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  Bodies<D, fixed_a, isotropic> bodies;
  bodies.load(block, all);
  ContactRows<D> rows{block};
  const auto carry = [&](Vec3V<hn::Vec<D>> slide) HWY_ATTR { return with_surfaces(block, slide); };
  const auto bounce = bounce_contact(rows, bodies, hn::Set(D(), p.substep), hn::Set(D(), p.restitution_threshold),
                                     CarriedByDirection<D, decltype(carry)>{block, carry});
  if (!bounce.any) return;
  p.bounced->store(true, std::memory_order_relaxed);
  block.set(step_impulse, hn::Add(block.get(step_impulse), bounce.impulse));
  store_contact_bodies(block, bodies, bounce.sum);
}

template <class D>
HWY_INLINE void prefetch_bodies(const Block<D>& block, const SolverBody* bodies) {
  const BlockHeader& h = block.header();
  for (std::size_t i = 0; i < h.lanes; ++i) prefetch_to_write(bodies + block.b()[i]);
  if (h.fixed_a) return;
  for (std::size_t i = 0; i < h.lanes; ++i) prefetch_to_write(bodies + block.a()[i]);
}

/// Calls act(block) for each block, prefetching the bodies of the next one, which another thread may have written.
template <class D, class Act>
HWY_INLINE void for_blocks(BlockArray blocks, std::size_t begin, std::size_t end, const SolverBody* bodies,
                           const Act& act) {
  const std::size_t fetch_end = blocks.shared ? std::max(end, blocks.fetch_end) : 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (i + 1 < fetch_end) prefetch_bodies(block_at<D>(blocks, i + 1), bodies);
    act(block_at<D>(blocks, i));
  }
}

template <bool warm, class D>
HWY_NOINLINE void roll(const Block<D>& block, SolverBody* all) {
  by_bodies(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { roll_block<warm, D, fixed_a.value, isotropic.value>(block, all); });
}

/// Out of line, because it would cost other sweeps registers.
template <ContactPass pass, class D>
HWY_NOINLINE void sweep_rare(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  by_bodies(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { sweep_block<pass, D, fixed_a.value, isotropic.value, true>(block, all, p); });
}

constexpr JointPass joint_pass(ContactPass pass) {
  return pass == ContactPass::soft    ? JointPass::soft
         : pass == ContactPass::relax ? JointPass::relax
                                      : JointPass::iterate;
}

/// Ball joints and couplings distinguish only a relax sweep from others: one instance serves all of those.
constexpr JointPass plain_pass(JointPass pass) { return pass == JointPass::relax ? JointPass::relax : JointPass::soft; }

template <JointPass pass, class D>
HWY_INLINE void sweep_joints_of_kind(const Block<D>& block, SolverBody* all, float h, bool ends_substep) {
  const ConstraintKind kind = block.header().kind;
  if (kind == ConstraintKind::ball_joint) return sweep_joints<plain_pass(pass)>(block, all, h, ends_substep);
  if (kind == ConstraintKind::coupling) return sweep_couplings<plain_pass(pass)>(block, all, h, ends_substep);
  sweep_generic_joints<pass>(block, all, h, ends_substep);
}

template <class D>
HWY_INLINE void warm_start_joints_of_kind(const Block<D>& block, SolverBody* all) {
  const ConstraintKind kind = block.header().kind;
  if (kind == ConstraintKind::ball_joint) return warm_start_joints(block, all);
  if (kind == ConstraintKind::coupling) return warm_start_couplings(block, all);
  warm_start_generic_joints(block, all);
}

template <class D>
HWY_INLINE void clear_joints_of_kind(const Block<D>& block) {
  const ConstraintKind kind = block.header().kind;
  if (kind == ConstraintKind::ball_joint) return clear_joints(block);
  if (kind == ConstraintKind::coupling) return clear_couplings(block);
  clear_generic_joints(block);
}

template <ContactPass pass>
bool ends_substep(const SweepParameters& p) {
  return pass == ContactPass::relax || p.ends_substep;
}

template <ContactPass pass, class D>
void sweep_only_couplings(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all,
                          const SweepParameters& p) {
  for (std::size_t i = begin; i < end; ++i) {
    const Block<D> block = block_at<D>(blocks, i);
    if (block.header().kind == ConstraintKind::coupling)
      sweep_couplings<plain_pass(joint_pass(pass))>(block, all, p.substep, ends_substep<pass>(p));
  }
}

template <ContactPass pass, class D>
void sweep(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all, const SweepParameters& p) {
  for_blocks<D>(blocks, begin, end, all, [&](Block<D> block) HWY_ATTR {
    if (HWY_UNLIKELY(block.header().kind != ConstraintKind::contact)) {
      const bool has_more = p.couplings_follow && block.header().kind == ConstraintKind::coupling;
      return sweep_joints_of_kind<joint_pass(pass)>(block, all, p.substep, ends_substep<pass>(p) && !has_more);
    }
    if (HWY_UNLIKELY(block.header().rare)) {
      sweep_rare<pass>(block, all, p);
      if (pass != ContactPass::soft && block.header().rolls) roll<false>(block, all);
      return;
    }
    by_bodies(block, [&](auto fixed_a, auto isotropic)
                         HWY_ATTR { sweep_block<pass, D, fixed_a.value, isotropic.value>(block, all, p); });
    if (pass != ContactPass::soft && block.header().rolls) roll<false>(block, all);
  });
}

template <class D>
void warm_start(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all) {
  for_blocks<D>(blocks, begin, end, all, [&](Block<D> block) HWY_ATTR {
    if (HWY_UNLIKELY(block.header().kind != ConstraintKind::contact)) return warm_start_joints_of_kind(block, all);
    by_bodies(block, [&](auto fixed_a, auto isotropic)
                         HWY_ATTR { warm_start_block<D, fixed_a.value, isotropic.value>(block, all); });
    if (block.header().rolls) roll<true>(block, all);
  });
}

template <class D>
void clear(BlockArray blocks, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    const Block<D> block = block_at<D>(blocks, i);
    const auto zero = hn::Zero(D());
    if (block.header().kind != ConstraintKind::contact) {
      clear_joints_of_kind(block);
      continue;
    }
    for (int p = 0; p < max_manifold_points; ++p) block.set(block.point(p, point_impulse), zero);
    for (const int field : {friction_impulse_1, friction_impulse_2, twist_impulse}) block.set(field, zero);
    if (block.header().rolls) block.set3(roll_x, {zero, zero, zero});
  }
}

template <class D>
void bounce(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all, const SweepParameters& p) {
  for_blocks<D>(blocks, begin, end, all, [&](Block<D> block) HWY_ATTR {
    if (!block.header().restitution) return;
    by_bodies(block, [&](auto fixed_a, auto isotropic)
                         HWY_ATTR { bounce_block<D, fixed_a.value, isotropic.value>(block, all, p); });
  });
}

template <class D>
std::size_t prepare(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
                    const Constrained& constrained, const BodiesView& view) {
  constexpr std::size_t width = Block<D>::width;
  std::size_t count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (blocks.scattered) {
      for (std::size_t k = 0; i + 2 < end && k < width && lanes[(i + 2) * width + k] != none; ++k)
        prefetch_to_read(constrained.contacts + index_of(lanes[(i + 2) * width + k]));
      if (i + 1 < end) prefetch_lanes<D>(lanes + (i + 1) * width, constrained, view);
    }
    const Block<D> block = block_at<D>(blocks, i);
    const ConstraintRef* const refs = lanes + i * width;
    if (HWY_LIKELY(kind_of(*refs) == ConstraintKind::contact))
      count += prepare_contacts(block, refs, constrained, view);
    else if (kind_of(*refs) == ConstraintKind::ball_joint)
      prepare_joints(block, refs, constrained, view);
    else if (kind_of(*refs) == ConstraintKind::coupling)
      prepare_couplings(block, refs, constrained, view);
    else
      prepare_generic_joints(block, refs, constrained, view);
  }
  return count;
}

template <class D>
HWY_INLINE void prefetch_impulses(const Block<D>& block, const Constrained& constrained) {
  if (block.header().kind != ConstraintKind::contact) return;
  for (std::size_t lane = 0; lane < block.header().lanes; ++lane) {
    const ContactManifold& m = constrained.manifolds[block.manifold()[lane]];
    prefetch_to_write(m.impulses);
    prefetch_to_write(&m.step_impulse);
  }
}

template <class D>
void store(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
           const Constrained& constrained, float overlap_kept, const LoadWatch& watch) {
  constexpr std::size_t ahead = 2;
  for (std::size_t i = begin; i < end; ++i) {
    if (blocks.scattered && i + ahead < end) prefetch_impulses(block_at<D>(blocks, i + ahead), constrained);
    const Block<D> block = block_at<D>(blocks, i);
    if (HWY_LIKELY(block.header().kind == ConstraintKind::contact))
      store_contacts(block, lanes + i * Block<D>::width, constrained, overlap_kept, watch);
    else if (block.header().kind == ConstraintKind::ball_joint)
      store_joints(block, constrained);
    else if (block.header().kind == ConstraintKind::coupling)
      store_couplings(block, constrained);
    else
      store_generic_joints(block, constrained);
  }
}

template <class D>
SolverKernels make_kernels(const char* name) {
  return {name,
          static_cast<int>(Block<D>::width),
          Block<D>::bytes_up_to(field_count),
          Block<D>::bytes_up_to(own_bias_rate),
          Block<D>::bytes_up_to(inertia_a),
          Block<D>::bytes_up_to(surface_field_count),
          Block<D>::bytes_up_to(generic_field_count),
          bounce_field_count * Block<D>::width,
          prepare<D>,
          warm_start<D>,
          clear<D>,
          sweep<ContactPass::soft, D>,
          sweep<ContactPass::relax, D>,
          bounce<D>,
          sweep<ContactPass::iterate, D>,
          sweep_only_couplings<ContactPass::soft, D>,
          sweep_only_couplings<ContactPass::relax, D>,
          sweep_only_couplings<ContactPass::iterate, D>,
          store<D>};
}

SolverKernels wide() { return make_kernels<hn::ScalableTag<float>>(hwy::TargetName(HWY_TARGET)); }
#if HWY_TARGET == HWY_STATIC_TARGET  // no other target uses it, and it would take a quarter of the build time
SolverKernels single() { return make_kernels<hn::CappedTag<float, 1>>("single"); }
#endif

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cstring>
#include <vector>

namespace fathom::native {

namespace {

// Widest first. Chosen here rather than by Highway's own dispatch, so that only its headers are needed.
std::vector<SolverKernels> runnable_kernels() {
  std::vector<SolverKernels> list;
#if HWY_TARGETS & HWY_AVX3
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    list.push_back(N_AVX3::wide());
#endif
  list.push_back(HWY_STATIC_DISPATCH(wide)());
  list.push_back(HWY_STATIC_DISPATCH(single)());
  return list;
}

const std::vector<SolverKernels>& all_kernels() {
  static const std::vector<SolverKernels> list = runnable_kernels();
  return list;
}

const SolverKernels* selected = nullptr;

}  // namespace

// From the table, because the solver's masses include inertia added by loads.
float LoadWatch::inverse_mass(std::uint32_t slot) const {
  return bodies[slot].inverse_mass > 0 ? (*table)[slot].inverse_mass : 0.0f;
}

// Half the thickness (m) of the thinner dynamic body.
float LoadWatch::thinner_half(std::uint32_t a, std::uint32_t b) const {
  float thinner = 1e30f;
  for (const std::uint32_t slot : {a, b})
    if (bodies[slot].inverse_mass > 0) thinner = min(thinner, half_thickness((*table)[slot]));
  return thinner;
}

bool LoadWatch::is_moving(std::uint32_t a, std::uint32_t b, Vec3 slide, float speed) const {
  return length_squared(bodies[b].linear - bodies[a].linear + slide) > speed * speed;
}

float LoadWatch::next_lift(float lift, std::uint32_t a, std::uint32_t b, float depth, float impulse, Vec3 slide) const {
  if (!overloads || !(impulse > 0)) return 0;
  if (is_moving(a, b, slide, pressed_speed)) return lift;
  const float load = impulse * (inverse_mass(a) + inverse_mass(b)) / unit;
  return fathom::next_lift(lift, depth, load, thinner_half(a, b), dt);
}

void LoadWatch::look_at(std::uint32_t a, std::uint32_t b, float impulse, Vec3 slide, bool is_linked) const {
  const float inverse_a = inverse_mass(a), inverse_b = inverse_mass(b), sum = inverse_a + inverse_b;
  const float thinner = thinner_half(a, b);
  const float stiffer = inverse_a > 0 && inverse_b > 0 ? stiffness : fixed_stiffness_ratio * stiffness;
  const float swept = sweep_load(thinner, stiffer), most = is_linked ? min(pressing_load, swept) : swept;
  if (!(impulse * sum > most * unit) || is_moving(a, b, slide, loaded_speed)) return;
  const auto gained = [this](std::uint32_t slot, float inverse) {
    const Vec3 change = bodies[slot].linear - before[slot].linear;
    return inverse > 0 ? length(change) / bodies[slot].inverse_mass : 0.0f;
  };
  const float load = lasting_load(impulse, gained(a, inverse_a), gained(b, inverse_b)) * sum / unit;
  const float ratio = load / (is_linked ? most : inertia_load(thinner, stiffer));
  const auto wanted = [&](std::uint32_t slot, float inverse) {
    float of_structure = slot < heaviest.size() ? heaviest[slot] : 0.0f;
    if (link_contacts && !(of_structure > 0) && link_contacts->stands(slot))
      of_structure = 1 / (inverse_a > 0 ? min(inverse_a, inverse_b) : inverse_b);
    return wanted_inertia(ratio, inverse, sum, of_structure);
  };
  if (inverse_a > 0) overloads->note(a, wanted(a, inverse_a));
  if (inverse_b > 0) overloads->note(b, wanted(b, inverse_b));
}

const SolverKernels& wide_kernels() { return selected ? *selected : all_kernels().front(); }
const SolverKernels& single_kernels() { return all_kernels().back(); }

bool select_kernels(const char* name) {
  selected = nullptr;
  if (!name) return true;
  for (const SolverKernels& kernels : all_kernels())
    if (std::strcmp(kernels.name, name) == 0) selected = &kernels;
  return selected != nullptr;
}

}  // namespace fathom::native
#endif
