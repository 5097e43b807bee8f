// Newton's law of restitution: a ball dropped from h rebounds to e²h, and rows of balls transmit hits.
#include <cmath>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

/// Highest point (m) of the ball's bottom after the first bounce.
double rebound_height(const Setup& setup, float restitution, float dt, double height) {
  WorldDef def = world_def(setup);
  def.dt = dt;
  World world(def);
  const Material material{0.5f, restitution};
  world.add(floor_slab(material));
  const BodyId id = world.add(body(sphere(0.25f), {0, 0, narrow(0.25 + height)}, 1.0f, material));
  double top = 0;
  bool bounced = false;
  for (int i = 0; i < step_count(world, 4); ++i) {
    const float before = world.velocity(id).linear.z;
    world.step();
    const float after = world.velocity(id).linear.z;
    bounced |= before < 0 && after > 0;
    if (!bounced) continue;
    top = std::max(top, wide(world.pose(id).position.z) - 0.25);
    if (after <= 0) break;
  }
  return top;
}

}  // namespace

void rebound(const Setup& setup, Record& record) {
  Plot plot{"Rebound over e²h − 1", "drop (m)", "relative error", false, false, {}};
  const int heights = setup.full ? 24 : 6;  // so that balls meet the floor at all phases of a step
  double highest = 0;
  for (const float dt : {1.0f / 240, 1.0f / 60}) {
    double worst = 0;
    for (const float e : {0.3f, 0.5f, 0.8f, 1.0f}) {
      Curve curve{"e = " + std::to_string(e).substr(0, 3) + (dt < 0.01f ? ", Δt 1/240" : ", Δt 1/60"), {}, {}};
      for (int i = 0; i < heights; ++i) {
        const double height = 1 + 2.0 * i / heights;
        const double top = rebound_height(setup, e, dt, height), error = top / (wide(e) * wide(e) * height) - 1;
        worst = std::max(worst, std::abs(error));
        highest = std::max(highest, top / height);
        curve.add(height, error);
      }
      plot.curves.push_back(std::move(curve));
    }
    record.at_most(dt < 0.01f ? "rebound, relative error from e²h, Δt 1/240 s" : "the same, Δt 1/60 s", worst,
                   dt < 0.01f ? 0.02 : 0.05);
  }
  record.at_most("highest rebound, of the drop", highest, 1.0005);
  record.plots.push_back(std::move(plot));
}

// Newton's cradle in both forms: balls that touch, and balls a millimetre apart. The moving ball meets the row at all
// phases of a step.
void cradle(const Setup& setup, Record& record) {
  double worst = 0;
  for (int row = 1; row <= 6; ++row)
    for (const float gap : {0.0f, 0.001f})
      for (int phase = 0; phase < 4; ++phase) {
        WorldDef def = world_def(setup);
        def.gravity = {};
        World world(def);
        const Material material{0, 1};
        std::vector<BodyId> balls;
        for (int i = 0; i <= row; ++i) {
          const float x =
              i == 0 ? -0.5f - 0.005f * static_cast<float>(phase) : static_cast<float>(i - 1) * (0.2f + gap);
          balls.push_back(world.add(body(sphere(0.1f), {x, 0, 0}, 1, material)));
        }
        world.set_velocity(balls[0], {2, 0, 0}, {});
        for (int i = 0; i < 60; ++i) world.step();
        for (int i = 0; i <= row; ++i)
          worst = std::max(
              worst, std::abs(wide(world.velocity(balls[static_cast<std::size_t>(i)]).linear.x) - (i == row ? 2 : 0)));
      }
  record.at_most("rows of one to six balls hit at 2 m/s, error of any ball's speed after", worst, 1e-4, "m/s");
}

}  // namespace fathom::validate
