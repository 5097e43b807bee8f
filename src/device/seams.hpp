// Seams between bodies that cannot be pushed, and between children of a compound (collision/seam.hpp). Where a body
// touches a piece of such a body, the neighbours of that piece are among the body's contacts, so the contacts of each
// dynamic body with static and kinematic bodies are chained. The neighbours of a dynamic compound's child are its
// siblings. Results do not depend on the order of a chain.
#pragma once

#include "collision/round_shapes.hpp"
#include "collision/seam.hpp"
#include "device/contact_arrays.hpp"
#include "device/pieces.hpp"
#include "dynamics/drift.hpp"
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
    if (!c.in_use() || c.is_patch() || c.apart() || !c.fixed_a()) return;
    if (is_asked_about(bodies, c.a, c.b)) return;  // it may not hold the body
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
  float dt;  ///< s
  // Known once `find` has been called.
  Aabb in_world{};      ///< around the box during the step
  Pose begin{}, end{};  ///< of `a`; `end` only if `drifts`
  bool drifts = false;  ///< some of them move against `a`
  int moment = 0;       ///< 1: as the step ends

  FATHOM_HD int moments() const { return drifts ? 2 : 1; }
  FATHOM_HD PieceNeighbours at(int then) const {
    PieceNeighbours neighbours = *this;
    neighbours.moment = then;
    return neighbours;
  }

  template <class Act>
  FATHOM_HD bool any(const Act& act) const {
    if (is_in_chain()) return any_in_chain([&](std::uint32_t other) { return any_of(other, act); });
    return bodies.constants[a].is_child() && any_sibling(act);
  }
  /// Whether there are any.
  FATHOM_HD bool find() {
    if (is_in_chain()) {
      begin = end = pose_of(a);
      drifts = any_in_chain([&](std::uint32_t other) { return does_drift(other); });
      if (drifts) end = end_of(a);
      in_world = drifts ? bounds_of_way(box, begin, end) : fathom::bounds(box, begin);
    }
    return any([](const auto&) { return true; });
  }

 private:
  FATHOM_HD bool is_in_chain() const { return !bodies.constants[a].is_dynamic() && contacts.fixed_contacts; }

  template <class Act>
  FATHOM_HD bool any_in_chain(const Act& act) const {
    for (std::uint32_t k = bodies.fixed_contact[body_of(bodies, b)]; k != none; k = contacts.fixed_contacts[k].next) {
      const std::uint32_t other = contacts.fixed_contacts[k].a;
      if (other != a && act(other)) return true;
    }
    return false;
  }
  template <class Act>
  FATHOM_HD bool any_of(std::uint32_t other, const Act& act) const {
    if (!overlaps(bodies.boxes[other], in_world)) return false;
    const bool is_later = moment == 1 && does_drift(other);
    const Pose in_a = is_later ? relative(end, end_of(other)) : relative(begin, pose_of(other));
    if (bodies.constants[other].is_surface())
      return any_triangle(bodies.surfaces[bodies.constants[other].hull], in_a, act);
    const NeighbourSolid solid{bodies.geometry(other), in_a};
    return has_faces(solid.shape) && act(solid);
  }
  FATHOM_HD bool does_drift(std::uint32_t other) const {
    const std::uint32_t body = body_of(bodies, a), other_body = body_of(bodies, other);
    return body != other_body && !stay_together(bodies.velocities[body], bodies.velocities[other_body]);
  }
  /// Not where PlaceChildren has put a child of a kinematic body: after the step the body is elsewhere.
  FATHOM_HD Pose pose_of(std::uint32_t piece) const {
    const BodyConstants& c = bodies.constants[piece];
    const bool is_carried = c.is_child() && c.motion() == MotionType::kinematic;
    return is_carried ? bodies.poses[c.link] * bodies.child_poses[piece] : bodies.poses[piece];
  }
  FATHOM_HD Pose end_of(std::uint32_t piece) const {
    const std::uint32_t body = body_of(bodies, piece);
    const Pose of_body = advanced(bodies.poses[body], bodies.velocities[body], dt);
    return bodies.constants[piece].is_child() ? of_body * bodies.child_poses[piece] : of_body;
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
    if (is_asked_about(bodies, a, b)) return false;
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
  float dt;  ///< s

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
    if (!contacts.fixed_contacts) return m;
    const float half = half_thickness(bodies.constants[b]);
    const SeamLengths l = make_seam_lengths(half, max_component(abs(bodies.poses[a].position)));
    PieceNeighbours<BodyArrays, ContactArrays> neighbours{bodies, contacts, a, b, around_patch(m, l.edge + half), dt};
    if (!neighbours.find()) return m;
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
    return c.is_child() || (!c.is_dynamic() && contacts.fixed_contacts);
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
    PieceNeighbours<BodyArrays, ContactArrays> neighbours{
        bodies, contacts, a, b, grown(fathom::bounds(of_b, b_in_a), l.edge), dt};
    if (!neighbours.find()) return {m};
    return kept_at_seam(of_a, of_b, b_in_a, margin, half, neighbours, l, m);
  }
};

template <class BodyArrays, class ContactArrays>
FATHOM_HD Seams<BodyArrays, ContactArrays> seams_of(const BodyArrays& bodies, const ContactArrays& contacts, float dt) {
  return {bodies, contacts, dt};
}

}  // namespace fathom::device
