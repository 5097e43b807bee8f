// Finds overlapping fat boxes. There are two interchangeable implementations.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "native/body_state.hpp"
#include "native/bvh.hpp"
#include "native/fixed_tree.hpp"
#include "native/pair_set.hpp"
#include "threads/thread_pool.hpp"

namespace fathom::native {

struct Pair {
  std::uint32_t a, b;
};

/// Input of a broad phase. A "changed" body has a new fat box.
struct BroadPhaseInput {
  const BodyTable& bodies;
  const BodyState& state;
  const PairSet& known;
  std::span<const std::uint32_t> changed;      ///< ascending slots
  bool changed_at_rest;                        ///< some of them are not awake, and may be fixed
  std::span<const std::uint32_t> set_changes;  ///< slots of bodies added or removed; may repeat

  bool set_changed() const { return !set_changes.empty(); }
  bool is_changed(std::uint32_t slot) const { return state.flags[slot] & box_changed; }
  /// True for a pair that can collide and is not known yet.
  bool is_wanted(std::uint32_t a, std::uint32_t b) const;
};

class BroadPhase {
 public:
  virtual ~BroadPhase() = default;
  /// Writes the new pairs into the first lists of `found`, one per chunk of work, and returns how many lists it used.
  /// The pairs and their order do not depend on threads.
  virtual std::size_t find(const BroadPhaseInput& input, ThreadPool& pool, std::vector<std::vector<Pair>>& found) = 0;

  /// True if no pair is ever listed twice.
  virtual bool lists_pairs_once() const { return false; }

  /// Updates the structure that `find` searches. `find` does so itself.
  virtual void refresh(const BroadPhaseInput& input, ThreadPool& pool) = 0;
  /// The tree of fixed bodies as `find` searched it; null if there is none.
  virtual const FixedTree* fixed() const { return nullptr; }
  /// Appends all slots that can move, neighbours close together.
  virtual void list_neighbours(std::vector<std::uint32_t>& slots) const = 0;
  virtual std::uint64_t order() const = 0;
  virtual std::size_t memory_bytes() const = 0;

  virtual void save(ByteWriter& write) const = 0;
  virtual void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool) = 0;
};

/// A `Bvh` of bodies that move and a `FixedTree` of those that do not; only changed bodies search.
std::unique_ptr<BroadPhase> make_tree_broad_phase();
/// Sweep-and-sort along the unit vector `axis` with components ≥ 0 (dissertation, section 3.3.1).
std::unique_ptr<BroadPhase> make_sweep_broad_phase(Vec3 axis);

}  // namespace fathom::native
