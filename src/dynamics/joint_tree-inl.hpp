// The direct solution of bodies that ball joints connect to a tree: the changes of velocity that satisfy all joints at
// once, with the least kinetic energy. Included like dynamics/joint_link-inl.hpp.
//
// Eliminates from the leaves to the root and substitutes back, in time proportional to the number of joints (Baraff,
// "Linear-time dynamics using Lagrange multipliers", 1996). Written as Featherstone's articulated bodies ("Rigid Body
// Dynamics Algorithms", 2008, chapter 7) with three degrees of freedom per joint: all that hangs on a joint appears to
// its parent as a symmetric 3×3 inertia at the anchor and an impulse.
//
// Angular inertias are factorised, never inverted: a thin light link with a heavy one behind it turns 10,000 times as
// easily about its own axis as across it. The rounding error of an inverse is that of its largest element. Multiplied
// by the heavy mass, it was several times the light one, and folded chains kept gaining energy
// (docs/log/2026-11-25-whipping-chains.md). A factor's rounding error is that of an inertia changed by about 1e-7 of
// itself.

/// Inertia of a body and all that hangs on it, about the body's centre: momentum per linear and angular velocity.
struct TreeInertia {
  Mat3 linear, mixed, angular;  ///< kg, kg·m (momentum per angular velocity), kg·m²
};

/// A symmetric, positive definite matrix as L D transpose(L), L with ones on its diagonal. A pivot no larger than the
/// rounding error of its diagonal element counts as infinite: nothing turns that way.
struct SymFactor {
  Real yx, zx, zy;  ///< L, below its diagonal
  Vec3 inverse;     ///< of D

  FATHOM_LANE_FUNCTION explicit SymFactor(const Mat3& m) {
    const auto inverse_of = [](Real pivot, Real of) { return select(pivot > 4e-7f * of, 1.0f / pivot, Real{}); };
    inverse.x = inverse_of(m.x.x, Real{});
    yx = m.x.y * inverse.x, zx = m.x.z * inverse.x;
    inverse.y = inverse_of(fma(-yx, m.x.y, m.y.y), m.y.y);
    const Real rest = fma(-zx, m.x.y, m.y.z);
    zy = rest * inverse.y;
    inverse.z = inverse_of(fma(-zy, rest, fma(-zx, m.x.z, m.z.z)), m.z.z);
  }
  SymFactor() = default;

  /// inverse(L) v
  FATHOM_LANE_FUNCTION Vec3 forward(Vec3 v) const {
    const Real y = fma(-yx, v.x, v.y);
    return {v.x, y, fma(-zy, y, fma(-zx, v.x, v.z))};
  }
  /// inverse(D) v
  FATHOM_LANE_FUNCTION Vec3 scaled(Vec3 v) const { return {inverse.x * v.x, inverse.y * v.y, inverse.z * v.z}; }
  /// inverse(transpose(L)) v
  FATHOM_LANE_FUNCTION Vec3 backward(Vec3 v) const {
    const Real y = fma(-zy, v.z, v.y);
    return {fma(-yx, y, fma(-zx, v.z, v.x)), y, v.z};
  }
  FATHOM_LANE_FUNCTION Vec3 solve(Vec3 v) const { return backward(scaled(forward(v))); }
  /// m inverse(transpose(L))
  FATHOM_LANE_FUNCTION Mat3 right(const Mat3& m) const {
    const Vec3 y = mul_add(m.y, -yx, m.x);
    return {m.x, y, mul_add(mul_add(m.z, -zx, m.x), -zy, y)};
  }
  /// v · inverse(this matrix) v
  FATHOM_LANE_FUNCTION Real response(Vec3 v) const {
    const Vec3 f = forward(v);
    return dot(scaled(f), f);
  }
};

/// The same at a body's anchor to its parent, with the angular velocity eliminated.
struct TreeLink {
  Vec3 arm;           ///< m, from the centre to the anchor
  Mat3 inertia;       ///< kg
  SymFactor angular;  ///< of kg·m²
  Mat3 mixed;         ///< kg·m (momentum per angular velocity), after `SymFactor::right`
};

