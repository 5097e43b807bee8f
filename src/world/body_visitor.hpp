// How queries get at bodies: a simulator's tree offers those whose boxes a moving box meets.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom {

/// A box that moves by `translation`, which may be zero; a ray is one without extents. All finite.
struct MovingBox {
  Vec3 centre;       ///< where it begins (m, world)
  Vec3 half;         ///< half extents, ≥ 0 (m)
  Vec3 translation;  ///< m
};

class BodyVisitor {
 public:
  /// A body whose box is met, or nearly. Returns the fraction of the way beyond which nothing is of interest any more.
  virtual float visit(std::uint32_t slot) = 0;

 protected:
  ~BodyVisitor() = default;
};

}  // namespace fathom
