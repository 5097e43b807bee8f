// Contact reduction: four points out of many.
//
// If the patch's load is unknown or near its centre, the deepest point is kept, and the largest quadrilateral with it
// as a corner is found exactly: for each opposite corner the best points on either side of the diagonal are independent
// of each other, so each pair is examined only once. High points count less, because a leaning body comes down next on
// the corners beside the deepest one: a cylinder rolling on its rim would otherwise drop between points that are far
// apart. If the patch does not lean and its load has left the kept points, the edge over which the body would tip is
// kept. The points may come in any order.
#pragma once

#include "collision/manifold.hpp"

namespace fathom {

/// A point found by clipping, in the frame of the reference face: x and y in the face, z its height over it.
struct FacePoint {
  float x, y, z;
  std::uint32_t feature;
};

inline constexpr int max_face_points = 64;

/// Points no higher above the deepest one than this (m) carry load too: contacts yield by as much under a body's
/// weight.
inline constexpr float level_height = 3e-4f;
/// Height of a patch over its length up to which it does not lean (about rad): columns of cubes sway by as much, and
/// come to rest on the points that their load chooses.
inline constexpr float sway_slope = 0.005f;

/// Share of the way from a patch's centre to its edge up to which a load counts as central: it may move on in any
/// direction, and corners chosen for the direction in which it is now would give way in others.
inline constexpr float central_share = 0.33f;

/// Position of a patch's load, in the frame of the reference face (m).
struct FaceLoad {
  float x = 0, y = 0;
  bool is_known = false;
};

/// Twice the area of the triangle.
FATHOM_HD float area(const FacePoint& a, const FacePoint& b, const FacePoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Chooses the points to keep for a patch with this load: the two corners between which the load would leave the patch,
/// moving from the centre (the body then tips over the patch's own edge), and the two that add the largest area, one
/// after the other. The lowest point replaces the last one if it lies clearly below the edge. False: the load is
/// central (`central_share`).
FATHOM_HD bool choose_towards(FaceLoad load, const FacePoint* points, int count, float level,
                              int chosen[max_manifold_points]) {
  float middle_x = 0, middle_y = 0;
  for (int i = 0; i < count; ++i) middle_x += points[i].x, middle_y += points[i].y;
  const float share = 1.0f / static_cast<float>(count);
  middle_x *= share, middle_y *= share;
  const float dx = load.x - middle_x, dy = load.y - middle_y;
  const auto along = [&](int i) { return (points[i].x - middle_x) * dx + (points[i].y - middle_y) * dy; };
  const auto aside = [&](int i) { return dx * (points[i].y - middle_y) - dy * (points[i].x - middle_x); };
  // Where the load's path crosses the line between corner i on its left and corner j on its right.
  const auto crossing = [&](int i, int j) {
    const float left_of_it = aside(i), right_of_it = -aside(j);
    if (!(left_of_it >= 0 && right_of_it > 0)) return -1e30f;
    return (along(i) * right_of_it + along(j) * left_of_it) / (left_of_it + right_of_it);
  };
  float farthest = -1e30f;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) farthest = max(farthest, crossing(i, j));
  if (central_share * farthest > dx * dx + dy * dy) return false;
  // Corners far apart that lose almost none of that distance suit a swaying load; neighbours would not.
  constexpr float enough = 0.985f;
  int left = 0, right = 0;
  float widest = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      if (!(crossing(i, j) >= enough * farthest)) continue;
      const float apart = aside(i) - aside(j);
      if (apart > widest) widest = apart, left = i, right = j;
    }
  if (left == right) return false;
  int third = left == 0 || right == 0 ? (left == 1 || right == 1 ? 2 : 1) : 0, fourth = left, lowest = 0;
  for (int i = 0; i < count; ++i) {
    if (abs(area(points[left], points[right], points[i])) > abs(area(points[left], points[right], points[third])))
      third = i;
    if (points[i].z < points[lowest].z) lowest = i;
  }
  const float side = area(points[left], points[right], points[third]) > 0 ? 1.0f : -1.0f;
  float most = 0;
  for (int i = 0; i < count; ++i) {
    const float gain = max(-side * area(points[right], points[third], points[i]),
                           -side * area(points[third], points[left], points[i]));
    if (gain > most) most = gain, fourth = i;
  }
  if (lowest != third && points[lowest].z < min(points[left].z, points[right].z) - level) fourth = lowest;
  chosen[0] = left, chosen[1] = right, chosen[2] = third, chosen[3] = fourth;
  return true;
}

