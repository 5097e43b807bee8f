// The couplings of a scene file: [[joint]] tables of the types gear, rack and pulley.
#pragma once

#include "scene/joint_axes.hpp"
#include "scene/scene.hpp"

namespace fathom {

/// Sets the members of a coupling's definition other than its spring.
void read_coupling(const TomlTable& table, JointWord word, const Scene& scene, SceneJoint& joint);

}  // namespace fathom
