// A shape's box in the frame of a surface or compound, for queries on host and device.
#pragma once

#include "geometry/placed_shape.hpp"

namespace fathom {

/// A box about a shape, in the frame of a placed surface or compound.
struct LocalBox {
  Vec3d centre, half;

  FATHOM_HD LocalBox(const PlacedShape& frame, const PlacedShape& shape)
      : centre(frame.to_local(shape.position - frame.position)),
        half{shape.reach(frame.axes[0]), shape.reach(frame.axes[1]), shape.reach(frame.axes[2])} {}
  /// Grown by `more` (m) and by the rounding error of single precision.
  FATHOM_HD Aabb grown(double more) const {
    const auto rounding = [&](double c, double h) { return h + more + 0x1p-21 * (std::abs(c) + h + more); };
    const Vec3d reach{rounding(centre.x, half.x), rounding(centre.y, half.y), rounding(centre.z, half.z)};
    return {to_float(centre - reach), to_float(centre + reach)};
  }
};

}  // namespace fathom
