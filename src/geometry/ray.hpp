// A ray against one convex shape or one triangle, for host and device. Pure; in double precision, see placed_shape.hpp.
#pragma once

#include <cmath>

#include "geometry/placed_shape.hpp"
#include "geometry/query.hpp"

namespace fathom {

/// Where a ray enters a shape, if it does.
struct RayEntry {
  bool is_hit = false;
  bool starts_inside = false;
  double fraction = 0;  ///< of the ray
  Vec3d normal;         ///< outward; unset if the ray starts inside
};

/// A ray in a shape's frame.
struct LocalRay {
  Vec3d origin, translation;  ///< m
};

FATHOM_HD RayEntry entry_inside() { return {true, true, 0, {}}; }

/// Ball about `centre`. Half a chord is subtracted from the ray's nearest approach: the textbook's quadratic
/// formula cancels where the ball is small and far (Haines et al.: Ray Tracing Gems, 2019, chapter 7).
FATHOM_HD RayEntry enter_ball(const LocalRay& ray, Vec3d centre, double radius) {
  const Vec3d s = ray.origin - centre;
  if (dot(s, s) <= radius * radius) return entry_inside();
  const double l = length(ray.translation);
  if (l == 0) return {};
  const Vec3d direction = (1 / l) * ray.translation;
  const double approach = -dot(s, direction);
  if (approach < 0) return {};
  const Vec3d nearest = s + approach * direction;
  const double room = radius * radius - dot(nearest, nearest);
  if (room < 0) return {};
  const double entry = approach - std::sqrt(room);
  if (entry > l) return {};
  return {true, false, (entry > 0 ? entry : 0.0) / l, (1 / radius) * (s + entry * direction)};
}

/// The infinite cylinder about z decides where the ray can enter the capsule: through the side between the ends, or
/// beyond an end through that end's ball.
FATHOM_HD RayEntry enter_capsule(const LocalRay& ray, double radius, double half_length) {
  const Vec3d s{ray.origin.x, ray.origin.y, 0};
  double z = ray.origin.z;
  if (dot(s, s) <= radius * radius) {
    if (std::abs(z) <= half_length) return entry_inside();
  } else {
    const RayEntry side = enter_ball({s, {ray.translation.x, ray.translation.y, 0}}, {}, radius);
    if (!side.is_hit) return {};
    z += side.fraction * ray.translation.z;
    if (std::abs(z) <= half_length) return side;
  }
  return enter_ball(ray, {0, 0, z < 0 ? -half_length : half_length}, radius);
}

/// Clips the ray to the half-spaces whose intersection is the shape (Cyrus, Beck 1978).
class HalfSpaceClip {
 public:
  /// `height` of the ray's origin above the plane and `climb`, the change of height over the whole ray.
  FATHOM_HD void clip(double height, double climb, Vec3d normal) {
    if (height > 0) inside_ = false;
    if (climb < 0) {
      const double t = -height / climb;
      if (height > 0 && t >= entry_) entry_ = t, normal_ = normal;
    } else if (climb > 0) {
      const double t = -height / climb;
      if (t < exit_) exit_ = t;
    } else if (height > 0) {
      exit_ = -1;
    }
  }

  FATHOM_HD RayEntry entry() const {
    if (inside_) return entry_inside();
    if (entry_ > exit_) return {};
    return {true, false, entry_, normal_};
  }

