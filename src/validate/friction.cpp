// Coulomb friction: when bodies begin to slip, how far they slide, how they come to roll and to rest.
#include <cmath>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

/// Distance (m) that a flat box slides down a ramp in 2 s from rest.
double slide_down(const Setup& setup, float friction, double angle) {
  World world(world_def(setup));
  const Quat tilt = turn_about({0, 1, 0}, angle);
  const Material material{friction, 0};
  BodyDef ramp = floor_slab(material, 20);
  ramp.pose.rotation = tilt;
  ramp.pose.position = rotate(tilt, {0, 0, -0.5f});
  world.add(ramp);
  BodyDef slider = body(box({0.5f, 0.5f, 0.1f}), rotate(tilt, {0, 0, 0.1f}), 1.0f, material);
  slider.pose.rotation = tilt;
  const BodyId id = world.add(slider);
  steps(world, 120);
  return wide(distance(world.pose(id).position, slider.pose.position));
}

}  // namespace

void ramps(const Setup& setup, Record& record) {
  constexpr double slipped = 0.02;  // m; one degree beyond the friction angle it is 0.3 m
  Plot plot{"Angle at which a box slips", "µ", "angle (°)", false, false, {}};
  Curve& measured = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  Curve& theory = plot.curves.emplace_back(Curve{"atan µ", {}, {}});
  int wrong = 0, ramps_run = 0;
  double worst = 0;
  for (int tenth = 1; tenth <= 10; tenth += setup.full ? 1 : 3) {
    const float friction = 0.1f * static_cast<float>(tenth);
    const double limit = std::atan(wide(friction)) / degree;
    for (int angle = 3; angle <= 40; angle += setup.full ? 1 : 4) {
      if (std::abs(angle - limit) < 1) continue;
      ++ramps_run;
      wrong += (slide_down(setup, friction, angle * degree) > slipped) != (angle > limit);
    }
    double low = limit - 2, high = limit + 2;
    while (high - low > 0.05) {
      const double middle = 0.5 * (low + high);
      (slide_down(setup, friction, middle * degree) > slipped ? high : low) = middle;
    }
    worst = std::max(worst, std::abs(0.5 * (low + high) - limit));
    measured.add(0.1 * tenth, 0.5 * (low + high)), theory.add(0.1 * tenth, limit);
  }
  record.at_most("ramps that hold or slip wrongly, of " + std::to_string(ramps_run), wrong, 0);
  record.at_most("slip angle off atan µ", worst, 1, "°");
  record.plots.push_back(std::move(plot));
}

void stopping_distance(const Setup& setup, Record& record) {
  Table table{"Stopping distance (m), v₀ = 2 m/s", {"µ", "Δt (s)", "v₀²/2µg", "least of 12 directions", "most"}, {}};
  for (const float dt : {1.0f / 60, 1.0f / 240}) {
    double worst = 0, spread = 0;
    for (const float friction : {0.2f, 0.4f, 0.7f}) {
      const double expected = 4 / (2 * wide(friction) * g);
      // Velocities change at the ends of substeps: the body moves through the first substep at full speed or not at
      // all.
      const double own = 0.5 * 2 * wide(dt) / 4;
      double least = 1e9, most = 0;
      for (int direction = 0; direction < 12; ++direction) {
        WorldDef def = world_def(setup);
        def.dt = dt;
        World world(def);
        const Material material{friction, 0};
        world.add(floor_slab(material));
        const BodyId id = world.add(body(box({0.5f, 0.5f, 0.1f}), {0, 0, 0.1f}, 1.0f, material));
        steps(world, step_count(world, 0.5));
        const Vec3 start = world.pose(id).position;
        const double angle = 30 * direction * degree;
        world.set_velocity(id, {narrow(2 * std::cos(angle)), narrow(2 * std::sin(angle)), 0}, {});
        steps(world, step_count(world, 2));
        const double way = wide(distance(world.pose(id).position, start));
        least = std::min(least, way), most = std::max(most, way);
      }
      for (const double way : {least, most})
        worst = std::max(worst, (std::abs(way - expected) - (dt > 0.01f ? own : 0)) / expected);
      spread = std::max(spread, (most - least) / expected);
      table.rows.push_back({std::to_string(friction), std::to_string(dt), std::to_string(expected),
                            std::to_string(least), std::to_string(most)});
    }
    const std::string at = dt > 0.01f ? "Δt 1/60 s, beyond half a substep at v₀" : "Δt 1/240 s";
    record.at_most("stopping distance, relative error, " + at, worst, 0.01);
    record.at_most("difference between directions, " + at, spread, 0.01);
  }
  record.tables.push_back(std::move(table));
}

void sliding_sphere(const Setup& setup, Record& record) {
  World world(world_def(setup));
  world.add(floor_slab());
  const BodyId id = world.add(body(sphere(0.5f), {0, 0, 0.5f}));
  steps(world, 10);
  world.set_velocity(id, {3, 0, 0}, {});
  Plot plot{"A sphere slides and comes to roll", "t (s)", "m/s", false, false, {}};
  Curve& linear = plot.curves.emplace_back(Curve{"speed of its centre", {}, {}});
  Curve& rolling = plot.curves.emplace_back(Curve{"r ω", {}, {}});
  for (int i = 1; i <= 120; ++i) {
    world.step();
    linear.add(i / 60.0, speed(world, id)), rolling.add(i / 60.0, 0.5 * wide(world.velocity(id).angular.y));
  }
  const double expected = 3.0 * 5 / 7;
  record.at_most("final speed, relative error from 5/7 v", std::abs(linear.y.back() / expected - 1), 0.01);
  record.at_most("r ω, relative error", std::abs(rolling.y.back() / expected - 1), 0.01);
  record.plots.push_back(std::move(plot));
}

void spinning_box(const Setup& setup, Record& record) {
  // Uniform pressure over a square of half side a: torque µ m g a (√2 + ln(1 + √2)) / 3.
  const double a = 0.5, spin = 10, friction = 0.4, mass = 1;
  const double torque = friction * mass * g * a * (std::sqrt(2.0) + std::log(1 + std::sqrt(2.0))) / 3;
  const double expected = mass * (2 * a) * (2 * a) / 6 * spin / torque;
  WorldDef def = world_def(setup);
  World world(def);
  const Material material{narrow(friction), 0};
  world.add(floor_slab(material));
  const BodyId id = world.add(body(box({0.5f, 0.5f, 0.1f}), {0, 0, 0.1f}, 1.0f, material));
  steps(world, 60);
  world.set_velocity(id, {}, {0, 0, narrow(spin)});
  Plot plot{"A box spins on the floor", "t (s)", "rad/s", false, false, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  Curve& theory = plot.curves.emplace_back(Curve{"uniform pressure", {}, {}});
  // The time at which the spin would reach zero, extrapolated from its slope between 90 % and 10 %.
  double t_high = 0, t_low = 0;
  for (int i = 1; i <= 120; ++i) {
    world.step();
    const double t = i / 60.0, now = wide(world.velocity(id).angular.z);
    curve.add(t, now), theory.add(t, std::max(0.0, spin * (1 - t / expected)));
    if (now > 0.9 * spin) t_high = t;
    if (now > 0.1 * spin) t_low = t;
  }
  const double stopped = (t_low - t_high) / 0.8;
  record.at_most("time to stop, relative error", std::abs(stopped / expected - 1), 0.05);
  record.plots.push_back(std::move(plot));
}

}  // namespace fathom::validate
