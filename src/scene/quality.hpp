// How well a run was simulated, whichever engine made it: measured from a scene and its final states.
#pragma once

#include <cstdint>
#include <span>

#include "scene/scene.hpp"

namespace fathom {

/// Figures of the dynamic bodies. Bodies whose state is not finite are counted and left out of the rest.
struct Quality {
  double ground_penetration_max = 0;      ///< m, the deepest point of any body under the ground's surface, ≥ 0
  double displacement_max = 0;            ///< m, the largest distance of a centre of mass from its start
  double top_drop = 0;                    ///< m, by how much the body that was highest at the start is lower now
  double kinetic_energy_per_body = 0;     ///< J
  std::uint64_t bodies_below_ground = 0;  ///< bodies with a point more than 0.5 m under the ground's surface
  double overlap_max = 0;                 ///< m, the deepest that two bodies are in each other, ≥ 0
  double joint_gap_max = 0;               ///< m, how far a rigid joint's anchors are at most from where it allows them
  std::uint64_t escaped = 0;              ///< bodies whose centre of mass is out of Scene::container
  std::uint64_t non_finite = 0;           ///< bodies whose state is not finite
};

/// Poses and velocities are those of Scene::bodies, in that order.
Quality measure_quality(const Scene& scene, std::span<const Pose> poses, std::span<const Velocity> velocities);
/// The same of a scene in a world.
Quality measure_quality(const Scene& scene, const SceneInstance& instance, const World& world);

/// How far a joint's anchors are from where its translations, or its distance, allow them to be (m). Poses as above.
float joint_gap(const Scene& scene, const SceneJoint& joint, std::span<const Pose> poses);

/// Height (m) of the lowest point of a placed shape.
float lowest_point(const Shape& shape, const Pose& pose);

}  // namespace fathom
