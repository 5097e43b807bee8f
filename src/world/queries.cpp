// World's queries: check arguments, find candidates in the simulator's tree, and test each exactly.
//
// Results depend only on bodies and poses, not on the tree, so all simulators give the same.
#include <algorithm>
#include <fathom/world.hpp>
#include <string>

#include "geometry/any_query.hpp"
#include "geometry/compound_query.hpp"
#include "geometry/query.hpp"
#include "geometry/separation.hpp"
#include "geometry/support.hpp"
#include "geometry/surface_query.hpp"
#include "world/simulator.hpp"
#include "world/validate.hpp"

namespace fathom {

namespace {

bool is_before(float fraction, BodyId id, const CastHit& other) {
  return fraction != other.fraction ? fraction < other.fraction : id.index < other.body.index;
}

QuerySight sight_of(const QueryFilter& filter) { return {filter.mask, filter.category, filter.group, filter.sensors}; }

PlacedShape placed(const ShapeCast& cast) { return {geometry(*cast.shape), cast.pose}; }

MovingBox box_of(const Ray& ray) { return {ray.origin, {}, ray.translation}; }
MovingBox box_of(const PlacedShape& shape, Vec3 translation) {
  return {to_float(shape.position), to_float(shape.reach()), translation};
}

auto meeting(const Ray& ray) {
  return [ray](const Geometry& shape, const Pose& pose, double limit) { return ray_cast(shape, pose, ray, limit); };
}
auto meeting(const PlacedShape& moving, Vec3 translation) {
  return [&moving, translation](const Geometry& shape, const Pose& pose, double limit) {
    return shape_cast_at(moving, translation, shape, pose, limit);
  };
}

/// The data of one query.
class Query {
 public:
  Query(const Simulator& simulator, const QueryFilter& filter, const char* action)
      : bodies_(simulator.bodies), simulator_(simulator), filter_(filter) {
    for (const BodyId id : filter.ignored) bodies_.slot(id, action);
    poses_ = simulator.prepare_queries();
  }

  /// The nearest hit among bodies whose boxes `box` meets. `meet(geometry, pose, limit)` returns an optional
  /// `SurfaceHit` up to the fraction `limit`. Of equal hits the body with the lowest index wins.
  template <class Meet>
  std::optional<CastHit> nearest(const MovingBox& box, const Meet& meet) const {
    std::optional<CastHit> nearest;
    for_each_in(box, [&](std::uint32_t slot) {
      const double limit = limit_beyond(nearest ? nearest->fraction : 1.0f);
      const std::optional<SurfaceHit> hit = meet(bodies_[slot].geometry, poses_[slot], limit);
      const bool is_nearer = hit && (!nearest || is_before(hit->fraction, bodies_.id(slot), *nearest));
      if (is_nearer && accepts(slot)) nearest = cast_hit(slot, *hit);
      return nearest ? nearest->fraction : 1.0f;
    });
    return nearest;
  }

  // Many at once: on the simulator's device, or on the world's threads, or, with a callback, on the caller's.
  void cast(std::span<const Ray> rays, std::span<std::optional<CastHit>> hits) const;
  void cast(std::span<const ShapeCast> casts, std::span<std::optional<CastHit>> hits) const;
  void overlap(std::span<const ShapeCast> shapes, std::span<std::vector<BodyId>> found) const;

  /// All hits, nearest first.
  template <class Meet>
  std::vector<CastHit> all(const MovingBox& box, const Meet& meet) const {
    std::vector<CastHit> hits;
    for_each_in(box, [&](std::uint32_t slot) {
      const std::optional<SurfaceHit> hit = meet(bodies_[slot].geometry, poses_[slot], 1.0);
      if (hit && accepts(slot)) hits.push_back(cast_hit(slot, *hit));
      return 1.0f;
    });
    std::ranges::sort(hits, [](const CastHit& a, const CastHit& b) { return is_before(a.fraction, a.body, b); });
    return hits;
  }

  /// Bodies whose boxes `box` meets and for which overlap(geometry, pose) is true, ascending.
  template <class Overlap>
  std::vector<BodyId> overlaps(const MovingBox& box, const Overlap& overlap) const {
    std::vector<BodyId> ids;
    for_each_in(box, [&](std::uint32_t slot) {
      if (overlap(bodies_[slot].geometry, poses_[slot]) && accepts(slot)) ids.push_back(bodies_.id(slot));
      return 1.0f;
    });
    std::ranges::sort(ids, {}, &BodyId::index);
    return ids;
  }

