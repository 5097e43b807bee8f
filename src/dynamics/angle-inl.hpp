// Angles over a lane type L, bit-identical on every target. Included like the constraint laws
// (dynamics/ball_joint-inl.hpp).

/// Angle (rad) of the vector (x, y), accurate to 3e-7: Abramowitz and Stegun, 4.4.49.
template <class L>
FATHOM_LANE_FUNCTION L angle_of(L y, L x) {
  const L zero = splat<L>(0.0f), one = splat<L>(1.0f);
  const L size_x = larger(x, zero - x), size_y = larger(y, zero - y);
  const L t = smaller(size_x, size_y) / larger(larger(size_x, size_y), splat<L>(1e-30f)), s = t * t;
  L p = mul_add(splat<L>(-0.0161657367f), s, splat<L>(0.0028662257f));
  p = mul_add(splat<L>(0.0429096138f), s, p);
  p = mul_add(splat<L>(-0.0752896400f), s, p);
  p = mul_add(splat<L>(0.1065626393f), s, p);
  p = mul_add(splat<L>(-0.1420889944f), s, p);
  p = mul_add(splat<L>(0.1999355085f), s, p);
  p = mul_add(splat<L>(-0.3333314528f), s, p);
  p = mul_add(one, s, p) * t;
  p = choose(is_less(size_x, size_y), splat<L>(1.57079633f) - p, p);
  p = choose(is_less(x, zero), splat<L>(3.14159265f) - p, p);
  return choose(is_less(y, zero), zero - p, p);
}
