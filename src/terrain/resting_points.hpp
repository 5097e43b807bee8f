// The points of a patch on uneven ground that a body comes to rest on.
//
// On flat ground the largest patch is best (collision/reduce.hpp). On peaks of rough ground one point of the largest
// patch may touch while three are far above the ground: the body then tips onto peaks without contact points, sinks in,
// is pushed out, and never comes to rest.
#pragma once

#include "collision/reduce.hpp"

namespace fathom {

struct RestingPoints {
  int under_load = 0;  ///< at most 4
  int around = 0;      ///< at most 4
};

/// The lower hull of points (x, y, z), where z is the separation from the ground: finds the facet under the body's
/// load.
class RestingGround {
 public:
  FATHOM_HD RestingGround(const FacePoint* points, int count, FaceLoad load)
      : points_(points), count_(count), load_{load.x, load.y, 0, 0} {}

  /// Three points of a plane, counter-clockwise.
  struct Facet {
    int a = -1, b = -1, c = -1;
    FATHOM_HD bool is_found() const { return c >= 0; }
  };

  /// The facet on which the body comes to rest. The body lands on its lowest point and tips about it towards the load
  /// until it meets a second point. Then it tips over the line between two points until no tipping lowers the load.
  /// None if the load is outside all points: the body falls off.
  FATHOM_HD Facet under_load() const {
    constexpr int max_tips = 32;
    int from = lowest(), to = first_towards_load(from);
    if (to < 0) return {};
    for (int tip = 0; tip < max_tips; ++tip) {
      if (turn(from, to) > 0) {
        const int other = from;
        from = to, to = other;
      }
      const int next = next_beyond(from, to);
      if (next < 0) return {};
      const bool is_past_from = turn(from, next) < 0, is_past_to = turn(next, to) < 0;
      if (!is_past_from && !is_past_to) return {to, from, next};
      (is_past_to ? from : to) = next;
    }
    return {};
  }

  FATHOM_HD float height_over(const Facet& f, const FacePoint& p) const {
    const FacePoint &a = points_[f.a], &b = points_[f.b], &c = points_[f.c];
    const float whole = area(a, b, c), u = area(b, c, p) / whole, v = area(c, a, p) / whole;
    return p.z - fma(u, a.z, fma(v, b.z, (1 - u - v) * c.z));
  }

  /// The point that a body on the facet first meets as it tips over the side nearest to its load; −1: none.
  FATHOM_HD int next_over(const Facet& f) const {
    const int corners[] = {f.a, f.b, f.c};
    int next = -1;
    float nearest = 3e38f;
    for (int k = 0; k < 3; ++k) {
      const int from = corners[k], to = corners[(k + 1) % 3];
      const float inside = turn(from, to) / fathom::sqrt(squared_length(from, to));
      if (inside < nearest) nearest = inside, next = next_beyond(from, to);
    }
    return next;
  }

 private:
  /// Above zero if the load is to the left of the line.
  FATHOM_HD float turn(int from, int to) const { return area(points_[from], points_[to], load_); }
  FATHOM_HD float squared_length(int from, int to) const {
    const float x = points_[to].x - points_[from].x, y = points_[to].y - points_[from].y;
    return fma(x, x, y * y);
  }

  FATHOM_HD int lowest() const {
    int lowest = 0;
    for (int i = 1; i < count_; ++i)
      if (points_[i].z < points_[lowest].z) lowest = i;
    return lowest;
  }

  FATHOM_HD int first_towards_load(int about) const {
    const FacePoint& a = points_[about];
    int first = -1;
    float least = 3e38f;
    for (int i = 0; i < count_; ++i) {
      const float along = (points_[i].x - a.x) * (load_.x - a.x) + (points_[i].y - a.y) * (load_.y - a.y);
      if (i == about || !(along > 0)) continue;
      const float slope = (points_[i].z - a.z) / along;
      if (slope < least) least = slope, first = i;
    }
    return first;
  }

  /// The point to the right of the line that tipping over the line meets first; −1: none.
  FATHOM_HD int next_beyond(int from, int to) const {
    const FacePoint &a = points_[from], &b = points_[to];
    const float square = squared_length(from, to), slope_along = square > 0 ? (b.z - a.z) / square : 0;
    int next = -1;
    float least = 3e38f;
    for (int i = 0; i < count_; ++i) {
      const float beyond = -area(a, b, points_[i]);
      if (i == from || i == to || !(beyond > 1e-6f * square)) continue;
      const float along = (points_[i].x - a.x) * (b.x - a.x) + (points_[i].y - a.y) * (b.y - a.y);
      const float slope = (points_[i].z - a.z - along * slope_along) / beyond;
      if (slope < least) least = slope, next = i;
    }
    return next;
  }

  const FacePoint* points_;
  int count_;
  FacePoint load_;
};

/// Moves the points to keep to the front and returns their number. `under_load`: the largest patch in one plane on
/// which the body comes to rest under the load at `load`; if it has only three points, also the point that the body
/// first meets as it tips over its nearest side. `around`: the largest patch of the points above that plane, because
/// other loads may press the body anywhere. `depth_tie`: points within this height (m) above the plane count as in it.
FATHOM_HD RestingPoints choose_resting_points(FacePoint* points, int count, float depth_tie, FaceLoad load) {
  if (count <= max_manifold_points) return {count, 0};
  const RestingGround ground(points, count, load);
  const RestingGround::Facet facet = ground.under_load();
  if (!facet.is_found()) return {reduce(points, count, depth_tie), 0};
  const int next = ground.next_over(facet);
  FacePoint level[max_face_points], above[max_face_points];
  int levels = 0, aboves = 0, next_above = -1;
  for (int i = 0; i < count; ++i) {
    const bool is_corner = i == facet.a || i == facet.b || i == facet.c;
    if (i == next) next_above = aboves;
    if (is_corner || ground.height_over(facet, points[i]) <= depth_tie)
      level[levels++] = points[i];
    else
      above[aboves++] = points[i];
  }
  if (levels == 3 && next >= 0) {
    level[levels++] = above[next_above];
    above[next_above] = above[--aboves];
  }
  levels = reduce(level, levels, depth_tie);
  aboves = reduce(above, aboves, depth_tie);
  for (int i = 0; i < levels; ++i) points[i] = level[i];
  for (int i = 0; i < aboves; ++i) points[levels + i] = above[i];
  return {levels, aboves};
}

}  // namespace fathom
