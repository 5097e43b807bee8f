// The patches in which a surface touches a convex shape, one for each contact direction, and the points that remain of
// them. Pure, for host and device.
#pragma once

#include "collision/clip.hpp"
#include "terrain/resting_points.hpp"
#include "terrain/triangle_contact.hpp"

namespace fathom {

inline constexpr int max_surface_manifolds = 8;
/// Minimum cosine between normals of manifolds that count as the same from step to step.
inline constexpr float alike_normals = 0.9f;

struct SurfaceContact {
  Manifold manifolds[max_surface_manifolds];
  bool is_reduced[max_surface_manifolds];         ///< it lacks some points
  std::uint8_t materials[max_surface_manifolds];  ///< which of the surface's it has
  int count = 0;
};

/// A manifold by which the surface pushed the shape in the last step.
struct SurfacePush {
  Vec3 normal;     ///< unit, the surface's axes
  PatchLoad load;  ///< the surface's frame
};

/// Normals within about 5° of each other share one manifold.
inline constexpr float same_direction = 0.996f;

/// The points of a group. Up to `max_face_points` are kept until `put` chooses those of the manifolds.
class SurfacePatch {
 public:
  SurfacePatch() = default;  // empty only after `begin`
  FATHOM_HD SurfacePatch(Vec3 normal, const Tolerance& tolerance) { begin(normal, tolerance); }

  FATHOM_HD void begin(Vec3 normal, const Tolerance& tolerance) {
    tolerance_ = tolerance;
    count_ = 0;
    set_normal(normal);
  }
  FATHOM_HD void set_normal(Vec3 normal) { frame_ = make_face_frame({normal, 0}); }
  FATHOM_HD Vec3 normal() const { return frame_.n; }

  FATHOM_HD void add(const ManifoldPoint& point) {
    // Adjacent triangles both report the corners that they share.
    const float apart = tolerance_.side * tolerance_.side;
    for (int i = 0; i < count_; ++i)
      if (length_squared(kept_[i].position - point.position) <= apart) {
        if (point.separation < kept_[i].separation) kept_[i] = point;
        return;
      }
    if (count_ == max_face_points) thin_out();
    kept_[count_++] = point;
  }

  /// Writes up to two manifolds with the same normal. Returns whether points were left out. `load`: position of the
  /// body's load (m).
  FATHOM_HD bool put(Manifold (&m)[2], bool of_round, Vec3 load) {
    m[0].normal = m[1].normal = frame_.n;
    if (of_round) {
      put_line(m[0]);
      return false;
    }
    FacePoint points[max_face_points];
    to_face(points);
    const FaceLoad at{dot(frame_.x, load), dot(frame_.y, load), true};
    const RestingPoints chosen = choose_resting_points(points, count_, tolerance_.depth_tie, at);
    m[0].count = chosen.under_load, m[1].count = chosen.around;
    for (int i = 0; i < m[0].count; ++i) m[0].points[i] = kept_[points[i].feature];
    for (int i = 0; i < m[1].count; ++i) m[1].points[i] = kept_[points[m[0].count + i].feature];
    return m[0].count + m[1].count < count_;
  }

 private:
  FATHOM_HD void to_face(FacePoint* points) const {
    for (int i = 0; i < count_; ++i) {
      points[i] = fathom::to_face(frame_, kept_[i].position, static_cast<std::uint32_t>(i));
      points[i].z = kept_[i].separation;
    }
  }

  /// A round shape touches along a line. Keeps the line's two ends, or the deepest point instead of the end nearer to
  /// it.
  FATHOM_HD void put_line(Manifold& m) const {
    int deepest = 0;
    for (int i = 1; i < count_; ++i)
      if (kept_[i].separation < kept_[deepest].separation) deepest = i;
    int end = farthest_from(deepest), other = farthest_from(end);
    if (kept_[deepest].separation < min(kept_[end].separation, kept_[other].separation) - tolerance_.depth_tie)
      other = deepest;
    m.points[0] = kept_[end];
    m.points[1] = kept_[other];
    m.count = end == other ? 1 : 2;
  }
  FATHOM_HD int farthest_from(int i) const {
    int farthest = i;
    float most = 0;
    for (int k = 0; k < count_; ++k) {
      const float apart = length_squared(kept_[k].position - kept_[i].position);
      if (apart > most) farthest = k, most = apart;
    }
    return farthest;
  }