  /// Bodies that the shape touches or overlaps, ascending.
  std::vector<BodyId> touching(const PlacedShape& shape) const {
    return overlaps(box_of(shape, {}),
                    [&](const Geometry& other, const Pose& at) { return touches(shape, other, at); });
  }

  const Geometry& geometry(std::uint32_t slot) const { return bodies_[slot].geometry; }
  const Pose& pose(std::uint32_t slot) const { return poses_[slot]; }

 private:
  /// Calls act(i) for all of `count` queries, on the world's threads unless the filter has a callback, which is called
  /// on the caller's thread alone.
  template <class Act>
  void divide(std::size_t count, const Act& act) const {
    const auto one_by_one = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) act(i);
    };
    if (filter_.accepts) return one_by_one(0, count);
    simulator_.divide_query(count, one_by_one);
  }

  /// Whether ask(many) is true: the simulator has answered all at once.
  template <class Asked, class Ask>
  bool answers(std::span<const Asked> asked, const Ask& ask) const {
    if (filter_.accepts) return false;
    std::vector<std::uint32_t> ignored;
    for (const BodyId id : filter_.ignored) ignored.push_back(id.index);
    std::ranges::sort(ignored);
    return ask(ManyQueries<Asked>{asked, sight_of(filter_), ignored});
  }

  TakeHits write_to(std::span<std::optional<CastHit>> hits) const {
    return [this, hits](std::size_t first, std::span<const BodyHit> found) {
      for (std::size_t i = 0; i < found.size(); ++i)
        hits[first + i] =
            found[i].slot == BodyHit::nothing ? std::nullopt : std::optional(cast_hit(found[i].slot, found[i].hit));
    };
  }

  /// Calls visit(slot) for bodies that pass the mask and the ignore list.
  template <class Visit>
  void for_each_in(const MovingBox& box, const Visit& visit) const {
    struct Visitor final : BodyVisitor {
      Visitor(const Query& of, const Visit& how) : query(of), act(how) {}
      float visit(std::uint32_t slot) override {
        if (query.looks_at(slot)) limit = act(slot);
        return limit;
      }
      const Query& query;
      const Visit& act;
      float limit = 1;
    } visitor(*this, visit);
    simulator_.visit_bodies(box, visitor);
  }

  bool looks_at(std::uint32_t slot) const {
    return sight_of(filter_).sees(bodies_[slot].filter, bodies_[slot].is_sensor) &&
           std::ranges::find(filter_.ignored, slot, &BodyId::index) == filter_.ignored.end();
  }
  bool accepts(std::uint32_t slot) const { return !filter_.accepts || filter_.accepts(bodies_.id(slot)); }

  CastHit cast_hit(std::uint32_t slot, const SurfaceHit& hit) const {
    return {bodies_.id(slot), hit.fraction, hit.point, hit.normal, hit.starts_inside, hit.triangle, hit.child};
  }

  const BodyTable& bodies_;
  const Simulator& simulator_;
  const QueryFilter& filter_;
  std::span<const Pose> poses_;
};

void Query::cast(std::span<const Ray> rays, std::span<std::optional<CastHit>> hits) const {
  if (answers(rays, [&](const ManyRays& many) { return simulator_.cast_rays(many, write_to(hits)); })) return;
  divide(rays.size(), [&](std::size_t i) { hits[i] = nearest(box_of(rays[i]), meeting(rays[i])); });
}

void Query::cast(std::span<const ShapeCast> casts, std::span<std::optional<CastHit>> hits) const {
  if (answers(casts, [&](const ManyShapes& many) { return simulator_.cast_shapes(many, write_to(hits)); })) return;
  divide(casts.size(), [&](std::size_t i) {
    const PlacedShape moving = placed(casts[i]);
    hits[i] = nearest(box_of(moving, casts[i].translation), meeting(moving, casts[i].translation));
  });
}

void Query::overlap(std::span<const ShapeCast> shapes, std::span<std::vector<BodyId>> found) const {
  const TakeTouched take = [&](std::size_t i, std::span<const std::uint32_t> slots) {
    found[i].clear();
    for (const std::uint32_t slot : slots) found[i].push_back(bodies_.id(slot));
  };
  if (answers(shapes, [&](const ManyShapes& many) { return simulator_.overlap_shapes(many, take); })) return;
  divide(shapes.size(), [&](std::size_t i) { found[i] = touching(placed(shapes[i])); });
}

