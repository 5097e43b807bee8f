// The pieces that touch in a contact: a body's shape, or one child of its compound.
#pragma once

#include "dynamics/friction_by_direction.hpp"
#include "dynamics/look_ahead.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/softness.hpp"
#include "geometry/support.hpp"
#include "native/contact.hpp"
#include "world/body_table.hpp"
#include "world/filter.hpp"

namespace fathom::native {

inline Pose inverse(const Pose& pose) { return relative(pose, {}); }

struct Piece {
  Geometry geometry;
  Pose pose;     ///< in the body's frame; the identity for a body's whole shape
  float radius;  ///< of the bounding sphere (m)
  float half;    ///< of its thickness (m)
  const Material& material;
  const Filter& filter;
  bool is_child;
};

/// The material of one part of a body without children: `part` is the number of a surface's material.
inline const Material& material_of(const BodyInfo& info, std::uint32_t part) {
  if (!info.geometry.is_surface() || info.geometry.surface().materials().empty()) return info.material;
  return info.geometry.surface().materials()[part];
}

/// `child`: of a compound; of a surface with materials, the number of one of them.
inline Piece piece_of(const BodyInfo& info, std::uint32_t child) {
  if (!info.geometry.is_compound())
    return {info.geometry, {}, info.radius, half_thickness(info), material_of(info, child), info.filter, false};
  const ChildShape& c = info.geometry.compound().children()[child];
  const Geometry shape = geometry(c.shape);
  return {shape,
          c.pose,
          c.shape.hull ? c.shape.hull->outer_radius() : bounding_radius(shape),
          half_thickness(shape.type, shape.half_extents, shape.radius),
          c.material ? *c.material : info.material,
          c.filter ? *c.filter : info.filter,
          true};
}

/// A vector of such a piece's material, in body axes.
inline Vec3 in_body_axes(Vec3 Material::*vector, const BodyInfo& info, std::uint32_t child) {
  if (!info.geometry.is_compound()) return material_of(info, child).*vector;
  const ChildShape& c = info.geometry.compound().children()[child];
  return c.material ? rotate(c.pose.rotation, (*c.material).*vector) : info.material.*vector;
}
inline Vec3 surface_velocity(const BodyInfo& info, std::uint32_t child) {
  return in_body_axes(&Material::surface_velocity, info, child);
}
inline Vec3 friction_axis(const BodyInfo& info, std::uint32_t child) {
  return in_body_axes(&Material::friction_axis, info, child);
}

/// Coulomb's coefficient, the largest in any direction.
inline float largest_friction(const Material& m) {
  return SideFriction{m.friction, m.friction_along, m.friction_axis, m.friction_rule}.largest();
}

/// The combined material of a contact's two surfaces.
struct ContactMaterials {
  float friction = 0, restitution = 0;
  Vec3 slide;  ///< sliding velocity of B relative to A added by moving surfaces (m/s, world axes)
};
/// Of the pieces `children` of two bodies with these rotations.
inline ContactMaterials mixed_materials(const BodyInfo& body_a, const BodyInfo& body_b, Children children, Quat turn_a,
                                        Quat turn_b) {
  const Material &a = piece_of(body_a, children.a).material, &b = piece_of(body_b, children.b).material;
  return {combine(largest_friction(a), largest_friction(b), a.friction_rule, b.friction_rule),
          combine(a.restitution, b.restitution, a.restitution_rule, b.restitution_rule),
          rotate(turn_b, surface_velocity(body_b, children.b)) - rotate(turn_a, surface_velocity(body_a, children.a))};
}

/// The piece as a body of its own, whose centre moves within dt (s) to where the body takes it: from `pose` with the
/// velocity `v` to `end`.
inline Mover mover_of(const Piece& piece, const Pose& pose, const Velocity& v, const Pose& end, float dt) {
  if (!piece.is_child) return {piece.geometry, piece.radius, pose, v};
  Mover m{piece.geometry, piece.radius, pose * piece.pose, v};
  m.velocity.linear = (1 / dt) * (transform(end, piece.pose.position) - m.pose.position);
  return m;
}
inline Mover mover_of(const Piece& piece, const Pose& pose, const Velocity& v, float dt) {
  return mover_of(piece, pose, v, piece.is_child ? advanced(pose, v, dt) : pose, dt);
}

}  // namespace fathom::native