  /// Keeps the farthest points in sixteen directions and the lowest half.
  FATHOM_HD void thin_out() {
    constexpr float x[] = {1, 0.924f, 0.707f, 0.383f, 0, -0.383f, -0.707f, -0.924f};
    constexpr float y[] = {0, 0.383f, 0.707f, 0.924f, 1, 0.924f, 0.707f, 0.383f};
    FacePoint points[max_face_points];
    to_face(points);
    bool stays[max_face_points];
    for (int i = 0; i < count_; ++i) {
      int lower = 0;
      for (int k = 0; k < count_; ++k) lower += points[k].z < points[i].z || (points[k].z == points[i].z && k < i);
      stays[i] = lower < low_points;
    }
    for (int direction = 0; direction < 8; ++direction) {
      int farthest = 0, nearest = 0;
      const auto along = [&](int i) { return points[i].x * x[direction] + points[i].y * y[direction]; };
      for (int i = 1; i < count_; ++i) {
        if (along(i) > along(farthest)) farthest = i;
        if (along(i) < along(nearest)) nearest = i;
      }
      stays[farthest] = stays[nearest] = true;
    }
    int left = 0;
    for (int i = 0; i < count_; ++i)
      if (stays[i]) kept_[left++] = kept_[i];
    count_ = left;
  }

  static constexpr int low_points = max_face_points / 2;
  static_assert(low_points + 16 < max_face_points);

  Tolerance tolerance_;
  FaceFrame frame_;
  ManifoldPoint kept_[max_face_points];
  int count_;
};

/// Position of a body's load relative to `origin` (m): where it was in the push whose normal is nearest, moved a little
/// towards the body's centre of mass. Without that shift, a body that lies alone would only know the peak that it
/// stands on at the moment. Without a push, the load is at the centre of mass.
FATHOM_HD Vec3 load_along(Vec3 normal, const SurfacePush* pushes, int count, Vec3 origin, Vec3 centre) {
  constexpr float share_of_centre = 0.2f;
  PatchLoad load;
  float nearest = alike_normals;
  for (int i = 0; i < count; ++i)
    if (const float cosine = dot(pushes[i].normal, normal); cosine > nearest) nearest = cosine, load = pushes[i].load;
  if (!load.is_known) return centre;
  return mul_add((1 - share_of_centre) * (load.at - origin), share_of_centre, centre);
}

/// Whether a point of a doubtful touch is not nearer to another side of the surface (`collide_triangle`). A box on a
/// plateau reaches far behind the cliff beside it, but does not penetrate the cliff. A rod whose end has run into a
/// slope does penetrate it.
FATHOM_HD bool is_true_point(const Manifold& m, int i, const auto& around, float tolerance) {
  const ManifoldPoint& point = m.points[i];
  const Vec3 of_shape = mul_add(point.position, 0.5f * point.separation, m.normal);
  return !around.is_nearer_elsewhere(of_shape, -point.separation, tolerance);
}
/// Whether a point of a touch is behind the surface, `depth` (m) at least.
FATHOM_HD bool is_inside_point(const Manifold& m, int i, const auto& around, float depth) {
  const ManifoldPoint& point = m.points[i];
  return around.is_inside(mul_add(point.position, 0.5f * point.separation, m.normal), depth);
}

/// Keeps the points i for which stays(i).
FATHOM_HD void leave_points(Manifold& m, const auto& stays) {
  int left = 0;
  for (int i = 0; i < m.count; ++i)
    if (stays(i)) m.points[left++] = m.points[i];
  m.count = left;
}
FATHOM_HD void leave_true_points(Manifold& m, const auto& around, float tolerance) {
  leave_points(m, [&](int i) { return is_true_point(m, i, around, tolerance); });
}
FATHOM_HD void leave_inside_points(Manifold& m, const auto& around, float depth) {
  leave_points(m, [&](int i) { return is_inside_point(m, i, around, depth); });
}

}  // namespace fathom
