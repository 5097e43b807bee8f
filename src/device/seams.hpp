// Seams between static bodies, and between children of a compound (collision/seam.hpp). Where a body touches a static
// piece, the neighbours of that piece are among the body's contacts, so the contacts of each dynamic body with static
// bodies are chained. The neighbours of a moving compound's child are its siblings. Results do not depend on the order
// of a chain.
#pragma once

#include "collision/round_shapes.hpp"
#include "collision/seam.hpp"
#include "device/contact_arrays.hpp"
#include "device/pieces.hpp"
#include "terrain/surface_seam.hpp"

namespace fathom::device {

struct ClearFixedContacts {
  Bodies<body_fast_pairs> bodies;

  FATHOM_HD void operator()(std::uint32_t i) const { bodies.fixed_contact[i] = none; }
};

/// Item k is a contact.
struct ChainFixedContacts {
  Bodies<body_fast_pairs> bodies;
  Contacts<contact_worklists> contacts;

  FATHOM_HD void operator()(std::uint32_t k) const {
    const Contact& c = contacts.contacts[k];
    if (!c.in_use() || c.is_patch() || c.apart() || bodies.constants[c.a].motion() != MotionType::fixed) return;
    contacts.fixed_contacts[k] = {pieces_of(bodies, c).a, exec::atomic_exchange(bodies.fixed_contact[c.b], k)};
  }
};

/// The neighbours of piece `a` around piece `b`, in the frame of `a`.
template <class BodyArrays, class ContactArrays>
struct PieceNeighbours {
  const BodyArrays& bodies;
  const ContactArrays& contacts;
  std::uint32_t a, b;
  Aabb box;  ///< m, frame of `a`

  template <class Act>
  FATHOM_HD bool any(const Act& act) const {
    if (bodies.constants[a].motion() == MotionType::fixed) return contacts.fixed_contacts && any_fixed(act);
    return bodies.constants[a].is_child() && any_sibling(act);
  }

 private:
  template <class Act>
  FATHOM_HD bool any_fixed(const Act& act) const {
    const Aabb in_world = fathom::bounds(box, bodies.poses[a]);
    bool found = false;
    for (std::uint32_t k = bodies.fixed_contact[body_of(bodies, b)]; k != none && !found;
         k = contacts.fixed_contacts[k].next) {
      const std::uint32_t other = contacts.fixed_contacts[k].a;
      if (other == a || !overlaps(bodies.boxes[other], in_world)) continue;
      const Pose in_a = relative(bodies.poses[a], bodies.poses[other]);
      if (bodies.constants[other].is_surface()) {
        found = any_triangle(bodies.surfaces[bodies.constants[other].hull], in_a, act);
        continue;
      }
      const NeighbourSolid solid{bodies.geometry(other), in_a};
      found = has_faces(solid.shape) && act(solid);
    }
    return found;
  }
  template <class Act>
  FATHOM_HD bool any_triangle(const SurfaceView& surface, const Pose& in_a, const Act& act) const {
    const float depth = half_thickness(bodies.constants[b]);
    return surface.any_in(fathom::bounds(box, relative(in_a, {})), [&](std::uint32_t number) {
      Triangle triangle = surface.triangle(number);
      for (Vec3& corner : triangle.corners) corner = transform(in_a, corner);
      return act(NeighbourTriangle{SurfaceTriangle(triangle, {}), depth});
    });
  }
  template <class Act>
  FATHOM_HD bool any_sibling(const Act& act) const {
    const BodyConstants& compound = bodies.constants[bodies.constants[a].link];
    bool found = false;
    for (std::uint32_t k = 0; k < compound.hull && !found; ++k) {
      const std::uint32_t other = compound.link + k;
      if (other == a) continue;
      const NeighbourSolid solid{bodies.geometry(other), relative(bodies.child_poses[a], bodies.child_poses[other])};
      if (!has_faces(solid.shape) || !overlaps(fathom::bounds(solid.shape, solid.pose), box)) continue;
      found = may_pieces_collide(bodies, other, b) && act(solid);
    }
    return found;
  }
};

template <class BodyArrays, class ContactArrays>
struct Seams {
  const BodyArrays& bodies;
  const ContactArrays& contacts;

  /// Whether one of two pieces may have neighbours where they touch.
  FATHOM_HD bool may_have(const TouchingPieces& pieces) const {
    return has_neighbours(pieces.a) || bodies.constants[pieces.b].is_child();
  }
  /// Whether their manifold may be at a seam.
  FATHOM_HD bool may_be_at(const TouchingPieces& pieces, const Pose& b_in_a, const Manifold& m) const {
    const auto [a, b] = pieces;
    if (has_neighbours(a) && may_be_at_seam(bodies.geometry(a), m, lengths(a, b, b_in_a))) return true;
    if (!bodies.constants[b].is_child()) return false;
    const Pose a_in_b = relative(b_in_a, {});
    return may_be_at_seam(bodies.geometry(b), swapped(m, a_in_b), lengths(b, a, a_in_b));
  }

