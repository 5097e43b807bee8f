// Pieces of bodies: a body's own shape, or one child of its compound.
//
// Every child of a compound has a device index of its own, and both phases of collision detection treat it like a body:
// it has constants, a filter, a pose, a velocity and boxes. A compound of a thousand children is then as parallel as a
// thousand bodies, and only what its children meet costs anything. A child has no state: `PlaceChildren` derives its
// pose from its body's before each search. The compound itself has no boxes. Contacts name two bodies, and which of
// their children touch, so everything after the narrow phase knows bodies only.
#pragma once

#include "device/contact_arrays.hpp"
#include "device/grid.hpp"
#include "dynamics/bounds.hpp"
#include "dynamics/look_ahead.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// The body of a piece.
template <BodyPart... written>
FATHOM_HD std::uint32_t body_of(const Bodies<written...>& bodies, std::uint32_t piece) {
  return bodies.constants[piece].is_child() ? bodies.constants[piece].link : piece;
}
/// The number of a piece among its body's children, 0 for a body that is no compound.
template <BodyPart... written>
FATHOM_HD std::uint32_t child_of(const Bodies<written...>& bodies, std::uint32_t piece) {
  return bodies.constants[piece].is_child() ? piece - bodies.constants[bodies.constants[piece].link].link : 0;
}
/// A body's piece with the number `child`.
template <BodyPart... written>
FATHOM_HD std::uint32_t piece_of(const Bodies<written...>& bodies, std::uint32_t body, std::uint32_t child) {
  return bodies.constants[body].is_compound() ? bodies.constants[body].link + child : body;
}
/// Pose of a piece in its body.
template <BodyPart... written>
FATHOM_HD Pose pose_in_body(const Bodies<written...>& bodies, std::uint32_t piece) {
  return bodies.constants[piece].is_child() ? bodies.child_poses[piece] : Pose{};
}

/// The pieces that touch in a contact.
struct TouchingPieces {
  std::uint32_t a, b;
};
template <BodyPart... written>
FATHOM_HD TouchingPieces pieces_of(const Bodies<written...>& bodies, const Contact& c) {
  if (!c.in_parts()) return {c.a, c.b};
  return {piece_of(bodies, c.a, c.child_a()), piece_of(bodies, c.b, c.child_b())};
}

/// The material of the surface's part that a patch touches; null: the body's, no patch, or one of a former shape.
template <BodyPart... written>
FATHOM_HD const Material* own_material(const Bodies<written...>& bodies, const Contact& c) {
  if (!c.is_patch() || !bodies.constants[c.a].is_surface()) return nullptr;
  const SurfaceView& surface = bodies.surfaces[bodies.constants[c.a].hull];
  return c.patch_material() < surface.material_count ? surface.materials + c.patch_material() : nullptr;
}

/// Whether the application is asked about a contact before it is solved.
template <BodyPart... written>
FATHOM_HD bool asks(const Bodies<written...>& bodies, const Contact& c) {
  return (bodies.constants[c.a].bits | bodies.constants[c.b].bits) & asks_bit;
}
/// Whether it is asked about the pair.
template <BodyPart... written>
FATHOM_HD bool has_custom_filter(const Bodies<written...>& bodies, const Contact& c) {
  return (bodies.constants[c.a].bits | bodies.constants[c.b].bits) & filters_bit;
}
/// Whether it may decide that two pieces do not collide.
template <BodyPart... written>
FATHOM_HD bool is_asked_about(const Bodies<written...>& bodies, std::uint32_t i, std::uint32_t j) {
  return (bodies.constants[i].bits | bodies.constants[j].bits) & (asks_bit | filters_bit);
}

/// A pair of indices that no other contact has, to rank contacts by: a surface lends one of its own to every patch.
template <BodyPart... written>
FATHOM_HD TouchingPieces ranked_pieces(const Bodies<written...>& bodies, const Contact& c) {
  TouchingPieces pieces = pieces_of(bodies, c);
  if (c.is_patch()) pieces.a = bodies.constants[c.a].link + c.patch_number();
  return pieces;
}

/// Whether two pieces may collide: the filters of the children and those of their bodies must allow it.
template <BodyPart... written>
FATHOM_HD bool may_pieces_collide(const Bodies<written...>& bodies, std::uint32_t i, std::uint32_t j) {
  if (!may_collide(bodies, i, j)) return false;
  if (!bodies.constants[i].is_child() && !bodies.constants[j].is_child()) return true;
  return may_collide(bodies, body_of(bodies, i), body_of(bodies, j));
}

/// Whether there is to be a contact of two pieces whose boxes overlap.
template <BodyPart... written>
FATHOM_HD bool may_touch(const Bodies<written...>& bodies, std::uint32_t i, std::uint32_t j) {
  const BodyConstants &a = bodies.constants[i], &b = bodies.constants[j];
  if (!a.is_dynamic() && !b.is_dynamic()) return false;
  if (a.is_child() && b.is_child() && a.link == b.link) return false;
  return may_pieces_collide(bodies, i, j);
}

/// Velocity of a piece whose centre moves within dt (s) to where its body takes it.
FATHOM_HD Velocity velocity_of_child(const Pose& in_body, const Pose& body, const Velocity& v, const Pose& end,
                                     float dt) {
  Velocity of_child = v;
  of_child.linear = (1 / dt) * (transform(end, in_body.position) - transform(body, in_body.position));
  return of_child;
}

/// The manifold in the frame of a body in which its own frame has the pose `piece`.
FATHOM_HD Manifold in_frame(const Pose& piece, Manifold m) {
  m.normal = rotate(piece.rotation, m.normal);
  for (int i = 0; i < m.count; ++i) m.points[i].position = transform(piece, m.points[i].position);
  return m;
}

/// Brings poses, velocities and boxes of children up to date with their bodies, and notes their bodies' changes.
struct PlaceChildren {
  Bodies<body_state> bodies;
  GridView grid;
  Counters* counters;
  float dt;  ///< s

  FATHOM_HD void operator()(std::uint32_t i) const {
    if (counters->stopped || i >= counters->bodies || !bodies.constants[i].is_child()) return;
    const BodyConstants& c = bodies.constants[i];
    const std::uint32_t body = c.link, changes = bodies.fat[body].changes;
    if (!changes && !bodies.is_awake(body) && !is_moving(bodies.velocities[i])) return;
    const Pose in_body = bodies.child_poses[i], of_body = bodies.poses[body];
    Velocity v = bodies.velocities[body];
    if (c.motion() != MotionType::fixed) v = velocity_of_child(in_body, of_body, v, advanced(of_body, v, dt), dt);
    const Pose pose = of_body * in_body;
    bodies.poses[i] = pose;
    bodies.velocities[i] = v;
    const Aabb box = motion_box(bodies.geometry(i), c.radius, pose, v, dt);
    bodies.boxes[i] = box;
    NotedBox fat = bodies.fat[i];
    fat.changes |= changes;
    if (changes & box_change || !contains(fat.box(), box)) {
      const Aabb around = fat_box(c.radius, box, v.linear, dt);
      fat = {around.lower, fat.changes | box_change, around.upper, grid.level_of(around)};
    }
    bodies.fat[i] = fat;
    if (changes & drop_contacts) bodies.known[i] = no_box();
    if (fat.changes) exec::atomic_store(counters->changed, 1u);
  }
};

}  // namespace fathom::device
