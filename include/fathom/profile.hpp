// What a step cost and processed: times per stage, and counts.
#pragma once

#include <cstdint>

namespace fathom {

/// Wall time of each stage of a step in milliseconds (see docs/architecture.md).
struct StageTimes {
  double find_pairs = 0;         ///< broad phase
  double update_manifolds = 0;   ///< narrow phase
  double build_constraints = 0;  ///< graph and layout
  double solve = 0;              ///< substeps
  double finish = 0;             ///< free bodies, sleep, publishing

  /// The stages as the dissertation names them (its section 4.2).
  double broad_phase() const { return find_pairs; }
  /// See `broad_phase`.
  double narrow_phase() const { return update_manifolds; }
  /// See `broad_phase`.
  double collision_resolution() const { return build_constraints + solve + finish; }
  /// The whole step.
  double total() const { return find_pairs + update_manifolds + build_constraints + solve + finish; }
};

/// What a step processed.
struct StepCounts {
  std::uint32_t bodies = 0;       ///< all bodies of the world
  std::uint32_t active = 0;       ///< awake bodies that can move
  std::uint32_t pairs = 0;        ///< pairs of the broad phase
  std::uint32_t manifolds = 0;    ///< pairs with contact points, as solved
  std::uint32_t points = 0;       ///< contact points, as solved
  std::uint32_t colours = 0;      ///< colours in use by the constraint graph, or batches of the cell with most of them
  std::uint32_t overflow = 0;     ///< manifolds beyond the last colour, solved one by one
  std::uint32_t unbatched = 0;    ///< manifolds not solved because their work-group was full (cells on a device)
  std::uint32_t work_groups = 0;  ///< cells of the grid (cells)
  std::uint32_t overlaps = 0;     ///< most overlaps found by one body (sweep on a device)
  std::uint32_t islands = 0;      ///< islands (0 where sleeping is off)
  std::uint32_t recycled = 0;     ///< manifolds that the narrow phase kept from the last step
  std::uint32_t quarantined = 0;  ///< bodies stopped in this step because their state was not finite
  std::uint64_t launches = 0;     ///< kernels submitted (device simulator)
  std::uint64_t bytes_to_device = 0;  ///< copied to the device (device simulator)
  std::uint64_t bytes_to_host = 0;    ///< copied back (device simulator)
  std::uint64_t memory_bytes = 0;     ///< held by the simulator
};

/// What a step cost.
struct Profile {
  std::uint64_t step = 0;  ///< number of the step this describes, from 1; 0 before the first
  StageTimes times;        ///< ms of each stage
  /// Device simulator: ms on the device's clock from the end of the previous step to the end of this one, or from the
  /// submission of this step if the device had to wait for it.
  double interval = 0;
  StepCounts counts;  ///< what it processed
};

}  // namespace fathom
