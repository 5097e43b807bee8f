#include "collision/collide.hpp"

namespace fathom {

Manifold collide(const Geometry& a, const Geometry& b, const Pose& b_in_a, float margin, AxisCache& cache,
                 const PatchLoad& load) {
  return collide_shapes(a, b, b_in_a, margin, cache, load);
}

}  // namespace fathom
