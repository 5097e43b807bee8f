// Contact constraints in vector lanes. One manifold is one lane; a colour's lanes share no body.
//
// A manifold's points share one normal, so their rows are written about one reference point c, the centroid of
// the points, in the frame (t1, t2, n): with u the relative velocity of the bodies at c and ω the relative
// angular velocity, a point at (x, y) in that frame approaches with
//     vn = u·n + y (ω·t1) − x (ω·t2),
// two floats a point instead of two anchors. Point impulses act on the three numbers (u·n, ω·t1, ω·t2) through
// a symmetric 3×3 matrix K, and only their sum (P along n, torques T1, T2) is applied to the bodies. The same
// rows applied to the bodies' movement since the step began give the separation in later substeps
// (first order in the rotation of one step; for a sphere exact, since its contact stays under the centre).
//
// Order within a sweep (Box2D v3, Box3D `contact_solver.c`): the soft sweep solves penetration alone; the relax
// sweep first friction, one 2-vector in a cone and one twist about n, then the points without bias.
//
// Lanes are independent and each goes through the same operations whatever the width, so results do not
// depend on the instruction set. Where a block skips work that would add zero to all its lanes, only the sign of
// a zero can differ, and states are published without negative zeros.

#define HWY_DISABLE_PCLMUL_AES
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "native/solver_kernels.cpp"
#include "native/solver_kernels.hpp"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "native/lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

enum Field : int {
  normal_x,
  normal_y,
  normal_z,
  tangent_x,
  tangent_y,
  tangent_z,
  arm_a_x,
  arm_a_y,
  arm_a_z,
  arm_b_x,
  arm_b_y,
  arm_b_z,
  k_nn,
  k_n1,
  k_n2,
  k_11,
  k_12,
  k_22,
  points,  // five a point: x, y, separation, effective mass, impulse
  friction = points + 5 * max_manifold_points,
  friction_impulse_1,
  friction_impulse_2,
  twist_impulse,
  slide_11,
  slide_12,
  slide_22,  // inverse of the tangential 2×2 matrix
  twist_mass,
  patch_radius,
  inertia_a,  // six each: xx yy zz xy xz yz
  inertia_b = inertia_a + 6,
  field_count = inertia_b + 6
};
/// Kept apart, see BlockArray.
enum BounceField : int {
  restitution,
  approach,                               // normal velocity before the step, one a point
  peak = approach + max_manifold_points,  // largest impulse of the step, one a point
  bounce_field_count = peak + max_manifold_points
};
enum PointField : int { point_x, point_y, point_separation, point_mass, point_impulse, point_fields };

constexpr std::size_t body_floats = sizeof(SolverBody) / sizeof(float);

template <class D>
struct Block {
  static constexpr std::size_t width = hn::MaxLanes(D());
  static constexpr std::size_t header_bytes = 64;
  static constexpr std::size_t bytes_up_to(std::size_t field) {
    return (header_bytes + (3 + field) * width * 4 + 63) / 64 * 64;
  }
  using V = hn::Vec<D>;

  std::byte* base;
  float* bounces;  // null where nothing bounces

