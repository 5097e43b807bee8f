#include "terrain/surface_contact.hpp"

#include <algorithm>

#include "collision/clip.hpp"
#include "geometry/support.hpp"
#include "terrain/resting_points.hpp"

namespace fathom {
namespace {

/// Normals within about 5° of each other share one manifold.
constexpr float same_normal = 0.996f;

/// The points of a group. Up to `max_face_points` are kept until `put` chooses those of the manifolds.
class Patch {
 public:
  Patch(Vec3 normal, const Tolerance& tolerance) : tolerance_(tolerance) { frame_ = make_face_frame({normal, 0}); }

  void add(const ManifoldPoint& point) {
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
  bool put(Manifold (&m)[2], bool of_round, Vec3 load) {
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
  void to_face(FacePoint* points) const {
    for (int i = 0; i < count_; ++i) {
      points[i] = fathom::to_face(frame_, kept_[i].position, static_cast<std::uint32_t>(i));
      points[i].z = kept_[i].separation;
    }
  }

  /// A round shape touches along a line. Keeps the line's two ends, or the deepest point instead of the end nearer to
  /// it.
  void put_line(Manifold& m) const {
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
  int farthest_from(int i) const {
    int farthest = i;
    float most = 0;
    for (int k = 0; k < count_; ++k) {
      const float apart = length_squared(kept_[k].position - kept_[i].position);
      if (apart > most) farthest = k, most = apart;
    }
    return farthest;
  }

  /// Keeps the farthest points in sixteen directions and the lowest half.
  void thin_out() {
    constexpr float x[] = {1, 0.924f, 0.707f, 0.383f, 0, -0.383f, -0.707f, -0.924f};
    constexpr float y[] = {0, 0.383f, 0.707f, 0.924f, 1, 0.924f, 0.707f, 0.383f};
    FacePoint points[max_face_points];
    to_face(points);
    bool stays[max_face_points];
    float heights[max_face_points];
    for (int i = 0; i < count_; ++i) heights[i] = points[i].z;
    std::nth_element(heights, heights + low_points - 1, heights + count_);
    int low = 0;
    for (int i = 0; i < count_; ++i) {
      stays[i] = low < low_points && points[i].z <= heights[low_points - 1];
      low += stays[i];
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
  int count_ = 0;
};

/// Keeps the points of a doubtful touch that are not nearer to another side of the surface. A box on a plateau reaches
/// far behind the cliff beside it, but does not penetrate the cliff. A rod whose end has run into a slope does
/// penetrate it.
void leave_true_points(Manifold& m, const FoundTriangles& found, float tolerance) {
  int left = 0;
  for (int i = 0; i < m.count; ++i) {
    const ManifoldPoint& point = m.points[i];
    const Vec3 of_shape = mul_add(point.position, 0.5f * point.separation, m.normal);
    if (!found.is_nearer_outside(of_shape, -point.separation, tolerance)) m.points[left++] = point;
  }
  m.count = left;
}

/// If all touches are deeper than the shape is thick, keeps those along the normal with the shortest way out.
void keep_shallowest(std::vector<SurfaceScratch::Touch>& touches) {
  const Vec3 way_out = std::ranges::max(touches, {}, &SurfaceScratch::Touch::nearest).manifold.normal;
  std::erase_if(touches, [&](const SurfaceScratch::Touch& t) { return dot(t.manifold.normal, way_out) < same_normal; });
}

/// Adds the points of doubtful touches that belong to no other side of the surface.
void add_doubtful(std::vector<SurfaceScratch::Touch>& touches, std::vector<SurfaceScratch::Touch>& doubtful,
                  const FoundTriangles& found, float tolerance) {
  if (touches.empty() && std::ranges::all_of(doubtful, &SurfaceScratch::Touch::is_deep)) {
    touches.swap(doubtful);
    if (!touches.empty()) keep_shallowest(touches);
    return;
  }
  for (SurfaceScratch::Touch& touch : doubtful) {
    leave_true_points(touch.manifold, found, tolerance);
    if (touch.manifold.count == 0) continue;
    touch.nearest = nearest_of(touch.manifold);
    touches.push_back(touch);
  }
}

/// Position of a body's load relative to `origin` (m): where it was in the push whose normal is nearest, moved a little
/// towards the body's centre of mass. Without that shift, a body that lies alone would only know the peak that it
/// stands on at the moment. Without a push, the load is at the centre of mass.
Vec3 load_along(Vec3 normal, std::span<const SurfacePush> pushes, Vec3 origin, Vec3 centre) {
  constexpr float share_of_centre = 0.2f;
  PatchLoad load;
  float nearest = alike_normals;
  for (const SurfacePush& push : pushes)
    if (const float cosine = dot(push.normal, normal); cosine > nearest) nearest = cosine, load = push.load;
  if (!load.is_known) return centre;
  return mul_add((1 - share_of_centre) * (load.at - origin), share_of_centre, centre);
}

/// Assigns every touch to a group. Returns the number of groups; `normals` gets theirs, deepest first.
int group(std::vector<SurfaceScratch::Touch>& touches, Vec3 (&normals)[max_surface_manifolds]) {
  int groups = 0;
  for (SurfaceScratch::Touch& touch : touches) {
    int best = -1;
    float nearest = same_normal;
    for (int g = 0; g < groups; ++g) {
      const float cosine = dot(normals[g], touch.manifold.normal);
      if (cosine > nearest) best = g, nearest = cosine;
    }
    if (best < 0 && groups < max_surface_manifolds) {
      best = groups;
      normals[groups++] = touch.manifold.normal;
    }
    touch.group = best;  // −1: no group, as there are more directions than anything can rest on
  }
  return groups;
}

}  // namespace

bool find_triangles(const Surface& surface, const Aabb& box, Vec3 origin, SurfaceScratch& scratch) {
  scratch.triangles.clear();
  surface.find(box, scratch.triangles);
  scratch.eights.clear();
  for (const std::uint32_t t : scratch.triangles) {
    if (scratch.eights.empty() || scratch.eights.back().count == 8) scratch.eights.emplace_back();
    scratch.eights.back().add({surface.triangle(t), origin});
  }
  return !scratch.triangles.empty();
}

void collide_surface(const Surface& surface, const Geometry& b, const Pose& b_in_a, float margin,
                     std::span<const SurfacePush> pushes, SurfaceScratch& scratch, SurfaceContact& contact,
                     Vec3 centre) {
  auto& [triangles, eights, index, pushed, shape, touches, doubtful] = scratch;
  contact.count = 0;
  if (!find_triangles(surface, grown(bounds(b, b_in_a), margin), b_in_a.position, scratch)) return;
  shape.turn(b, b_in_a.rotation);
  const FoundTriangles found(eights, index);
  touches.clear(), doubtful.clear(), pushed.clear();
  for (const SurfacePush& push : pushes) pushed.push_back(push.normal);
  for (const EightTriangles& eight : eights) {
    const TriangleAxes axes = axes_of(eight, shape, margin, pushed);
    for (unsigned near = axes.near; near != 0; near &= near - 1) {
      const int lane = lowest_bit(near);
      const auto [m, is_doubtful, is_deep] = collide_triangle(eight.at(lane), axes, lane, shape, margin, found);
      if (m.count > 0) (is_doubtful ? doubtful : touches).push_back({m, nearest_of(m), is_deep, 0});
    }
  }
  const Tolerance tolerance = make_tolerance(shape.inner(), shape.outer());
  add_doubtful(touches, doubtful, found, tolerance.side);
  if (touches.empty()) return;
  std::ranges::stable_sort(touches, {}, &SurfaceScratch::Touch::nearest);

  Vec3 normals[max_surface_manifolds];
  contact.count = group(touches, normals);
  int second = contact.count;  // follows the first manifolds of all groups
  for (int g = 0; g < contact.count; ++g) {
    Patch patch(normals[g], tolerance);
    for (const SurfaceScratch::Touch& touch : touches) {
      if (touch.group != g) continue;
      for (int i = 0; i < touch.manifold.count; ++i) patch.add(touch.manifold.points[i]);
    }
    Manifold both[2];
    const bool is_reduced = patch.put(both, shape.is_round(), load_along(normals[g], pushes, b_in_a.position, centre));
    for (Manifold& m : both) {
      for (int i = 0; i < m.count; ++i) m.points[i].position += b_in_a.position;
      if (&m == &both[1] && (m.count == 0 || second == max_surface_manifolds)) continue;
      const int at = &m == &both[0] ? g : second++;
      contact.manifolds[at] = m;
      contact.is_reduced[at] = is_reduced;
    }
  }
  contact.count = second;
}

}  // namespace fathom
