// Two shapes in any pose: a manifold of at most four finite points with a unit normal, the same for the same input.
#include "collision/collide.hpp"
#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fathom;
  fuzz::Input input(data, size);
  try {
    const Shape a = input.shape(), b = input.shape();
    Pose pose;
    pose.position = input.vector();
    pose.rotation = normalize(input.rotation());
    const float margin = fathom::abs(input.number());
    // Poses that a world passes on: finite, and no farther than it extends.
    if (!is_finite(pose) || !(length(pose.position) < 1e7f) || !(margin < 1e6f)) return 0;
    const Geometry ga = geometry(a), gb = geometry(b);
    AxisCache cache, again;
    const Manifold m = collide(ga, gb, pose, margin, cache), same = collide(ga, gb, pose, margin, again);
    fuzz::require(m.count >= 0 && m.count <= max_manifold_points && m.count == same.count);
    for (int i = 0; i < m.count; ++i) {
      fuzz::require(is_finite(m.points[i].position) && is_finite(m.points[i].separation));
      fuzz::require(m.points[i].feature == same.points[i].feature);
    }
    if (m.count > 0) fuzz::require(fathom::abs(length(m.normal) - 1.0f) < 1e-3f);
    // With the cached axis, as in the next step.
    const Manifold next = collide(ga, gb, pose, margin, cache);
    fuzz::require(next.count >= 0 && next.count <= max_manifold_points);
  } catch (const Error&) {
  }
  return 0;
}