void check_translation(Vec3 translation, const std::string& action) {
  check_finite(translation, action.c_str(), "the translation");
  if (translation == Vec3{}) refuse(action + ": the translation is zero; give the vector from origin to end");
}

void check_ray(const Ray& ray, const std::string& action) {
  check_finite(ray.origin, action.c_str(), "the origin");
  check_translation(ray.translation, action);
}

/// Whether `check_ray` accepts it.
bool is_valid(const Ray& ray) {
  return is_finite(ray.origin) && is_finite(ray.translation) && !(ray.translation == Vec3{});
}

void check_placed(const Shape& shape, const Pose& pose, const char* action) {
  check_shape(shape, action);
  if (shape.is_surface())
    refuse(std::string(action) + ": the shape is a mesh or a height field; ask with a convex one");
  if (shape.compound) refuse(std::string(action) + ": the shape is a compound; ask with each of its children");
  check_pose(pose, action);
}

PlacedShape checked(const Shape& shape, const Pose& pose, const char* action) {
  check_placed(shape, pose, action);
  return {geometry(shape), pose};
}

void check_sizes(std::size_t asked, const char* what, std::size_t room, const char* answers, const char* action) {
  if (asked == room) return;
  refuse(std::string(action) + ": there are " + std::to_string(asked) + " " + what + " and room for " +
         std::to_string(room) + " " + answers + "; give as many of each");
}

/// Calls check(i) for all of `count` arguments; an error names the one that it is about.
template <class Check>
void check_each(std::size_t count, const char* what, const Check& check) {
  std::size_t i = 0;
  try {
    for (; i < count; ++i) check(i);
  } catch (const Error& error) {
    throw Error(error.code(), std::string(what) + " " + std::to_string(i) + ": " + error.what());
  }
}

void check_all(std::span<const ShapeCast> casts, bool are_moving, const char* action) {
  check_each(casts.size(), "shape", [&](std::size_t i) {
    if (!casts[i].shape) refuse(std::string(action) + ": there is no shape; set ShapeCast::shape");
    check_placed(*casts[i].shape, casts[i].pose, action);
    if (are_moving) check_translation(casts[i].translation, action);
  });
}

/// `s` is relative to a shape at position `at`.
ClosestPoints points_of(const Separation& s, Vec3d at) {
  return {static_cast<float>(s.distance), to_float(at + s.on_a), to_float(at + s.on_b), to_float(s.normal)};
}

ClosestPoints turned(const ClosestPoints& p) { return {p.distance, p.on_b, p.on_a, -p.normal}; }

/// The nearest result of points_to(child, pose); of equal ones, that of the child with the lowest index.
template <class PointsTo>
ClosestPoints nearest_child(const Compound& compound, const Pose& pose, const PointsTo& points_to) {
  std::optional<ClosestPoints> nearest;
  for (const ChildShape& child : compound.children()) {
    const ClosestPoints points = points_to(geometry(child.shape), pose * child.pose);
    if (!nearest || points.distance < nearest->distance) nearest = points;
  }
  return *nearest;
}

ClosestPoints closest_points(const PlacedShape& a, const Geometry& b, const Pose& pose) {
  if (b.is_compound())
    return nearest_child(b.compound(), pose, [&](const Geometry& child, const Pose& at) {
      return points_of(separation(a, {child, at}), a.position);
    });
  if (b.is_surface()) return turned(points_of(separation_from_surface(b, pose, a), to_double(pose.position)));
  return points_of(separation(a, {b, pose}), a.position);
}

}  // namespace

std::optional<CastHit> World::cast_ray(Vec3 origin, Vec3 translation, const QueryFilter& filter) const {
  const Ray ray{origin, translation};
  check_ray(ray, "cast ray");
  return Query(*simulator_, filter, "cast ray").nearest(box_of(ray), meeting(ray));
}

std::vector<CastHit> World::cast_ray_all(Vec3 origin, Vec3 translation, const QueryFilter& filter) const {
  const Ray ray{origin, translation};
  check_ray(ray, "cast ray");
  return Query(*simulator_, filter, "cast ray").all(box_of(ray), meeting(ray));
}

