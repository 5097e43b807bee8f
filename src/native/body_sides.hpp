// Moving bodies and fixed ones, for their separate search trees.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/fixed_tree.hpp"
#include "world/body_table.hpp"

namespace fathom::native {

struct BodySides {
  std::vector<std::uint32_t> moving;  ///< slots, ascending
  FixedTree fixed;
  bool lists_all = true;  ///< the next `take` goes through all bodies

  /// Applies additions and removals of bodies in these slots, which may repeat. Returns whether any of these bodies
  /// moves.
  bool take(const BodyTable& bodies, std::span<const std::uint32_t> set_changes);

  void save(ByteWriter& write) const;
  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool);
};

}  // namespace fathom::native