 private:
  bool inside_ = true;
  double entry_ = 0, exit_ = 1;
  Vec3d normal_;
};

FATHOM_HD RayEntry enter_box(const LocalRay& ray, Vec3d half) {
  HalfSpaceClip ray_clip;
  const auto clip = [&](double o, double d, double h, Vec3d normal) {
    ray_clip.clip(o - h, d, normal);
    ray_clip.clip(-o - h, -d, -normal);
  };
  clip(ray.origin.x, ray.translation.x, half.x, {1, 0, 0});
  clip(ray.origin.y, ray.translation.y, half.y, {0, 1, 0});
  clip(ray.origin.z, ray.translation.z, half.z, {0, 0, 1});
  return ray_clip.entry();
}

FATHOM_HD RayEntry enter_hull(const LocalRay& ray, const HullView& hull) {
  HalfSpaceClip ray_clip;
  for (int i = 0; i < hull.face_count; ++i) {
    const Vec3d normal = to_double(hull.planes[i].normal);
    ray_clip.clip(dot(normal, ray.origin) - to_double(hull.planes[i].offset), dot(normal, ray.translation), normal);
  }
  return ray_clip.entry();
}

/// Whether a point lies in the prism over a face.
FATHOM_HD bool is_over(const HullView& hull, int face, Vec3d point) {
  const Vec3d normal = to_double(hull.planes[face].normal);
  int e = hull.face_edges[face];
  do {
    const int next = hull.edges[e].next;
    const Vec3d from = to_double(hull.vertices[hull.edges[e].origin]);
    const Vec3d along = to_double(hull.vertices[hull.edges[next].origin]) - from;
    if (dot(cross(normal, along), point - from) < 0) return false;
    e = next;
  } while (e != hull.face_edges[face]);
  return true;
}

/// Capsule about an edge.
FATHOM_HD RayEntry enter_edge(const LocalRay& ray, Vec3d from, Vec3d to, double radius) {
  const Vec3d along = to - from, middle = 0.5 * (from + to);
  const double l = length(along);
  const Vec3d z = (1 / l) * along, aside = std::abs(z.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d across = cross(z, aside), x = (1 / length(across)) * across, y = cross(z, x);
  const auto turned = [&](Vec3d v) { return Vec3d{dot(x, v), dot(y, v), dot(z, v)}; };
  RayEntry entry = enter_capsule({turned(ray.origin - middle), turned(ray.translation)}, radius, 0.5 * l);
  const Vec3d n = entry.normal;
  entry.normal = n.x * x + (n.y * y + n.z * z);
  return entry;
}

/// A hull with a radius is the union of the polyhedron, a prism on each face and a capsule about each edge.
FATHOM_HD RayEntry enter_rounded_hull(const LocalRay& ray, const HullView& hull) {
  const double radius = to_double(hull.radius);
  HalfSpaceClip around;
  for (int f = 0; f < hull.face_count; ++f) {
    const Vec3d normal = to_double(hull.planes[f].normal);
    const double offset = to_double(hull.planes[f].offset) + radius;
    around.clip(dot(normal, ray.origin) - offset, dot(normal, ray.translation), normal);
  }
  if (!around.entry().is_hit) return {};
  RayEntry first = enter_hull(ray, hull);
  const auto offer = [&](const RayEntry& entry) {
    if (entry.is_hit && (!first.is_hit || entry.fraction < first.fraction || entry.starts_inside)) first = entry;
  };
  for (int f = 0; f < hull.face_count && !first.starts_inside; ++f) {
    const Vec3d normal = to_double(hull.planes[f].normal);
    const double height = dot(normal, ray.origin) - to_double(hull.planes[f].offset);
    const double climb = dot(normal, ray.translation), t = (radius - height) / climb;
    if (height >= 0 && height <= radius && is_over(hull, f, ray.origin)) offer(entry_inside());
    if (height > radius && climb < 0 && t <= 1 && is_over(hull, f, ray.origin + t * ray.translation))
      offer({true, false, t, normal});
  }
  for (int e = 0; e < hull.edge_count && !first.starts_inside; e += 2)
    offer(enter_edge(ray, to_double(hull.vertices[hull.edges[e].origin]),
                     to_double(hull.vertices[hull.edges[e + 1].origin]), radius));
  return first;
}

/// A ray against a convex shape at a pose; true: `hit` says where.
FATHOM_HD bool meets_convex(const Ray& ray, const Geometry& shape, const Pose& pose, SurfaceHit& hit) {
  const PlacedShape placed(shape, pose);
  const Vec3d from = to_double(ray.origin), way = to_double(ray.translation);
  const LocalRay local{placed.to_local(from - placed.position), placed.to_local(way)};
  RayEntry entry;
  switch (shape.type) {
    case ShapeType::sphere:
      entry = enter_ball(local, {}, placed.radius);
      break;
    case ShapeType::capsule:
      entry = enter_capsule(local, placed.radius, placed.half.z);
      break;
    case ShapeType::box:
      entry = enter_box(local, placed.half);
      break;
    case ShapeType::hull:
      entry = shape.radius > 0 ? enter_rounded_hull(local, shape.hull) : enter_hull(local, shape.hull);
      break;
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      break;  // SurfaceRay, geometry/child_search.hpp
  }
  if (!entry.is_hit) return false;
  hit = SurfaceHit{static_cast<float>(entry.fraction), to_float(from + entry.fraction * way),
                   to_float(placed.to_world(entry.normal)), entry.starts_inside};
  return true;
}

/// A ray against the triangles of a placed surface, one after the other. It hits them only from outside; of equally
/// near ones, that with the lowest number.
class SurfaceRay {
 public:
  /// `surface`: its type and pose count, not its triangles.
  FATHOM_HD SurfaceRay(const Ray& ray, const Geometry& surface, const Pose& pose, double limit)
      : frame_(surface, pose),
        from_(to_double(ray.origin)),
        way_(to_double(ray.translation)),
        local_{frame_.to_local(from_ - frame_.position), frame_.to_local(way_)},
        nearest_(limit) {}

  /// In the surface's frame.
  FATHOM_HD const LocalRay& local() const { return local_; }

  /// Returns the fraction up to which other triangles count. The edge tests have bit-identical signs for the triangles
  /// on both sides of an edge: no ray passes between them (S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle
  /// Intersection", JCGT 2 (2013)).
  FATHOM_HD float meet(std::uint32_t number, const Triangle& triangle) {
    const Vec3d a = to_double(triangle.corners[0]) - local_.origin, b = to_double(triangle.corners[1]) - local_.origin,
                c = to_double(triangle.corners[2]) - local_.origin;
    const Vec3d n = cross(b - a, c - a), way = local_.translation;
    const double approach = -dot(n, way);
    const bool is_through =
        approach > 0 && dot(way, cross(a, b)) <= 0 && dot(way, cross(b, c)) <= 0 && dot(way, cross(c, a)) <= 0;
    if (!is_through) return search_limit(nearest_);
    const double fraction = -dot(n, a) / approach;
    const bool is_nearer = fraction >= 0 && fraction <= nearest_ && !(fraction == nearest_ && number > met_);
    if (is_nearer) nearest_ = fraction, met_ = number, normal_ = n;
    return search_limit(nearest_);
  }

  /// True: `hit` says where the ray met the nearest triangle.
  FATHOM_HD bool hit(SurfaceHit& hit) const {
    if (met_ == no_triangle) return false;
    const bool starts_inside = nearest_ == 0;
    const Vec3d unit = starts_inside ? Vec3d{} : (1 / length(normal_)) * normal_;
    hit = SurfaceHit{static_cast<float>(nearest_), to_float(from_ + nearest_ * way_), to_float(frame_.to_world(unit)),
                     starts_inside, met_};
    return true;
  }

 private:
  PlacedShape frame_;
  Vec3d from_, way_;
  LocalRay local_;
  double nearest_;
  std::uint32_t met_ = no_triangle;
  Vec3d normal_;
};

}  // namespace fathom
