// Bodies in contact with several principal moments, which turn in a substep (dynamics/rotation-inl.hpp), eight side by
// side: each gets the bits that it would get alone.
#pragma once

#include <cstdint>
#include <span>

#include "dynamics/solver_body.hpp"
#include "world/body_table.hpp"

namespace fathom::native {

inline constexpr std::size_t spin_lanes = 8;

/// By slot.
struct SpinningBodies {
  const BodyTable& table;
  SolverBody* bodies;
  WarmStart* warm;
  WorldInertia* inertia;
  const Pose* poses;          ///< as the step began
  const std::uint8_t* flags;  ///< which of them have joints; null where none has
};

/// Turns those in at most eight slots by a substep of length h (s).
void spin_in_contact(const SpinningBodies& all, std::span<const std::uint32_t> slots, float h);

}  // namespace fathom::native
