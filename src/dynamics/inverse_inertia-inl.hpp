// A body's inverse inertia over a lane type L: how an impulse changes its velocities. Constraint rows use this
// interface and never ask which kind of inertia it is. Included like the joint laws (dynamics/ball_joint-inl.hpp),
// before them.
//
// An impulse (N·s) comes with its moment (N·m·s) about the body's centre. Both kinds provide
//     VecOf<L> moved_by(impulse, moment);  VecOf<L> spun_by(impulse, moment);  VecOf<L> spun_by(moment);
//     L along(direction, moment);  L response(direction, moment);
//     void push(linear, angular, impulse, moment);  void pull(…);  void twist(linear, angular, moment);
// in m/s and rad/s. `along` is the linear velocity that a unit impulse gives along itself, `response` the velocity of
// the point on which it acts: the inverse of the effective mass of a row with that direction and arm.

/// Linear and angular velocity are uncoupled. `Spin` is L where the inertia is a multiple of the identity, else
/// SymOf<L>.
template <class L, class Spin>
struct InverseInertia {
  static constexpr bool couples = false;  ///< whether a moment moves the centre

  L mass;     ///< 1/kg
  Spin spin;  ///< 1/(kg·m²)

  FATHOM_LANE_FUNCTION VecOf<L> moved_by(VecOf<L> impulse, VecOf<L>) const { return scale(mass, impulse); }
  FATHOM_LANE_FUNCTION VecOf<L> spun_by(VecOf<L> moment) const {
    if constexpr (std::is_same_v<Spin, L>)
      return scale(spin, moment);
    else
      return spin * moment;
  }
  FATHOM_LANE_FUNCTION VecOf<L> spun_by(VecOf<L>, VecOf<L> moment) const { return spun_by(moment); }
  FATHOM_LANE_FUNCTION L along(VecOf<L>, VecOf<L>) const { return mass; }
  FATHOM_LANE_FUNCTION L response(VecOf<L>, VecOf<L> moment) const { return mass + dot(moment, spun_by(moment)); }

  FATHOM_LANE_FUNCTION void push(VecOf<L>& linear, VecOf<L>& angular, VecOf<L> impulse, VecOf<L> moment) const {
    linear = mul_add(linear, mass, impulse);
    angular = angular + spun_by(moment);
  }
  FATHOM_LANE_FUNCTION void pull(VecOf<L>& linear, VecOf<L>& angular, VecOf<L> impulse, VecOf<L> moment) const {
    linear = mul_sub(linear, mass, impulse);
    angular = angular - spun_by(moment);
  }
  FATHOM_LANE_FUNCTION void twist(VecOf<L>&, VecOf<L>& angular, VecOf<L> moment) const {
    angular = angular + spun_by(moment);
  }
  FATHOM_LANE_FUNCTION void twist_back(VecOf<L>&, VecOf<L>& angular, VecOf<L> moment) const {
    angular = angular - spun_by(moment);
  }
};

/// The inverse of a symmetric 6×6 mass matrix, for a body in water, whose added mass differs along each of its axes. A
/// force off the centre of added mass turns the body, and a moment moves its centre.
template <class L>
struct CoupledInertia {
  static constexpr bool couples = true;

  SymOf<L> linear;            ///< 1/kg
  VecOf<L> by_x, by_y, by_z;  ///< 1/(kg·m): linear velocity due to a unit moment about each axis
  SymOf<L> angular;           ///< 1/(kg·m²)

  FATHOM_LANE_FUNCTION VecOf<L> moved_by(VecOf<L> impulse, VecOf<L> moment) const {
    return mul_add(mul_add(mul_add(linear * impulse, moment.x, by_x), moment.y, by_y), moment.z, by_z);
  }
  FATHOM_LANE_FUNCTION VecOf<L> spun_by(VecOf<L> moment) const { return angular * moment; }
  FATHOM_LANE_FUNCTION VecOf<L> spun_by(VecOf<L> impulse, VecOf<L> moment) const {
    return spun_by(moment) + VecOf<L>{dot(by_x, impulse), dot(by_y, impulse), dot(by_z, impulse)};
  }
  FATHOM_LANE_FUNCTION L along(VecOf<L> direction, VecOf<L> moment) const {
    return dot(direction, moved_by(direction, moment));
  }
  FATHOM_LANE_FUNCTION L response(VecOf<L> direction, VecOf<L> moment) const {
    return along(direction, moment) + dot(moment, spun_by(direction, moment));
  }

  FATHOM_LANE_FUNCTION void push(VecOf<L>& v, VecOf<L>& w, VecOf<L> impulse, VecOf<L> moment) const {
    v = v + moved_by(impulse, moment);
    w = w + spun_by(impulse, moment);
  }
  FATHOM_LANE_FUNCTION void pull(VecOf<L>& v, VecOf<L>& w, VecOf<L> impulse, VecOf<L> moment) const {
    v = v - moved_by(impulse, moment);
    w = w - spun_by(impulse, moment);
  }
  FATHOM_LANE_FUNCTION void twist(VecOf<L>& v, VecOf<L>& w, VecOf<L> moment) const {
    const L zero = splat<L>(0.0f);
    push(v, w, VecOf<L>{zero, zero, zero}, moment);
  }
  FATHOM_LANE_FUNCTION void twist_back(VecOf<L>& v, VecOf<L>& w, VecOf<L> moment) const {
    const L zero = splat<L>(0.0f);
    pull(v, w, VecOf<L>{zero, zero, zero}, moment);
  }
};

// For two bodies: `Bodies` has sides `a` and `b` with `linear` and `angular`, `inverse_of_a()` and `inverse_of_b()`,
// and a flag for whether A is never pushed. Impulses act on B, and reversed on A.

/// Applies an impulse with its moments about each body's centre.
template <class Bodies, class Vec>
FATHOM_LANE_FUNCTION void push_apart(Bodies& bodies, Vec impulse, Vec moment_a, Vec moment_b) {
  bodies.inverse_of_b().push(bodies.b.linear, bodies.b.angular, impulse, moment_b);
  if constexpr (!Bodies::only_pushes_b)
    bodies.inverse_of_a().pull(bodies.a.linear, bodies.a.angular, impulse, moment_a);
}

/// Applies a moment alone.
template <class Bodies, class Vec>
FATHOM_LANE_FUNCTION void twist_apart(Bodies& bodies, Vec moment) {
  bodies.inverse_of_b().twist(bodies.b.linear, bodies.b.angular, moment);
  if constexpr (!Bodies::only_pushes_b) bodies.inverse_of_a().twist_back(bodies.a.linear, bodies.a.angular, moment);
}

/// Change of the bodies' relative angular velocity due to a moment.
template <class Bodies, class Vec>
FATHOM_LANE_FUNCTION Vec spun_apart(const Bodies& bodies, Vec moment) {
  if constexpr (Bodies::only_pushes_b)
    return bodies.inverse_of_b().spun_by(moment);
  else
    return bodies.inverse_of_a().spun_by(moment) + bodies.inverse_of_b().spun_by(moment);
}
