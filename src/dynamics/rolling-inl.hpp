// The row of a contact's rolling resistance over a lane type L; included after dynamics/contact-inl.hpp.

/// Brakes the relative angular velocity, limited by `length` (m) times `load`, the sum of the points' impulses (N·s).
/// The impulse points along that velocity, and stops where it removes the most energy. `old` and the result are angular
/// impulses, plus on B and minus on A, accumulated over the substep (N·m·s, world axes).
template <class L, class Bodies>
FATHOM_LANE_FUNCTION VecOf<L> solve_rolling(Bodies& bodies, L length, L load, VecOf<L> old) {
  const L limit = length * load;
  const VecOf<L> spin = bodies.b.angular - bodies.a.angular;
  const L zero = splat<L>(0.0f), response = dot(spin, spun_apart(bodies, spin));
  const auto turns = is_above(response, zero);
  const L mass = select(turns, dot(spin, spin) / select(turns, response, splat<L>(1.0f)), zero);
  const VecOf<L> wanted = mul_sub(old, mass, spin);
  const L squared = dot(wanted, wanted);
  const L shrink =
      select(is_above(squared, limit * limit), limit / root(larger(squared, splat<L>(1e-30f))), splat<L>(1.0f));
  // Without a limit nothing is braked, even where the square underflows: lanes without resistance share vectors.
  const VecOf<L> now = scale(select(is_above(limit, zero), shrink, zero), wanted);
  twist_apart(bodies, now - old);
  return now;
}
