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
  // The point of q nearest to p's at `start`, and the point of p nearest to that one.
  const auto pair_from = [&](float start) {
    const float t = clamp(ratio(fma(pq, start, qr), qq), 0, 1);
    const float s = clamp(ratio(fma(pq, t, -pr), pp), 0, 1);
    return SegmentPair{s, t, mul_add(p.from, s, p.along), mul_add(q.from, t, q.along)};
  };
  const float det = pp * qq - pq * pq;
  if (det > 1e-6f * pp * qq) return pair_from(clamp((pq * qr - pr * qq) / det, 0, 1));
  // For segments this parallel rounding hides where they are closest: at one of the ends of what faces each other.
  const SegmentPair begin = pair_from(0), end = pair_from(1);
  return length_squared(end.on_2 - end.on_1) < length_squared(begin.on_2 - begin.on_1) ? end : begin;
}

}  // namespace fathom