/// Load on a body and all that hangs on it, about the body's centre.
struct TreeLoad {
  Vec3 impulse, moment;  ///< N·s, N·m·s
};

struct TreeChange {
  Vec3 linear, angular;  ///< m/s, rad/s
};

FATHOM_LANE_FUNCTION Mat3 skew(Vec3 a) { return {{Real{}, a.z, -a.y}, {-a.z, Real{}, a.x}, {a.y, -a.x, Real{}}}; }
FATHOM_LANE_FUNCTION Mat3 operator-(const Mat3& a, const Mat3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FATHOM_LANE_FUNCTION Mat3 diagonal(Real a) { return {{a, Real{}, Real{}}, {Real{}, a, Real{}}, {Real{}, Real{}, a}}; }

FATHOM_LANE_FUNCTION TreeInertia tree_inertia(Real mass, const Mat3& inertia) {
  return {diagonal(mass), diagonal(Real{}), inertia};
}

/// The link that a body's parent feels at the anchor, `arm` from the body's centre.
FATHOM_LANE_FUNCTION TreeLink tree_link(const TreeInertia& body, Vec3 arm) {
  const Mat3 r = skew(arm), vr = body.linear * r, rc = r * body.mixed;
  TreeLink link;
  link.arm = arm;
  link.angular = SymFactor(body.angular - r * vr - rc - transpose(rc));
  link.mixed = link.angular.right(vr + body.mixed);
  link.inertia = body.linear;
  const auto take = [&](Vec3 column, Real share) {
    const Vec3 s = -share * column;
    link.inertia.x = mul_add(link.inertia.x, column.x, s);
    link.inertia.y = mul_add(link.inertia.y, column.y, s);
    link.inertia.z = mul_add(link.inertia.z, column.z, s);
  };
  take(link.mixed.x, link.angular.inverse.x);
  take(link.mixed.y, link.angular.inverse.y);
  take(link.mixed.z, link.angular.inverse.z);
  return link;
}

/// Attaches a child to `parent` at `arm` from its centre.
FATHOM_LANE_FUNCTION void add_child(TreeInertia& parent, const TreeLink& child, Vec3 arm) {
  const Mat3 s = skew(arm), bs = child.inertia * s;
  parent.linear = parent.linear + child.inertia;
  parent.mixed = parent.mixed - bs;
  parent.angular = parent.angular - s * bs;
}

/// Moves a load from the body's centre to its anchor.
FATHOM_LANE_FUNCTION TreeLoad at_anchor(const TreeLink& link, const TreeLoad& load) {
  return {load.impulse, load.moment - cross(link.arm, load.impulse)};
}

/// The impulse at the anchor due to a load about it, with the angular velocity eliminated.
FATHOM_LANE_FUNCTION Vec3 pushed_at_anchor(const TreeLink& link, const TreeLoad& load) {
  return load.impulse - link.mixed * link.angular.scaled(link.angular.forward(load.moment));
}

/// The impulse at the anchor that the child hands on to its parent, for its load (about its anchor) and anchors that
/// separate at `error` (m/s).
FATHOM_LANE_FUNCTION Vec3 handed_on(const TreeLink& child, const TreeLoad& load, Vec3 error) {
  return child.inertia * error + pushed_at_anchor(child, load);
}

/// The impulse on a body at its anchor if the anchor's velocity is to change by `change`.
FATHOM_LANE_FUNCTION Vec3 impulse_on(const TreeLink& link, const TreeLoad& load, Vec3 change) {
  return link.inertia * change - pushed_at_anchor(link, load);
}

/// The resulting change of the body's velocities.
FATHOM_LANE_FUNCTION TreeChange follow(const TreeLink& link, const TreeLoad& load, Vec3 change) {
  const Vec3 angular =
      link.angular.backward(link.angular.scaled(link.angular.forward(load.moment) - transpose_mul(link.mixed, change)));
  return {change + cross(link.arm, angular), angular};
}

/// Change of a body without a parent, given its link at its centre.
FATHOM_LANE_FUNCTION TreeChange root_change(const TreeLink& link, const TreeLoad& load) {
  return follow(link, load, SymFactor(link.inertia).solve(pushed_at_anchor(link, load)));
}
