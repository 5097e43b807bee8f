// Serialises joint definitions.
#pragma once

#include <fathom/joint.hpp>

#include "world/archive.hpp"

namespace fathom {

/// Archives all but the two bodies, which each format names in its own way.
template <class Def, class Archive>
void archive_joint(Def& def, Archive& archive) {
  archive(def.type, def.frame_a.position, def.frame_a.rotation, def.frame_b.position, def.frame_b.rotation,
          def.collide_connected, def.hertz, def.damping_ratio, def.max_force, def.break_force, def.break_torque,
          def.user_data);
  if (def.type == JointType::ball) return;
  archive(def.cone_angle);
  for (auto& axis : def.axes)
    archive(axis.mode, axis.lower, axis.upper, axis.drive.position, axis.drive.velocity, axis.drive.stiffness,
            axis.drive.damping, axis.drive.max_force, axis.drive.by_frequency, axis.restitution, axis.armature);
  if (def.type != JointType::coupling) return;
  archive(def.ratio);
  for (auto* end : {&def.coupled_a, &def.coupled_b}) archive(end->motion, end->from.position, end->from.rotation);
}

inline JointDef read_joint(ByteReader& in) {
  JointDef def;
  archive_joint(def, in);
  in.require(def.type <= JointType::coupling);
  for (const CouplingEnd& end : {def.coupled_a, def.coupled_b}) in.require(end.motion <= CoupledMotion::rope);
  for (const JointAxis& axis : def.axes) in.require(axis.mode <= AxisMode::locked);
  return def;
}

}  // namespace fathom
