// Seams between static bodies (collision/seam.hpp). Where a body touches a static one, the neighbours of the static
// body are among the first body's contacts, so the contacts of each dynamic body with static bodies are chained.
// Results do not depend on the order of a chain.
#pragma once

#include "collision/seam.hpp"
#include "device/contact_arrays.hpp"

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
    if (!c.in_use() || c.apart() || bodies.constants[c.a].motion() != MotionType::fixed) return;
    contacts.fixed_contacts[k] = {c.a, exec::atomic_exchange(bodies.fixed_contact[c.b], k)};
  }
};

/// The static neighbours of the static body `a` in a box around body `b`, in the frame of `a`.
template <class BodyArrays, class ContactArrays>
struct FixedNeighbours {
  const BodyArrays& bodies;
  const ContactArrays& contacts;
  std::uint32_t a, b;
  Aabb box;  ///< m, world axes

  template <class Act>
  FATHOM_HD bool any(const Act& act) const {
    bool found = false;
    for (std::uint32_t k = bodies.fixed_contact[b]; k != none && !found; k = contacts.fixed_contacts[k].next) {
      const std::uint32_t other = contacts.fixed_contacts[k].a;
      if (other == a || !overlaps(bodies.boxes[other], box)) continue;
      const NeighbourSolid solid{bodies.geometry(other), relative(bodies.poses[a], bodies.poses[other])};
      found = has_faces(solid.shape) && act(solid);
    }
    return found;
  }
};

template <class BodyArrays, class ContactArrays>
struct Seams {
  const BodyArrays& bodies;
  const ContactArrays& contacts;

  FATHOM_HD bool may_have(std::uint32_t a) const {
    return contacts.fixed_contacts && bodies.constants[a].motion() == MotionType::fixed;
  }
  FATHOM_HD SeamLengths lengths(std::uint32_t a, std::uint32_t b, const Pose& b_in_a) const {
    const BodyConstants &of_a = bodies.constants[a], &of_b = bodies.constants[b];
    return make_seam_lengths(half_thickness(of_b), of_a.radius, of_b.radius, b_in_a, bodies.poses[a]);
  }

  /// The part of the manifold `m` of a static body and another one that counts.
  FATHOM_HD SeamManifold kept(std::uint32_t a, std::uint32_t b, const Pose& b_in_a, float margin,
                              const Manifold& m) const {
    const Geometry of_a = bodies.geometry(a), of_b = bodies.geometry(b);
    const SeamLengths l = lengths(a, b, b_in_a);
    if (m.count == 0 || !may_be_at_seam(of_a, m, l)) return {m};
    const float half = half_thickness(bodies.constants[b]);
    const FixedNeighbours<BodyArrays, ContactArrays> neighbours{
        bodies, contacts, a, b, fathom::bounds(grown(fathom::bounds(of_b, b_in_a), l.edge), bodies.poses[a])};
    if (!neighbours.any([](const NeighbourSolid&) { return true; })) return {m};
    return kept_at_seam(of_a, of_b, b_in_a, margin, half, neighbours, l, m);
  }
};

template <class BodyArrays, class ContactArrays>
FATHOM_HD Seams<BodyArrays, ContactArrays> seams_of(const BodyArrays& bodies, const ContactArrays& contacts) {
  return {bodies, contacts};
}

}  // namespace fathom::device
