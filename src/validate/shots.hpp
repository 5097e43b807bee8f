// Random bodies shot at others and past them, judged by exact overlaps in double precision.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>

#include "validate/setup.hpp"

namespace fathom::validate {

/// A body of any shape from 5 mm to 4 m, thrown at 1 to 1,000 m/s, half of them spinning, at a fixed one from 1 cm to
/// 20 m, without gravity.
struct Shot {
  BodyDef target, bullet;
  float dt = 0;
  int substeps = 4;
  int steps = 0;         ///< until it is beyond
  double thinner = 0;    ///< m, half the thickness of the thinner body, about
  double path = 0;       ///< m a step
  double clearance = 0;  ///< m, of those past the target
};

/// At the inner part of the target.
Shot shot_at(std::uint64_t seed);
/// A body of 1 to 20 cm at 20 to 1,000 m/s at one that can be pushed and has 0.01 to 100 times its mass, half of them
/// moving: a crate of 1 m, a plate of 2 cm or of 1 mm, a ball, a capsule or a hull.
Shot shot_at_free(std::uint64_t seed);
/// Past it, whatever way the bullet turns, at a clearance.
Shot shot_past(std::uint64_t seed);

/// How deep (m) the bullet is in the target after any step, or half way through one, or behind a plate, beyond what is
/// allowed: the larger of 5 mm and a tenth of the thinner body's half thickness, and never more than a quarter of that
/// and half a millimetre.
double too_deep(const Shot& shot, const Setup& setup);

/// Whether the bullet or the target is told to have touched anything, or the bullet's velocity changes.
bool leaves_a_trace(const Shot& shot, const Setup& setup);

}  // namespace fathom::validate
