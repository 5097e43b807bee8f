// Loops of joints in a direct solution (dynamics/mechanism.hpp). Pure, for host and device.
//
// A tree has no loops, so a loop is cut at one of its bodies: the tree gets a copy of it, which has a share of its
// mass, and the joint that closes the loop holds the copy. That the body and its copy move alike are six rows more.
// What these give is J inverse(A) transpose(J) by the tree's response A, a column for each row by a solution of the
// tree (cut joints: Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 8). Cut at a body, all joints are
// joints of the tree, with their limits, drives and springs, and there is one kind of closure.
//
// Rows that nothing in the loop can follow, as those across a planar linkage, would be singular, and what does not fit
// together would be pulled without end. So each gives way by a little of what it holds, as a spring of some 100 times a
// substep's rate. Only what nothing follows is to do that: of what rows hold, the part (S inverse(R + S))² S is taken
// as an aim, with responses R and softnesses S, which is next to nothing where R is the larger. Rounds on the error
// that is left do the rest, and are told by how bodies would move, because rounding in R would have them aim past it
// (docs/log/2026-11-25-loop-closures.md).
#pragma once

#include <cstdint>

#include "dynamics/joint_tree.hpp"
#include "dynamics/tuning.hpp"
#include "math/team.hpp"

namespace fathom {

inline constexpr std::uint32_t closure_rows = 6;

/// The rows that close a mechanism's loops, in memory of the mechanism's own.
class LoopClosure {
 public:
  /// Floats that `closures` take.
  FATHOM_HD static constexpr std::uint32_t size(std::uint32_t closures) {
    const std::uint32_t rows = closure_rows * closures;
    return rows * (rows + 1) / 2 + 5 * rows;
  }
  FATHOM_HD LoopClosure(float* memory, std::uint32_t closures)
      : lower_(memory), rows_(closure_rows * closures), vectors_(memory + rows_ * (rows_ + 1) / 2) {}

  /// What row i moves by where row j <= i gives a unit.
  FATHOM_HD float& response(std::uint32_t i, std::uint32_t j) const { return lower_[i * (i + 1) / 2 + j]; }
  /// What row i gives way by for each unit that it holds.
  FATHOM_HD float& softness(std::uint32_t i) const { return vectors_[i]; }
  /// N·s or N·m·s that row i holds more of than as the step began …
  FATHOM_HD float& total(std::uint32_t i) const { return vectors_[rows_ + i]; }
  /// … and by the rounds of a solution.
  FATHOM_HD float& more(std::uint32_t i) const { return vectors_[2 * rows_ + i]; }
  /// What row i is off by (m/s or rad/s); once solved, what takes that away (N·s or N·m·s).
  FATHOM_HD float& error(std::uint32_t i) const { return vectors_[3 * rows_ + i]; }

  /// Factorises the responses as L D transpose(L), column by column: inverse(D) and L D take their place. By a team.
  FATHOM_HD void factorise() const {
    for (std::uint32_t k = 0; k < rows_; ++k) {
      // Rounding leaves no row stiffer than it is alone.
      if (team::is_leader()) response(k, k) = 1 / max(response(k, k), softness(k));
      team::sync();
      for (std::uint32_t i = k + 1 + team::item(); i < rows_; i += team::items) {
        const float share = response(i, k) * response(k, k);
        for (std::uint32_t j = k + 1; j <= i; ++j) response(i, j) = fma(-share, response(j, k), response(i, j));
      }
      team::sync();
    }
  }
  /// Solves for what takes the errors away and adds it to `more`. By a team.
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
  /// By which row i gives way for what it holds that nothing in the loop follows (m/s or rad/s).
  FATHOM_HD float& yield(std::uint32_t i) const { return vectors_[4 * rows_ + i]; }
  /// Of the responses' equations, x being the right side at first.
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
