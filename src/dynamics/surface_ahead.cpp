#include "dynamics/surface_ahead.hpp"

#include "geometry/support.hpp"

namespace fathom {
namespace {

/// Of b over the surface `a` within dt (s), in a's frame.
ShapeMotion motion_of(const Mover& a, const Mover& b, const SurfaceSweep& sweep, float dt) {
  const Vec3 turn = inverse_rotate(a.pose.rotation, dt * b.velocity.angular);
  const bool is_short = length_squared(a.velocity.angular) == 0 && length_squared(turn) <= 1;
  if (!is_short) return {sweep.way, {}, sweep.around};
  // A point that turns by an angle leaves its tangent by at most half the angle's square times its radius.
  return {sweep.way, turn, 0.5f * length_squared(turn) * (b.radius - b.geometry.radius)};
}

}  // namespace

SurfaceAhead look_ahead(const Mover& a, const Mover& b, const Pose& b_in_a, float margin, float rest, float half,
                        float dt, SurfaceScratch& scratch) {
  SurfaceAhead result{b_in_a};
  const SurfaceSweep sweep = sweep_over(a, b, b_in_a, dt);
  const Aabb box = box_of_sweep(b, b_in_a, sweep, margin, rest, half);
  result.is_clear = !find_triangles(a.geometry.surface(), box, b_in_a.position, scratch);
  if (result.is_clear) return result;
  scratch.shape.turn(b.geometry, b_in_a.rotation);
  scratch.on_way.set(scratch.shape, motion_of(a, b, sweep, dt));
  constexpr float search_tolerance = 1.25f;  // of the distances that `first_impact` compares with the skin
  const float skin = search_tolerance * skin_of(half, b.radius);
  float earliest = 3e38f;
  for (const EightTriangles& eight : scratch.eights)
    for (unsigned met = met_on_way(eight, scratch.on_way, skin); met != 0; met &= met - 1)
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
