// The couplings of a scene file: [[joint]] tables of the types gear, rack and pulley.
#pragma once

#include "scene/joint_axes.hpp"
#include "scene/scene.hpp"

namespace fathom {

/// Sets what a coupling's definition has besides its spring.
void read_coupling(const TomlTable& table, JointWord word, const Scene& scene, SceneJoint& joint);

}  // namespace fathom
