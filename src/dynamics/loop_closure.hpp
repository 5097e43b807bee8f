// Loops of joints in a direct solution (dynamics/mechanism.hpp). Pure, for host and device.
//
// A tree has no loops, so a loop is cut at one of its bodies: the tree gets a copy of the body with a share of its
// mass, and the joint that closes the loop holds the copy. Six additional rows make the body and its copy move alike.
// Their matrix is J inverse(A) transpose(J) with the tree's response A; each column takes one solution of the tree (cut
// joints: Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 8). Because the cut is at a body, all joints
// stay joints of the tree, with their limits, drives and springs, and there is only one kind of closure.
//
// Rows that nothing in the loop can follow, such as those across a planar linkage, would be singular, and a loop that
// does not fit together would be pulled endlessly. So each row yields a little under its load, like a spring of about
// 100 times a substep's rate. Only rows that nothing follows are meant to yield: the aim is the part (S inverse(R +
// S))² S of their impulses, with responses R and softnesses S, which is negligible where R is the larger. Further
// rounds work on the remaining error. They measure it from the bodies' motion, because rounding in R would make them
// miss the aim (docs/log/2026-11-25-loop-closures.md).
#pragma once

#include <cstdint>

#include "dynamics/joint_tree.hpp"
#include "dynamics/tuning.hpp"
#include "math/team.hpp"

namespace fathom {

inline constexpr std::uint32_t closure_rows = 6;

/// The rows that close a mechanism's loops, stored in the mechanism's memory.
class LoopClosure {
 public:
  /// Floats that this many closures need.
  FATHOM_HD static constexpr std::uint32_t size(std::uint32_t closures) {
    const std::uint32_t rows = closure_rows * closures;
    return rows * (rows + 1) / 2 + 5 * rows;
  }
  FATHOM_HD LoopClosure(float* memory, std::uint32_t closures)
      : lower_(memory), rows_(closure_rows * closures), vectors_(memory + rows_ * (rows_ + 1) / 2) {}

  /// Response of row i to a unit impulse on row j <= i.
  FATHOM_HD float& response(std::uint32_t i, std::uint32_t j) const { return lower_[i * (i + 1) / 2 + j]; }
  /// Yield of row i per unit of its impulse.
  FATHOM_HD float& softness(std::uint32_t i) const { return vectors_[i]; }
  /// Impulse of row i (N·s or N·m·s) added since the step began …
  FATHOM_HD float& total(std::uint32_t i) const { return vectors_[rows_ + i]; }
  /// … and by the current solution's rounds.
  FATHOM_HD float& more(std::uint32_t i) const { return vectors_[2 * rows_ + i]; }
  /// Error of row i (m/s or rad/s); after `solve`, the impulse that removes it (N·s or N·m·s).
  FATHOM_HD float& error(std::uint32_t i) const { return vectors_[3 * rows_ + i]; }

  /// Factorises the responses as L D transpose(L), column by column, in place: stores inverse(D) and L D. Run by a
  /// team.
  FATHOM_HD void factorise() const {
    for (std::uint32_t k = 0; k < rows_; ++k) {
      // Rounding must not make a row stiffer than its own softness.
      if (team::is_leader()) response(k, k) = 1 / max(response(k, k), softness(k));
      team::sync();
      for (std::uint32_t i = k + 1 + team::item(); i < rows_; i += team::items) {
        const float share = response(i, k) * response(k, k);
        for (std::uint32_t j = k + 1; j <= i; ++j) response(i, j) = fma(-share, response(j, k), response(i, j));
      }
      team::sync();
    }
  }
  /// Solves for the impulses that remove the errors and adds them to `more`. By a team.
  FATHOM_HD void solve() const {
    each_row([&](std::uint32_t i) { yield(i) = total(i) + more(i); });
    for (int pass = 0; pass < yielding_passes; ++pass) {
      each_row([&](std::uint32_t i) { yield(i) *= softness(i); });
      substitute(&yield(0));
    }
    each_row([&](std::uint32_t i) { yield(i) *= softness(i); });
    each_row([&](std::uint32_t i) { error(i) = -(error(i) + yield(i)); });
    substitute(&error(0));
    each_row([&](std::uint32_t i) { more(i) += error(i); });
  }
  FATHOM_HD TreeLoad load(std::uint32_t closure) const {
    const float* const row = &error(closure_rows * closure);
    return {{row[0], row[1], row[2]}, {row[3], row[4], row[5]}};
  }

 private:
  template <class Act>
  FATHOM_HD void each_row(const Act& act) const {
    for (std::uint32_t i = team::item(); i < rows_; i += team::items) act(i);
    team::sync();
  }
  /// Yield (m/s or rad/s) of row i under the part of its impulse that nothing in the loop follows.
  FATHOM_HD float& yield(std::uint32_t i) const { return vectors_[4 * rows_ + i]; }
  /// Solves the factorised equations in place; x is the right-hand side at first.
  FATHOM_HD void substitute(float* x) const {
    for (std::uint32_t k = 0; k < rows_; ++k) {
      const float known = x[k] * response(k, k);
      team::sync();
      if (team::is_leader()) x[k] = known;
      for (std::uint32_t i = k + 1 + team::item(); i < rows_; i += team::items)
        x[i] = fma(-response(i, k), known, x[i]);
      team::sync();
    }
    for (std::uint32_t k = rows_; k-- > 0;) {
      for (std::uint32_t i = team::item(); i < k; i += team::items)
        x[i] = fma(-response(k, i) * response(i, i), x[k], x[i]);
      team::sync();
    }
  }

  float* lower_;
  std::uint32_t rows_;
  float* vectors_;
};

}  // namespace fathom
