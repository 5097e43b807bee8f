// Contact reduction: four points out of many.
//
// Of a patch whose load is not known the deepest point stays. Of the quadrilaterals that have it as a corner the
// largest is found exactly: for each opposite corner the best points on either side of the diagonal are independent of
// each other, so all pairs need to be looked at once only. High points count less, because a body that leans comes down
// on the corners next to the deepest one first: a cylinder that rolls on its rim would come down between points that
// are far apart. Once the load of a patch that does not lean has moved out of what is kept, the edge over which the
// body would tip stays. The points may come in any order.
#pragma once

#include "collision/manifold.hpp"

namespace fathom {

/// A point found by clipping, in the frame of the reference face: x and y in the face, z its height over it.
struct FacePoint {
  float x, y, z;
  std::uint32_t feature;
};

inline constexpr int max_face_points = 64;

/// m that a point may be above the deepest one and carry as well: contacts give by as much under a body's weight.
inline constexpr float level_height = 3e-4f;

/// Where the load of a patch lies, in the frame of the reference face (m).
struct FaceLoad {
  float x = 0, y = 0;
  bool is_known = false;
};

/// Twice the area of the triangle.
FATHOM_HD float area(const FacePoint& a, const FacePoint& b, const FacePoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The points to keep of a patch with this load: the two corners between which it would leave the patch, on its way
/// from the middle, so that the body tips over the patch's own edge, and the two that make the largest area with them,
/// one after the other. The lowest takes the last one's place where it lies clearly below the edge. False: the load is
/// in the middle.
FATHOM_HD bool choose_towards(FaceLoad load, const FacePoint* points, int count, float depth_tie,
                              int chosen[max_manifold_points]) {
  float middle_x = 0, middle_y = 0;
  for (int i = 0; i < count; ++i) middle_x += points[i].x, middle_y += points[i].y;
  const float share = 1.0f / static_cast<float>(count);
  middle_x *= share, middle_y *= share;
  const float dx = load.x - middle_x, dy = load.y - middle_y;
  const auto along = [&](int i) { return (points[i].x - middle_x) * dx + (points[i].y - middle_y) * dy; };
  const auto aside = [&](int i) { return dx * (points[i].y - middle_y) - dy * (points[i].x - middle_x); };
  // Between corners i and j, as they lie to the left and the right of its way.
  const auto crossing = [&](int i, int j) {
    const float left_of_it = aside(i), right_of_it = -aside(j);
    if (!(left_of_it >= 0 && right_of_it > 0)) return -1e30f;
    return (along(i) * right_of_it + along(j) * left_of_it) / (left_of_it + right_of_it);
  };
  float farthest = -1e30f;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) farthest = max(farthest, crossing(i, j));
  // Corners far apart that lose next to nothing of that serve a load that sways; neighbours would not.
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
  if (lowest != third && points[lowest].z < min(points[left].z, points[right].z) - depth_tie) fourth = lowest;
  chosen[0] = left, chosen[1] = right, chosen[2] = third, chosen[3] = fourth;
  return true;
}

/// The deepest point, and of the largest quadrilateral that has it as a corner the others. The areas of what is higher
/// than `level` (m) above the deepest count less, as heights do.
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

/// Reorders the points so that those to keep come first; returns how many (at most 4).
/// `depth_tie`: points that much (m) above the deepest count as equally deep, so that rounding does not choose.
FATHOM_HD int reduce(FacePoint* points, int count, float depth_tie, FaceLoad load = {}) {
  if (count <= max_manifold_points) return count;
  int chosen[max_manifold_points];
  float lowest = points[0].z, highest = lowest;
  for (int i = 1; i < count; ++i) lowest = min(lowest, points[i].z), highest = max(highest, points[i].z);
  const float level = max(level_height, depth_tie);
  const bool leans = highest - lowest > 4 * level;
  if (!load.is_known || leans || !choose_towards(load, points, count, depth_tie, chosen))
    choose_largest(points, count, depth_tie, level, chosen);
  // In the order of their indices, so that the result does not depend on which of them is the deepest.
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const bool keep = i == chosen[0] || i == chosen[1] || i == chosen[2] || i == chosen[3];
    if (keep) points[kept++] = points[i];
  }
  return kept;
}

}  // namespace fathom
