// The masses that a joint's springs by frequency move.
//
// A spring's stiffness must not depend on where the bodies are, or it does work as they turn. So a joint has the masses
// that its axes move where its two frames coincide, which follow from its definition and the bodies' mass properties.
#pragma once

#include <array>
#include <fathom/joint.hpp>

#include "math/vec3d.hpp"

namespace fathom {

/// By JointAxisName (kg or kg·m²); 0 for an axis that cannot move. For ball and distance joints and couplings the first
/// one alone.
using JointMasses = std::array<float, joint_axis_count>;

/// One of the two bodies, as far as masses depend on it.
struct JointedMass {
  Pose frame;               ///< the joint's, in body axes from the centre of mass
  float inverse_mass = 0;   ///< 1/kg
  SymMat3 inverse_inertia;  ///< 1/(kg·m²), body axes
};

namespace joint_masses {

/// Velocities (m/s and rad/s) by row for a unit impulse on each axis, where the frames coincide.
using Response = std::array<std::array<double, joint_axis_count>, joint_axis_count>;

inline Vec3d unit(std::size_t axis) { return {axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0}; }

/// Adds a body's part.
inline void add_response(const JointedMass& body, Response& k) {
  const Quat to_frame = conjugate(body.frame.rotation);
  const Vec3d arm = to_double(rotate(to_frame, body.frame.position));
  Vec3d columns[3];
  for (std::size_t i = 0; i < 3; ++i)
    columns[i] = to_double(rotate(to_frame, body.inverse_inertia * rotate(body.frame.rotation, to_float(unit(i)))));
  std::array<Vec3d, joint_axis_count> turning, linear{};  // of a unit impulse: its moment, and the impulse
  for (std::size_t i = 0; i < 3; ++i) linear[i] = unit(i), turning[i] = cross(arm, unit(i)), turning[3 + i] = unit(i);
  for (std::size_t i = 0; i < joint_axis_count; ++i)
    for (std::size_t j = 0; j < joint_axis_count; ++j) {
      const Vec3d m = turning[j], spun = m.x * columns[0] + m.y * columns[1] + m.z * columns[2];
      k[i][j] += dot(turning[i], spun) + to_double(body.inverse_mass) * dot(linear[i], linear[j]);
    }
}

/// Mass that axis i moves while all other locked ones hold.
inline float mass_along(const JointDef& def, Response k, std::size_t i) {
  constexpr double negligible = 1e-9;  // beside rounding of the mass properties
  const double alone = k[i][i];
  for (std::size_t l = 0; l < joint_axis_count; ++l) {
    if (l == i || !def.axes[l].is_locked() || !(k[l][l] > 0)) continue;
    for (std::size_t r = 0; r < joint_axis_count; ++r) {
      if (r == l) continue;
      const double share = k[r][l] / k[l][l];
      for (std::size_t c = 0; c < joint_axis_count; ++c) k[r][c] -= share * k[l][c];
    }
    for (std::size_t c = 0; c < joint_axis_count; ++c) k[l][c] = 0;
  }
  return k[i][i] > negligible * alone ? static_cast<float>(1 / k[i][i]) : 0.0f;
}

/// Change of a coupled motion's rate for a unit impulse.
inline double response_of(const CouplingEnd& end, const JointedMass& body) {
  if (end.motion != CoupledMotion::turn) return to_double(body.inverse_mass);
  const Vec3 axis = rotate(body.frame.rotation, {1, 0, 0});
  return to_double(dot(axis, body.inverse_inertia * axis));
}

inline float inverted(double response) { return response > 0 ? static_cast<float>(1 / response) : 0.0f; }

}  // namespace joint_masses

/// Of a generic joint, along and about each axis with the other locked ones held; of a ball or distance joint the
/// reduced mass 1 / (1 / m_a + 1 / m_b), which its force moves along a line through both centres; of a coupling that of
/// its sum.
inline JointMasses joint_masses_of(const JointDef& def, const JointedMass& a, const JointedMass& b) {
  using namespace joint_masses;
  JointMasses masses{};
  if (def.type == JointType::coupling) {
    const double ratio = to_double(def.ratio);
    masses[0] = inverted(response_of(def.coupled_a, a) + ratio * ratio * response_of(def.coupled_b, b));
  } else if (def.type != JointType::generic) {
    masses[0] = inverted(to_double(a.inverse_mass) + to_double(b.inverse_mass));
  } else {
    Response k{};
    add_response(a, k), add_response(b, k);
    for (std::size_t i = 0; i < joint_axis_count; ++i) masses[i] = mass_along(def, k, i);
  }
  return masses;
}

}  // namespace fathom
