// Structures stand: nothing moves farther than settling explains, and at the end everything is at rest. Sleeping is
// off, so that nothing stands just because it is frozen.
#include <algorithm>
#include <cstdio>

#include "scene/environments.hpp"
#include "validate/bodies.hpp"
#include "validate/case_list.hpp"
#include "validate/standing_scenes.hpp"

namespace fathom::validate {
namespace {

constexpr double at_rest = 1e-6;  // J/kg: 1.4 mm/s

double largest_displacement(const Scene& scene, const SceneInstance& instance, const World& world) {
  double moved = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Vec3d from = to_double(scene.bodies[i].pose.position);
    const Vec3d way = to_double(world.pose(instance.ids()[i]).position) - from;
    moved = std::max(moved, length(way));
  }
  return moved;
}

/// Of all bodies together (J/kg).
double kinetic_energy_per_mass(const World& world) {
  double energy = 0, mass = 0;
  for (const BodyId id : world.bodies())
    if (world.motion(id) == MotionType::dynamic) energy += kinetic_energy(world, id), mass += wide(world.mass(id));
  return energy / mass;
}

/// Runs `scene` for `seconds`, or until it has collapsed.
void stands(const Setup& setup, Record& record, const std::string& name, const Scene& scene, double seconds,
            double max_moved) {
  WorldDef def = world_def(setup);
  def.gravity = scene.world.gravity;
  World world(def);
  SceneInstance instance(scene, world);
  Curve curve{name, {}, {}};
  double moved = 0;
  const int count = step_count(world, seconds);
  for (int i = 1; i <= count; ++i) {
    world.step();
    if (i % 30 != 0 && i != count) continue;
    moved = largest_displacement(scene, instance, world);
    curve.add(world.time(), std::max(moved, 1e-6));
    if (!(moved <= 20 * max_moved)) {
      char text[120];
      std::snprintf(text, sizeof text, ": fell, stopped after %.1f of %.0f s", world.time(), seconds);
      record.note(name + text);
      break;
    }
  }
  record.at_most(name + ": moved", moved, max_moved, "m");
  record.at_most(name + ": kinetic energy at the end", kinetic_energy_per_mass(world), at_rest, "J/kg");
  if (record.plots.empty()) record.plots.push_back({"Largest displacement", "t (s)", "m", false, true, {}});
  record.plots.front().curves.push_back(std::move(curve));
}

double seconds(const Setup& setup) { return setup.full ? 60 : 10; }

}  // namespace

void standing_large_pyramid(const Setup& setup, Record& record) {
  if (setup.full)
    stands(setup, record, "100 rows, 5,050 cubes", large_pyramid(100), 60, 0.20);
  else
    stands(setup, record, "40 rows, 820 cubes", large_pyramid(40), 10, 0.20);
}

void standing_walls(const Setup& setup, Record& record) {
  stands(setup, record, "40 courses of 20 bricks", running_bond_wall(40, 20, 1), seconds(setup), 0.20);
  stands(setup, record, "half as thick", running_bond_wall(40, 20, 0.5f), seconds(setup), 0.20);
}

void standing_plates(const Setup& setup, Record& record) {
  stands(setup, record, "20 plates", plates(20), seconds(setup), 0.02);
  stands(setup, record, "20 crossed planks", crossed_planks(10), seconds(setup), 0.02);
}

void standing_heavy_on_light(const Setup& setup, Record& record) {
  stands(setup, record, "32 t on four cubes of 10 kg", slab_on_cubes(), seconds(setup), 0.05);
  stands(setup, record, "columns of 10 to 2,560 kg", top_heavy_columns(), seconds(setup), 0.05);
}

void standing_stones(const Setup& setup, Record& record) {
  stands(setup, record, "arch of 31 stones", stone_arch(31), seconds(setup), 0.20);
  // No load path of a direct solution carries the arch's thrust. The springs that carry it sway.
  for (Check& check : record.checks) check.known = "it stands, and sways";
  stands(setup, record, "dry-stone wall of 500 hulls", dry_stone_wall(20), seconds(setup), 0.20);
}

void standing_pyramids(const Setup& setup, Record& record) {
  stands(setup, record, "1,240 cubes", pyramid(15), setup.full ? 60 : 5, 0.007);
  if (setup.full) stands(setup, record, "9,455 cubes", pyramid(30), 60, 0.025);
}

}  // namespace fathom::validate
