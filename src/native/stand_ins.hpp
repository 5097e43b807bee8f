// Stand-ins of kinematic bodies for groups and domains (constraint_layout.hpp).
//
// Nothing pushes a kinematic body, so it bounds islands and domains like a fixed one. But it moves from substep to
// substep, and groups and domains do not run in step. So each such *part* has stand-ins for the kinematic bodies that
// its constraints touch, and moves them along with its own bodies. All parts use the same operations, so stand-ins are
// where the body itself would be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "native/body_state.hpp"
#include "native/constraint_layout.hpp"
#include "native/solver_kernels.hpp"

namespace fathom::native {

class StandIns {
 public:
  explicit StandIns(BodyState& state) : state_(state) {}

  /// Makes room for the stand-ins of each part: a group, or a domain of the first division. They are entries of
  /// `BodyState::solver` after those of the slots.
  void lay_out(const ConstraintLayout& layout);
  bool any() const { return !parts_.empty(); }

  // By the part's thread.

  /// Makes stand-ins of the moving bodies as loaded, and puts them into the part's blocks. Call right after preparing
  /// these.
  void make(std::size_t part, BlockArray blocks);
  /// Advances them by a substep of length h (s).
  void move(std::size_t part, float h);
  /// Restores the bodies themselves in the blocks.
  void remove(std::size_t part, BlockArray blocks);

  std::size_t memory_bytes() const {
    return parts_.capacity() * sizeof(Part) + slots_.capacity() * sizeof(std::uint32_t);
  }

 private:
  struct Part {
    ConstraintLayout::Range blocks;
    std::size_t first, end;  ///< of `slots_`; `end` grows as stand-ins are made
  };

  template <class Act>
  void for_each_moving(const Part& part, BlockArray blocks, const Act& act) const;
  std::uint32_t entry(std::size_t stand_in) const { return static_cast<std::uint32_t>(state_.size() + stand_in); }
  std::uint32_t stand_in_for(Part& part, std::uint32_t slot);

  BodyState& state_;
  std::size_t width_ = 0;
  std::vector<Part> parts_;           // empty if no body is kinematic
  std::vector<std::uint32_t> slots_;  // of the bodies, by stand-in
};

}  // namespace fathom::native
