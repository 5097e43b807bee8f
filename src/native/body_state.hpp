// The state that a step changes, by slot. Arrays are separate, because each stage reads only a few of them. They are
// indexed by slot, not compacted, because contacts, trees and the application use slots as stable names.
#pragma once

#include <cstdint>
#include <vector>

#include "dynamics/forces.hpp"
#include "dynamics/solver_body.hpp"
#include "native/body_bounds.hpp"

namespace fathom::native {

enum BodyFlag : std::uint8_t {
  awake = 1,        ///< takes part in steps
  box_changed = 2,  ///< its fat box is new since the broad phase last ran
  has_force = 4,    ///< `forces` holds something for the next step
  isolated = 8,     ///< stopped because its state was not finite
  kinematic = 16,
  targeted = 64,  ///< the next step takes it to a pose given by the application
  jointed = 128,  ///< it has joints
  filtered = 32,  ///< there may be bodies that it does not collide with
};

/// Acceleration of a body with this orientation under an application force besides `gravity` (m/s²).
inline Acceleration forced_acceleration(const BodyInfo& info, Quat rotation, const Force& f, Vec3 gravity) {
  Acceleration a{gravity, {}};
  add_forces(a, rotation, info.inverse_mass, info.isotropic ? info.inverse_inertia.xx : 0.0f, info.inverse_inertia,
             f.force, f.torque);
  return a;
}

/// What a free body's motion needs of BodyInfo, which spans six cache lines.
struct alignas(16) FlightData {
  float gravity_scale = 1;
  float linear_damping = 0, angular_damping = 0;  ///< 1/s
  float zero = 0;
};

struct BodyState {
  std::vector<Pose> poses;
  std::vector<Velocity> velocities;
  std::vector<BodyBounds> bounds;
  std::vector<FlightData> flight;
  std::vector<std::uint8_t> flags;
  std::vector<float> slow_time;               ///< s for which the body has been slow
  std::vector<std::uint32_t> colour_mask;     ///< colours its contacts occupy
  std::vector<std::uint32_t> overflow_count;  ///< its contacts without a colour
  std::vector<Force> forces;
  std::vector<std::uint64_t> to_solve;  ///< a bit per body: the solver moves it, because it has colours or is kinematic

  // Used only within a step, by bodies in contact.
  std::vector<SolverBody> solver;  ///< entry 0 stands for "no body"; slot s is entry s + 1; then stand-ins
  std::vector<BodyMotion> motion;
  std::vector<WarmStart> warm;
  std::vector<WorldInertia> inertia;
  std::vector<std::uint8_t> swings;  ///< 1: only their mechanism's joints act on it and its mechanism's other bodies

  /// What outlasts a step, for snapshots.
  template <class Self, class Archive>
  static void archive(Self& s, Archive& a) {
    a(s.poses, s.velocities, s.bounds, s.flags, s.slow_time, s.colour_mask, s.overflow_count, s.forces);
  }
  void restore(ByteReader& in, std::size_t slots);

  SolverBody* solver_bodies() { return solver.data() + 1; }
  /// m/s², of a body that swings; else 0.
  Vec3 swing(std::uint32_t slot) const { return swings[slot] ? motion[slot].acceleration : Vec3{}; }

  void resize(std::size_t slots);
  void reserve(std::size_t slots);
  /// Answered from flags where possible; BodyInfo is far away.
  bool is_dynamic(const BodyTable& bodies, std::uint32_t slot) const {
    return flags[slot] & awake ? !(flags[slot] & kinematic) : bodies[slot].motion == MotionType::dynamic;
  }
  bool is_to_solve(std::uint32_t slot) const { return to_solve[slot / 64] >> slot % 64 & 1; }
  void note_filter(std::uint32_t slot, const BodyInfo& info) {
    const bool is = info.is_sensor || may_keep_out(info.filter);
    flags[slot] = static_cast<std::uint8_t>(is ? flags[slot] | filtered : flags[slot] & ~filtered);
  }
  /// Brings the bit of `to_solve` up to date.
  void note_to_solve(std::uint32_t slot) {
    const std::uint64_t bit = std::uint64_t{1} << slot % 64;
    const bool is = colour_mask[slot] != 0 || overflow_count[slot] != 0 || (flags[slot] & kinematic);
    to_solve[slot / 64] = is ? to_solve[slot / 64] | bit : to_solve[slot / 64] & ~bit;
  }

  /// Resets to the state of an unused slot.
  void clear(std::uint32_t slot);
  std::size_t size() const { return poses.size(); }
  std::size_t memory_bytes() const;

 private:
  template <class Act>
  void for_each_array(const Act& act);
};

inline FlightData flight_data(const BodyInfo& info) {
  return {info.gravity_scale, info.linear_damping, info.angular_damping};
}

}  // namespace fathom::native
