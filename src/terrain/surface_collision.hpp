// Contacts of a surface with a convex shape, triangle by triangle and without lists: for devices. As in
// surface_contact.hpp, but touches join their patches as they are found, so their order decides which of two directions
// within 5° of each other a patch gets. Pure.
#pragma once

#include "collision/box_hull.hpp"
#include "math/team.hpp"
#include "terrain/surface_patch.hpp"
#include "terrain/surface_view.hpp"

namespace fathom {

/// A convex shape in its own axes, for `axes_of` and `collide_triangle`.
class ShapeInOwnAxes {
 public:
  FATHOM_HD explicit ShapeInOwnAxes(const Geometry& shape) {
    if (fathom::is_round(shape)) {
      round_ = round_shape(shape);
      inner_ = round_.radius;
      outer_ = max_component(abs(round_.core.from)) + round_.radius;
      return;
    }
    if (shape.type == ShapeType::box) box_ = BoxHull(shape.half_extents);
    hull_ = shape.type == ShapeType::box ? fathom::view(box_) : shape.hull;
    const HullSize size = size_of(hull_);
    inner_ = hull_.inner = size.inner, outer_ = hull_.outer = size.outer + hull_.radius;
  }
  ShapeInOwnAxes(const ShapeInOwnAxes&) = delete;
  ShapeInOwnAxes& operator=(const ShapeInOwnAxes&) = delete;

  FATHOM_HD bool is_round() const { return round_.radius > 0; }
  FATHOM_HD const RoundShape& round() const { return round_; }
  FATHOM_HD const HullView& hull() const { return hull_; }
  FATHOM_HD const HullView& turned() const { return hull_; }
  FATHOM_HD int edge_count() const { return hull_.edge_count / 2; }
  FATHOM_HD EdgeArc edge(int i) const { return edge_arc(hull_, i); }
  FATHOM_HD Quat rotation() const { return {}; }
  FATHOM_HD float inner() const { return inner_; }  ///< m, half the smallest thickness
  FATHOM_HD float outer() const { return outer_; }  ///< m, largest coordinate

 private:
  RoundShape round_{{}, 0};
  BoxHull box_{{1, 1, 1}};
  HullView hull_;
  float inner_ = 0, outer_ = 0;
};

/// The triangles of a surface around a shape at `pose`, in the shape's axes.
struct TrianglesAround {
  const SurfaceView& surface;
  const Pose& pose;
  Aabb box;  ///< of the shape, in the surface's axes

  FATHOM_HD SurfaceTriangle triangle(std::uint32_t number) const {
    return in_axes(pose.rotation, SurfaceTriangle(surface.triangle(number), pose.position));
  }
  // See `collide_triangle`.
  FATHOM_HD bool rises(const SurfaceTriangle& t, unsigned tips, Vec3 axis) const {
    const SharedCorners shared(t, tips);
    const Vec3 at = surface.vertex(shared.names[0]);
    return surface.any_in({at, at}, [&](std::uint32_t number) {
      const Triangle beside = surface.triangle(number);
      if (!shared.are_in(beside.vertices)) return false;
      SurfaceTriangle other;
      for (int k = 0; k < 3; ++k) {
        other.corners[k] = inverse_rotate(pose.rotation, beside.corners[k] - pose.position);
        other.names[k] = beside.vertices[k];
      }
      return does_rise(t, other, shared, axis);
    });
  }
  FATHOM_HD bool is_nearer_elsewhere(Vec3 point, float depth, float tolerance) const {
    const float way = depth - tolerance;
    return way > 0 && surface.any_in(bounds(grown(Aabb{point, point}, 1.001f * way), pose),
                                     [&](std::uint32_t number) { return point_by(number, point).squares < way * way; });
  }
  FATHOM_HD bool is_inside(Vec3 point, float depth) const {
    float in_front = 3e38f, behind = 3e38f;  // squared distances (m²)
    surface.for_each_in(box, [&](std::uint32_t number) {
      const PointByTriangles<OneLane> p = point_by(number, point);
      (p.heights > 0 ? in_front : behind) = min(p.squares, p.heights > 0 ? in_front : behind);
    });
    if (behind < depth * depth || !is_behind(in_front, behind)) return false;
    SurfaceTriangle nearest;
    const bool is_found = surface.any_in(box, [&](std::uint32_t number) {
      if (point_by(number, point).squares > behind) return false;
      nearest = triangle(number);
      return true;
    });
    return is_found && continues_at(nearest, point);
  }

