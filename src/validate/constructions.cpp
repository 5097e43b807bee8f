// Constructions that people build: houses of cards, arches, rows of dominoes, towers of crossed blocks, tops.
#include <cmath>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr double turn = 3.14159265358979323846;

double lowering(const World& world, const std::vector<BodyId>& ids, const std::vector<Vec3>& start) {
  double worst = 0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    worst = std::max(worst, wide(start[i].z - world.pose(ids[i]).position.z));
  return worst;
}

std::vector<Vec3> positions(const World& world, const std::vector<BodyId>& ids) {
  std::vector<Vec3> all;
  for (const BodyId id : ids) all.push_back(world.pose(id).position);
  return all;
}

}  // namespace

// Cards of 10 cm lean in pairs at 20°, in three storeys, with a card between pairs (after Box2D's sample).
void card_house(const Setup& setup, Record& record) {
  World world(world_def(setup));
  const Material material{0.7f, 0};
  world.add(floor_slab(material));
  std::vector<BodyId> ids;
  const float half = 0.2f, thin = 0.001f, lean = 20 * pi / 180;
  const auto card = [&](float x, float z, float angle) {
    BodyDef def = body(box({thin, half, half}), {x, 0, z}, 0.03f, material);
    def.pose.rotation = turn_about({0, 1, 0}, wide(angle));
    ids.push_back(world.add(def));
  };
  const float rise = half * std::cos(lean) + thin * std::sin(lean), run = half * std::sin(lean) + thin * std::cos(lean);
  const int storeys = 3;
  float floor_height = 0, left = 0;
  for (int storey = 0; storey < storeys; ++storey) {
    const int pairs = storeys - storey;
    for (int i = 0; i < pairs; ++i) {
      const float middle = left + 4 * run * static_cast<float>(i);
      card(middle - run, floor_height + rise, lean);
      card(middle + run, floor_height + rise, -lean);
      if (i + 1 < pairs) card(middle + 2 * run, floor_height + 2 * rise + thin, 0.5f * pi);
    }
    floor_height += 2 * rise + 2 * thin;
    left += 2 * run;
  }
  const std::vector<Vec3> start = positions(world, ids);
  Plot plot{"House of cards", "t (s)", "largest lowering of a card (m)", false, false, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  const int count = step_count(world, setup.full ? 20 : 5);
  for (int i = 0; i < count; ++i) {
    world.step();
    if (i % 10 == 0) curve.add(i / 60.0, lowering(world, ids, start));
  }
  record.at_most("largest lowering of a card", lowering(world, ids, start), 0.05, "m");
  record.plots.push_back(std::move(plot));
}

// Fifteen voussoirs form a semicircle of 4 m without mortar.
void arch(const Setup& setup, Record& record) {
  World world(world_def(setup));
  const Material material{0.7f, 0};
  world.add(floor_slab(material));
  const int stones = 15;
  const double inner = 3.5, outer = 4.5;
  std::vector<BodyId> ids;
  for (int i = 0; i < stones; ++i) {
    const double from = turn * i / stones, to = turn * (i + 1) / stones;
    std::vector<Vec3> corners;
    for (const double angle : {from, to})
      for (const double radius : {inner, outer})
        for (const double y : {-0.5, 0.5})
          corners.push_back({narrow(radius * std::cos(angle)), narrow(y), narrow(radius * std::sin(angle))});
    BodyDef def;
    def.shape = hull(corners);
    def.pose.position = def.shape.hull->offset();
    def.material = material;
    ids.push_back(world.add(def));
  }
  const std::vector<Vec3> start = positions(world, ids);
  steps(world, step_count(world, setup.full ? 60 : 10));
  record.at_most("largest lowering of a stone", lowering(world, ids, start), 0.05, "m");
}

// A row of 1,000 dominoes falls to its end, at constant speed.
void dominoes(const Setup& setup, Record& record) {
  World world(world_def(setup));
  const Material material{0.4f, 0};
  world.add(floor_slab(material, 150));
  const int count = setup.full ? 1000 : 100;
  const float spacing = 0.25f;
  std::vector<BodyId> ids;
  for (int i = 0; i < count; ++i)
    ids.push_back(
        world.add(body(box({0.05f, 0.25f, 0.5f}), {spacing * static_cast<float>(i) - 120, 0, 0.5f}, 1.0f, material)));
  world.apply_impulse_at(ids[0], {1.0f, 0, 0}, world.pose(ids[0]).position + Vec3{0, 0, 0.5f});
  Plot plot{"A row of dominoes", "t (s)", "fallen", false, false, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  int fallen = 0, half_way = 0, step = 0;
  for (; step < 60 * 120 && fallen < count; ++step) {
    world.step();
    // A domino counts as fallen when its upright axis leans by more than 30°.
    while (fallen < count && rotate(world.pose(ids[fallen]).rotation, {0, 0, 1}).z < 0.87f) ++fallen;
    if (fallen < count / 2) half_way = step;
    if (step % 10 == 0) curve.add(step / 60.0, fallen);
  }
  record.at_least("dominoes fallen", fallen, count);
  const double second_half = step - half_way;
  record.at_most("second half's time over the first's", second_half / (half_way + 1), 1.2);
  record.plots.push_back(std::move(plot));
}

// Eighteen layers of three blocks, laid crosswise. Then every other layer loses its middle block.
void crossed_tower(const Setup& setup, Record& record) {
  World world(world_def(setup));
  const Material material{0.5f, 0};
  world.add(floor_slab(material));
  std::vector<BodyId> ids, middles;
  for (int layer = 0; layer < 18; ++layer)
    for (int i = 0; i < 3; ++i) {
      const float off = 0.25f * static_cast<float>(i - 1), z = 0.075f + 0.15f * static_cast<float>(layer);
      const bool along_x = layer % 2 == 0;
      const BodyId id = world.add(body(box(along_x ? Vec3{0.375f, 0.124f, 0.075f} : Vec3{0.124f, 0.375f, 0.075f}),
                                       along_x ? Vec3{0, off, z} : Vec3{off, 0, z}, std::nullopt, material));
      (i == 1 && layer % 2 == 1 && layer < 16 ? middles : ids).push_back(id);
    }
  const std::vector<Vec3> start = positions(world, ids);
  steps(world, 120);
  for (const BodyId id : middles) {
    world.remove(id);
    steps(world, 30);
  }
  steps(world, step_count(world, setup.full ? 60 : 10));
  double moved = 0;
  for (std::size_t i = 0; i < ids.size(); ++i)
    moved = std::max(moved, wide(distance(world.pose(ids[i]).position, start[i])));
  record.at_most("largest displacement after taking out eight blocks", moved, 0.05, "m");
}

// A cone spins on its tip. A fast top stays up and precesses at about m g l / (I ω).
void spinning_top(const Setup& setup, Record& record) {
  World world(world_def(setup));
  world.add(floor_slab({0.8f, 0}));
  std::vector<Vec3> points{{0, 0, 0}};
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * turn * i / 24;
    points.push_back({narrow(0.5 * std::cos(angle)), narrow(0.5 * std::sin(angle)), 0.5f});
  }
  BodyDef def;
  def.shape = hull(points);
  def.mass = 1.0f;
  const float tip = def.shape.hull->offset().z;  // height of the centre of mass above the tip
  const double lean = 0.1;
  def.pose.rotation = turn_about({1, 0, 0}, lean);
  def.pose.position = rotate(def.pose.rotation, {0, 0, tip});
  const double spin = 60;
  def.velocity.angular = narrow(spin) * rotate(def.pose.rotation, {0, 0, 1});
  const BodyId id = world.add(def);
  const double inertia = wide(world.mass_properties(id).inertia.zz);
  const double expected = g * wide(tip) / (inertia * spin);  // rad/s
  Plot plot{"A top: lean of its axis", "t (s)", "rad", false, false, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  double turned = 0, previous = 0, worst = 0;
  bool first = true;
  const int count = step_count(world, 10);
  for (int i = 0; i < count; ++i) {
    world.step();
    const Vec3 axis = rotate(world.pose(id).rotation, {0, 0, 1});
    const double angle = std::atan2(wide(axis.y), wide(axis.x)), now = std::acos(std::min(1.0, wide(axis.z)));
    if (!first) turned += std::remainder(angle - previous, 2 * turn);
    first = false;
    previous = angle;
    worst = std::max(worst, now);
    if (i % 6 == 0) curve.add(i / 60.0, now);
  }
  const double seconds = (count - 1) / 60.0;
  record.at_most("largest lean in 10 s, started at 0.1", worst, 0.3, "rad");
  record.note("Precession: " + std::to_string(turned / seconds) + " rad/s; a fast top on a fixed tip has " +
              std::to_string(expected) + " rad/s at its first spin.");
  record.plots.push_back(std::move(plot));
}

}  // namespace fathom::validate
