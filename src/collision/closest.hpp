// Closest points of segments (C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.9).
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// The points from + t·along, 0 ≤ t ≤ 1; may be a single point.
struct Segment {
  Vec3 from, along;
};

struct SegmentPair {
  float s, t;  ///< parameters of the closest points
  Vec3 on_1, on_2;
};

FATHOM_HD float ratio(float a, float b) { return b > 0 ? a / b : 0; }

FATHOM_HD SegmentPair closest_points(const Segment& p, const Segment& q) {
  const Vec3 r = p.from - q.from;
  const float pp = length_squared(p.along), qq = length_squared(q.along), pq = dot(p.along, q.along);
  const float pr = dot(p.along, r), qr = dot(q.along, r);
  // For parallel segments any pair of facing points will do: start at the first one's beginning.
  const float det = pp * qq - pq * pq;
  float s = det > 1e-6f * pp * qq ? clamp((pq * qr - pr * qq) / det, 0, 1) : 0;
  const float t = clamp(ratio(fma(pq, s, qr), qq), 0, 1);
  s = clamp(ratio(fma(pq, t, -pr), pp), 0, 1);
  return {s, t, mul_add(p.from, s, p.along), mul_add(q.from, t, q.along)};
}

}  // namespace fathom
