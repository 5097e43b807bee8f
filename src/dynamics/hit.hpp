// Where and how fast two bodies meet that begin to touch. Pure, for host and device.
#pragma once

#include <fathom/body.hpp>
#include <fathom/math.hpp>

#include "dynamics/contact_manifold.hpp"

namespace fathom {

struct Hit {
  Vec3 point;       ///< in the world (m)
  Vec3 normal;      ///< in the world, from A to B
  float speed = 0;  ///< at which the bodies approach there (m/s); 0: they do not
};

/// The point of `m` that approaches fastest.
FATHOM_HD Hit fastest_hit(const ContactManifold& m, const Pose& pa, const Pose& pb, const Velocity& va,
                          const Velocity& vb) {
  Hit hit;
  hit.normal = rotate(pa.rotation, m.normal);
  for (int i = 0; i < m.point_count(); ++i) {
    const Vec3 arm_a = rotate(pa.rotation, m.points[i].anchor_a), arm_b = rotate(pb.rotation, m.points[i].anchor_b);
    const Vec3 speed = (vb.linear + cross(vb.angular, arm_b)) - (va.linear + cross(va.angular, arm_a));
    if (-dot(speed, hit.normal) > hit.speed) {
      hit.speed = -dot(speed, hit.normal);
      hit.point = pa.position + arm_a;
    }
  }
  return hit;
}

}  // namespace fathom
