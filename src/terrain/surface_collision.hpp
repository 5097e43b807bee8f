// Contacts of a surface with a convex shape, triangle by triangle: for devices. As in surface_contact.hpp, but touches
// join their patches in the order of triangles, which decides which of two directions within 5° of each other a patch
// gets. Pure.
#pragma once

#include "collision/box_hull.hpp"
#include "math/team.hpp"
#include "terrain/surface_patch.hpp"
#include "terrain/surface_view.hpp"

namespace fathom {

/// What a kernel knows of the shapes that it collides.
enum class ShapeKind { any, round, polyhedron };

/// A convex shape in its own axes, for `axes_of` and `collide_triangle`.
template <ShapeKind kind>
class ShapeInOwnAxes {
 public:
  FATHOM_HD explicit ShapeInOwnAxes(const Geometry& shape) {
    if (kind == ShapeKind::any ? fathom::is_round(shape) : kind == ShapeKind::round) {
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

  FATHOM_HD bool is_round() const { return kind == ShapeKind::any ? round_.radius > 0 : kind == ShapeKind::round; }
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
    return surface.any_around(shared.names[0], [&](std::uint32_t number) {
      std::uint32_t names[3];
      surface.name_vertices(number, names);
      if (!shared.are_in(names)) return false;
      const Triangle beside = surface.triangle(number);
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
    std::uint32_t walk = 0;
    surface.any_around(shared.names[0], [&](std::uint32_t number) {
      std::uint32_t names[3];
      surface.name_vertices(number, names);
      if (shared.are_in(names)) walk += walk_past(names, shared);
      return false;
    });
    return walk == 0;
  }
  FATHOM_HD PointByTriangles<OneLane> point_by(std::uint32_t number, Vec3 point) const {
    TriangleLanes<OneLane> t = begin_lane(triangle(number));
    t.complete();
    return {t, point};
  }
};

/// A touch with one triangle.
struct SurfaceTouch {
  Manifold manifold;
  float nearest;  ///< m, of all its points
  std::uint8_t material;
  std::uint8_t true_points;  ///< a bit for each point that belongs to no other side of the surface
  bool touches, is_doubtful, is_deep;
};

template <ShapeKind kind>
FATHOM_HD SurfaceTouch touch_of(std::uint32_t number, const TrianglesAround& around, const ShapeInOwnAxes<kind>& shape,
                                float margin, const Vec3* pushed, int push_count, const Tolerance& tolerance) {
  SurfaceTouch touch;
  touch.touches = false;
  const SurfaceTriangle t = around.triangle(number);
  const AxesOfTriangles<OneLane> axes = axes_of(t, shape, margin, pushed, push_count);
  if (!axes.near) return touch;
  const TriangleContact contact = collide_triangle(t, axes, shape, margin, around);
  touch.touches = contact.manifold.count > 0;
  if (!touch.touches) return touch;
  touch.manifold = contact.manifold;
  touch.material = around.surface.material_of(number);
  touch.nearest = nearest_separation(contact.manifold);
  touch.is_doubtful = contact.is_doubtful, touch.is_deep = contact.is_deep;
  touch.true_points = 0;
  for (int i = 0; i < contact.manifold.count; ++i)
    if (!contact.is_doubtful || is_true_point(contact.manifold, i, around, tolerance.side))
      touch.true_points |= static_cast<std::uint8_t>(1u << i);
  return touch;
}

/// The points of a touch that count, a bit each.
struct TouchPart {
  const Manifold& manifold;
  unsigned points;
  std::uint8_t material;

  FATHOM_HD float nearest() const {
    float nearest = 3e38f;
    for (int i = 0; i < max_manifold_points; ++i)
      if (points >> i & 1) nearest = min(nearest, manifold.points[i].separation);
    return nearest;
  }
};

/// Groups of touches in about the same direction: the patches, without their points.
class SurfaceGroups {
 public:
  FATHOM_HD int count() const { return count_; }
  FATHOM_HD std::uint8_t material(int g) const { return materials_[g]; }

  /// What a touch changes.
  struct Change {
    int group;  ///< that it joins; −1: none
    bool begins, turns;
  };
  FATHOM_HD Change join(const TouchPart& touch) {
    const float near = touch.nearest();
    const Vec3 normal = touch.manifold.normal;
    int best = -1;
    float most = same_direction;
    for (int g = 0; g < count_; ++g)
      if (const float cosine = dot(normals_[g], normal); cosine > most && materials_[g] == touch.material)
        best = g, most = cosine;
    const bool begins = best < 0;
    if (begins) {
      const bool is_full = count_ == max_surface_manifolds;  // more directions than anything can rest on
      best = is_full ? shallowest() : count_++;
      if (is_full && near >= nearest_[best]) return {-1, false, false};
      materials_[best] = touch.material;
    } else if (near >= nearest_[best]) {
      return {best, false, false};
    }
    normals_[best] = normal;
    nearest_[best] = near;
    return {best, begins, !begins};
  }
  /// The deepest group but for those that are `taken` (a bit each).
  FATHOM_HD int deepest(unsigned taken) const {
    int best = -1;
    for (int g = 0; g < count_; ++g)
      if ((taken >> g & 1) == 0 && (best < 0 || nearest_[g] < nearest_[best])) best = g;
    return best;
  }

 private:
  FATHOM_HD int shallowest() const {
    int most = 0;
    for (int g = 1; g < count_; ++g)
      if (nearest_[g] > nearest_[most]) most = g;
    return most;
  }

  Vec3 normals_[max_surface_manifolds];
  float nearest_[max_surface_manifolds];  ///< m, least separation of each
  std::uint8_t materials_[max_surface_manifolds];
  int count_ = 0;
};

/// Joins the touches of a shape with a surface to manifolds. It needs no memory for them, but sees them several times:
///
///     do { for each touch, in the order of triangles: join.take(touch); } while (join.next());
///
/// First it judges which points count. True points do, unless all there is are doubtful touches: then all points along
/// the shortest way out of a shape that all touches are deeper than; or else those inside the surface of the touch with
/// the shortest way out, because others belong to one another's sides, as under a ridge. Then it groups the touches,
/// and at last collects the points of one patch after the other: together patches would be large.
class JoinOfTouches {
 public:
  /// `pushes`: the last step's manifolds. `centre`: from the shape's centre to its body's centre of mass (m, the
  /// surface's axes); the load is assumed there until a push locates it.
  FATHOM_HD JoinOfTouches(const TrianglesAround& around, const Tolerance& tolerance, bool of_round,
                          const SurfacePush* pushes, int push_count, Vec3 centre, SurfaceContact& contact)
      : around_(around),
        tolerance_(tolerance),
        of_round_(of_round),
        contact_(contact),
        pushes_(pushes),
        push_count_(push_count),
        centre_(centre) {
    contact.count = 0;
  }

  FATHOM_HD void take(const SurfaceTouch& touch) {
    if (stage_ == Stage::judge) return judge(touch);
    if (stage_ == Stage::find_inside_points) return find_inside_points(touch);
    if (all_points_ && dot(touch.manifold.normal, way_out_) < same_direction) return;
    const unsigned points = all_points_ ? (1u << touch.manifold.count) - 1 : touch.true_points;
    if (points != 0) take_points({touch.manifold, points, touch.material});
  }
  /// Whether it has to see all touches once more. At last the contact has the manifolds in the surface's frame, deepest
  /// first, then second ones of the same patches.
  FATHOM_HD bool next() {
    if (stage_ == Stage::judge) {
      all_points_ = any_doubtful_ && !any_sure_ && are_deep_;
      const bool has_none = any_doubtful_ && !all_points_ && !any_overlap_;
      stage_ = has_none ? Stage::find_inside_points : Stage::group;
      return any_doubtful_ || any_sure_;
    }
    if (stage_ == Stage::find_inside_points) {
      stage_ = Stage::group;
      return true;
    }
    if (inside_points_ != 0) take_points({inside_, inside_points_, inside_material_});
    if (stage_ == Stage::group) {
      stage_ = Stage::collect;
      second_ = groups_.count();  // follows the first manifolds of all groups
    } else {
      put();
    }
    collected_ = groups_.deepest(taken_);
    if (collected_ < 0) {
      contact_.count = second_;
      return false;
    }
    taken_ |= 1u << collected_;
    groups_ = {};
    return true;
  }

 private:
  enum class Stage { judge, find_inside_points, group, collect };

  FATHOM_HD void judge(const SurfaceTouch& touch) {
    if (touch.is_doubtful) {
      any_doubtful_ = true;
      are_deep_ &= touch.is_deep;
      if (touch.nearest > way_out_at_) way_out_at_ = touch.nearest, way_out_ = touch.manifold.normal;
    } else {
      any_sure_ = true;
    }
    any_overlap_ |= TouchPart{touch.manifold, touch.true_points, touch.material}.nearest() < 0;
  }
  FATHOM_HD void find_inside_points(const SurfaceTouch& touch) {
    if (!touch.is_doubtful) return;
    unsigned points = 0;
    for (int i = 0; i < touch.manifold.count; ++i)
      points |= (is_inside_point(touch.manifold, i, around_, tolerance_.side) ? 1u : 0u) << i;
    const float nearest = TouchPart{touch.manifold, points, touch.material}.nearest();
    if (points == 0 || nearest <= inside_at_) return;
    inside_at_ = nearest;
    inside_ = touch.manifold, inside_points_ = points, inside_material_ = touch.material;
  }
  FATHOM_HD void take_points(const TouchPart& touch) {
    const SurfaceGroups::Change change = groups_.join(touch);
    if (stage_ != Stage::collect || change.group != collected_) return;
    if (change.begins) patch_.begin(touch.manifold.normal, tolerance_);
    if (change.turns) patch_.set_normal(touch.manifold.normal);
    for (int i = 0; i < touch.manifold.count; ++i)
      if (touch.points >> i & 1) patch_.add(touch.manifold.points[i]);
  }
  /// The manifolds of the patch.
  FATHOM_HD void put() {
    const Pose& b_in_a = around_.pose;
    SurfacePush of_shape[max_surface_manifolds];
    for (int i = 0; i < push_count_; ++i) {
      of_shape[i].normal = inverse_rotate(b_in_a.rotation, pushes_[i].normal);
      of_shape[i].load = {inverse_transform(b_in_a, pushes_[i].load.at), pushes_[i].load.is_known};
    }
    Manifold both[2];
    const Vec3 load = load_along(patch_.normal(), of_shape, push_count_, {}, inverse_rotate(b_in_a.rotation, centre_));
    const bool is_reduced = patch_.put(both, of_round_, load);
    for (int i = 0; i < 2; ++i) {
      Manifold& m = both[i];
      if (i == 1 && (m.count == 0 || second_ == max_surface_manifolds)) continue;
      m.normal = rotate(b_in_a.rotation, m.normal);
      for (int k = 0; k < m.count; ++k) m.points[k].position = transform(b_in_a, m.points[k].position);
      const int at = i == 0 ? first_++ : second_++;
      contact_.manifolds[at] = m;
      contact_.is_reduced[at] = is_reduced;
      contact_.materials[at] = groups_.material(collected_);
    }
  }

  const TrianglesAround& around_;
  Tolerance tolerance_;
  bool of_round_;
  SurfaceContact& contact_;
  const SurfacePush* pushes_;
  int push_count_;
  Vec3 centre_;
  Stage stage_ = Stage::judge;
  bool any_sure_ = false, any_doubtful_ = false, are_deep_ = true, any_overlap_ = false, all_points_ = false;
  float way_out_at_ = -3e38f, inside_at_ = -3e38f;
  Vec3 way_out_;
  Manifold inside_;
  unsigned inside_points_ = 0;
  std::uint8_t inside_material_ = 0;
  SurfaceGroups groups_;
  unsigned taken_ = 0;  ///< groups whose points have been collected
  int collected_ = -1;  ///< the group whose points are being collected
  int first_ = 0, second_ = 0;
  SurfacePatch patch_;
};

}  // namespace fathom
