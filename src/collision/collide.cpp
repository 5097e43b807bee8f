#include "collision/collide.hpp"

namespace fathom {

Manifold collide(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin, AxisCache& cache) {
  return collide_shapes(a, b, b_in_a, margin, cache);
}

}  // namespace fathom
