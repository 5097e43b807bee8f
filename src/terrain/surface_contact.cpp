#include "terrain/surface_contact.hpp"

#include <algorithm>

#include "geometry/support.hpp"
#include "terrain/triangle_axes.hpp"

namespace fathom {
namespace {

/// If all touches are deeper than the shape is thick, keeps those along the normal with the shortest way out.
void keep_shallowest(std::vector<SurfaceScratch::Touch>& touches) {
  const Vec3 way_out = std::ranges::max(touches, {}, &SurfaceScratch::Touch::nearest).manifold.normal;
  std::erase_if(touches,
                [&](const SurfaceScratch::Touch& t) { return dot(t.manifold.normal, way_out) < same_direction; });
}

bool is_overlap(const SurfaceScratch::Touch& touch) { return touch.nearest < 0; }

/// Adds the points of doubtful touches that belong to no other side of the surface. Under a ridge each of two sides may
/// be nearer to the points of the other one: then the shape leaves along the shorter way.
void add_doubtful(std::vector<SurfaceScratch::Touch>& touches, std::vector<SurfaceScratch::Touch>& doubtful,
                  const FoundTriangles& found, float tolerance) {
  if (touches.empty() && std::ranges::all_of(doubtful, &SurfaceScratch::Touch::is_deep)) {
    touches.swap(doubtful);
    if (!touches.empty()) keep_shallowest(touches);
    return;
  }
  for (SurfaceScratch::Touch touch : doubtful) {
    leave_true_points(touch.manifold, found, tolerance);
    if (touch.manifold.count == 0) continue;
    touch.nearest = nearest_separation(touch.manifold);
    touches.push_back(touch);
  }
  if (std::ranges::any_of(touches, is_overlap)) return;
  const SurfaceScratch::Touch* shortest = nullptr;
  for (SurfaceScratch::Touch& touch : doubtful) {
    leave_inside_points(touch.manifold, found, tolerance);
    if (touch.manifold.count == 0) continue;
    touch.nearest = nearest_separation(touch.manifold);
    if (!shortest || touch.nearest > shortest->nearest) shortest = &touch;
  }
  if (shortest) touches.push_back(*shortest);
}

/// Assigns every touch to a group. Returns the number of groups; `normals` and `materials` get theirs, deepest first.
int group(std::vector<SurfaceScratch::Touch>& touches, Vec3 (&normals)[max_surface_manifolds],
          std::uint8_t (&materials)[max_surface_manifolds]) {
  int groups = 0;
  for (SurfaceScratch::Touch& touch : touches) {
    int best = -1;
    float nearest = same_direction;
    for (int g = 0; g < groups; ++g) {
      const float cosine = dot(normals[g], touch.manifold.normal);
      if (cosine > nearest && materials[g] == touch.material) best = g, nearest = cosine;
    }
    if (best < 0 && groups < max_surface_manifolds) {
      best = groups;
      materials[groups] = touch.material;
      normals[groups++] = touch.manifold.normal;
    }
    touch.group = best;  // −1: no group, as there are more directions than anything can rest on
  }
  return groups;
}

}  // namespace

bool find_triangles(const Surface& surface, const Aabb& box, Vec3 origin, SurfaceScratch& scratch) {
  scratch.searched = box;
  scratch.triangles.clear();
  surface.find(box, scratch.triangles);
  scratch.eights.clear();
  for (const std::uint32_t t : scratch.triangles) {
    if (scratch.eights.empty() || scratch.eights.back().count == 8) scratch.eights.emplace_back();
    scratch.eights.back().add(surface.triangle(t));
  }
  for (EightTriangles& eight : scratch.eights) eight.complete(origin);
  return !scratch.triangles.empty();
}

void collide_surface(const Surface& surface, const Geometry& b, const Pose& b_in_a, float margin,
                     std::span<const SurfacePush> pushes, SurfaceScratch& scratch, SurfaceContact& contact,
                     Vec3 centre) {
  const std::vector<std::uint32_t>& triangles = scratch.triangles;
  const std::vector<EightTriangles>& eights = scratch.eights;
  std::vector<Vec3>& pushed = scratch.pushed;
  TurnedShape& shape = scratch.shape;
  std::vector<SurfaceScratch::Touch>&touches = scratch.touches, &doubtful = scratch.doubtful;
  contact.count = 0;
  if (!find_triangles(surface, grown(bounds(b, b_in_a), margin), b_in_a.position, scratch)) return;
  shape.turn(b, b_in_a.rotation);
  const FoundTriangles found(eights, scratch.index);
  touches.clear(), doubtful.clear(), pushed.clear();
  for (const SurfacePush& push : pushes) pushed.push_back(push.normal);
  const bool has_materials = !surface.materials().empty();
  GatheredTriangles gathered;
  const auto add_touch = [&](const SurfaceTriangle& triangle, const AxesOfTriangles<OneLane>& axes,
                             std::uint32_t number) {
    const auto [m, is_doubtful, is_deep] = collide_triangle(triangle, axes, shape, margin, found);
    if (m.count == 0) return;
    const std::uint32_t material = has_materials ? surface.material_of(number) : 0;
    (is_doubtful ? doubtful : touches)
        .push_back({m, nearest_separation(m), is_deep, static_cast<std::uint8_t>(material), 0});
  };
  for (std::size_t e = 0; e < eights.size(); ++e) {
    const TriangleAxes axes = face_axes_of(eights[e], shape, margin, pushed);
    for (unsigned near = axes.near; near != 0; near &= near - 1) {
      const int lane = lowest_bit(near);
      gathered.add(eights[e], axes, lane, triangles[8 * e + static_cast<std::size_t>(lane)]);
      if (!gathered.is_full()) continue;
      gathered.for_each_near(shape, margin, add_touch);
      gathered.clear();
    }
  }
  gathered.for_each_near(shape, margin, add_touch);
  const Tolerance tolerance = make_tolerance(shape.inner(), shape.outer());
  add_doubtful(touches, doubtful, found, tolerance.side);
  if (touches.empty()) return;
  std::ranges::stable_sort(touches, {}, &SurfaceScratch::Touch::nearest);

  Vec3 normals[max_surface_manifolds];
  contact.count = group(touches, normals, contact.materials);
  int second = contact.count;  // follows the first manifolds of all groups
  for (int g = 0; g < contact.count; ++g) {
    SurfacePatch patch(normals[g], tolerance);
    for (const SurfaceScratch::Touch& touch : touches) {
      if (touch.group != g) continue;
      for (int i = 0; i < touch.manifold.count; ++i) patch.add(touch.manifold.points[i]);
    }
    Manifold both[2];
    const bool is_reduced =
        patch.put(both, shape.is_round(),
                  load_along(normals[g], pushes.data(), static_cast<int>(pushes.size()), b_in_a.position, centre));
    for (Manifold& m : both) {
      for (int i = 0; i < m.count; ++i) m.points[i].position += b_in_a.position;
      if (&m == &both[1] && (m.count == 0 || second == max_surface_manifolds)) continue;
      const int at = &m == &both[0] ? g : second++;
      contact.manifolds[at] = m;
      contact.is_reduced[at] = is_reduced;
      contact.materials[at] = contact.materials[g];
    }
  }
  contact.count = second;
}

}  // namespace fathom