  /// The part of the pieces' manifold `m` that counts.
  FATHOM_HD SeamManifold kept(const TouchingPieces& pieces, const Pose& b_in_a, float margin, const Manifold& m) const {
    SeamManifold kept{m};
    // A loop, because the code for one side is long.
    for (int side = 0; side < 2 && kept.manifold.count > 0; ++side) {
      const bool of_b = side == 1;
      if (of_b && !bodies.constants[pieces.b].is_child()) break;
      const Pose second_in_first = of_b ? relative(b_in_a, {}) : b_in_a;
      const Manifold& now = kept.manifold;
      const SeamManifold one = kept_of_first(of_b ? pieces.b : pieces.a, of_b ? pieces.a : pieces.b, second_in_first,
                                             margin, of_b ? swapped(now, second_in_first) : now);
      kept = {of_b ? swapped(one.manifold, b_in_a) : one.manifold, kept.has_neighbours || one.has_neighbours,
              kept.is_whole && one.is_whole};
    }
    return kept;
  }

  /// The part of a manifold of the surface `pieces.a` that counts beside its neighbours, in A's frame.
  FATHOM_HD Manifold kept_on_surface(const TouchingPieces& pieces, const Pose& b_in_a, const Manifold& m) const {
    const auto [a, b] = pieces;
    if (!contacts.fixed_contacts || bodies.constants[a].motion() != MotionType::fixed) return m;
    const float half = half_thickness(bodies.constants[b]);
    const SeamLengths l = make_seam_lengths(half, max_component(abs(bodies.poses[a].position)));
    const PieceNeighbours<BodyArrays, ContactArrays> neighbours{bodies, contacts, a, b, around_patch(m, l.edge + half)};
    if (!neighbours.any([](const auto&) { return true; })) return m;
    const SurfaceView& surface = bodies.surfaces[bodies.constants[a].hull];
    const auto any_normal = [&](const Aabb& box, const auto& act) {
      return surface.any_in(
          box, [&](std::uint32_t number) { return act(SurfaceTriangle(surface.triangle(number), {}).normal); });
    };
    return kept_beside(neighbours, any_normal, l, bodies.geometry(b), b_in_a, m);
  }

 private:
  FATHOM_HD bool has_neighbours(std::uint32_t a) const {
    const BodyConstants& c = bodies.constants[a];
    return c.motion() == MotionType::fixed ? contacts.fixed_contacts != nullptr : c.is_child();
  }
  FATHOM_HD SeamLengths lengths(std::uint32_t a, std::uint32_t b, const Pose& b_in_a) const {
    const BodyConstants &of_a = bodies.constants[a], &of_b = bodies.constants[b];
    SeamLengths l = make_seam_lengths(half_thickness(of_b), of_a.radius, of_b.radius, b_in_a, bodies.poses[a]);
    if (of_a.is_dynamic()) l.limit_depth(half_thickness(of_a));
    return l;
  }
  FATHOM_HD SeamManifold kept_of_first(std::uint32_t a, std::uint32_t b, const Pose& b_in_a, float margin,
                                       const Manifold& m) const {
    if (m.count == 0 || !has_neighbours(a)) return {m};
    const Geometry of_a = bodies.geometry(a), of_b = bodies.geometry(b);
    const SeamLengths l = lengths(a, b, b_in_a);
    if (!may_be_at_seam(of_a, m, l)) return {m};
    const BodyConstants& touched = bodies.constants[a];
    const float half_b = half_thickness(bodies.constants[b]),
                half = touched.is_dynamic() ? min(half_thickness(touched), half_b) : half_b;
    const PieceNeighbours<BodyArrays, ContactArrays> neighbours{bodies, contacts, a, b,
                                                                grown(fathom::bounds(of_b, b_in_a), l.edge)};
    if (!neighbours.any([](const auto&) { return true; })) return {m};
    return kept_at_seam(of_a, of_b, b_in_a, margin, half, neighbours, l, m);
  }
};

template <class BodyArrays, class ContactArrays>
FATHOM_HD Seams<BodyArrays, ContactArrays> seams_of(const BodyArrays& bodies, const ContactArrays& contacts) {
  return {bodies, contacts};
}

}  // namespace fathom::device