  HWY_INLINE BlockHeader& header() const { return *reinterpret_cast<BlockHeader*>(base); }
  HWY_INLINE std::uint32_t* a() const { return reinterpret_cast<std::uint32_t*>(base + header_bytes); }
  HWY_INLINE std::uint32_t* b() const { return a() + width; }
  HWY_INLINE std::uint32_t* manifold() const { return a() + 2 * width; }
  HWY_INLINE float* at(int field) const {
    return reinterpret_cast<float*>(base + header_bytes) + (3 + static_cast<std::size_t>(field)) * width;
  }
  HWY_INLINE V get(int field) const { return hn::Load(D(), at(field)); }
  HWY_INLINE void set(int field, V v) const { hn::Store(v, D(), at(field)); }
  HWY_INLINE V get(BounceField field, int i = 0) const {
    return hn::Load(D(), bounces + static_cast<std::size_t>(field + i) * width);
  }
  HWY_INLINE void set(BounceField field, int i, V v) const {
    hn::Store(v, D(), bounces + static_cast<std::size_t>(field + i) * width);
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
  HWY_INLINE static int point(int p, PointField f) { return points + p * point_fields + f; }
};

/// Bodies of a block's lanes. Index `none` addresses the entry before the array's first, which is all zeros
/// and never written.
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

/// The two bodies of a block with what their kind allows to skip decided at compile time.
template <class D, bool fixed_a, bool isotropic>
struct Bodies {
  using V = hn::Vec<D>;
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
  HWY_INLINE Vec3V<V> turn_a(Vec3V<V> torque) const {
    if constexpr (isotropic)
      return scale(a.inverse_inertia, torque);
    else
      return inertia_of_a * torque;
  }
  HWY_INLINE Vec3V<V> turn_b(Vec3V<V> torque) const {
    if constexpr (isotropic)
      return scale(b.inverse_inertia, torque);
    else
      return inertia_of_b * torque;
  }
  /// Impulse and angular impulses about each centre: plus on B, minus on A.
  HWY_INLINE void push(Vec3V<V> impulse, Vec3V<V> angular_a, Vec3V<V> angular_b) {
    b.linear = mul_add(b.linear, b.inverse_mass, impulse);
    b.angular = b.angular + turn_b(angular_b);
    if constexpr (!fixed_a) {
      a.linear = mul_sub(a.linear, a.inverse_mass, impulse);
      a.angular = a.angular - turn_a(angular_a);
    }
  }
  /// An angular impulse: plus on B, minus on A.
  HWY_INLINE void twist(Vec3V<V> torque) {
    b.angular = b.angular + turn_b(torque);
    if constexpr (!fixed_a) a.angular = a.angular - turn_a(torque);
  }
  HWY_INLINE void store(std::size_t used) const {
    b.store_velocities(used);
    if constexpr (!fixed_a) a.store_velocities(used);
  }
};

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

/// Accumulates the points' impulses of one sweep and carries their effect on the relative motion.
template <class D>
struct NormalRows {
  using V = hn::Vec<D>;
  V nn, n1, n2, k11, k12, k22;
  Twist3<V> motion, sum;

