#include "geometry/query.hpp"

#include "geometry/compound_query.hpp"
#include "geometry/placed_shape.hpp"
#include "geometry/surface_query.hpp"

namespace fathom {
namespace {

/// A ray in the shape's frame.
struct LocalRay {
  Vec3d origin, translation;
};

struct Entry {
  double fraction = 0;
  Vec3d normal;
  bool starts_inside = false;
};

using Hit = std::optional<Entry>;

const Entry starts_inside{0, {}, true};

/// Ball about `centre`. Half a chord is subtracted from the ray's nearest approach: the textbook's quadratic
/// formula cancels where the ball is small and far (Haines et al.: Ray Tracing Gems, 2019, chapter 7).
Hit cast_at_ball(const LocalRay& ray, Vec3d centre, double radius) {
  const Vec3d s = ray.origin - centre;
  if (dot(s, s) <= radius * radius) return starts_inside;
  const double l = length(ray.translation);
  if (l == 0) return std::nullopt;
  const Vec3d direction = (1 / l) * ray.translation;
  const double approach = -dot(s, direction);
  if (approach < 0) return std::nullopt;
  const Vec3d nearest = s + approach * direction;
  const double room = radius * radius - dot(nearest, nearest);
  if (room < 0) return std::nullopt;
  const double entry = approach - std::sqrt(room);
  if (entry > l) return std::nullopt;
  return Entry{std::max(entry, 0.0) / l, (1 / radius) * (s + entry * direction)};
}

/// The infinite cylinder about z decides where the ray can enter the capsule: through the side between the ends, or
/// beyond an end through that end's ball.
Hit cast_at_capsule(const LocalRay& ray, double radius, double half_length) {
  const auto ball_beyond = [&](double z) {
    return cast_at_ball(ray, {0, 0, z < 0 ? -half_length : half_length}, radius);
  };
  const Vec3d s{ray.origin.x, ray.origin.y, 0};
  if (dot(s, s) <= radius * radius)
    return std::abs(ray.origin.z) <= half_length ? Hit(starts_inside) : ball_beyond(ray.origin.z);
  const Hit side = cast_at_ball({s, {ray.translation.x, ray.translation.y, 0}}, {}, radius);
  if (!side) return std::nullopt;
  const double z = ray.origin.z + side->fraction * ray.translation.z;
  return std::abs(z) <= half_length ? side : ball_beyond(z);
}

/// Clips the ray to the half-spaces whose intersection is the shape (Cyrus, Beck 1978).
class HalfSpaceClip {
 public:
  /// `height` of the ray's origin above the plane and `climb`, the change of height over the whole ray.
  void clip(double height, double climb, Vec3d normal) {
    if (height > 0) inside_ = false;
    if (climb < 0) {
      const double t = -height / climb;
      if (height > 0 && t >= entry_) entry_ = t, normal_ = normal;
    } else if (climb > 0) {
      exit_ = std::min(exit_, -height / climb);
    } else if (height > 0) {
      exit_ = -1;
    }
  }

  Hit hit() const {
    if (inside_) return starts_inside;
    if (entry_ > exit_) return std::nullopt;
    return Entry{entry_, normal_};
  }

 private:
  bool inside_ = true;
  double entry_ = 0, exit_ = 1;
  Vec3d normal_;
};

Hit cast_at_box(const LocalRay& ray, Vec3d half) {
  HalfSpaceClip ray_clip;
  const auto clip = [&](double o, double d, double h, Vec3d normal) {
    ray_clip.clip(o - h, d, normal);
    ray_clip.clip(-o - h, -d, -normal);
  };
  clip(ray.origin.x, ray.translation.x, half.x, {1, 0, 0});
  clip(ray.origin.y, ray.translation.y, half.y, {0, 1, 0});
  clip(ray.origin.z, ray.translation.z, half.z, {0, 0, 1});
  return ray_clip.hit();
}

Hit cast_at_hull(const LocalRay& ray, const HullView& hull) {
  HalfSpaceClip ray_clip;
  for (int i = 0; i < hull.face_count; ++i) {
    const Vec3d normal = to_double(hull.planes[i].normal);
    ray_clip.clip(dot(normal, ray.origin) - to_double(hull.planes[i].offset), dot(normal, ray.translation), normal);
  }
  return ray_clip.hit();
}

Hit cast(const LocalRay& ray, const PlacedShape& shape, ShapeType type) {
  switch (type) {
    case ShapeType::sphere:
      return cast_at_ball(ray, {}, shape.radius);
    case ShapeType::capsule:
      return cast_at_capsule(ray, shape.radius, shape.half.z);
    case ShapeType::box:
      return cast_at_box(ray, shape.half);
    case ShapeType::hull:
      return cast_at_hull(ray, shape.hull);
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      break;  // shapes of many parts: geometry/surface_query.hpp, geometry/compound_query.hpp
  }
  return std::nullopt;
}

}  // namespace

std::optional<SurfaceHit> ray_cast(const Geometry& shape, const Pose& pose, Vec3 origin, Vec3 translation,
                                   double limit) {
  if (shape.is_compound()) return ray_cast_at_compound(shape.compound(), pose, origin, translation, limit);
  if (shape.is_surface()) return ray_cast_at_surface(shape, pose, origin, translation, limit);
  const PlacedShape placed(shape, pose);
  const Vec3d from = to_double(origin), way = to_double(translation);
  const Hit hit = cast({placed.to_local(from - placed.position), placed.to_local(way)}, placed, shape.type);
  if (!hit) return std::nullopt;
  return SurfaceHit{static_cast<float>(hit->fraction), to_float(from + hit->fraction * way),
                    to_float(placed.to_world(hit->normal)), hit->starts_inside};
}

}  // namespace fathom
