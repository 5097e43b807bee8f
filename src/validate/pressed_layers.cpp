// Heavy slabs and balls on layers of small bodies, which are between 30 and 100,000 times lighter.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"
#include "validate/chance.hpp"

namespace fathom::validate {
namespace {

/// A scene: loads fall on layers of small bodies, which lie in order, or at random attitudes.
struct Press {
  WorldDef world;
  std::vector<BodyDef> small, loads;
  double fall = 0;  ///< m, from the highest load down to the floor
};

enum class Kind { cubes, balls, capsules, boxes, hulls, mixed };

Shape small_shape(Chance& chance, Kind kind, double size) {
  const float r = narrow(size);
  switch (kind == Kind::mixed ? static_cast<Kind>(chance.below(5)) : kind) {
    case Kind::cubes:
      return box({r, r, r});
    case Kind::balls:
      return sphere(r);
    case Kind::capsules:
      return capsule(0.5f * r, 0.5f * r);
    case Kind::boxes:
      return box({r, r * narrow(chance.between(0.3, 1)), r * narrow(chance.between(0.2, 1))});
    default:
      break;
  }
  std::vector<Vec3> corners;
  for (int i = 16; i > 0; --i) corners.push_back(r * chance.direction());
  return hull(corners);
}

Press make_press(const Setup& setup, std::uint64_t seed) {
  Chance chance(seed);
  Press press{world_def(setup), {}, {}, 0};
  constexpr float time_steps[] = {1.0f / 30, 1.0f / 60, 1.0f / 60, 1.0f / 120};
  constexpr int substeps[] = {2, 4, 4, 8};
  press.world.dt = time_steps[chance.below(4)];
  press.world.solver.substeps = substeps[chance.below(4)];
  const Material material{.friction = narrow(chance.between(0.2, 0.8))};
  const double size = chance.log_between(0.03, 0.5), smallest = chance.coin() ? 1 : chance.between(0.3, 0.7);
  const bool in_order = chance.coin();
  const int side = 4 + chance.below(12), layers = 1 + chance.below(3);
  const double lift = size * (in_order ? 2.02 : 3.6);  // from layer to layer
  const auto kind = static_cast<Kind>(chance.below(6));
  for (int i = 0; i < layers * side * side; ++i) {
    const auto across = [&](int k) { return 2.2 * size * (k - 0.5 * (side - 1)); };
    const Vec3 at{narrow(across(i % side)), narrow(across(i / side % side)),
                  narrow(0.505 * lift + lift * (i / (side * side)))};
    BodyDef def = body(small_shape(chance, kind, size * chance.between(smallest, 1)), at, {}, material);
    if (!in_order) def.pose.rotation = chance.rotation();
    press.small.push_back(def);
  }
  const double reach = 1.1 * size * side, mass = 8000 * size * size * size * chance.log_between(30, 1e5);
  const double drop = chance.coin() ? 0.02 : chance.log_between(0.1, 3);
  double top = 1.05 * lift * layers + drop;
  for (int i = 1 + chance.below(2); i > 0; --i) {
    const bool is_ball = chance.below(4) == 0;
    const double half = is_ball ? 0.8 * reach : reach * chance.between(0.1, 0.5);
    const auto width = [&] { return narrow(reach * chance.between(0.7, 1.3)); };
    const Shape shape = is_ball ? sphere(narrow(half)) : box({width(), width(), narrow(half)});
    press.loads.push_back(body(shape, {0, 0, narrow(top + half)}, narrow(mass), material));
    top += 2 * half + 0.1 * reach;
  }
  press.fall = top;
  return press;
}

struct Pressed {
  double speed = 0;  ///< of the fastest small body, of what a fall from the highest load gives
  int lost = 0;      ///< small bodies that are not finite, or end under the floor
};

Pressed run(const Press& press) {
  World world(press.world);
  world.add(floor_slab(press.small.front().material));
  std::vector<BodyId> ids;
  for (const BodyDef& def : press.small) ids.push_back(world.add(def));
  for (const BodyDef& def : press.loads) world.add(def);
  double fastest = 0;
  for (int step = step_count(world, 4); step > 0; --step) {
    world.step();
    for (const BodyId id : ids) fastest = std::max(fastest, speed(world, id));
  }
  Pressed pressed{fastest / std::sqrt(2 * g * press.fall), 0};
  for (const BodyId id : ids) pressed.lost += !(world.pose(id).position.z > 0);
  return pressed;
}

}  // namespace

// Bodies that are squeezed out of a closing gap are faster than the load, by the ratio of a wedge. What throws them
// without one is an error (docs/log/2026-11-28-thrown-by-solutions.md).
void pressed_layers(const Setup& setup, Record& record) {
  constexpr double most = 10;
  const int seeds = setup.full ? 300 : 12;
  double fastest = 0;
  int thrown = 0, lost = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Pressed pressed = run(make_press(setup, static_cast<std::uint64_t>(seed)));
    fastest = std::max(fastest, pressed.speed);
    thrown += !(pressed.speed <= most);
    lost += pressed.lost > 0;
  }
  const std::string of = "of " + std::to_string(seeds) + " presses, ";
  record.at_most(of + "those that throw a body at more than ten times the speed of the fall", thrown, 0);
  record.at_most(of + "those that push a body through the floor", lost, 0);
  record.checks.back().known = "a box under 66,000 times its mass, two substeps";
  record.at_most("fastest small body, in speeds of the fall", fastest, most);
}

}  // namespace fathom::validate