  HWY_INLINE NormalRows(const Block<D>& block, const Twist3<V>& velocity) : motion(velocity) {
    nn = block.get(k_nn), n1 = block.get(k_n1), n2 = block.get(k_n2);
    k11 = block.get(k_11), k12 = block.get(k_12), k22 = block.get(k_22);
    sum.n = sum.t1 = sum.t2 = hn::Zero(D());
  }
  HWY_INLINE void add(V impulse, V x, V y) {
    const V torque_1 = hn::Mul(y, impulse), torque_2 = hn::Neg(hn::Mul(x, impulse));
    sum.n = hn::Add(sum.n, impulse);
    sum.t1 = hn::Add(sum.t1, torque_1);
    sum.t2 = hn::Add(sum.t2, torque_2);
    motion.n = hn::MulAdd(n2, torque_2, hn::MulAdd(n1, torque_1, hn::MulAdd(nn, impulse, motion.n)));
    motion.t1 = hn::MulAdd(k12, torque_2, hn::MulAdd(k11, torque_1, hn::MulAdd(n1, impulse, motion.t1)));
    motion.t2 = hn::MulAdd(k22, torque_2, hn::MulAdd(k12, torque_1, hn::MulAdd(n2, impulse, motion.t2)));
  }
};

template <class B, class V>
HWY_INLINE void push_normal(B& bodies, const Frame<V>& f, const Twist3<V>& sum) {
  const Vec3V<V> torque = mul_add(scale(sum.t1, f.t1), sum.t2, f.t2);
  bodies.push(scale(sum.n, f.n), mul_add(torque, sum.n, f.lever_a), mul_add(torque, sum.n, f.lever_b));
}

template <class B, class V>
HWY_INLINE void push_tangential(B& bodies, const Frame<V>& f, V impulse_1, V impulse_2, V twist) {
  const Vec3V<V> impulse = mul_add(scale(impulse_1, f.t1), impulse_2, f.t2);
  const Vec3V<V> torque = scale(twist, f.n);
  bodies.push(impulse, torque + cross(f.arm_a, impulse), torque + cross(f.arm_b, impulse));
}

template <class D>
HWY_INLINE hn::Vec<D> total_impulse(const Block<D>& block, int count) {
  auto sum = block.get(Block<D>::point(0, point_impulse));
  for (int p = 1; p < count; ++p) sum = hn::Add(sum, block.get(Block<D>::point(p, point_impulse)));
  return sum;
}

/// Twist about the normal, then sliding, both limited by µ times the points' impulses (Coulomb's cone).
template <class D, class B>
HWY_INLINE void solve_friction(const Block<D>& block, const Frame<hn::Vec<D>>& f, B& bodies) {
  using V = hn::Vec<D>;
  const D d;
  const V limit = hn::Mul(block.get(friction), total_impulse(block, block.header().max_points));

  const V twist_limit = hn::Mul(limit, block.get(patch_radius));
  const V twist_speed = dot(f.n, bodies.b.angular - bodies.a.angular);
  const V old_twist = block.get(twist_impulse);
  const V wanted_twist = hn::NegMulAdd(block.get(twist_mass), twist_speed, old_twist);
  const V new_twist = hn::Max(hn::Neg(twist_limit), hn::Min(wanted_twist, twist_limit));
  block.set(twist_impulse, new_twist);
  const V twist = hn::Sub(new_twist, old_twist);
  // The twist's own effect on sliding at c, where c is not above a centre, is left to the next sweep's slide
  // only through the bodies' velocities, which are updated first.
  bodies.twist(scale(twist, f.n));

  const Vec3V<V> slide =
      (bodies.b.linear + cross(bodies.b.angular, f.arm_b)) - (bodies.a.linear + cross(bodies.a.angular, f.arm_a));
  const V v1 = dot(f.t1, slide), v2 = dot(f.t2, slide);
  const V old_1 = block.get(friction_impulse_1), old_2 = block.get(friction_impulse_2);
  const V m11 = block.get(slide_11), m12 = block.get(slide_12), m22 = block.get(slide_22);
  const V wanted_1 = hn::Sub(old_1, hn::MulAdd(m11, v1, hn::Mul(m12, v2)));
  const V wanted_2 = hn::Sub(old_2, hn::MulAdd(m12, v1, hn::Mul(m22, v2)));
  const V size_squared = hn::MulAdd(wanted_1, wanted_1, hn::Mul(wanted_2, wanted_2));
  const auto slips = hn::Gt(size_squared, hn::Mul(limit, limit));
  const V size = hn::Sqrt(hn::Max(size_squared, hn::Set(d, 1e-30f)));
  const V shrink = hn::IfThenElse(slips, hn::Div(limit, size), hn::Set(d, 1.0f));
  const V new_1 = hn::Mul(wanted_1, shrink), new_2 = hn::Mul(wanted_2, shrink);
  block.set(friction_impulse_1, new_1);
  block.set(friction_impulse_2, new_2);
  push_tangential(bodies, f, hn::Sub(new_1, old_1), hn::Sub(new_2, old_2), hn::Zero(d));
}

enum class Pass { soft, relax, iterate };

/// One sweep over the points: soft with bias and push-out, relax without, or `iterate` with a plain velocity bias.
template <Pass pass, class D, class B>
HWY_INLINE void solve_points(const Block<D>& block, const Frame<hn::Vec<D>>& f, B& bodies, const SweepParameters& p,
                             const Softness& softness) {
  using V = hn::Vec<D>;
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const V inverse_substep = hn::Set(d, p.inverse_substep);
  const V bias_rate = hn::Set(d, softness.bias_rate), push_out = hn::Set(d, -p.push_out_velocity);
  const V mass_scale = hn::Set(d, softness.mass_scale), impulse_scale = hn::Set(d, softness.impulse_scale);

  NormalRows<D> rows(block, normal_motion(f, bodies.a.linear, bodies.a.angular, bodies.b.linear, bodies.b.angular));
  const Twist3<V> moved = normal_motion(f, bodies.a.moved, bodies.a.turned, bodies.b.moved, bodies.b.turned);
  const int count = block.header().max_points;
  for (int i = 0; i < count; ++i) {
    const V x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
    const V mass = block.get(Block<D>::point(i, point_mass)), old = block.get(Block<D>::point(i, point_impulse));
    const V separation = hn::Add(block.get(Block<D>::point(i, point_separation)), at_point(moved, x, y));
    const V speed = at_point(rows.motion, x, y);
    const auto apart = hn::Gt(separation, zero);
    // A point still apart may close its gap within the substep and no more: a speculative contact.
    const V gap_speed = hn::Mul(separation, inverse_substep);
    V wanted;
    if constexpr (pass == Pass::soft) {
      const V bias = hn::IfThenElse(apart, gap_speed, hn::Max(hn::Mul(bias_rate, separation), push_out));
      const V scaled = hn::Mul(mass, hn::IfThenElse(apart, one, mass_scale));
      const V kept = hn::NegMulAdd(hn::IfThenZeroElse(apart, impulse_scale), old, old);
      wanted = hn::NegMulAdd(scaled, hn::Add(speed, bias), kept);
    } else if constexpr (pass == Pass::relax) {
      wanted = hn::NegMulAdd(mass, hn::Add(speed, hn::IfThenElseZero(apart, gap_speed)), old);
    } else {
      const V bias = hn::IfThenElse(apart, gap_speed, hn::Max(hn::Mul(bias_rate, separation), push_out));
      wanted = hn::NegMulAdd(mass, hn::Add(speed, bias), old);
    }
    const V impulse = hn::Max(wanted, zero);
    block.set(Block<D>::point(i, point_impulse), impulse);
    rows.add(hn::Sub(impulse, old), x, y);
    if (block.header().restitution) block.set(peak, i, hn::Max(block.get(peak, i), impulse));
  }
  push_normal(bodies, f, rows.sum);
}

template <Pass pass, class D, bool fixed_a, bool isotropic>
HWY_INLINE void sweep_block(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  Bodies<D, fixed_a, isotropic> bodies;
  Frame<hn::Vec<D>> frame;
  bodies.load(block, all);
  frame.load(block);
  if constexpr (pass != Pass::soft) solve_friction(block, frame, bodies);
  solve_points<pass>(block, frame, bodies, p, fixed_a ? p.fixed : p.dynamic);
  bodies.store(block.header().lanes);
}

/// Impulses of the last step act again at once (Catto, "Iterative Dynamics with Temporal Coherence", 2005).
template <class D, bool fixed_a, bool isotropic>
HWY_INLINE void warm_start_block(const Block<D>& block, SolverBody* all) {
  using V = hn::Vec<D>;
  Bodies<D, fixed_a, isotropic> bodies;
  Frame<V> f;
  bodies.load(block, all);
  f.load(block);
  Twist3<V> sum{hn::Zero(D()), hn::Zero(D()), hn::Zero(D())};
  for (int i = 0; i < block.header().max_points; ++i) {
    const V impulse = block.get(Block<D>::point(i, point_impulse));
    sum.n = hn::Add(sum.n, impulse);
    sum.t1 = hn::MulAdd(block.get(Block<D>::point(i, point_y)), impulse, sum.t1);
    sum.t2 = hn::NegMulAdd(block.get(Block<D>::point(i, point_x)), impulse, sum.t2);
  }
  push_normal(bodies, f, sum);
  push_tangential(bodies, f, block.get(friction_impulse_1), block.get(friction_impulse_2), block.get(twist_impulse));
  bodies.store(block.header().lanes);
}

/// Points that approached fast and were hit leave with e times that speed (Newton's law, applied last).
template <class D, bool fixed_a, bool isotropic>
HWY_INLINE void restitute_block(const Block<D>& block, SolverBody* all, const SweepParameters& p) {
  using V = hn::Vec<D>;
  const D d;
  Bodies<D, fixed_a, isotropic> bodies;
  Frame<V> f;
  bodies.load(block, all);
  f.load(block);
  NormalRows<D> rows(block, normal_motion(f, bodies.a.linear, bodies.a.angular, bodies.b.linear, bodies.b.angular));
  const V e = block.get(restitution), threshold = hn::Set(d, -p.restitution_threshold);
  for (int i = 0; i < block.header().max_points; ++i) {
    const V x = block.get(Block<D>::point(i, point_x)), y = block.get(Block<D>::point(i, point_y));
    const V old = block.get(Block<D>::point(i, point_impulse)), before = block.get(approach, i);
    const auto bounces = hn::And(hn::Lt(before, threshold), hn::Gt(block.get(peak, i), hn::Zero(d)));
    const V speed = hn::MulAdd(e, before, at_point(rows.motion, x, y));
    const V wanted = hn::Max(hn::NegMulAdd(block.get(Block<D>::point(i, point_mass)), speed, old), hn::Zero(d));
    const V impulse = hn::IfThenElse(hn::And(bounces, hn::Gt(e, hn::Zero(d))), wanted, old);
    block.set(Block<D>::point(i, point_impulse), impulse);
    rows.add(hn::Sub(impulse, old), x, y);
  }
  push_normal(bodies, f, rows.sum);
  bodies.store(block.header().lanes);
}

/// Calls `act` with the block's kind as compile-time constants.
template <class D, class Act>
HWY_INLINE void by_kind(const Block<D>& block, const Act& act) {
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

template <class D>
HWY_INLINE Block<D> block_at(BlockArray array, std::size_t i) {
  return {array.blocks + i * array.stride,
          array.bounces ? array.bounces + i * bounce_field_count * Block<D>::width : nullptr};
}

template <class D, class Act>
HWY_INLINE void for_blocks(BlockArray blocks, std::size_t begin, std::size_t end, const Act& act) {
  for (std::size_t i = begin; i < end; ++i) act(block_at<D>(blocks, i));
}

template <Pass pass, class D>
void sweep(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all, const SweepParameters& p) {
  for_blocks<D>(blocks, begin, end, [&](Block<D> block) HWY_ATTR {
    by_kind(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { sweep_block<pass, D, fixed_a.value, isotropic.value>(block, all, p); });
  });
}

template <class D>
void warm_start(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all) {
  for_blocks<D>(blocks, begin, end, [&](Block<D> block) HWY_ATTR {
    by_kind(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { warm_start_block<D, fixed_a.value, isotropic.value>(block, all); });
  });
}

template <class D>
void restitute(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* all, const SweepParameters& p) {
  for_blocks<D>(blocks, begin, end, [&](Block<D> block) HWY_ATTR {
    if (!block.header().restitution) return;
    by_kind(block, [&](auto fixed_a, auto isotropic)
                       HWY_ATTR { restitute_block<D, fixed_a.value, isotropic.value>(block, all, p); });
  });
}

// --- prepare -------------------------------------------------------------------------------------------------

alignas(64) constexpr float zeros[64] = {};

/// Reads the manifolds of a block's lanes.
template <class D>
struct LaneContacts {
  using V = hn::Vec<D>;
  static constexpr std::size_t width = hn::MaxLanes(D());
  const float* manifold[width];
  const float* pose_a[width];
  const float* pose_b[width];
  const float* body_a[width];
  const float* body_b[width];
  const float* inertia_of_a[width];
  const float* inertia_of_b[width];
  HWY_ALIGN float counts[width];

  HWY_INLINE QuadV<V> quad(const float* const* objects, std::size_t offset) const {
    const float* at[width];
    for (std::size_t i = 0; i < width; ++i) at[i] = objects[i] + offset;
    return load_quads(D(), at);
  }
};

// An anisotropic body that can be pushed has a mass but no single inverse inertia.
HWY_INLINE bool is_anisotropic(const SolverBody& body) { return body.inverse_mass > 0 && body.inverse_inertia == 0; }

template <class D>
HWY_INLINE std::size_t locate_lanes(const Block<D>& block, const std::uint32_t* contact_indices,
                                    const Constrained& constrained, const BodiesView& view, LaneContacts<D>& lanes) {
  BlockHeader h;
  h.fixed_a = h.still_a = h.isotropic = true;
  std::size_t points_of_block = 0;
  for (std::size_t i = 0; i < Block<D>::width; ++i) {
    const std::uint32_t index = contact_indices[i];
    if (index == none) {
      block.manifold()[i] = none;
      block.a()[i] = block.b()[i] = none;
      lanes.manifold[i] = lanes.pose_a[i] = lanes.pose_b[i] = lanes.body_a[i] = lanes.body_b[i] = zeros;
      lanes.inertia_of_a[i] = lanes.inertia_of_b[i] = zeros;
      lanes.counts[i] = 0;
      continue;
    }
    const Contact& c = constrained.contacts[index];
    const ContactManifold& m = constrained.manifolds[c.manifold];
    const SolverBody &a = view.bodies[c.a], &b = view.bodies[c.b];
    block.manifold()[i] = c.manifold;
    block.a()[i] = c.a;
    block.b()[i] = c.b;
    lanes.manifold[i] = reinterpret_cast<const float*>(&m);
    lanes.pose_a[i] = reinterpret_cast<const float*>(view.poses + c.a);
    lanes.pose_b[i] = reinterpret_cast<const float*>(view.poses + c.b);
    lanes.body_a[i] = reinterpret_cast<const float*>(&a);
    lanes.body_b[i] = reinterpret_cast<const float*>(&b);
    lanes.inertia_of_a[i] = is_anisotropic(a) ? reinterpret_cast<const float*>(view.inertias + c.a) : zeros;
    lanes.inertia_of_b[i] = is_anisotropic(b) ? reinterpret_cast<const float*>(view.inertias + c.b) : zeros;
    lanes.counts[i] = m.points[3].other;
    h.lanes = static_cast<std::uint8_t>(i + 1);
    const int count = m.point_count();
    points_of_block += static_cast<std::size_t>(count);
    if (count > h.max_points) h.max_points = static_cast<std::uint8_t>(count);
    h.fixed_a = h.fixed_a && c.fixed_a;
    h.still_a = h.still_a && c.fixed_a && length_squared(a.linear) == 0 && length_squared(a.angular) == 0;
    h.isotropic = h.isotropic && !is_anisotropic(a) && !is_anisotropic(b);
    h.restitution = h.restitution || m.restitution > 0;
  }
  block.header() = h;
  return points_of_block;
}

template <class D>
HWY_INLINE SymMat3V<hn::Vec<D>> load_inertia(const LaneContacts<D>& lanes, const float* const* objects,
                                             hn::Vec<D> isotropic) {
  const auto q0 = lanes.quad(objects, 0), q1 = lanes.quad(objects, 4);
  return {hn::Add(q0.x, isotropic), hn::Add(q0.y, isotropic), hn::Add(q0.z, isotropic), q0.w, q1.x, q1.y};
}

/// Rows of one block: frame, arms, effective masses, impulses to start from. Returns the number of its points.
template <class D>
HWY_INLINE std::size_t prepare_block(const Block<D>& block, const std::uint32_t* indices,
                                     const Constrained& constrained, const BodiesView& view) {
  using V = hn::Vec<D>;
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  LaneContacts<D> lanes;
  const std::size_t point_count = locate_lanes(block, indices, constrained, view, lanes);

  // World frame of the manifold, relative to A's centre.
  const QuadV<V> q_a = lanes.quad(lanes.pose_a, 4), q_b = lanes.quad(lanes.pose_b, 4);
  const Mat3V<V> rot_a = to_matrix(d, q_a.x, q_a.y, q_a.z, q_a.w), rot_b = to_matrix(d, q_b.x, q_b.y, q_b.z, q_b.w);
  const Vec3V<V> between = lanes.quad(lanes.pose_b, 0).xyz() - lanes.quad(lanes.pose_a, 0).xyz();
  const QuadV<V> normal = lanes.quad(lanes.manifold, 0), tangent = lanes.quad(lanes.manifold, 4),
                 impulses = lanes.quad(lanes.manifold, 8), frictions = lanes.quad(lanes.manifold, 12);
  Frame<V> f;
  f.n = rot_a * normal.xyz();
  f.t1 = rot_a * tangent.xyz();
  f.t2 = cross(f.n, f.t1);

  const V count = hn::Load(d, lanes.counts);
  Vec3V<V> middle[max_manifold_points];
  Vec3V<V> sum{zero, zero, zero};
  const int max_points = block.header().max_points;
  for (int i = 0; i < max_points; ++i) {
    const QuadV<V> anchor_a = lanes.quad(lanes.manifold, 16 + 8 * static_cast<std::size_t>(i)),
                   anchor_b = lanes.quad(lanes.manifold, 20 + 8 * static_cast<std::size_t>(i));
    const Vec3V<V> on_a = rot_a * anchor_a.xyz();
    const Vec3V<V> on_b = between + rot_b * anchor_b.xyz();
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    block.set(Block<D>::point(i, point_separation), dot(on_b - on_a, f.n));
    const V impulse = i == 0 ? impulses.x : i == 1 ? impulses.y : i == 2 ? impulses.z : impulses.w;
    block.set(Block<D>::point(i, point_impulse), hn::IfThenElseZero(used, impulse));
    middle[i] = scale(hn::Set(d, 0.5f), on_a + on_b);
    const V weight = hn::IfThenElseZero(used, one);
    sum = mul_add(sum, weight, middle[i]);
  }
  const V share = hn::Div(one, hn::Max(count, one));
  f.arm_a = scale(share, sum);
  f.arm_b = f.arm_a - between;
  f.lever_a = cross(f.arm_a, f.n);
  f.lever_b = cross(f.arm_b, f.n);

  const QuadV<V> a2 = lanes.quad(lanes.body_a, 8), a3 = lanes.quad(lanes.body_a, 12);
  const QuadV<V> b2 = lanes.quad(lanes.body_b, 8), b3 = lanes.quad(lanes.body_b, 12);
  const SymMat3V<V> i_a = load_inertia<D>(lanes, lanes.inertia_of_a, a3.w),
                    i_b = load_inertia<D>(lanes, lanes.inertia_of_b, b3.w);
  const V mass_sum = hn::Add(a2.w, b2.w);

  // K over (n, t1, t2).
  const Vec3V<V> la = i_a * f.lever_a, lb = i_b * f.lever_b;
  const Vec3V<V> turn_1 = (i_a * f.t1) + (i_b * f.t1), turn_2 = (i_a * f.t2) + (i_b * f.t2);
  const V nn = hn::Add(mass_sum, hn::Add(dot(f.lever_a, la), dot(f.lever_b, lb)));
  const Vec3V<V> lever_turn = la + lb;
  const V n1 = dot(f.t1, lever_turn), n2 = dot(f.t2, lever_turn);
  const V k11 = dot(f.t1, turn_1), k12 = dot(f.t2, turn_1), k22 = dot(f.t2, turn_2);

  V radius_sum = zero;
  for (int i = 0; i < max_points; ++i) {
    const auto used = hn::Gt(count, hn::Set(d, static_cast<float>(i)));
    const Vec3V<V> from_c = middle[i] - f.arm_a;
    const V x = hn::IfThenElseZero(used, dot(from_c, f.t1)), y = hn::IfThenElseZero(used, dot(from_c, f.t2));
    const V h_n = hn::NegMulAdd(x, n2, hn::MulAdd(y, n1, nn));
    const V h_1 = hn::NegMulAdd(x, k12, hn::MulAdd(y, k11, n1));
    const V h_2 = hn::NegMulAdd(x, k22, hn::MulAdd(y, k12, n2));
    const V k = hn::NegMulAdd(x, h_2, hn::MulAdd(y, h_1, h_n));
    const auto solvable = hn::And(used, hn::Gt(k, zero));
    block.set(Block<D>::point(i, point_x), x);
    block.set(Block<D>::point(i, point_y), y);
    block.set(Block<D>::point(i, point_mass),
              hn::IfThenElseZero(solvable, hn::Div(one, hn::IfThenElse(solvable, k, one))));
    radius_sum = hn::Add(radius_sum, hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y))));
  }

  // Sliding: 2×2 over (t1, t2) at c. Twist: about n.
  const Vec3V<V> a1 = cross(f.arm_a, f.t1), a_2 = cross(f.arm_a, f.t2), b1 = cross(f.arm_b, f.t1),
                 b_2 = cross(f.arm_b, f.t2);
  const Vec3V<V> ia1 = i_a * a1, ib1 = i_b * b1;
  const V s11 = hn::Add(mass_sum, hn::Add(dot(a1, ia1), dot(b1, ib1)));
  const V s12 = hn::Add(dot(a_2, ia1), dot(b_2, ib1));
  const V s22 = hn::Add(mass_sum, hn::Add(dot(a_2, i_a * a_2), dot(b_2, i_b * b_2)));
  const V det = hn::NegMulAdd(s12, s12, hn::Mul(s11, s22));
  const auto regular = hn::Gt(det, zero);
  const V inverse_det = hn::IfThenElseZero(regular, hn::Div(one, hn::IfThenElse(regular, det, one)));
  const V twist_k = dot(f.n, (i_a * f.n) + (i_b * f.n));
  const auto twistable = hn::Gt(twist_k, zero);

  block.set3(normal_x, f.n);
  block.set3(tangent_x, f.t1);
  block.set3(arm_a_x, f.arm_a);
  block.set3(arm_b_x, f.arm_b);
  block.set(k_nn, nn), block.set(k_n1, n1), block.set(k_n2, n2);
  block.set(k_11, k11), block.set(k_12, k12), block.set(k_22, k22);
  block.set(friction, normal.w);
  block.set(friction_impulse_1, frictions.x);
  block.set(friction_impulse_2, frictions.y);
  block.set(twist_impulse, frictions.z);
  block.set(slide_11, hn::Mul(s22, inverse_det));
  block.set(slide_12, hn::Neg(hn::Mul(s12, inverse_det)));
  block.set(slide_22, hn::Mul(s11, inverse_det));
  block.set(twist_mass, hn::IfThenElseZero(twistable, hn::Div(one, hn::IfThenElse(twistable, twist_k, one))));
  block.set(patch_radius, hn::Mul(radius_sum, share));
  if (!block.header().isotropic) {
    block.set_inertia(inertia_a, i_a);
    block.set_inertia(inertia_b, i_b);
  }
  if (block.header().restitution) {
    block.set(restitution, 0, tangent.w);
    const Vec3V<V> va = lanes.quad(lanes.body_a, 0).xyz(), wa = lanes.quad(lanes.body_a, 4).xyz();
    const Vec3V<V> vb = lanes.quad(lanes.body_b, 0).xyz(), wb = lanes.quad(lanes.body_b, 4).xyz();
    const Twist3<V> before = normal_motion(f, va, wa, vb, wb);
    for (int i = 0; i < max_points; ++i) {
      block.set(approach, i,
                at_point(before, block.get(Block<D>::point(i, point_x)), block.get(Block<D>::point(i, point_y))));
      block.set(peak, i, zero);
    }
  }
  return point_count;
}

