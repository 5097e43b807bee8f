// Bodies that move, and those that do not, for the trees that are searched for them.
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
  bool lists_all = true;  ///< the next `take` asks all bodies

  /// Applies that bodies in these slots were added or removed, maybe repeatedly. Returns whether any of them moves.
  bool take(const BodyTable& bodies, std::span<const std::uint32_t> set_changes);

  void save(ByteWriter& write) const;
  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool);
};

}  // namespace fathom::native
