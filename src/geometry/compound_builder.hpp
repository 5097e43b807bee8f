// Builds compounds: mass properties of all children, and a tree of their boxes.
#pragma once

#include <fathom/compound.hpp>
#include <memory>
#include <span>

namespace fathom {

class CompoundBuilder {
 public:
  /// From validated children. Throws `Error{degenerate_shape}` if single precision cannot represent their volume or
  /// size.
  static std::shared_ptr<const Compound> build(std::span<const ChildShape> children);

 private:
  friend struct CompoundArchive;
  /// Derives the other data from the children, whose poses are in the compound's frame.
  static void arrange(Compound& compound);
};

}  // namespace fathom
