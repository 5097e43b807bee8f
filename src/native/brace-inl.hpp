// Braces of columns (dynamics/columns.hpp), as many side by side as there are lanes, one column a lane.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).
//
// Three walks: up, where each body's velocity follows from the one below; down, where the momentum that those above
// must gain is what the contact has to give, and how much of it all can give; and up again, to give it. Every lane goes
// through the same operations, whatever its neighbours do, so results depend neither on the width nor on which columns
// lie together. A row is a body and the contact above it. Where a contact does not hold, a piece of the column ends,
// and the next one begins in that lane; beyond a column's top nothing holds.

#if defined(FATHOM_BRACE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_BRACE_INL
#undef FATHOM_BRACE_INL
#else
#define FATHOM_BRACE_INL
#endif

#include "dynamics/columns.hpp"
#include "native/constraint_block-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

/// Vectors of a row. Points have four each.
enum RowField : int {
  // Of a step: the body …
  row_mass,
  row_inertia,  // six: xx yy zz xy xz yz
  row_gravity = row_inertia + 6,
  row_weight_time = row_gravity + 3,
  // … and the contact above it, seen from below: its normal and tangents are those of B above.
  row_place,  // of the lane's first float in the blocks (int32)
  row_normal,
  row_tangent_1 = row_normal + 3,
  row_tangent_2 = row_tangent_1 + 3,
  row_arm_below = row_tangent_2 + 3,
  row_arm_above = row_arm_below + 3,
  row_friction = row_arm_above + 3,
  row_patch_radius,
  row_bias_rate,
  row_most_speed,
  row_x,
  row_y = row_x + max_manifold_points,
  row_separation = row_y + max_manifold_points,  // infinite where there is no point
  // Of a brace: the body …
  row_linear = row_separation + max_manifold_points,
  row_angular = row_linear + 3,
  row_target = row_angular + 3,
  row_spin = row_target + 3,
  // … the piece that ends with it …
  piece_top = row_spin + 3,
  piece_spin = piece_top + 3,
  piece_weight = piece_spin + 3,
  // … and the contact.
  row_holds = piece_weight + 3,
  row_touches,
  row_impulse = row_touches + max_manifold_points,
  row_change = row_impulse + max_manifold_points,
  row_friction_change = row_change + max_manifold_points,  // slide 1 and 2, twist
  row_distribution = row_friction_change + 3,              // six
  row_speed = row_distribution + 6,
  row_part,  // in the piece's lowest row
  row_fields
};

