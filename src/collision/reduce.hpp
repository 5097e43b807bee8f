// Contact reduction: four points out of many.
//
// The deepest point stays. Of the quadrilaterals that have it as a corner the largest is found exactly: for each
// opposite corner the best points on either side of the diagonal are independent of each other, so all pairs need
// to be looked at once only. The points may come in any order.
#pragma once

#include "collision/manifold.hpp"

namespace fathom {

/// A point found by clipping, in the frame of the reference face: x and y in the face, z its height over it.
struct FacePoint {
  float x, y, z;
  std::uint32_t feature;
};

inline constexpr int max_face_points = 64;

/// Reorders the points so that those to keep come first; returns how many (at most 4).
/// `depth_tie`: points that much (m) above the deepest count as equally deep, so that rounding does not choose.
FATHOM_HD int reduce(FacePoint* points, int count, float depth_tie) {
  if (count <= max_manifold_points) return count;

  float lowest = points[0].z;
  for (int i = 1; i < count; ++i) lowest = min(lowest, points[i].z);
  int deepest = 0;
  while (points[deepest].z > lowest + depth_tie) ++deepest;

  // Twice the areas of the largest triangles over the diagonal from the deepest point to each other one.
  float left_area[max_face_points], right_area[max_face_points];
  int left[max_face_points], right[max_face_points];
  float dx[max_face_points], dy[max_face_points];
  for (int i = 0; i < count; ++i) {
    dx[i] = points[i].x - points[deepest].x;
    dy[i] = points[i].y - points[deepest].y;
    left_area[i] = right_area[i] = 0;
    left[i] = right[i] = deepest;
  }
  for (int i = 1; i < count; ++i) {
    for (int j = 0; j < i; ++j) {
      const float area = dx[i] * dy[j] - dy[i] * dx[j];
      if (area > left_area[i]) left_area[i] = area, left[i] = j;
      if (-area > right_area[i]) right_area[i] = -area, right[i] = j;
      if (-area > left_area[j]) left_area[j] = -area, left[j] = i;
      if (area > right_area[j]) right_area[j] = area, right[j] = i;
    }
  }
  int opposite = deepest == 0 ? 1 : 0;
  for (int i = 0; i < count; ++i) {
    if (left_area[i] + right_area[i] > left_area[opposite] + right_area[opposite]) opposite = i;
  }

  // In the order of their indices, so that the result does not depend on which of them is the deepest.
  const int chosen[max_manifold_points] = {deepest, opposite, left[opposite], right[opposite]};
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const bool keep = i == chosen[0] || i == chosen[1] || i == chosen[2] || i == chosen[3];
    if (keep) points[kept++] = points[i];
  }
  return kept;
}

}  // namespace fathom