/// The deepest point and the other corners of the largest quadrilateral that contains it. A point's areas shrink in
/// proportion to its height above the deepest one where that exceeds `level` (m).
FATHOM_HD void choose_largest(const FacePoint* points, int count, float depth_tie, float level,
                              int chosen[max_manifold_points]) {
  float lowest = points[0].z;
  for (int i = 1; i < count; ++i) lowest = min(lowest, points[i].z);
  int deepest = 0;
  while (points[deepest].z > lowest + depth_tie) ++deepest;

  // Twice the areas of the largest triangles over the diagonal from the deepest point to each other one, by weight.
  float left_area[max_face_points], right_area[max_face_points];
  int left[max_face_points], right[max_face_points];
  float dx[max_face_points], dy[max_face_points], weight[max_face_points];
  for (int i = 0; i < count; ++i) {
    dx[i] = points[i].x - points[deepest].x;
    dy[i] = points[i].y - points[deepest].y;
    weight[i] = level / max(points[i].z - lowest, level);
    left_area[i] = right_area[i] = 0;
    left[i] = right[i] = deepest;
  }
  for (int i = 1; i < count; ++i) {
    for (int j = 0; j < i; ++j) {
      const float area = dx[i] * dy[j] - dy[i] * dx[j];
      const float of_i = weight[i] * area, of_j = weight[j] * area;
      if (of_j > left_area[i]) left_area[i] = of_j, left[i] = j;
      if (-of_j > right_area[i]) right_area[i] = -of_j, right[i] = j;
      if (-of_i > left_area[j]) left_area[j] = -of_i, left[j] = i;
      if (of_i > right_area[j]) right_area[j] = of_i, right[j] = i;
    }
  }
  int opposite = deepest == 0 ? 1 : 0;
  for (int i = 0; i < count; ++i) {
    if (left_area[i] + right_area[i] > left_area[opposite] + right_area[opposite]) opposite = i;
  }
  chosen[0] = deepest, chosen[1] = opposite, chosen[2] = left[opposite], chosen[3] = right[opposite];
}

/// Moves the points to keep to the front; returns how many (at most 4). `depth_tie`: points up to this much (m) above
/// the deepest count as equally deep, so rounding does not decide.
FATHOM_HD int reduce(FacePoint* points, int count, float depth_tie, FaceLoad load = {}) {
  if (count <= max_manifold_points) return count;
  int chosen[max_manifold_points];
  float lowest = points[0].z, highest = lowest;
  float min_x = points[0].x, max_x = min_x, min_y = points[0].y, max_y = min_y;
  for (int i = 1; i < count; ++i) {
    lowest = min(lowest, points[i].z), highest = max(highest, points[i].z);
    min_x = min(min_x, points[i].x), max_x = max(max_x, points[i].x);
    min_y = min(min_y, points[i].y), max_y = max(max_y, points[i].y);
  }
  const float level = max(level_height, depth_tie);
  const bool leans = highest - lowest > max(4 * level, sway_slope * max(max_x - min_x, max_y - min_y));
  if (!load.is_known || leans || !choose_towards(load, points, count, level, chosen))
    choose_largest(points, count, depth_tie, level, chosen);
  // In the order of their indices: the result must not depend on which of them is the deepest.
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const bool keep = i == chosen[0] || i == chosen[1] || i == chosen[2] || i == chosen[3];
    if (keep) points[kept++] = points[i];
  }
  return kept;
}

}  // namespace fathom
