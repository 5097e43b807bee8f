#include "dynamics/surface_ahead.hpp"

#include "geometry/support.hpp"
#include "terrain/triangles_ahead.hpp"

namespace fathom {

SurfaceAhead look_ahead(const Mover& a, const Mover& b, const Pose& b_in_a, float margin, float rest, float half,
                        float dt, SurfaceScratch& scratch) {
  SurfaceAhead result{b_in_a};
  const SurfaceSweep sweep = sweep_over(a, b, b_in_a, dt);
  const Aabb box = box_of_sweep(b, b_in_a, sweep, margin, rest, half);
  result.is_clear = !find_triangles(a.geometry.surface(), box, b_in_a.position, scratch);
  if (result.is_clear) return result;
  scratch.shape.turn(b.geometry, b_in_a.rotation);
  const float skin = skin_of(half, b.radius);
  float earliest = 3e38f;
  for (const EightTriangles& eight : scratch.eights)
    for (unsigned met = met_on_way(eight, scratch.shape, sweep.way, sweep.around + skin); met != 0; met &= met - 1)
      earliest = min(earliest, deep_impact(eight.at(lowest_bit(met)), a, b, b_in_a, half, dt));
  if (earliest < 3e38f) set_ahead(result, a, b, earliest);
  return result;
}

CentreWay centre_way(const Mover& a, const Mover& b, const Pose& end_a, const Pose& end_b, float depth,
                     SurfaceScratch& scratch) {
  const Surface& surface = a.geometry.surface();
  const auto for_each_in = [&](const Aabb& box, const auto& act) {
    scratch.triangles.clear();
    surface.find(box, scratch.triangles);
    for (const std::uint32_t number : scratch.triangles) act(surface.triangle(number));
  };
  return centre_way(for_each_in, a.pose, end_a, b.pose.position, end_b.position, depth);
}

}  // namespace fathom
