// Sweeps over the overflow, whose constraints share bodies and still act at once.
//
// A body on which n of them act counts as n parts of equal mass, one for each, and moves with the mean of their
// velocities (Tonge, Benevolenski and Voroshilov, "Mass Splitting for Jitter-Free Parallel Rigid Body Simulation",
// SIGGRAPH 2012). Each impulse still acts in full: an n-th of the velocity that it gives an n-th of the mass. A
// contact that would change nothing in this sweep has no part: a plate over a hundred bumps that touches three of them
// must not be a hundred times too light for these.
#pragma once

#include "device/constraint_rows.hpp"
#include "exec/atomic.hpp"
#include "exec/load.hpp"

namespace fathom::device {

/// The phases of a sweep over the overflow: constraints that act are counted, then act, then bodies take the mean.
enum class SplitPhase : std::uint32_t { outside, count, act, merge };

template <class AnyBodies>
struct MassSplitting {
  /// In 1 m/s or rad/s.
  static constexpr float units = 1 << 30;
  /// Faster than any body may be: sums of 2¹⁷ terms do not overflow.
  static constexpr float max_term = 65536.0f * units;

  const AnyBodies& bodies;

  FATHOM_HD void count(std::uint32_t i) const { exec::atomic_add(bodies.split[i].parts, 1u); }
  /// Number of parts of body i: 1 in warm starting, which nobody counts, because impulses are given.
  FATHOM_HD float parts(std::uint32_t i) const {
    const std::uint32_t n = exec::atomic_load(bodies.split[i].parts);
    return n > 0 ? static_cast<float>(n) : 1.0f;
  }
  /// A constraint leaves its part of body i with these velocities.
  FATHOM_HD void add(std::uint32_t i, Vec3 linear, Vec3 angular) const {
    const float share = 1 / parts(i);
    add_terms(bodies.split[i].linear, share * (linear - exec::load_shared_quad(bodies.solver[i].linear).xyz()));
    add_terms(bodies.split[i].angular, share * (angular - exec::load_shared_quad(bodies.solver[i].angular).xyz()));
  }
  FATHOM_HD void merge(std::uint32_t i) const {
    SplitBody& body = bodies.split[i];
    const Vec3 linear = sum_of(body.linear), angular = sum_of(body.angular);
    if (!(linear == Vec3{} && angular == Vec3{})) {
      SolverQuads& to = bodies.solver[i];
      const Quad l = exec::load_shared_quad(to.linear), a = exec::load_shared_quad(to.angular);
      exec::store_shared_quad(to.linear, quad(l.xyz() + linear, l.w));
      exec::store_shared_quad(to.angular, quad(a.xyz() + angular, a.w));
    }
    body = {};
  }

 private:
  FATHOM_HD static void add_terms(std::uint64_t (&sums)[3], Vec3 v) {
    const float terms[3] = {v.x, v.y, v.z};
    for (int i = 0; i < 3; ++i) {
      const float term = max(-max_term, min(terms[i] * units, max_term));
      const auto whole = static_cast<std::int64_t>(term + (term < 0 ? -0.5f : 0.5f));
      if (whole != 0) exec::atomic_add(sums[i], static_cast<std::uint64_t>(whole));
    }
  }
  FATHOM_HD static Vec3 sum_of(const std::uint64_t (&sums)[3]) {
    const auto sum = [&](int i) { return static_cast<float>(static_cast<std::int64_t>(sums[i])) * (1 / units); };
    return {sum(0), sum(1), sum(2)};
  }
};

/// Makes a body of a contact one of `parts` parts.
template <class Inertia>
FATHOM_HD void split(ContactBody<Inertia>& side, float parts) {
  side.inverse_mass *= parts;
  side.inverse_inertia = parts * side.inverse_inertia;
}
/// The same for a joint.
FATHOM_HD void split(auto& side, float parts) {
  side.inverse_mass *= parts;
  if (side.inverse_mass > 0) side.inverse_inertia *= parts;
  side.response = parts * side.response;
}

}  // namespace fathom::device
