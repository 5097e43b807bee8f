// Margins of the broad phase's boxes, over vectors like those of dynamics/integrate-inl.hpp.

/// Half the speculative margin (m): half the distance at which two bodies with bounding radius `radius` (m) become a
/// contact before they touch. It reaches its full value at a radius of about 17 cm (at 1/60 s). In a heap of pebbles
/// dozens of others would be within that distance of each. Small bodies therefore get a fraction of their size, plus
/// the distance that one body of the pair may fall before contacts are searched again.
template <class L>
FATHOM_LANE_FUNCTION L half_speculative_margin(L radius, float dt) {
  return smaller(splat<L>(half_margin), splat<L>(half_margin_share) * radius + splat<L>(0.5f * fall_within(dt)));
}

/// How far (m) any point of a body may turn out of its box within `dt` (s), plus half the speculative margin. Turning
/// moves a point by at most the angle times its distance from the centre, and never beyond the bounding sphere.
template <class Vec>
FATHOM_LANE_FUNCTION LaneOf<Vec> reach_beyond_box(Vec angular, LaneOf<Vec> radius, float dt) {
  using L = LaneOf<Vec>;
  const L turning = smaller(root(dot(angular, angular)) * splat<L>(dt), splat<L>(1.0f)) * radius;
  return half_speculative_margin(radius, dt) + turning;
}

/// The part of a body's movement `moved` (m) that left the line predicted by its velocity; `way` (m) is the movement
/// predicted for a step.
template <class Vec>
FATHOM_LANE_FUNCTION Vec aside_of(Vec moved, Vec way) {
  using L = LaneOf<Vec>;
  const L along = dot(moved, way) / larger(dot(way, way), splat<L>(1e-30f));
  return moved - scale(larger(smaller(along, splat<L>(1.0f)), splat<L>(0.0f)), way);
}

template <class Vec>
struct BoxOf {
  Vec lower, upper;
};

/// `box` swept along `path` (m).
template <class Vec>
FATHOM_LANE_FUNCTION BoxOf<Vec> swept(const BoxOf<Vec>& box, Vec path) {
  const LaneOf<Vec> o = splat<LaneOf<Vec>>(0.0f);
  const Vec zero{o, o, o};
  return {box.lower + smaller(path, zero), box.upper + larger(path, zero)};
}

/// `box` with room for several steps of motion, so the broad phase rarely has to update it.
template <class Vec>
FATHOM_LANE_FUNCTION BoxOf<Vec> fat_box(LaneOf<Vec> radius, const BoxOf<Vec>& box, Vec velocity, float dt) {
  using L = LaneOf<Vec>;
  const L reach = splat<L>(fat_reach_share) * radius, back = splat<L>(-fat_reach_share) * radius;
  const L margin = smaller(splat<L>(fat_margin), splat<L>(fat_margin_share) * radius);
  const Vec ahead =
      larger(Vec{back, back, back}, smaller(scale(splat<L>(fat_steps_ahead * dt), velocity), Vec{reach, reach, reach}));
  const Vec grown{margin, margin, margin};
  return swept(BoxOf<Vec>{box.lower - grown, box.upper + grown}, ahead);
}
