// Quality far from the origin, where single precision is coarse: 0.06 mm at 1 km, 1 mm at 10 km, 8 mm at 100 km.
#include <cmath>
#include <cstdio>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

struct Far {
  double moved = 0, shaking = 0, thrown_error = 0;
};

Far simulate_at(const Setup& setup, float distance_from_origin) {
  World world(world_def(setup));
  const Vec3 origin{distance_from_origin, 0, 0};
  BodyDef slab = floor_slab();
  slab.pose.position += origin;
  world.add(slab);
  std::vector<BodyId> ids;
  std::vector<Vec3> start;
  for (int row = 0; row < 5; ++row)
    for (int i = 0; i < (5 - row) * (5 - row); ++i) {
      const int side = 5 - row;
      const Vec3 position{1.05f * (static_cast<float>(i % side) - 0.5f * static_cast<float>(side - 1)),
                          1.05f * (static_cast<float>(i / side) - 0.5f * static_cast<float>(side - 1)),
                          0.5f + static_cast<float>(row)};
      ids.push_back(world.add(body(box({0.5f, 0.5f, 0.5f}), origin + position)));
      start.push_back(world.pose(ids.back()).position);
    }
  BodyDef ball = body(sphere(0.5f), origin + Vec3{20, 0, 30});
  ball.velocity.linear = {1.23f, 0.77f, 4};
  const BodyId thrown = world.add(ball);
  const Vec3 from = world.pose(thrown).position;
  Far far;
  steps(world, 120);
  const Vec3 way = world.pose(thrown).position - from;
  far.thrown_error = std::hypot(wide(way.x) - 2.46, wide(way.y) - 1.54);
  steps(world, 480);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    far.moved = std::max(far.moved, wide(distance(world.pose(ids[i]).position, start[i])));
    far.shaking = std::max(far.shaking, speed(world, ids[i]));
  }
  return far;
}

std::string figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

void far_from_origin(const Setup& setup, Record& record) {
  Table table{"Pyramid of five layers and a projectile, by distance from the origin",
              {"distance (km)", "pyramid moved (m)", "fastest body (m/s)", "projectile off after 2 s (m)"},
              {}};
  for (const float kilometres : {0.0f, 1.0f, 10.0f, 100.0f}) {
    const Far far = simulate_at(setup, 1000 * kilometres);
    table.rows.push_back({figure(wide(kilometres)), figure(far.moved), figure(far.shaking), figure(far.thrown_error)});
    const std::string at = figure(wide(kilometres)) + " km: ";
    if (kilometres > 10) continue;
    record.at_most(at + "pyramid moved in 10 s", far.moved, 0.02, "m");
    record.at_most(at + "projectile off after 2 s", far.thrown_error, 0.02, "m");
  }
  record.note("100 km is reported, not judged: one unit in the last place is 8 mm there.");
  record.tables.push_back(std::move(table));
}

}  // namespace fathom::validate
