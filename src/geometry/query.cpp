#include "geometry/query.hpp"

namespace fathom {
namespace {

/// A ray in the shape's frame.
struct Ray {
  Vec3 origin;
  Vec3 translation;
};

using Hit = std::optional<SurfaceHit>;

constexpr SurfaceHit starts_inside{0, {0, 0, 0}};

/// Ball about `centre`. Half a chord is subtracted from the ray's nearest approach: the textbook's quadratic
/// formula cancels where the ball is small and far (Haines et al.: Ray Tracing Gems, 2019, chapter 7).
Hit cast_at_ball(const Ray& ray, Vec3 centre, float radius) {
  const Vec3 s = ray.origin - centre;
  if (length_squared(s) <= radius * radius) return starts_inside;
  const float l = length(ray.translation);
  if (l == 0) return std::nullopt;
  const Vec3 direction = (1 / l) * ray.translation;
  const float approach = -dot(s, direction);
  if (approach < 0) return std::nullopt;
  const Vec3 nearest = mul_add(s, approach, direction);
  const float room = radius * radius - length_squared(nearest);
  if (room < 0) return std::nullopt;
  const float entry = approach - fathom::sqrt(room);
  if (entry > l) return std::nullopt;
  return SurfaceHit{max(entry, 0) / l, normalize(mul_add(s, entry, direction))};
}

/// The infinite cylinder about z decides which part of the capsule the ray can enter by: its side between the
/// ends, or else the ball at the end on that side.
Hit cast_at_capsule(const Ray& ray, float radius, float half_length) {
  const auto ball_beyond = [&](float z) {
    return cast_at_ball(ray, {0, 0, z < 0 ? -half_length : half_length}, radius);
  };
  const Vec3 s{ray.origin.x, ray.origin.y, 0};
  if (length_squared(s) <= radius * radius) {
    return fathom::abs(ray.origin.z) <= half_length ? Hit(starts_inside) : ball_beyond(ray.origin.z);
  }
  const Hit side = cast_at_ball({s, {ray.translation.x, ray.translation.y, 0}}, {0, 0, 0}, radius);
  if (!side) return std::nullopt;
  const float z = fathom::fma(side->fraction, ray.translation.z, ray.origin.z);
  return fathom::abs(z) <= half_length ? side : ball_beyond(z);
}

/// Clips the ray to the half spaces that the shape is the common part of (Cyrus, Beck 1978).
class HalfSpaceClip {
 public:
  /// `height` of the ray's origin above the plane and `climb`, the change of height over the whole ray.
  void clip(float height, float climb, Vec3 normal) {
    if (height > 0) inside_ = false;
    if (climb < 0) {
      const float t = -height / climb;
      if (height > 0 && t >= entry_) entry_ = t, normal_ = normal;
    } else if (climb > 0) {
      exit_ = min(exit_, -height / climb);
    } else if (height > 0) {
      exit_ = -1;
    }
  }

  Hit hit() const {
    if (inside_) return starts_inside;
    if (entry_ > exit_) return std::nullopt;
    return SurfaceHit{entry_, normal_};
  }

 private:
  bool inside_ = true;
  float entry_ = 0, exit_ = 1;
  Vec3 normal_;
};

Hit cast_at_box(const Ray& ray, Vec3 half_extents) {
  HalfSpaceClip ray_clip;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 normal{axis == 0 ? 1.f : 0.f, axis == 1 ? 1.f : 0.f, axis == 2 ? 1.f : 0.f};
    const float o = ray.origin[axis], d = ray.translation[axis], h = half_extents[axis];
    ray_clip.clip(o - h, d, normal);
    ray_clip.clip(-o - h, -d, -normal);
  }
  return ray_clip.hit();
}

Hit cast_at_hull(const Ray& ray, const HullView& hull) {
  HalfSpaceClip ray_clip;
  for (int i = 0; i < hull.face_count; ++i) {
    const Hull::Plane& plane = hull.planes[i];
    ray_clip.clip(dot(plane.normal, ray.origin) - plane.offset, dot(plane.normal, ray.translation), plane.normal);
  }
  return ray_clip.hit();
}

Hit cast(const Ray& ray, const Geometry& shape) {
  switch (shape.type) {
    case ShapeType::sphere:
      return cast_at_ball(ray, {0, 0, 0}, shape.radius);
    case ShapeType::capsule:
      return cast_at_capsule(ray, shape.radius, shape.half_extents.z);
    case ShapeType::box:
      return cast_at_box(ray, shape.half_extents);
    case ShapeType::hull:
      return cast_at_hull(ray, shape.hull);
  }
  return std::nullopt;
}

}  // namespace

std::optional<SurfaceHit> ray_cast(const Geometry& shape, const Pose& pose, Vec3 origin, Vec3 translation) {
  Hit hit = cast({inverse_transform(pose, origin), inverse_rotate(pose.rotation, translation)}, shape);
  if (hit) hit->normal = rotate(pose.rotation, hit->normal);
  return hit;
}

}  // namespace fathom
