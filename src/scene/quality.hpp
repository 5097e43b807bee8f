// The quality of a simulation, whichever engine ran it: measured from a scene and its final states.
#pragma once

#include <cstdint>
#include <span>

#include "scene/scene.hpp"

namespace fathom {

/// Figures of the dynamic bodies. Bodies with a state that is not finite are counted and otherwise ignored.
struct Quality {
  double ground_penetration_max = 0;      ///< m, the deepest point of any body below the ground, ≥ 0
  double displacement_max = 0;            ///< m, the largest distance of a centre of mass from its start
  double top_drop = 0;                    ///< m, how much lower the initially highest body is
  double kinetic_energy_per_body = 0;     ///< J
  std::uint64_t bodies_below_ground = 0;  ///< bodies with a point more than 0.5 m below the ground
  double overlap_max = 0;                 ///< m, the deepest penetration between two bodies, ≥ 0
  double joint_gap_max = 0;               ///< m, the largest violation of a rigid joint's anchors
  std::uint64_t escaped = 0;              ///< bodies with their centre of mass outside Scene::container
  std::uint64_t non_finite = 0;           ///< bodies whose state is not finite
};

/// Poses and velocities are in the order of Scene::bodies.
Quality measure_quality(const Scene& scene, std::span<const Pose> poses, std::span<const Velocity> velocities);
/// The same for a scene in a world.
Quality measure_quality(const Scene& scene, const SceneInstance& instance, const World& world);

/// How far a joint's anchors are from where its translations, or its distance, allow them to be (m). Poses as above.
float joint_gap(const Scene& scene, const SceneJoint& joint, std::span<const Pose> poses);

/// Height (m) of the lowest point of a placed shape.
float lowest_point(const Shape& shape, const Pose& pose);

}  // namespace fathom
