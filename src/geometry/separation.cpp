#include "geometry/gjk.hpp"

namespace fathom {

Separation separation(const PlacedShape& a, const PlacedShape& b, Vec3d shift, Vec3d guess) {
  return separation_of(a, b, shift, guess);
}

}  // namespace fathom
