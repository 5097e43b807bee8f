// Joints that something forces apart. Pure, for host and device.
//
// A direct solution comes after the contacts and closes a joint's gap by moving the lighter body, whatever is in its
// way: a heavy body that is held elsewhere would pull its light neighbour into the ground. While the gap is wide, the
// lighter body counts as heavy as the other, so that both move and contacts can resist.
#pragma once

#include "dynamics/generic_joint.hpp"
#include "dynamics/mechanism_link.hpp"
#include "dynamics/tuning.hpp"

namespace fathom {

/// How far (m) the anchors of a generic joint are from where its linear axes hold them; `between` (m) leads from that
/// on A to that on B, in A's axes.
FATHOM_HD float held_gap(const GenericJoint& joint, Vec3 between) {
  const auto beyond = [](const GenericAxis<float>& axis, float x) {
    return axis.locked + axis.limited > 0 ? max(max(x - axis.upper, axis.lower - x), 0.0f) : 0.0f;
  };
  if (joint.distance != 0) return beyond(joint.axes[0], length(between));
  const Quat frame{joint.on_a.w, joint.on_a.v.x, joint.on_a.v.y, joint.on_a.v.z};
  const Vec3 position = inverse_rotate(frame, between);
  const Vec3 gap{beyond(joint.axes[0], position.x), beyond(joint.axes[1], position.y),
                 beyond(joint.axes[2], position.z)};
  return length(gap);
}

/// Inertia, as a multiple of its own, that the body of link i needs: as much as the heaviest body to which a torn joint
/// connects it, and at least its own. `Access` has joint(j): {a, b, anchor_a, anchor_b}, generic_joint(j), and by body
/// pose(i), inverse_mass(i), radius(i).
template <class Access>
FATHOM_HD float inertia_where_torn(const Access& access, const MechanismLink* links, std::uint32_t i) {
  constexpr std::uint32_t none = MechanismLink::none;
  const MechanismLink& link = links[i];
  if (link.is_copy()) return 1;
  const float own = access.inverse_mass(link.body);
  float inertia = 1;
  const auto look = [&](const MechanismLink& of, std::uint32_t other) {
    const float inverse_mass = access.inverse_mass(other);
    if (!(inverse_mass > 0 && own > inertia * inverse_mass)) return;
    const auto joint = access.joint(of.joint);
    const Pose &a = access.pose(joint.a), &b = access.pose(joint.b);
    const Vec3 between =
        (b.position - a.position) + (rotate(b.rotation, joint.anchor_b) - rotate(a.rotation, joint.anchor_a));
    const float gap = of.generic == none
                          ? length(between)
                          : held_gap(access.generic_joint(of.joint), inverse_rotate(a.rotation, between));
    if (gap > torn_share * min(access.radius(link.body), access.radius(other))) inertia = own / inverse_mass;
  };
  if (link.joint != none && link.parent != none) look(link, links[link.parent].body);
  for (std::uint32_t k = link.first_child; k < link.end_of_children(); ++k) look(links[k], links[k].body);
  return inertia;
}

}  // namespace fathom
