// Loops of joints in a direct solution (dynamics/mechanism.hpp). Pure, for host and device.
//
// A tree has no loops, so a loop is cut at one of its bodies: the tree gets a copy of it, which has a share of its
// mass, and the joint that closes the loop holds the copy. That the body and its copy move alike are six rows more.
// What these give is J inverse(A) transpose(J) by the tree's response A, a column for each row by a solution of the
// tree (cut joints: Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 8). Cut at a body, all joints are
// joints of the tree, with their limits, drives and springs, and there is one kind of closure.
//
// Rows that nothing in the loop can follow, as those across a planar linkage, would be singular, and what does not fit
// together would be pulled without end. So each gives way by a little of all that it holds, as a spring of some 100
// times a substep's rate: ten times its weight opens a loop by less than a micrometre.
#pragma once

#include <cstdint>

#include "dynamics/joint_tree.hpp"
#include "math/team.hpp"

namespace fathom {

inline constexpr std::uint32_t closure_rows = 6;
inline constexpr std::uint32_t max_closures = 8;  // of a mechanism: more loops are a net
inline constexpr float closure_softness = 1e-4f;  // of a row, by what its body alone would move

/// The rows that close a mechanism's loops, in memory of the mechanism's own.
class LoopClosure {
 public:
  /// Floats that `closures` take.
  FATHOM_HD static constexpr std::uint32_t size(std::uint32_t closures) {
    const std::uint32_t rows = closure_rows * closures;
    return rows * (rows + 1) / 2 + 4 * rows;
  }
  FATHOM_HD LoopClosure(float* memory, std::uint32_t closures)
      : lower_(memory), rows_(closure_rows * closures), vectors_(memory + rows_ * (rows_ + 1) / 2) {}

  /// What row i moves by where row j <= i gives a unit.
  FATHOM_HD float& response(std::uint32_t i, std::uint32_t j) const { return lower_[i * (i + 1) / 2 + j]; }
  /// What row i gives way by for each unit that it holds.
  FATHOM_HD float& softness(std::uint32_t i) const { return vectors_[i]; }
  /// N·s or N·m·s that row i holds so far in the substep …
  FATHOM_HD float& total(std::uint32_t i) const { return vectors_[rows_ + i]; }
  /// … and by the rounds of a solution.
  FATHOM_HD float& more(std::uint32_t i) const { return vectors_[2 * rows_ + i]; }
  /// What row i is off by (m/s or rad/s); once solved, what takes that away (N·s or N·m·s).
  FATHOM_HD float& error(std::uint32_t i) const { return vectors_[3 * rows_ + i]; }

  /// Factorises the responses as L D transpose(L), column by column: D and L D take their place. By a team.
  FATHOM_HD void factorise() const {
    for (std::uint32_t k = 0; k < rows_; ++k) {
      for (std::uint32_t i = k + 1 + team::item(); i < rows_; i += team::items) {
        const float share = response(i, k) / pivot(k);
        for (std::uint32_t j = k + 1; j <= i; ++j) response(i, j) = fma(-share, response(j, k), response(i, j));
      }
      team::sync();
    }
  }
  /// Solves for what takes the errors away, with what rows give way by, and adds it to `more`. By one of a team.
  FATHOM_HD void solve() const {
    for (std::uint32_t i = 0; i < rows_; ++i) error(i) = -fma(softness(i), total(i) + more(i), error(i));
    for (std::uint32_t k = 0; k < rows_; ++k) {
      error(k) /= pivot(k);
      for (std::uint32_t i = k + 1; i < rows_; ++i) error(i) = fma(-response(i, k), error(k), error(i));
    }
    for (std::uint32_t k = rows_; k-- > 0;) {
      float sum = 0;
      for (std::uint32_t i = k + 1; i < rows_; ++i) sum = fma(response(i, k), error(i), sum);
      error(k) = fma(-1 / pivot(k), sum, error(k));
      more(k) += error(k);
    }
  }
  FATHOM_HD TreeLoad load(std::uint32_t closure) const {
    const float* const e = &error(closure_rows * closure);
    return {{e[0], e[1], e[2]}, {e[3], e[4], e[5]}};
  }

 private:
  /// Rounding leaves no row stiffer than it is alone.
  FATHOM_HD float pivot(std::uint32_t k) const { return max(response(k, k), softness(k)); }

  float* lower_;
  std::uint32_t rows_;
  float* vectors_;
};

}  // namespace fathom
