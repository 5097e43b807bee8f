// Layout of a block of constraints: the fields of each lane.
#pragma once

#include <cstddef>
#include <cstdint>

#include "collision/manifold.hpp"

namespace fathom::native {

enum Field : int {
  normal_x,
  normal_y,
  normal_z,
  tangent_x,
  tangent_y,
  tangent_z,
  arm_a_x,
  arm_a_y,
  arm_a_z,
  arm_b_x,
  arm_b_y,
  arm_b_z,
  k_nn,
  k_n1,
  k_n2,
  k_11,
  k_12,
  k_22,
  points,  // five per point: x, y, separation, effective mass, impulse
  friction = points + 5 * max_manifold_points,
  friction_impulse_1,
  friction_impulse_2,
  twist_impulse,
  slide_11,
  slide_12,
  slide_22,  // inverse of the tangential 2×2 matrix
  twist_mass,
  patch_radius,
  step_impulse,   // along the normal, sum of all points over the step
  held_part,      // from the supports' direct solution; this and the next only if the header says so (`rare`)
  own_bias_rate,  // `soft_step`
  own_mass_scale,
  own_impulse_scale,
  own_push_out,
  inertia_a,  // six each: xx yy zz xy xz yz
  inertia_b = inertia_a + 6,
  field_count = inertia_b + 6,
  roll_length = field_count,  // rolling resistance, and its impulse in world axes
  roll_x,
  roll_y,
  roll_z,
  surface_x,  // `ContactSurface`
  surface_y,
  surface_z,
  grain_1,
  grain_2,
  surface_field_count
};
enum PointField : int { point_x, point_y, point_separation, point_mass, point_impulse, point_fields };

constexpr int point_field(int point, PointField field) { return points + point * point_fields + field; }

/// A block is its header, then three indices per lane, then the fields, each for all lanes.
inline constexpr std::size_t block_header_bytes = 64, block_indices = 3;

/// One lane of a block, for access to single constraints.
class LaneFields {
 public:
  LaneFields() = default;
  LaneFields(std::byte* block, std::size_t width, std::size_t lane)
      : first_(reinterpret_cast<float*>(block + block_header_bytes) + block_indices * width + lane), width_(width) {}

  float& operator[](int field) const { return first_[static_cast<std::size_t>(field) * width_]; }

 private:
  float* first_ = nullptr;
  std::size_t width_ = 0;
};

}  // namespace fathom::native