template <class D>
std::size_t prepare(BlockArray blocks, std::size_t begin, std::size_t end, const std::uint32_t* lanes,
                    const Constrained& constrained, const BodiesView& view) {
  std::size_t count = 0;
  for (std::size_t i = begin; i < end; ++i)
    count += prepare_block(block_at<D>(blocks, i), lanes + i * Block<D>::width, constrained, view);
  return count;
}

template <class D>
void store(BlockArray blocks, std::size_t begin, std::size_t end, const Constrained& constrained) {
  for (std::size_t i = begin; i < end; ++i) {
    const Block<D> block = block_at<D>(blocks, i);
    const std::size_t used = block.header().lanes;
    float* impulses[Block<D>::width];
    float* friction_impulses[Block<D>::width];
    for (std::size_t lane = 0; lane < used; ++lane) {
      ContactManifold& m = constrained.manifolds[block.manifold()[lane]];
      impulses[lane] = m.impulses;
      friction_impulses[lane] = m.friction_impulse;
    }
    QuadV<hn::Vec<D>> q{hn::Zero(D()), hn::Zero(D()), hn::Zero(D()), hn::Zero(D())};
    const int count = block.header().max_points;
    q.x = block.get(Block<D>::point(0, point_impulse));
    if (count > 1) q.y = block.get(Block<D>::point(1, point_impulse));
    if (count > 2) q.z = block.get(Block<D>::point(2, point_impulse));
    if (count > 3) q.w = block.get(Block<D>::point(3, point_impulse));
    store_quads(D(), q, impulses, used);
    store_quads(D(),
                {block.get(friction_impulse_1), block.get(friction_impulse_2), block.get(twist_impulse), hn::Zero(D())},
                friction_impulses, used);
  }
}

template <class D>
SolverKernels make_kernels(const char* name) {
  return {name,
          static_cast<int>(Block<D>::width),
          Block<D>::bytes_up_to(field_count),
          Block<D>::bytes_up_to(inertia_a),
          bounce_field_count * Block<D>::width,
          prepare<D>,
          warm_start<D>,
          sweep<Pass::soft, D>,
          sweep<Pass::relax, D>,
          restitute<D>,
          sweep<Pass::iterate, D>,
          store<D>};
}

SolverKernels wide() { return make_kernels<hn::ScalableTag<float>>(hwy::TargetName(HWY_TARGET)); }
SolverKernels single() { return make_kernels<hn::CappedTag<float, 1>>("single"); }

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
