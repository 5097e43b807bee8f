// How queries find bodies: a simulator's tree visits those whose boxes a moving box overlaps.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom {

/// A box that moves by `translation`, which may be zero; a ray has no extents. All finite.
struct MovingBox {
  Vec3 centre;       ///< at the start (m, world)
  Vec3 half;         ///< half extents, ≥ 0 (m)
  Vec3 translation;  ///< m
};

class BodyVisitor {
 public:
  /// Visits a body whose box is hit, or nearly. Returns the fraction of the path at which the search may stop.
  virtual float visit(std::uint32_t slot) = 0;

 protected:
  ~BodyVisitor() = default;
};

}  // namespace fathom
