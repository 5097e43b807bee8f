// Rotates anisotropic bodies (dynamics/rotation-inl.hpp), eight side by side; each result is bit-identical to that of
// the body alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "dynamics/solver_body.hpp"
#include "math/eight.hpp"
#include "world/body_table.hpp"

namespace fathom::native {

inline constexpr std::size_t spin_lanes = 8;

/// Arrays by slot.
struct SpinningBodies {
  const BodyTable& table;
  SolverBody* bodies;
  WarmStart* warm;
  WorldInertia* inertia;
  const Pose* poses;          ///< as the step began
  const std::uint8_t* flags;  ///< which bodies have joints; null if none has
};

/// Rotates the bodies in at most eight slots, in contact, by a substep of length h (s).
void spin_in_contact(const SpinningBodies& all, std::span<const std::uint32_t> slots, float h);

/// Bodies that nothing touches, by lane.
struct FreeSpins {
  std::array<const BodyInfo*, spin_lanes> bodies{};  ///< null: not to be turned
  Eight rotation[4], angular[3];                     ///< w, x, y, z; rad/s
  Eight acceleration[3], damping;                    ///< rad/s²; factor per substep
};

/// Rotates them by all substeps of length h (s), at most `most` (rad/s) fast (`fathom::spin_freely`).
void spin_freely(FreeSpins& spins, float h, int substeps, float most);

}  // namespace fathom::native
