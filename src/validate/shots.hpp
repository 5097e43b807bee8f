// Random bodies shot at others and past them, judged by exact overlaps in double precision.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>

#include "validate/setup.hpp"

namespace fathom::validate {

/// A body of any shape from 5 mm to 4 m, thrown at 1 to 1,000 m/s at a fixed body from 1 cm to 20 m, without gravity.
/// It spins in half of the shots.
struct Shot {
  BodyDef target, bullet;
  float dt = 0;
  int substeps = 4;
  int steps = 0;         ///< until the bullet is past the target
  double thinner = 0;    ///< m, approximate half thickness of the thinner body
  double path = 0;       ///< m per step
  double clearance = 0;  ///< m, of shots past the target
};

/// Aimed at the inner part of the target.
Shot shot_at(std::uint64_t seed);
/// A body of 1 to 20 cm at 20 to 1,000 m/s, aimed at a body that can be pushed and moves in half of the shots. The
/// target has 0.01 to 100 times its mass: a crate of 1 m, a plate of 2 cm or of 1 mm, a ball, a capsule or a hull.
Shot shot_at_free(std::uint64_t seed);
/// Past the target at a clearance, however the bullet turns.
Shot shot_past(std::uint64_t seed);

/// Excess depth (m) of the bullet in the target, or behind a plate, after any step or half way through one. The allowed
/// depth is the larger of 5 mm and a tenth of the thinner body's half thickness, but at most a quarter of that
/// thickness plus half a millimetre.
double too_deep(const Shot& shot, const Setup& setup);

/// Whether the bullet or the target is reported to have touched anything, or the bullet's velocity has changed.
bool leaves_a_trace(const Shot& shot, const Setup& setup);

}  // namespace fathom::validate