void World::cast_rays(std::span<const Ray> rays, std::span<std::optional<CastHit>> hits,
                      const QueryFilter& filter) const {
  check_sizes(rays.size(), "rays", hits.size(), "hits", "cast rays");
  check_each(rays.size(), "ray", [&](std::size_t i) {
    if (!is_valid(rays[i])) check_ray(rays[i], "cast rays");
  });
  Query(*simulator_, filter, "cast rays").cast(rays, hits);
}

std::optional<CastHit> World::cast_shape(const Shape& shape, const Pose& pose, Vec3 translation,
                                         const QueryFilter& filter) const {
  const PlacedShape moving = checked(shape, pose, "cast shape");
  check_translation(translation, "cast shape");
  return Query(*simulator_, filter, "cast shape").nearest(box_of(moving, translation), meeting(moving, translation));
}

std::vector<CastHit> World::cast_shape_all(const Shape& shape, const Pose& pose, Vec3 translation,
                                           const QueryFilter& filter) const {
  const PlacedShape moving = checked(shape, pose, "cast shape");
  check_translation(translation, "cast shape");
  return Query(*simulator_, filter, "cast shape").all(box_of(moving, translation), meeting(moving, translation));
}

void World::cast_shapes(std::span<const ShapeCast> casts, std::span<std::optional<CastHit>> hits,
                        const QueryFilter& filter) const {
  check_sizes(casts.size(), "shapes", hits.size(), "hits", "cast shapes");
  check_all(casts, true, "cast shapes");
  Query(*simulator_, filter, "cast shapes").cast(casts, hits);
}

std::vector<BodyId> World::overlap_aabb(const Aabb& box, const QueryFilter& filter) const {
  check_finite(box.lower, "overlap", "the box's lower corner");
  check_finite(box.upper, "overlap", "the box's upper corner");
  if (min_component(box.upper - box.lower) < 0) refuse("overlap: the box's upper corner is below its lower corner");
  const Vec3 lower = 0.5f * box.lower, upper = 0.5f * box.upper;
  return Query(*simulator_, filter, "overlap")
      .overlaps({lower + upper, upper - lower, {}}, [&](const Geometry& shape, const Pose& pose) {
        return fathom::overlaps(tight_bounds(shape, pose), box);
      });
}

std::vector<BodyId> World::overlap_shape(const Shape& shape, const Pose& pose, const QueryFilter& filter) const {
  return Query(*simulator_, filter, "overlap").touching(checked(shape, pose, "overlap"));
}

void World::overlap_shapes(std::span<const ShapeCast> shapes, std::span<std::vector<BodyId>> found,
                           const QueryFilter& filter) const {
  check_sizes(shapes.size(), "shapes", found.size(), "lists", "overlap shapes");
  check_all(shapes, false, "overlap shapes");
  Query(*simulator_, filter, "overlap shapes").overlap(shapes, found);
}

ClosestPoints World::closest_points(const Shape& shape, const Pose& pose, BodyId body) const {
  const PlacedShape placed = checked(shape, pose, "closest points");
  const std::uint32_t slot = simulator_->bodies.slot(body, "closest points");
  const QueryFilter everything;
  const Query query(*simulator_, everything, "closest points");
  return fathom::closest_points(placed, query.geometry(slot), query.pose(slot));
}

ClosestPoints World::closest_points(BodyId a, BodyId b) const {
  const std::uint32_t slot_a = simulator_->bodies.slot(a, "closest points");
  const std::uint32_t slot_b = simulator_->bodies.slot(b, "closest points");
  const QueryFilter everything;
  const Query query(*simulator_, everything, "closest points");
  const Geometry &of_a = query.geometry(slot_a), &of_b = query.geometry(slot_b);
  if (of_a.is_surface() && of_b.is_surface())
    refuse("closest points: both bodies are meshes or height fields; one of them must be convex");
  if (of_a.is_surface()) return turned(closest_points(b, a));
  if (of_a.is_compound())
    return nearest_child(of_a.compound(), query.pose(slot_a), [&](const Geometry& child, const Pose& at) {
      return fathom::closest_points({child, at}, of_b, query.pose(slot_b));
    });
  return fathom::closest_points({of_a, query.pose(slot_a)}, of_b, query.pose(slot_b));
}

}  // namespace fathom
