// The direct solution of bodies that ball joints connect to a tree: what changes of velocity make all joints hold at
// once, with the least kinetic energy. Pure, for host and device.
//
// Eliminated from the leaves to the root and substituted back, in a time proportional to the number of joints (Baraff,
// "Linear-time dynamics using Lagrange multipliers", 1996). Written as Featherstone's articulated bodies ("Rigid Body
// Dynamics Algorithms", 2008, chapter 7) with three degrees of freedom a joint: what a joint's parent feels of all that
// hangs on it is a symmetric 3×3 inertia at the anchor and an impulse. Only 3×3 matrices are inverted, so a light chain
// may carry a load a million times as heavy before single precision ends.
#pragma once

#include <fathom/math.hpp>

namespace fathom {

/// What a body and all that hangs on it resist a change of velocity with, about the body's centre: momentum by linear
/// and angular velocity.
struct TreeInertia {
  Mat3 linear, mixed, angular;  ///< kg, kg·m (momentum by angular velocity), kg·m²
};

/// The same at a body's anchor to its parent, its angular velocity eliminated.
struct TreeLink {
  Vec3 arm;              ///< m, from the centre to the anchor
  Mat3 inertia;          ///< kg
  Mat3 mixed;            ///< kg·m
  Mat3 inverse_angular;  ///< 1/(kg·m²)
};

/// What acts on a body and all that hangs on it, about the body's centre.
struct TreeLoad {
  Vec3 impulse, moment;  ///< N·s, N·m·s
};

struct TreeChange {
  Vec3 linear, angular;  ///< m/s, rad/s
};

FATHOM_HD Mat3 skew(Vec3 a) { return {{0, a.z, -a.y}, {-a.z, 0, a.x}, {a.y, -a.x, 0}}; }
FATHOM_HD Mat3 operator-(const Mat3& a, const Mat3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FATHOM_HD Mat3 diagonal(float a) { return {{a, 0, 0}, {0, a, 0}, {0, 0, a}}; }

/// Of a matrix of any size, scaled to a trace of one before products of its elements could leave the range of numbers.
FATHOM_HD Mat3 scaled_inverse(const Mat3& m) {
  const float trace = m.x.x + (m.y.y + m.z.z), s = trace > 0 ? 1.0f / trace : 0.0f;
  return s * inverse(s * m);
}

FATHOM_HD TreeInertia tree_inertia(float mass, const Mat3& inertia) { return {diagonal(mass), diagonal(0), inertia}; }

/// What a body's parent feels of it at the anchor, `arm` from the body's centre.
FATHOM_HD TreeLink tree_link(const TreeInertia& body, Vec3 arm) {
  const Mat3 r = skew(arm), vr = body.linear * r, rc = r * body.mixed;
  TreeLink link;
  link.arm = arm;
  link.mixed = vr + body.mixed;
  link.inverse_angular = scaled_inverse(body.angular - r * vr - rc - transpose(rc));
  link.inertia = body.linear - link.mixed * link.inverse_angular * transpose(link.mixed);
  return link;
}

/// A child hangs on `parent` at `arm` from its centre.
FATHOM_HD void add_child(TreeInertia& parent, const TreeLink& child, Vec3 arm) {
  const Mat3 s = skew(arm), bs = child.inertia * s;
  parent.linear = parent.linear + child.inertia;
  parent.mixed = parent.mixed - bs;
  parent.angular = parent.angular - s * bs;
}

/// A load about the body's centre, about its anchor.
FATHOM_HD TreeLoad at_anchor(const TreeLink& link, const TreeLoad& load) {
  return {load.impulse, load.moment - cross(link.arm, load.impulse)};
}

/// What the child hands on to its parent of its load (about its anchor), where the anchors run away from each other at
/// `error` (m/s): an impulse at the anchor.
FATHOM_HD Vec3 handed_on(const TreeLink& child, const TreeLoad& load, Vec3 error) {
  return child.inertia * error + (load.impulse - child.mixed * (child.inverse_angular * load.moment));
}

/// The impulse on a body at its anchor where that is to change its velocity by `change`.
FATHOM_HD Vec3 impulse_on(const TreeLink& link, const TreeLoad& load, Vec3 change) {
  return link.inertia * change - (load.impulse - link.mixed * (link.inverse_angular * load.moment));
}

/// How the body then changes its velocities.
FATHOM_HD TreeChange follow(const TreeLink& link, const TreeLoad& load, Vec3 change) {
  const Vec3 angular = link.inverse_angular * (load.moment - transpose_mul(link.mixed, change));
  return {change + cross(link.arm, angular), angular};
}

/// Of a body without a parent, given its link at its centre.
FATHOM_HD TreeChange root_change(const TreeLink& link, const TreeLoad& load) {
  return follow(link, load,
                scaled_inverse(link.inertia) * (load.impulse - link.mixed * (link.inverse_angular * load.moment)));
}

}  // namespace fathom