 private:
  /// See `FoundTriangles::continues_at`.
  FATHOM_HD bool continues_at(const SurfaceTriangle& t, Vec3 point) const {
    const unsigned tips = nearest_tips(t, point);
    if (tips == all_tips) return true;
    const SharedCorners shared(t, tips);
    const Vec3 at = surface.vertex(shared.names[0]);
    std::uint32_t walk = 0;
    surface.for_each_in({at, at}, [&](std::uint32_t number) {
      const Triangle beside = surface.triangle(number);
      if (shared.are_in(beside.vertices)) walk += walk_past(beside.vertices, shared);
    });
    return walk == 0;
  }
  FATHOM_HD PointByTriangles<OneLane> point_by(std::uint32_t number, Vec3 point) const {
    TriangleLanes<OneLane> t = begin_lane(triangle(number));
    t.complete();
    return {t, point};
  }
};

/// A touch with one triangle, before it joins a patch.
struct SurfaceTouch {
  Manifold manifold;  ///< points that count
  Vec3 normal;
  float nearest;  ///< m, of all its points
  std::uint8_t material;
  bool touches, is_doubtful, is_deep;
};

/// Which points of doubtful touches count.
enum class SurfacePass {
  true_points,    ///< those that belong to no other side of the surface
  all_points,     ///< along the shortest way out, of a shape that all touches are deeper than
  inside_points,  ///< of the touch with the shortest way out: others belong to one another's sides, as under a ridge
};

/// The patches of one shape; large, so kept in memory of the caller's.
struct PatchSet {
  SurfaceTouch touches[team::size];  ///< with one triangle for each work-item of a team
  SurfaceTouch shortest;             ///< of the pass for inside points
  SurfacePatch patches[max_surface_manifolds];
  float nearest[max_surface_manifolds];  ///< m, least separation of each
  std::uint8_t materials[max_surface_manifolds];
  int count;

  FATHOM_HD void add(const Manifold& m, std::uint8_t material, const Tolerance& tolerance) {
    const float near = nearest_separation(m);
    int best = -1;
    float most = same_direction;
    for (int g = 0; g < count; ++g)
      if (const float cosine = dot(patches[g].normal(), m.normal); cosine > most && materials[g] == material)
        best = g, most = cosine;
    if (best < 0) {
      const bool is_full = count == max_surface_manifolds;  // more directions than anything can rest on
      best = is_full ? shallowest() : count++;
      if (is_full && near >= nearest[best]) return;
      patches[best].begin(m.normal, tolerance);
      nearest[best] = near;
      materials[best] = material;
    } else if (near < nearest[best]) {
      patches[best].set_normal(m.normal);
      nearest[best] = near;
    }
    for (int i = 0; i < m.count; ++i) patches[best].add(m.points[i]);
  }
  /// The deepest patch but for those that are `taken` (a bit each).
  FATHOM_HD int deepest(unsigned taken) const {
    int best = -1;
    for (int g = 0; g < count; ++g)
      if ((taken >> g & 1) == 0 && (best < 0 || nearest[g] < nearest[best])) best = g;
    return best;
  }

