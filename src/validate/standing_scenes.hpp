// Structures that people build without mortar and that must stand. All stand on a fixed floor at z = 0, fit without
// gaps or overlaps, and start at rest. Body 0 is the floor.
#pragma once

#include "scene/scene.hpp"

namespace fathom::validate {

/// A flat pyramid of unit cubes, `rows` high and wide: `large_pyramid` of Box3D's benchmark (shared/benchmarks.c) with
/// its density of 100 kg/m³, friction 0.6 and gravity of 10 m/s².
Scene large_pyramid(int rows);
/// A wall in running bond of bricks 2 m long, 0.5 m high and `thickness` deep, friction 0.6. Every other course begins
/// and ends with half a brick.
Scene running_bond_wall(int courses, int bricks, float thickness);
/// A stack of plates of 2 × 2 × 0.02 m.
Scene plates(int count);
/// Planks of 3 × 0.04 × 0.04 m, in crosswise layers of two side by side.
Scene crossed_planks(int pairs);
/// A slab of 4 × 4 × 2 m and 32 t with its corners on four cubes of 1 m and 10 kg.
Scene slab_on_cubes();
/// Three columns of unit cubes of 10, 40, 160, 640 and 2,560 kg, the heaviest on top.
Scene top_heavy_columns();
/// A semicircular arch of `stones` voussoirs, 1 m deep, with a mean radius of 5 m. At a fifth of the radius the depth
/// is nearly twice what the line of thrust needs (0.1075: Milankovitch 1907; Heyman, The Stone Skeleton, 1995).
Scene stone_arch(int stones);
/// `courses` of 25 stones each, all different: a wall of 10 m cut by bedding planes and joints that are slightly out of
/// level and plumb. Neighbours share the plane between them, so their faces match.
Scene dry_stone_wall(int courses);

}  // namespace fathom::validate
