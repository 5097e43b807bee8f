// Polyhedra with a radius: rounded boxes and hulls.
//
// Their cores collide as if they reached farther, and the contact is shifted to the surfaces. That is exact where a
// face of either core is nearest to the other core, or two edges cross. Elsewhere an edge or a vertex of one core is
// nearest to one of the other, and both shapes are capsules about their edges there.
#pragma once

#include "collision/gap.hpp"
#include "collision/polyhedra.hpp"
#include "collision/round_shapes.hpp"

namespace fathom {

/// Turns a contact of cores into one of the shapes.
FATHOM_HD void round_off(Manifold& m, float radius_a, float radius_b) {
  for (int i = 0; i < max_manifold_points; ++i) {
    if (i >= m.count) continue;
    m.points[i].position = mul_add(m.points[i].position, 0.5f * (radius_a - radius_b), m.normal);
    m.points[i].separation -= radius_a + radius_b;
  }
}

/// Edges at the hull's highest vertex along `n` that are nearly across it; if there are none, the one that is most.
struct EdgesAcross {
  static constexpr int max_count = 4;
  int edges[max_count];
  int count = 0;

  FATHOM_HD EdgesAcross(const HullView& hull, Vec3 n) {
    constexpr float level = -0.06f;  // sine of 3.4 degrees
    const int vertex = highest_vertex(hull, n).vertex;
    int start = hull.vertex_edges ? hull.vertex_edges[vertex] : 0;
    while (hull.edges[start].origin != vertex) ++start;
    int e = start, best = start;
    float highest = -3e38f;
    do {
      const Vec3 along = hull.vertices[hull.edges[e ^ 1].origin] - hull.vertices[vertex];
      const float rise = dot(along, n) / length(along);  // at most zero
      if (rise >= level && count < max_count) edges[count++] = e >> 1;
      if (rise > highest) highest = rise, best = e;
      e = hull.edges[e ^ 1].next;
    } while (e != start);
    if (count == 0) edges[count++] = best >> 1;
  }
};
FATHOM_HD RoundShape edge_capsule(const HullView& hull, int edge) {
  const EdgeView e = edge_view(hull, edge);
  return {{e.from, e.along}, hull.radius};
}

/// By how much (m) the nearest point of a contact of cores misses their distance.
FATHOM_HD float miss_of(const Manifold& m, float distance) {
  return m.count > 0 ? abs(nearest_separation(m) - distance) : 3e38f;
}

/// Whether the nearest points of the cores, which are `distance` (m) apart, are others than those of their contact `m`.
/// `noise`: rounding error of separations (m).
FATHOM_HD bool is_at_corner(float distance, const Manifold& m, float noise) {
  constexpr float share = 1e-3f;  // of directions 2.6 degrees apart
  return distance > 4 * noise && miss_of(m, distance) > fma(share, distance, 2 * noise);
}

/// The contact of the capsules about the nearest edges of both hulls, whose cores are nearest along `n`.
FATHOM_HD Manifold corner_contact(const HullView& a, const HullView& b, const Pose& b_in_a, Vec3 n, float margin) {
  const EdgesAcross of_a(a, n), of_b(b, -inverse_rotate(b_in_a.rotation, n));
  int edge_a = 0, edge_b = 0;
  float nearest = 3e38f;
  for (int i = 0; i < of_a.count * of_b.count; ++i) {
    const int first = of_a.edges[i / of_b.count], second = of_b.edges[i % of_b.count];
    const SegmentPair pair =
        closest_points(edge_capsule(a, first).core, transform(b_in_a, edge_capsule(b, second)).core);
    const float squared = length_squared(pair.on_2 - pair.on_1);
    if (squared < nearest) nearest = squared, edge_a = first, edge_b = second;
  }
  Manifold m = collide_round(edge_capsule(a, edge_a), transform(b_in_a, edge_capsule(b, edge_b)), margin);
  for (int i = 0; i < m.count; ++i)
    m.points[i].feature =
        edge_feature(static_cast<std::uint32_t>(edge_a), static_cast<std::uint32_t>(4 * edge_b + i), false);
  return m;
}

/// The cores' contact at B's vertex that is nearest along the gap.
FATHOM_HD Manifold vertex_contact(const HullPair& p, const Gap& gap) {
  const int vertex = lowest_vertex(p.b, transpose_mul(p.b_in_a.rotation, gap.normal)).vertex;
  const Vec3 on_b = transform(p.b_in_a, p.b.vertices[vertex]);
  Manifold m;
  m.normal = gap.normal;
  m.count = 1;
  m.points[0] = {mul_add(on_b, -0.5f * gap.distance, gap.normal), gap.distance,
                 vertex_feature(static_cast<std::uint32_t>(vertex), true)};
  return m;
}

/// As `collide_hulls`, for hulls that may have a radius.
FATHOM_HD Manifold collide_rounded(const HullView& a, const HullView& b, const Pose& b_in_a, float margin,
                                   AxisCache& cache, const PatchLoad& load) {
  const float radii = a.radius + b.radius;
  Manifold m = collide_hulls(a, b, b_in_a, margin + radii, cache, load);
  if (radii == 0 || cache.separated) return m;
  const HullPair p = make_hull_pair(a, b, b_in_a);
  const Vec3 guess = m.count > 0 ? m.normal : b_in_a.position;
  const Gap gap = gap_between(Core{{}, {}, a, a.radius}, Core{{}, {}, b, b.radius}, p.b_in_a, guess, p.tolerance.noise);
  if (gap.distance > margin + radii) return {};
  if (is_at_corner(gap.distance, m, p.tolerance.noise)) {
    const Manifold corner = corner_contact(a, b, b_in_a, gap.normal, margin);
    if (miss_of(corner, gap.distance - radii) < miss_of(m, gap.distance)) return corner;
    // Not edges, but a face that was almost best is nearest, or a vertex beside the face that was best.
    if (is_at_corner(gap.distance, m, p.tolerance.axis)) m = vertex_contact(p, gap);
  } else if (m.count == 0 && cache.kind != AxisCache::edges) {
    // Beside the best face of a hull so large that rounding hides the distance.
    const bool of_b = cache.kind == AxisCache::face_b;
    hull_vertex_contact(p, of_b ? cache.b : cache.a, of_b, m);
  }
  round_off(m, a.radius, b.radius);
  return m;
}

}  // namespace fathom