 private:
  FATHOM_HD int shallowest() const {
    int most = 0;
    for (int g = 1; g < count; ++g)
      if (nearest[g] > nearest[most]) most = g;
    return most;
  }
};

/// The touch with a triangle.
FATHOM_HD SurfaceTouch touch_of(std::uint32_t number, const TrianglesAround& around, const ShapeInOwnAxes& shape,
                                float margin, const Vec3* pushed, int push_count, const Tolerance& tolerance,
                                SurfacePass pass) {
  SurfaceTouch touch;
  touch.touches = false;
  const SurfaceTriangle t = around.triangle(number);
  const AxesOfTriangles<OneLane> axes = axes_of(t, shape, margin, pushed, push_count);
  if (!axes.near) return touch;
  const TriangleContact contact = collide_triangle(t, axes, shape, margin, around);
  touch.touches = contact.manifold.count > 0;
  if (!touch.touches) return touch;
  touch.manifold = contact.manifold;
  touch.normal = contact.manifold.normal;
  touch.material = around.surface.material_of(number);
  touch.nearest = nearest_separation(contact.manifold);
  touch.is_doubtful = contact.is_doubtful, touch.is_deep = contact.is_deep;
  if (!contact.is_doubtful) return touch;
  if (pass == SurfacePass::true_points) leave_true_points(touch.manifold, around, tolerance.side);
  if (pass == SurfacePass::inside_points) {
    leave_inside_points(touch.manifold, around, tolerance.side);
    touch.nearest = nearest_separation(touch.manifold);
  }
  return touch;
}

/// Manifolds in the surface's frame, deepest first, where the shape `b` is nearer than `margin` (m). Called by a whole
/// team (math/team.hpp), whose leader alone gets them. Normals point from the surface to the shape. `pushes`: the last
/// step's manifolds. `centre`: from the shape's centre to its body's centre of mass (m, the surface's axes); the load
/// is assumed there until a push locates it.
FATHOM_HD void collide_surface(const SurfaceView& surface, const Geometry& b, const Pose& b_in_a, float margin,
                               const SurfacePush* pushes, int push_count, PatchSet& set, SurfaceContact& contact,
                               Vec3 centre) {
  contact.count = 0;
  const ShapeInOwnAxes shape(b);
  const Aabb box = grown(bounds(b, b_in_a), margin);
  const TrianglesAround around{surface, b_in_a, box};
  const Tolerance tolerance = make_tolerance(shape.inner(), shape.outer());
  SurfacePush of_shape[max_surface_manifolds];
  Vec3 pushed[max_surface_manifolds];
  for (int i = 0; i < push_count; ++i) {
    of_shape[i] = pushes[i];
    of_shape[i].normal = pushed[i] = inverse_rotate(b_in_a.rotation, pushes[i].normal);
    of_shape[i].load.at = inverse_transform(b_in_a, pushes[i].load.at);
  }
  bool any_sure = false, are_deep = true, any_overlap = false;
  float way_out_at = -3e38f, shortest_at = -3e38f;
  Vec3 way_out;
  SurfacePass pass = SurfacePass::true_points, last_pass;
  do {
    last_pass = pass;
    if (pass != SurfacePass::inside_points) set.count = 0;
    for_each_by_team(
        surface, box,
        [&](std::uint32_t number) {
          // Each work-item collides a triangle of its own; then all touches join their patches in the order of
          // triangles.
          set.touches[team::item()] = touch_of(number, around, shape, margin, pushed, push_count, tolerance, last_pass);
        },
        [&](std::uint32_t count) {
          for (std::uint32_t k = 0; k < count; ++k) {
            const SurfaceTouch& touch = set.touches[k];
            if (!touch.touches) continue;
            if (last_pass == SurfacePass::inside_points) {
              if (!touch.is_doubtful || touch.manifold.count == 0 || touch.nearest <= shortest_at) continue;
              shortest_at = touch.nearest;
              if (team::is_leader()) set.shortest = touch;
              continue;
            }
            if (last_pass == SurfacePass::all_points) {
              if (dot(touch.normal, way_out) < same_direction) continue;
            } else if (touch.is_doubtful) {
              are_deep &= touch.is_deep;
              if (touch.nearest > way_out_at) way_out_at = touch.nearest, way_out = touch.normal;
            } else {
              any_sure = true;
            }
            any_overlap |= touch.manifold.count > 0 && nearest_separation(touch.manifold) < 0;
            if (touch.manifold.count > 0 && team::is_leader()) set.add(touch.manifold, touch.material, tolerance);
          }
        });
    // A second pass where doubtful touches are all there is.
    const bool any_doubtful = way_out_at > -3e38f;
    if (last_pass == SurfacePass::true_points && any_doubtful) {
      if (!any_sure && are_deep)
        pass = SurfacePass::all_points;
      else if (!any_overlap)
        pass = SurfacePass::inside_points;
    }
  } while (pass != last_pass);
  team::sync();

  if (!team::is_leader()) return;
  if (shortest_at > -3e38f) set.add(set.shortest.manifold, set.shortest.material, tolerance);
  contact.count = set.count;
  int second = set.count;  // follows the first manifolds of all patches
  unsigned taken = 0;
  for (int g = 0; g < set.count; ++g) {
    const int deepest = set.deepest(taken);
    taken |= 1u << deepest;
    SurfacePatch& patch = set.patches[deepest];
    Manifold both[2];
    const Vec3 load = load_along(patch.normal(), of_shape, push_count, {}, inverse_rotate(b_in_a.rotation, centre));
    const bool is_reduced = patch.put(both, shape.is_round(), load);
    for (int i = 0; i < 2; ++i) {
      Manifold& m = both[i];
      if (i == 1 && (m.count == 0 || second == max_surface_manifolds)) continue;
      m.normal = rotate(b_in_a.rotation, m.normal);
      for (int k = 0; k < m.count; ++k) m.points[k].position = transform(b_in_a, m.points[k].position);
      const int at = i == 0 ? g : second++;
      contact.manifolds[at] = m;
      contact.is_reduced[at] = is_reduced;
      contact.materials[at] = set.materials[deepest];
    }
  }
  contact.count = second;
}

}  // namespace fathom
