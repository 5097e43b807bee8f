// What a touching pair keeps from step to step: anchors in both bodies, impulses, and the friction frame.
//
// Consists of 16-byte quads, because constraint building loads them as such: transposed into vector lanes on the CPU,
// as vectors on a GPU.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "collision/manifold.hpp"

namespace fathom {

/// Lever of the friction that brakes spin, per radius of curvature of the patch (dynamics/rolling.hpp).
inline constexpr float spin_lever_share = 0.589f * 0.01f;

/// Anchors of a contact point: two quads.
struct ContactPointState {
  Vec3 anchor_a;  ///< in A's frame (m)
  std::uint32_t feature = 0;
  Vec3 anchor_b;  ///< in B's frame (m)

 private:
  friend struct ContactManifold;
  float of_manifold_ = 0;  // spare word of the quad, in which `ContactManifold` stores data of its own
};

struct alignas(16) ContactManifold {
  Vec3 normal;  ///< in A's frame, from A to B
  float friction = 0;
  Vec3 tangent;  ///< in A's frame
  float restitution = 0;
  float impulses[max_manifold_points] = {};  ///< along the normal, over the last substep (N·s)
  float friction_impulse[2] = {0, 0};        ///< along tangent and normal × tangent (N·s)
  float twist_impulse = 0;                   ///< about the normal (N·m·s)
  float step_impulse = 0;                    ///< of all points along the normal, over the step (N·s)
  ContactPointState points[max_manifold_points];
  Quat rotation_at_build;  ///< B in A's frame when the points were made

  /// Impulse of point i over the step (N·s). The step's sum is divided among the points as in the last substep, or
  /// evenly where none of them carries load then.
  FATHOM_HD float step_impulse_of(int i) const {
    const float sum = ((impulses[0] + impulses[1]) + impulses[2]) + impulses[3];
    return sum > 0 ? step_impulse * (impulses[i] / sum) : step_impulse / static_cast<float>(point_count());
  }

  // A contact of a round shape has at most two points. In the slot of the last one's anchors it stores values of its
  // contact patch: curvature (m) and share as in RoundContact, the rolling resistance length (m), and the rolling
  // impulse along tangent, normal × tangent and normal (N·m·s).
  FATHOM_HD void set_round(float curvature, float share_a, float rolling_length) {
    points[3].anchor_a = {curvature, rolling_length, share_a};
  }
  FATHOM_HD float curvature() const { return points[3].anchor_a.x; }
  FATHOM_HD float rolling_length() const { return points[3].anchor_a.y; }
  FATHOM_HD float share_a() const { return points[3].anchor_a.z; }
  /// m, of the friction that brakes spin about the normal.
  FATHOM_HD float spin_lever() const { return spin_lever_share * curvature(); }
  FATHOM_HD Vec3 rolling_impulse() const { return points[3].anchor_b; }
  FATHOM_HD void set_rolling_impulse(Vec3 impulse) { points[3].anchor_b = impulse; }

  /// B's position in A's frame when the points were made (m).
  FATHOM_HD Vec3 position_at_build() const {
    return {points[0].of_manifold_, points[1].of_manifold_, points[2].of_manifold_};
  }
  FATHOM_HD int point_count() const { return static_cast<int>(point_count_as_float()); }
  /// As a float, which vector lanes compare, and which a damaged snapshot may corrupt.
  FATHOM_HD float point_count_as_float() const { return points[3].of_manifold_; }
  FATHOM_HD void set_build(const Pose& b_in_a, int count) {
    rotation_at_build = b_in_a.rotation;
    points[0].of_manifold_ = b_in_a.position.x;
    points[1].of_manifold_ = b_in_a.position.y;
    points[2].of_manifold_ = b_in_a.position.z;
    points[3].of_manifold_ = static_cast<float>(count);
  }
  /// Forces a rebuild, wherever the bodies are.
  FATHOM_HD void forget_build() { points[0].of_manifold_ = 3e38f; }
};
static_assert(sizeof(ContactManifold) == 208);

/// Upper bound on the speed (m/s) of any point of a body.
FATHOM_HD float fastest_speed(float radius, Vec3 linear, Vec3 angular) {
  return length(linear) + radius * length(angular);
}

/// Whether friction is within `beyond` times its cone, for checks. Two tolerances: the residue of a load that ended
/// within the step is no better than its rounding; and where friction is less than 1e-19 of the impulse `stopping`
/// (N·s) that would stop the slide, the quotient of both squares in `solve_friction` is subnormal and loses digits.
FATHOM_HD bool is_within_cone(const ContactManifold& m, float beyond, float stopping) {
  const float load = (m.impulses[0] + m.impulses[1]) + (m.impulses[2] + m.impulses[3]);
  const float slide =
      fathom::sqrt(fma(m.friction_impulse[0], m.friction_impulse[0], m.friction_impulse[1] * m.friction_impulse[1]));
  return slide <= beyond * m.friction * load + (1e-6f * m.step_impulse + 1e-18f * stopping + 1e-20f);
}

}  // namespace fathom
