// Vector functions over lanes for moving bodies and joints. Included like the constraint laws
// (dynamics/contact-inl.hpp).

/// `v`, shortened to `most` if it is longer.
template <class Vec>
FATHOM_LANE_FUNCTION Vec limited(Vec v, LaneOf<Vec> most) {
  using L = LaneOf<Vec>;
  const L squared = dot(v, v), max_squared = most * most;
  if (!any_above(squared, max_squared)) return v;
  // Scaled first, because the square may have overflowed.
  const L largest = larger(magnitude(v.x), larger(magnitude(v.y), magnitude(v.z)));
  const Vec scaled{v.x / largest, v.y / largest, v.z / largest};
  return select(is_above(squared, max_squared), scale(most / root(dot(scaled, scaled)), scaled), v);
}

/// The rotation vector (rad) of a rotation by `turned` followed by one by `by`, to second order (Baker, Campbell and
/// Hausdorff).
template <class Vec>
FATHOM_LANE_FUNCTION Vec turned_further(Vec turned, Vec by) {
  using L = LaneOf<Vec>;
  return turned + by +
         (scale(splat<L>(0.5f), cross(by, turned)) + scale(splat<L>(1.0f / 12), cross(turned, cross(turned, by))));
}
