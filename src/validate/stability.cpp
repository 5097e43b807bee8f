// Structures that must stand: stacks, unequal masses, all sizes, all time steps.
#include <cmath>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

const Shape& unit_cube() {
  static const Shape shape = box({0.5f, 0.5f, 0.5f});
  return shape;
}

double horizontal_distance(Vec3 a, Vec3 b) { return std::hypot(wide(a.x - b.x), wide(a.y - b.y)); }

/// Seconds for which a column of cubes of 1 m stands: until its top is 0.5 m off its axis or half a storey too low.
double column_stands(const Setup& setup, int cubes, double seconds, int substeps, Curve* curve) {
  WorldDef def = world_def(setup);
  def.solver.substeps = substeps;
  def.solver.contact_hertz = 1000;  // limited by the substep rate
  World world(def);
  world.add(floor_slab());
  BodyId top;
  for (int i = 0; i < cubes; ++i) top = world.add(body(unit_cube(), {0, 0, 0.5f + static_cast<float>(i)}));
  const Vec3 start = world.pose(top).position;
  const int count = step_count(world, seconds);
  for (int i = 0; i < count; ++i) {
    world.step();
    const Vec3 p = world.pose(top).position;
    if (curve && i % 30 == 0) curve->add(i / 60.0, horizontal_distance(p, start));
    if (horizontal_distance(p, start) > 0.5) return i / 60.0;
  }
  return seconds;
}

}  // namespace

void tall_stack(const Setup& setup, Record& record) {
  Plot plot{"Columns of cubes: how far the top is off", "t (s)", "m", false, false, {}};
  const double seconds = setup.full ? 60 : 10;
  const auto column = [&](int cubes, int substeps) {
    Curve& curve = plot.curves.emplace_back(
        Curve{std::to_string(cubes) + " cubes, " + std::to_string(substeps) + " substeps", {}, {}});
    return column_stands(setup, cubes, seconds, substeps, &curve);
  };
  record.at_least("10 cubes stand", column(10, 4), seconds, "s");
  record.at_least("100 cubes stand at 4 substeps", column(100, 4), seconds, "s");
  if (setup.full) record.at_least("30 cubes stand at 4 substeps", column(30, 4), seconds, "s");
  record.plots.push_back(std::move(plot));
}

void mass_ratios(const Setup& setup, Record& record) {
  const auto squeeze = [&](float light, float heavy, int substeps) {
    WorldDef def = world_def(setup);
    def.solver.substeps = substeps;
    def.solver.contact_hertz = 1000;  // limited by the substep rate
    World world(def);
    world.add(floor_slab());
    const BodyId under = world.add(body(unit_cube(), {0, 0, 0.5f}, light));
    const BodyId above = world.add(body(unit_cube(), {0, 0, 1.5f}, heavy));
    steps(world, 600);
    return std::max(
        {horizontal_distance(world.pose(under).position, {}), horizontal_distance(world.pose(above).position, {}),
         std::abs(wide(world.pose(above).position.z) - 1.5), std::abs(wide(world.pose(under).position.z) - 0.5)});
  };
  record.at_most("1,000 kg under 1 kg: moved in 10 s", squeeze(1000, 1, 4), 0.005, "m");
  record.at_most("1 kg under 10 kg", squeeze(1, 10, 4), 0.05, "m");
  record.at_most("1 kg under 200 kg", squeeze(1, 200, 4), 0.05, "m");
  record.at_most("1 kg under 1,000 kg", squeeze(1, 1000, 4), 0.05, "m");
}

void wall_pyramid(const Setup& setup, Record& record) {
  World world(world_def(setup));
  world.add(floor_slab());
  std::vector<BodyId> ids;
  for (int row = 0; row < 16; ++row)
    for (int i = 0; i < 16 - row; ++i)
      ids.push_back(world.add(body(unit_cube(), {1.05f * (static_cast<float>(i) + 0.5f * static_cast<float>(row)), 0,
                                                 0.5f + static_cast<float>(row)})));
  std::vector<Vec3> start;
  for (const BodyId id : ids) start.push_back(world.pose(id).position);
  Plot plot{"Pyramid of 16 rows", "t (s)", "kinetic energy (J)", false, true, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"all 136 cubes", {}, {}});
  double energy_now = 0;
  for (int i = 1; i <= 600; ++i) {
    world.step();
    energy_now = 0;
    for (const BodyId id : ids) energy_now += kinetic_energy(world, id);
    if (i % 10 == 0) curve.add(i / 60.0, std::max(energy_now, 1e-15));
  }
  double moved = 0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    moved = std::max(moved, wide(distance(world.pose(ids[i]).position, start[i])));
  record.at_most("kinetic energy after 10 s", energy_now, 1e-5, "J");
  record.at_most("largest displacement", moved, 0.02, "m");
  record.plots.push_back(std::move(plot));
}

void sizes(const Setup& setup, Record& record) {
  for (const float size : {0.01f, 0.1f, 1.0f, 10.0f, 100.0f}) {
    World world(world_def(setup));
    world.add(floor_slab({}, 50 * size));
    std::vector<BodyId> ids;
    const Shape shape = box({0.5f * size, 0.5f * size, 0.5f * size});
    // A pyramid of four rows, and a ball that drops beside it.
    for (int row = 0; row < 4; ++row)
      for (int i = 0; i < 4 - row; ++i)
        ids.push_back(world.add(body(shape,
                                     {size * 1.05f * (static_cast<float>(i) + 0.5f * static_cast<float>(row)), 0,
                                      size * (0.5f + static_cast<float>(row))},
                                     std::nullopt)));
    const BodyId ball = world.add(body(sphere(0.5f * size), {-3 * size, 0, 0.6f * size}, std::nullopt));
    std::vector<Vec3> start;
    for (const BodyId id : ids) start.push_back(world.pose(id).position);
    steps(world, 600);
    double moved = std::abs(wide(world.pose(ball).position.z - 0.5f * size));
    for (std::size_t i = 0; i < ids.size(); ++i)
      moved = std::max(moved, wide(distance(world.pose(ids[i]).position, start[i])));
    record.at_most("bodies of " + std::to_string(size) + " m: moved in 10 s, of their size", moved / wide(size), 0.25);
  }
}

void time_steps(const Setup& setup, Record& record) {
  Plot plot{"Column of 10 cubes: sag over the time step", "Δt (s)", "m", true, true, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"top came down", {}, {}});
  for (const int rate : {30, 60, 120, 240, 1000}) {
    WorldDef def = world_def(setup);
    def.dt = 1.0f / static_cast<float>(rate);
    World world(def);
    world.add(floor_slab());
    std::vector<BodyId> ids;
    for (int i = 0; i < 10; ++i) ids.push_back(world.add(body(unit_cube(), {0, 0, 0.5f + static_cast<float>(i)})));
    steps(world, rate * (setup.full ? 10 : 4));
    double off = 0;
    for (const BodyId id : ids) off = std::max(off, horizontal_distance(world.pose(id).position, {}));
    curve.add(1.0 / rate, std::max(1e-6, 9.5 - wide(world.pose(ids.back()).position.z)));
    record.at_most("Δt 1/" + std::to_string(rate) + " s: off the axis", off, 0.02, "m");
  }
  record.plots.push_back(std::move(plot));
}

}  // namespace fathom::validate