/// As `fathom::cross`, without fma.
template <class V>
HWY_INLINE Vec3V<V> plain_cross(Vec3V<V> a, Vec3V<V> b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
template <class M, class V>
HWY_INLINE Vec3V<V> choose(M mask, Vec3V<V> yes, Vec3V<V> no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}
template <class M, class V>
HWY_INLINE SymMat3V<V> choose(M mask, const SymMat3V<V>& yes, const SymMat3V<V>& no) {
  return {hn::IfThenElse(mask, yes.xx, no.xx), hn::IfThenElse(mask, yes.yy, no.yy),
          hn::IfThenElse(mask, yes.zz, no.zz), hn::IfThenElse(mask, yes.xy, no.xy),
          hn::IfThenElse(mask, yes.xz, no.xz), hn::IfThenElse(mask, yes.yz, no.yz)};
}
template <class V>
HWY_INLINE SymMat3V<V> operator+(const SymMat3V<V>& a, const SymMat3V<V>& b) {
  return {hn::Add(a.xx, b.xx), hn::Add(a.yy, b.yy), hn::Add(a.zz, b.zz),
          hn::Add(a.xy, b.xy), hn::Add(a.xz, b.xz), hn::Add(a.yz, b.yz)};
}
template <class V>
HWY_INLINE SymMat3V<V> scale(V s, const SymMat3V<V>& m) {
  return {hn::Mul(s, m.xx), hn::Mul(s, m.yy), hn::Mul(s, m.zz), hn::Mul(s, m.xy), hn::Mul(s, m.xz), hn::Mul(s, m.yz)};
}
/// As `fathom::inverse` of a matrix that is symmetric, and so its inverse.
template <class V>
HWY_INLINE SymMat3V<V> inverse(const SymMat3V<V>& m) {
  const hn::DFromV<V> d;
  const Vec3V<V> x{m.xx, m.xy, m.xz}, y{m.xy, m.yy, m.yz}, z{m.xz, m.yz, m.zz};
  const Vec3V<V> yz = plain_cross(y, z), zx = plain_cross(z, x), xy = plain_cross(x, y);
  const V determinant = dot(x, yz);
  const auto regular = hn::Ne(determinant, hn::Zero(d));
  const V one = hn::Set(d, 1.0f);
  const V s = hn::IfThenElseZero(regular, hn::Div(one, hn::IfThenElse(regular, determinant, one)));
  return {hn::Mul(s, yz.x), hn::Mul(s, zx.y), hn::Mul(s, xy.z), hn::Mul(s, yz.y), hn::Mul(s, yz.z), hn::Mul(s, zx.z)};
}

/// `ColumnCone` in lanes.
template <class V>
struct ConeV {
  V a, b, c;

  HWY_INLINE ConeV(V now_1, V now_2, V change_1, V change_2, V limit, V limit_change)
      : a(hn::Sub(hn::MulAdd(change_1, change_1, hn::Mul(change_2, change_2)), hn::Mul(limit_change, limit_change))),
        b(hn::Sub(hn::MulAdd(now_1, change_1, hn::Mul(now_2, change_2)), hn::Mul(limit, limit_change))),
        c(hn::Min(hn::Sub(hn::MulAdd(now_1, now_1, hn::Mul(now_2, now_2)), hn::Mul(limit, limit)),
                  hn::Zero(hn::DFromV<V>()))) {}

  template <class M>
  HWY_INLINE V part_within(M holds, V part) const {
    const hn::DFromV<V> d;
    const V zero = hn::Zero(d);
    const V value = hn::MulAdd(part, hn::MulAdd(part, a, hn::Mul(hn::Set(d, 2.0f), b)), c);
    const auto beyond = hn::AndNot(hn::Le(value, zero), holds);
    if (hn::AllFalse(d, beyond)) return part;
    const V root = hn::Add(b, hn::Sqrt(hn::Max(hn::NegMulAdd(a, c, hn::Mul(b, b)), zero)));
    const auto meets = hn::And(beyond, hn::Gt(root, zero));
    const V at = hn::Min(hn::Max(hn::Div(hn::Neg(c), hn::IfThenElse(meets, root, hn::Set(d, 1.0f))), zero), part);
    return hn::IfThenElse(meets, at, part);
  }
};

template <class D>
class ColumnLanes {
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;
  using I = hn::RebindToSigned<D>;
  static constexpr std::size_t width = hn::MaxLanes(D());

 public:
  HWY_INLINE ColumnLanes(BlockArray blocks, const ColumnBundle& bundle, const BodiesView& view,
                         const SweepParameters& parameters)
      : blocks_(blocks), bundle_(bundle), view_(view), parameters_(parameters) {}

  /// What does not change from brace to brace.
  HWY_INLINE void load() const {
    for (std::uint32_t j = 0; j <= bundle_.contacts; ++j) load_body(j);
    for (std::uint32_t k = 0; k < bundle_.contacts; ++k) load_contact(k);
  }

  HWY_INLINE void brace(bool pushes_out) const {
    find_pieces(pushes_out);
    find_changes();
    apply(pushes_out);
  }

 private:
  static HWY_INLINE V set(float x) { return hn::Set(D(), x); }
  static HWY_INLINE V zero() { return hn::Zero(D()); }
  static HWY_INLINE Vec3V<V> zero3() { return {zero(), zero(), zero()}; }

  HWY_INLINE float* at(std::uint32_t row, int field) const {
    return bundle_.work + (std::size_t{row} * row_fields + static_cast<std::size_t>(field)) * width;
  }
  HWY_INLINE V get(std::uint32_t row, int field) const { return hn::Load(D(), at(row, field)); }
  HWY_INLINE void put(std::uint32_t row, int field, V v) const { hn::Store(v, D(), at(row, field)); }
  HWY_INLINE Vec3V<V> get3(std::uint32_t row, int field) const {
    return {get(row, field), get(row, field + 1), get(row, field + 2)};
  }
  HWY_INLINE void put3(std::uint32_t row, int field, Vec3V<V> v) const {
    put(row, field, v.x), put(row, field + 1, v.y), put(row, field + 2, v.z);
  }
  HWY_INLINE SymMat3V<V> get_matrix(std::uint32_t row, int field) const {
    return {get(row, field),     get(row, field + 1), get(row, field + 2),
            get(row, field + 3), get(row, field + 4), get(row, field + 5)};
  }
  HWY_INLINE void put_matrix(std::uint32_t row, int field, const SymMat3V<V>& m) const {
    put(row, field, m.xx), put(row, field + 1, m.yy), put(row, field + 2, m.zz), put(row, field + 3, m.xy),
        put(row, field + 4, m.xz), put(row, field + 5, m.yz);
  }
  HWY_INLINE M get_mask(std::uint32_t row, int field) const { return hn::MaskFromVec(get(row, field)); }
  HWY_INLINE void put_mask(std::uint32_t row, int field, M m) const { put(row, field, hn::VecFromMask(D(), m)); }

  HWY_INLINE const std::uint32_t* slots(std::uint32_t row) const { return bundle_.bodies + row * width; }
  /// Where lanes' objects are, in floats; of lanes without a body, the first object's.
  template <class T>
  HWY_INLINE void locate(std::uint32_t row, const T* objects, const float** lanes) const {
    for (std::size_t i = 0; i < width; ++i)
      lanes[i] = reinterpret_cast<const float*>(objects + (slots(row)[i] == none ? 0 : slots(row)[i]));
  }
  /// The same of bodies, which have an entry of zeros for those.
  HWY_INLINE QuadV<V> body_quad(std::uint32_t row, std::size_t quad) const {
    const float* lanes[width];
    for (std::size_t i = 0; i < width; ++i)
      lanes[i] = reinterpret_cast<const float*>(view_.bodies + static_cast<std::int32_t>(slots(row)[i])) + 4 * quad;
    return load_quads(D(), lanes);
  }
  /// A field of the contacts' blocks.
  HWY_INLINE V gather(std::uint32_t k, int field) const {
    const auto place = hn::Load(I(), reinterpret_cast<const std::int32_t*>(at(k, row_place)));
    const auto* const floats = reinterpret_cast<const float*>(blocks_.blocks);
    return hn::GatherIndex(D(), floats + static_cast<std::size_t>(field) * width, place);
  }
  HWY_INLINE Vec3V<V> gather3(std::uint32_t k, int field) const {
    return {gather(k, field), gather(k, field + 1), gather(k, field + 2)};
  }

  HWY_INLINE void load_body(std::uint32_t j) const {
    const V inverse_mass = body_quad(j, 2).w, inverse_inertia = body_quad(j, 3).w, one = set(1.0f);
    const M pushed = hn::Gt(inverse_mass, zero()), isotropic = hn::Gt(inverse_inertia, zero());
    const V mass = hn::IfThenElseZero(pushed, hn::Div(one, hn::IfThenElse(pushed, inverse_mass, one)));
    const V i = hn::IfThenElseZero(isotropic, hn::Div(one, hn::IfThenElse(isotropic, inverse_inertia, one)));
    SymMat3V<V> inertia{i, i, i, zero(), zero(), zero()};
    if (!hn::AllFalse(D(), hn::AndNot(isotropic, pushed))) {
      const float* lanes[width];
      locate(j, view_.inertias, lanes);
      const QuadV<V> first = load_quads(D(), lanes);
      for (const float*& lane : lanes) lane += 4;
      const QuadV<V> second = load_quads(D(), lanes);
      const SymMat3V<V> tensor{first.x, first.y, first.z, first.w, second.x, second.y};
      inertia = choose(isotropic, inertia, inverse(tensor));
    }
    const float* lanes[width];
    locate(j, view_.motion, lanes);
    const Vec3V<V> gravity = load_quads(D(), lanes).xyz();
    put(j, row_mass, mass);
    put_matrix(j, row_inertia, inertia);
    put3(j, row_gravity, gravity);
    put(j, row_weight_time, hn::Div(mass, set(parameters_.inverse_substep)));
  }

  HWY_INLINE void load_contact(std::uint32_t k) const {
    HWY_ALIGN std::int32_t places[width];
    HWY_ALIGN float points_of[width], contacts[width];
    for (std::size_t i = 0; i < width; ++i) {
      const std::uint32_t lane = bundle_.lanes[k * width + i];
      const Block<D> block = block_at<D>(blocks_, lane / width);
      places[i] = static_cast<std::int32_t>(block.at(0) - reinterpret_cast<const float*>(blocks_.blocks)) +
                  static_cast<std::int32_t>(lane % width);
      points_of[i] = block.header().max_points;
      contacts[i] = static_cast<float>(bundle_.lengths[i]);
    }
    hn::Store(hn::Load(I(), places), I(), reinterpret_cast<std::int32_t*>(at(k, row_place)));
    const V up = hn::LoadU(D(), bundle_.up + k * width), count = hn::Load(D(), points_of);
    const Vec3V<V> n = gather3(k, normal_x), t1 = gather3(k, tangent_x);
    const Vec3V<V> arm_a = gather3(k, arm_a_x), arm_b = gather3(k, arm_b_x);
    const M upward = hn::Gt(up, zero());
    put3(k, row_normal, scale(up, n));
    put3(k, row_tangent_1, scale(up, t1));
    put3(k, row_tangent_2, scale(up, plain_cross(n, t1)));
    put3(k, row_arm_below, choose(upward, arm_a, arm_b));
    put3(k, row_arm_above, choose(upward, arm_b, arm_a));
    put(k, row_friction, gather(k, friction));
    put(k, row_patch_radius, gather(k, patch_radius));
    const M fixed = hn::Le(get(k, row_mass), zero());
    put(k, row_bias_rate,
        hn::IfThenElse(fixed, set(parameters_.contacts.fixed.bias_rate), set(parameters_.contacts.dynamic.bias_rate)));
    const Vec3V<V> gravity = get3(k + 1, row_gravity);
    const V most =
        hn::Div(hn::Mul(set(column_push_out), hn::Sqrt(dot(gravity, gravity))), set(parameters_.inverse_substep));
    put(k, row_most_speed, hn::Div(most, hn::Load(D(), contacts)));
    // Points that a lane does not have weigh nothing.
    M exists = hn::Gt(count, zero());
    for (int i = 0; i < max_manifold_points; ++i) {
      exists = hn::And(hn::And(exists, hn::Gt(count, set(static_cast<float>(i)))),
                       hn::Gt(gather(k, Block<D>::point(i, point_mass)), zero()));
      put(k, row_x + i, hn::IfThenElseZero(exists, gather(k, Block<D>::point(i, point_x))));
      put(k, row_y + i, hn::IfThenElseZero(exists, gather(k, Block<D>::point(i, point_y))));
      put(k, row_separation + i,
          hn::IfThenElse(exists, gather(k, Block<D>::point(i, point_separation)), set(__builtin_inff())));
    }
  }

  struct Body {
    Vec3V<V> linear, angular, moved, turned;
  };
  HWY_INLINE Body body(std::uint32_t j) const {
    const Body b{body_quad(j, 0).xyz(), body_quad(j, 1).xyz(), body_quad(j, 2).xyz(), body_quad(j, 3).xyz()};
    put3(j, row_linear, b.linear);
    put3(j, row_angular, b.angular);
    return b;
  }

  /// `column_rung` of contact k. Returns where it holds.
  HWY_INLINE M find_rung(std::uint32_t k, const Body& below, const Body& above, bool pushes_out) const {
    const Vec3V<V> n = get3(k, row_normal);
    const Vec3V<V> lever_below = plain_cross(get3(k, row_arm_below), n);
    const Vec3V<V> lever_above = plain_cross(get3(k, row_arm_above), n);
    const Vec3V<V> turned = above.turned - below.turned;
    const Twist3<V> moved{hn::Add(dot(n, above.moved - below.moved),
                                  hn::Sub(dot(lever_above, above.turned), dot(lever_below, below.turned))),
                          dot(get3(k, row_tangent_1), turned), dot(get3(k, row_tangent_2), turned)};
    const V bias_rate = get(k, row_bias_rate);
    V count = zero(), x1 = zero(), y1 = zero(), xx = zero(), yy = zero(), xy = zero(), wanted = zero();
    for (int i = 0; i < max_manifold_points; ++i) {
      const V px = get(k, row_x + i), py = get(k, row_y + i), start = get(k, row_separation + i);
      const V separation = hn::Add(start, at_point(moved, px, py));
      const M exists = hn::Lt(start, set(__builtin_inff()));
      const V impulse = hn::IfThenElseZero(exists, gather(k, Block<D>::point(i, point_impulse)));
      const M touches =
          hn::And(exists, hn::Or(hn::Gt(impulse, zero()), hn::Not(hn::Gt(separation, set(column_reach)))));
      const V x = hn::IfThenElseZero(touches, px), y = hn::IfThenElseZero(touches, py);
      put(k, row_impulse + i, hn::IfThenElseZero(touches, impulse));
      put_mask(k, row_touches + i, touches);
      count = hn::Add(count, hn::IfThenElseZero(touches, set(1.0f)));
      x1 = hn::Add(x1, x), y1 = hn::Add(y1, y);
      xx = hn::MulAdd(x, x, xx), yy = hn::MulAdd(y, y, yy), xy = hn::MulAdd(x, y, xy);
      const V depth = hn::IfThenElseZero(touches, hn::Min(separation, zero()));
      wanted = hn::NegMulAdd(bias_rate, depth, wanted);
    }
    const V spread = hn::NegMulAdd(xy, xy, hn::Mul(xx, yy)), size = hn::Add(xx, yy);
    const M holds = hn::And(hn::And(hn::Gt(get(k + 1, row_mass), zero()), hn::Ge(count, set(3.0f))),
                            hn::Gt(spread, hn::Mul(hn::Mul(set(1e-3f), size), size)));
    put_mask(k, row_holds, holds);
    put_matrix(k, row_distribution, inverse(SymMat3V<V>{count, yy, xx, y1, hn::Neg(x1), hn::Neg(xy)}));
    V speed = zero();
    if (pushes_out) speed = hn::Min(hn::Div(wanted, hn::Max(count, set(1.0f))), get(k, row_most_speed));
    put(k, row_speed, hn::IfThenElseZero(holds, speed));
    return holds;
  }

  /// A piece on its way up, and the sums over it where it stands on nothing fixed.
  struct Piece {
    M stands;
    Vec3V<V> top, spin, weight, d;
    V mass;
    Vec3V<V> first, linear, angular;
    SymMat3V<V> inertia;
  };

  HWY_INLINE void begin(Piece& p, M mask, std::uint32_t j, const Body& base) const {
    const V mass = get(j, row_mass);
    const SymMat3V<V> inertia = get_matrix(j, row_inertia);
    const M fixed = hn::Le(mass, zero());
    p.stands = hn::Or(hn::And(mask, fixed), hn::AndNot(mask, p.stands));
    p.top = choose(mask, choose(fixed, base.linear, zero3()), p.top);
    p.spin = choose(mask, choose(fixed, base.angular, zero3()), p.spin);
    p.weight = choose(mask, zero3(), p.weight);
    p.d = choose(mask, zero3(), p.d);
    p.mass = hn::IfThenElse(mask, mass, p.mass);
    p.first = choose(mask, zero3(), p.first);
    p.linear = choose(mask, scale(mass, base.linear), p.linear);
    p.angular = choose(mask, inertia * base.angular, p.angular);
    p.inertia = choose(mask, inertia, p.inertia);
  }

  /// dd·1 − d dᵀ
  static HWY_INLINE SymMat3V<V> lever(Vec3V<V> d) {
    const V dd = dot(d, d);
    return {hn::Sub(dd, hn::Mul(d.x, d.x)), hn::Sub(dd, hn::Mul(d.y, d.y)), hn::Sub(dd, hn::Mul(d.z, d.z)),
            hn::Neg(hn::Mul(d.x, d.y)),     hn::Neg(hn::Mul(d.x, d.z)),     hn::Neg(hn::Mul(d.y, d.z))};
  }

  HWY_INLINE void go_on(Piece& p, std::uint32_t k, const Body& above) const {
    const Vec3V<V> arm = get3(k, row_arm_below) - get3(k, row_arm_above);
    p.d = p.d + arm;
    const Vec3V<V> rise = scale(get(k, row_speed), get3(k, row_normal));
    p.top = p.top + (plain_cross(p.spin, arm) + rise);
    p.weight = mul_add(p.weight, get(k + 1, row_weight_time), get3(k + 1, row_gravity));
    if (hn::AllTrue(D(), p.stands)) return;
    const V mass = get(k + 1, row_mass);
    const SymMat3V<V> inertia = get_matrix(k + 1, row_inertia);
    const Vec3V<V> momentum = scale(mass, above.linear - p.top);
    p.mass = hn::Add(p.mass, mass);
    p.first = mul_add(p.first, mass, p.d);
    p.linear = p.linear + momentum;
    p.angular = p.angular + (inertia * above.angular + plain_cross(p.d, momentum));
    p.inertia = p.inertia + inertia + scale(mass, lever(p.d));
  }

  /// The piece's targets, of body j at its top; those so far are relative to the base at rest.
  HWY_INLINE void end(const Piece& p, std::uint32_t j) const {
    Vec3V<V> top = p.top, spin = p.spin;
    if (!hn::AllTrue(D(), p.stands)) {
      const V share = hn::Div(set(1.0f), p.mass);
      const Vec3V<V> centre = scale(share, p.first);
      const SymMat3V<V> inertia = p.inertia + scale(hn::Neg(p.mass), lever(centre));
      const Vec3V<V> kept = inverse(inertia) * (p.angular - plain_cross(centre, p.linear));
      const Vec3V<V> moved = top + mul_add(plain_cross(kept, p.d - centre), share, p.linear);
      spin = choose(p.stands, spin, kept);
      top = choose(p.stands, top, moved);
    }
    put3(j, piece_top, top);
    put3(j, piece_spin, spin);
    put3(j, piece_weight, p.weight);
  }

  /// Going up, each body's velocity follows from the one below.
  HWY_INLINE void find_pieces(bool pushes_out) const {
    Body below = body(0);
    Piece p{};
    begin(p, hn::Eq(zero(), zero()), 0, below);
    for (std::uint32_t k = 0; k < bundle_.contacts; ++k) {
      const Body above = body(k + 1);
      const M holds = find_rung(k, below, above, pushes_out);
      if (hn::AllTrue(D(), holds)) {
        go_on(p, k, above);
      } else {
        end(p, k);
        go_on(p, k, above);
        begin(p, hn::Not(holds), k + 1, above);
      }
      below = above;
    }
    end(p, bundle_.contacts);
    put_mask(bundle_.contacts, row_holds, hn::Lt(zero(), zero()));
  }

  /// Going down, the momentum that those above must gain is what the contact has to give, as far as all of a piece can.
  HWY_INLINE void find_changes() const {
    Vec3V<V> gain_linear = zero3(), gain_angular = zero3(), target = zero3(), spin = zero3(), weight = zero3(),
             arm = zero3();
    V part = set(1.0f);
    for (std::uint32_t k = bundle_.contacts; k-- > 0;) {
      const M holds = get_mask(k, row_holds);
      if (hn::AllFalse(D(), holds)) continue;
      const M tops = hn::AndNot(get_mask(k + 1, row_holds), holds);
      if (!hn::AllFalse(D(), tops)) {
        target = choose(tops, get3(k + 1, piece_top), target);
        spin = choose(tops, get3(k + 1, piece_spin), spin);
        weight = choose(tops, get3(k + 1, piece_weight), weight);
        gain_linear = choose(tops, zero3(), gain_linear);
        gain_angular = choose(tops, zero3(), gain_angular);
        arm = choose(tops, zero3(), arm);
        part = hn::IfThenElse(tops, set(1.0f), part);
        put3(k + 1, row_target, target);
        put3(k + 1, row_spin, spin);
      }
      const Vec3V<V> arm_below = get3(k, row_arm_below), arm_above = get3(k, row_arm_above);
      const Vec3V<V> momentum = scale(get(k + 1, row_mass), target - get3(k + 1, row_linear));
      gain_angular = gain_angular + plain_cross(arm - arm_above, gain_linear);
      gain_linear = gain_linear + momentum;
      const Vec3V<V> turned = get_matrix(k + 1, row_inertia) * (spin - get3(k + 1, row_angular));
      gain_angular = gain_angular + (turned - plain_cross(arm_above, momentum));
      arm = arm_below;
      part = find_change(k, holds, gain_linear, gain_angular, weight, part);
      put(k, row_part, part);
      const Vec3V<V> rise = scale(get(k, row_speed), get3(k, row_normal));
      target = target - plain_cross(spin, arm_below - arm_above) - rise;
      put3(k, row_target, target);
      put3(k, row_spin, spin);
    }
  }

  /// `column_multipliers` and `column_limits` of contact k; returns what part of the gain is possible.
  HWY_INLINE V find_change(std::uint32_t k, M holds, Vec3V<V> gain_linear, Vec3V<V> gain_angular, Vec3V<V> weight,
                           V part) const {
    const Vec3V<V> n = get3(k, row_normal), t1 = get3(k, row_tangent_1), t2 = get3(k, row_tangent_2);
    Vec3V<V> sum{dot(gain_linear, n), dot(gain_angular, t1), dot(gain_angular, t2)};
    const V change = sum.x;
    V x[max_manifold_points], y[max_manifold_points], now[max_manifold_points];
    for (int i = 0; i < max_manifold_points; ++i) {
      x[i] = get(k, row_x + i), y[i] = get(k, row_y + i), now[i] = get(k, row_impulse + i);
      sum = sum + Vec3V<V>{now[i], hn::Mul(y[i], now[i]), hn::Neg(hn::Mul(x[i], now[i]))};
    }
    const Vec3V<V> m = get_matrix(k, row_distribution) * sum;
    for (int i = 0; i < max_manifold_points; ++i) {
      const V share = hn::NegMulAdd(x[i], m.z, hn::MulAdd(y[i], m.y, m.x));
      const V change_i = hn::IfThenElseZero(get_mask(k, row_touches + i), hn::Sub(share, now[i]));
      put(k, row_change + i, change_i);
      const M pulls = hn::And(holds, hn::Lt(hn::MulAdd(part, change_i, now[i]), zero()));
      if (!hn::AllFalse(D(), pulls)) part = hn::IfThenElse(pulls, hn::Div(now[i], hn::Neg(change_i)), part);
    }
    const V total = hn::Add(hn::Add(hn::Add(now[0], now[1]), now[2]), now[3]);
    const V most = hn::Mul(set(column_load), hn::Max(hn::Neg(dot(weight, n)), zero()));
    const M knocks = hn::And(holds, hn::And(hn::Gt(change, zero()), hn::Gt(hn::MulAdd(part, change, total), most)));
    if (!hn::AllFalse(D(), knocks))
      part = hn::IfThenElse(knocks, hn::Div(hn::Max(hn::Sub(most, total), zero()), change), part);
    const V slide_1 = dot(gain_linear, t1), slide_2 = dot(gain_linear, t2), twist = dot(gain_angular, n);
    put(k, row_friction_change, slide_1);
    put(k, row_friction_change + 1, slide_2);
    put(k, row_friction_change + 2, twist);
    const V mu = get(k, row_friction), lever = hn::Mul(mu, get(k, row_patch_radius));
    const ConeV<V> slides(gather(k, friction_impulse_1), gather(k, friction_impulse_2), slide_1, slide_2,
                          hn::Mul(mu, total), hn::Mul(mu, change));
    const ConeV<V> twists(gather(k, twist_impulse), zero(), twist, zero(), hn::Mul(lever, total),
                          hn::Mul(lever, change));
    part = twists.part_within(holds, slides.part_within(holds, part));
    // Where a body is not finite its piece stays as it is: a brace must not carry that to all of the column.
    const V sums = hn::Add(hn::Add(hn::Add(slide_1, slide_2), hn::Add(twist, change)), hn::Add(m.x, hn::Add(m.y, m.z)));
    return hn::IfThenElseZero(hn::Eq(hn::Sub(sums, sums), zero()), part);
  }

  /// Velocities and impulses of that part of the change.
  HWY_INLINE void apply(bool pushes_out) const {
    M inside = hn::Lt(zero(), zero());  // lanes whose piece goes on from below
    V part = zero();
    for (std::uint32_t k = 0; k < bundle_.contacts; ++k) {
      const M holds = get_mask(k, row_holds);
      const M begins = hn::AndNot(inside, holds);
      part = hn::IfThenElse(begins, get(k, row_part), part);
      const M acts = hn::And(holds, hn::Gt(part, zero()));
      inside = holds;
      if (hn::AllFalse(D(), acts)) continue;
      const M base = hn::And(hn::And(begins, acts), hn::Gt(get(k, row_mass), zero()));
      if (!hn::AllFalse(D(), base)) turn(k, base, part);
      turn(k + 1, acts, part);
      give(k, acts, part, pushes_out);
    }
  }

  HWY_INLINE void turn(std::uint32_t j, M mask, V part) const {
    const Vec3V<V> linear = get3(j, row_linear), angular = get3(j, row_angular);
    const Vec3V<V> v = mul_add(linear, part, get3(j, row_target) - linear);
    const Vec3V<V> w = mul_add(angular, part, get3(j, row_spin) - angular);
    HWY_ALIGN float elsewhere[8];
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(D(), mask, bits);
    float* lanes[width];
    for (std::size_t i = 0; i < width; ++i)
      lanes[i] = bits[i / 8] >> i % 8 & 1 ? reinterpret_cast<float*>(view_.bodies + slots(j)[i]) : elsewhere;
    store_quads(D(), {v.x, v.y, v.z, zero()}, lanes, width);
    for (float*& lane : lanes) lane += 4;
    store_quads(D(), {w.x, w.y, w.z, zero()}, lanes, width);
  }

  HWY_INLINE void give(std::uint32_t k, M mask, V part, bool pushes_out) const {
    constexpr int count = max_manifold_points + 4;
    constexpr int friction_fields[] = {friction_impulse_1, friction_impulse_2, twist_impulse};
    HWY_ALIGN float values[count * width];
    int fields[count];
    V sum = zero(), before = zero();
    for (int i = 0; i < max_manifold_points; ++i) {
      const V now = get(k, row_impulse + i);
      const V impulse = hn::IfThenElseZero(get_mask(k, row_touches + i),
                                           hn::Max(hn::MulAdd(part, get(k, row_change + i), now), zero()));
      sum = i == 0 ? impulse : hn::Add(sum, impulse);
      before = i == 0 ? now : hn::Add(before, now);
      fields[i] = Block<D>::point(i, point_impulse);
      hn::Store(impulse, D(), values + static_cast<std::size_t>(i) * width);
    }
    for (int i = 0; i < 3; ++i) {
      fields[max_manifold_points + i] = friction_fields[i];
      hn::Store(hn::MulAdd(part, get(k, row_friction_change + i), gather(k, friction_fields[i])), D(),
                values + static_cast<std::size_t>(max_manifold_points + i) * width);
    }
    fields[count - 1] = step_impulse;
    if (!pushes_out)
      hn::Store(hn::Add(gather(k, step_impulse), hn::Sub(sum, before)), D(),
                values + static_cast<std::size_t>(count - 1) * width);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(D(), mask, bits);
    const auto* const places = reinterpret_cast<const std::int32_t*>(at(k, row_place));
    for (std::size_t i = 0; i < width; ++i) {
      if (!(bits[i / 8] >> i % 8 & 1)) continue;
      float* const to = reinterpret_cast<float*>(blocks_.blocks) + places[i];
      for (int f = 0; f < count - (pushes_out ? 1 : 0); ++f)
        to[static_cast<std::size_t>(fields[f]) * width] = values[static_cast<std::size_t>(f) * width + i];
    }
  }

  const BlockArray blocks_;
  const ColumnBundle& bundle_;
  const BodiesView& view_;
  const SweepParameters& parameters_;
};

template <class D>
void load_columns(BlockArray blocks, const ColumnBundle& bundle, const BodiesView& view, const SweepParameters& p) {
  ColumnLanes<D>(blocks, bundle, view, p).load();
}

template <class D>
void brace(BlockArray blocks, const ColumnBundle& bundle, const BodiesView& view, bool pushes_out,
           const SweepParameters& p) {
  ColumnLanes<D>(blocks, bundle, view, p).brace(pushes_out);
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
