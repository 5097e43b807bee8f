// Rotates anisotropic bodies in contact by a substep (dynamics/rotation-inl.hpp), eight side by side; each result is
// bit-identical to that of the body alone.
#pragma once

#include <cstdint>
#include <span>

#include "dynamics/solver_body.hpp"
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

/// Rotates the bodies in at most eight slots by a substep of length h (s).
void spin_in_contact(const SpinningBodies& all, std::span<const std::uint32_t> slots, float h);

}  // namespace fathom::native
