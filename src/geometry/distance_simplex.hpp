// The simplex of GJK in double precision (gjk.hpp). Pure, for host and device.
#pragma once

#include <limits>

#include "math/vec3d.hpp"

namespace fathom {

/// The minimal set of corners that contains the point nearest to the origin, and that point's weights over them.
class DistanceSimplex {
 public:
  /// A point of B − A, and the point of A it comes from.
  struct Corner {
    Vec3d difference, on_a;
  };

  FATHOM_HD int count() const { return count_; }
  FATHOM_HD void add(const Corner& corner) { corners_[count_++] = corner; }
  FATHOM_HD bool has(Vec3d d) const {
    for (int i = 0; i < count_; ++i)
      if (corners_[i].difference.x == d.x && corners_[i].difference.y == d.y && corners_[i].difference.z == d.z)
        return true;
    return false;
  }
  /// The nearest point on A.
  FATHOM_HD Vec3d on_a() const {
    Vec3d sum;
    for (int i = 0; i < count_; ++i) sum += weights_[i] * corners_[i].on_a;
    return sum;
  }

  /// Leaves the corners that the nearest point depends on; returns that point.
  FATHOM_HD Vec3d reduce() {
    Nearest nearest{corners_[0].difference, {1}};
    if (count_ == 2) nearest = of_segment(0, 1);
    if (count_ == 3) nearest = of_triangle(0, 1, 2);
    if (count_ == 4) nearest = of_tetrahedron();
    int kept = 0;
    for (int i = 0; i < count_; ++i)
      if (nearest.weights[i] > 0) {
        weights_[kept] = nearest.weights[i];
        corners_[kept++] = corners_[i];
      }
    count_ = kept;
    return nearest.point;
  }

 private:
  /// A point and its weights over the corners.
  struct Nearest {
    Vec3d point;
    double weights[4] = {};
  };

  FATHOM_HD static double square(Vec3d v) { return dot(v, v); }
  FATHOM_HD static Nearest nearer(const Nearest& a, const Nearest& b) {
    return square(b.point) < square(a.point) ? b : a;
  }

  FATHOM_HD Nearest of_segment(int i, int j) const {
    const Vec3d a = corners_[i].difference, ab = corners_[j].difference - a;
    const double along = -dot(a, ab), whole = square(ab);
    const double t = along > 0 ? (along < whole ? along / whole : 1) : 0;
    Nearest nearest{a + t * ab};
    nearest.weights[i] = 1 - t;
    nearest.weights[j] = t;
    return nearest;
  }

  /// In the interior if the origin is above it, else on one of the edges.
  FATHOM_HD Nearest of_triangle(int i, int j, int k) const {
    const Vec3d a = corners_[i].difference, b = corners_[j].difference, c = corners_[k].difference;
    const Vec3d n = cross(b - a, c - a);
    const double area = square(n);
    // Parts of the triangle opposite each corner.
    const double of_a = dot(n, cross(b, c)), of_b = dot(n, cross(c, a)), of_c = dot(n, cross(a, b));
    if (area > 1e-26 * square(b - a) * square(c - a) && of_a >= 0 && of_b >= 0 && of_c >= 0) {
      Nearest nearest{(dot(n, a) / area) * n};
      const double sum = of_a + of_b + of_c;
      nearest.weights[i] = of_a / sum;
      nearest.weights[j] = of_b / sum;
      nearest.weights[k] = of_c / sum;
      return nearest;
    }
    return nearer(nearer(of_segment(i, j), of_segment(j, k)), of_segment(k, i));
  }

  /// The origin itself if it is inside.
  FATHOM_HD Nearest of_tetrahedron() const {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    Nearest nearest, inside;
    double smallest = infinite;
    for (int without = 0; without < 4; ++without) {
      const int i = without == 0 ? 1 : 0, j = without <= 1 ? 2 : 1, k = without <= 2 ? 3 : 2;
      const Vec3d a = corners_[i].difference;
      const Vec3d n = cross(corners_[j].difference - a, corners_[k].difference - a);
      const double origin = -dot(n, a), fourth = dot(n, corners_[without].difference - a);
      // A face does not separate the origin if the fourth corner is on the same side of it.
      if (origin * fourth > 0) {
        inside.weights[without] = origin / fourth;
        continue;
      }
      const Nearest of_face = of_triangle(i, j, k);
      if (square(of_face.point) >= smallest) continue;
      smallest = square(of_face.point);
      nearest = of_face;
    }
    return smallest < infinite ? nearest : inside;
  }

  Corner corners_[4];
  double weights_[4] = {};
  int count_ = 0;
};

}  // namespace fathom
