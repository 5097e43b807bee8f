// Bodies under gravity alone, and clouds of them that collide.
#include <array>
#include <cmath>

#include "scene/random.hpp"
#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {

void free_fall(const Setup& setup, Record& record) {
  World world(world_def(setup));
  BodyDef def = body(sphere(0.5f), {0, 0, 100});
  def.velocity.linear = {3, -2, 5};
  const BodyId id = world.add(def);
  Plot plot{"Height of a projectile", "t (s)", "height minus exact parabola (mm)", false, false, {}};
  Curve& error = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  double worst = 0;
  for (int i = 1; i <= 120; ++i) {
    world.step();
    const double t = i / 60.0;
    const Vec3 p = world.pose(id).position;
    const double exact = 100 + 5 * t - 0.5 * g * t * t;
    const double x = wide(p.x) - 3 * t, y = wide(p.y) + 2 * t, z = wide(p.z) - exact;
    worst = std::max(worst, std::sqrt(x * x + y * y + z * z));
    error.add(t, 1000 * (wide(p.z) - exact));
  }
  record.at_most("distance from the exact parabola in 2 s", worst, 1e-3, "m");
  record.note(
      "Free bodies fly on exact parabolas (the mean velocity of a substep moves them), so nothing is the integrator's "
      "own.");
  record.plots.push_back(std::move(plot));
}

namespace {

struct Momenta {
  Vec3d linear, angular;
  double linear_scale = 0, angular_scale = 0;  // sums of magnitudes
};

Momenta momenta(const World& world) {
  Momenta sum;
  for (const BodyId id : world.bodies()) {
    const Vec3d p = wide(world.mass(id)) * to_double(world.velocity(id).linear);
    const Vec3d l = cross(to_double(world.pose(id).position), p) + to_double(spin_momentum(world, id));
    sum.linear += p;
    sum.angular += l;
    sum.linear_scale += length(p);
    sum.angular_scale += length(l);
  }
  return sum;
}

}  // namespace

void colliding_cloud(const Setup& setup, Record& record) {
  WorldDef def = world_def(setup);
  def.gravity = {};
  World world(def);
  Random random(7);
  const int side = setup.full ? 8 : 6;
  const float spacing = 1.5f, middle = 0.5f * spacing * static_cast<float>(side - 1);
  const auto next = [&] { return narrow(random.symmetric(1)); };
  for (int i = 0; i < side * side * side; ++i) {
    const Vec3 p{spacing * static_cast<float>(i % side) - middle,
                 spacing * static_cast<float>(i / side % side) - middle,
                 spacing * static_cast<float>(i / side / side) - middle};
    BodyDef one = body(i % 3 == 0   ? sphere(0.5f)
                       : i % 3 == 1 ? box({0.5f, 0.4f, 0.3f})
                                    : capsule(0.3f, 0.4f),
                       p, i % 5 == 0 ? 3.0f : 1.0f);
    one.material.restitution = i % 2 == 0 ? 0.5f : 0.0f;
    one.velocity.linear = -1.0f * normalize(p, {0, 0, 1}) + Vec3{next(), next(), next()};
    one.velocity.angular = {next(), next(), next()};
    world.add(one);
  }
  const Momenta before = momenta(world);
  Plot plot{"Drift of momentum in a cloud", "step", "relative drift", false, false, {}};
  Curve& linear = plot.curves.emplace_back(Curve{"linear", {}, {}});
  Curve& angular = plot.curves.emplace_back(Curve{"angular", {}, {}});
  double worst_linear = 0, worst_angular = 0;
  std::size_t collisions = 0;
  for (int i = 1; i <= 1000; ++i) {
    world.step();
    collisions += world.contacts_begun().size();
    if (i % 10 != 0) continue;
    const Momenta now = momenta(world);
    const double dl = length(now.linear - before.linear) / before.linear_scale;
    const double da = length(now.angular - before.angular) / before.angular_scale;
    worst_linear = std::max(worst_linear, dl), worst_angular = std::max(worst_angular, da);
    linear.add(i, dl), angular.add(i, da);
  }
  record.at_most("linear momentum drift, of Σ|mv|", worst_linear, 5e-4);
  record.at_most("angular momentum drift, of Σ|L|", worst_angular, 5e-4);
  record.at_least("collisions", static_cast<double>(collisions), side * side * side);
  record.plots.push_back(std::move(plot));
}

void torque_free(const Setup& setup, Record& record) {
  WorldDef def = world_def(setup);
  def.gravity = {};
  World world(def);
  BodyDef one = body(box({0.1f, 0.3f, 0.5f}), {});
  one.velocity.angular = {4, 3, -2};
  const BodyId id = world.add(one);
  const Vec3d before = to_double(spin_momentum(world, id));
  const double start = kinetic_energy(world, id);
  Plot plot{"Torque-free body, 20 s", "t (s)", "relative change", false, false, {}};
  Curve& momentum = plot.curves.emplace_back(Curve{"|L − L₀| / |L₀|", {}, {}});
  Curve& energies = plot.curves.emplace_back(Curve{"E / E₀ − 1", {}, {}});
  double worst = 0, gain = 0, loss = 0;
  for (int i = 1; i <= 1200; ++i) {
    world.step();
    const double drift = length(to_double(spin_momentum(world, id)) - before) / length(before);
    const double change = kinetic_energy(world, id) / start - 1;
    worst = std::max(worst, drift), gain = std::max(gain, change), loss = std::max(loss, -change);
    if (i % 6 == 0) momentum.add(i / 60.0, drift), energies.add(i / 60.0, change);
  }
  record.at_most("angular momentum drift", worst, 5e-3);
  record.at_most("kinetic energy gained", gain, 0.02);
  record.at_most("kinetic energy lost", loss, 0.02);
  record.plots.push_back(std::move(plot));
}

namespace {

/// Period (s) of a torque-free body's angular velocity in its own axes (Landau and Lifshitz, Mechanics, § 37).
/// Principal moments are I1 < I2 < I3, w is the spin about these axes.
double elliptic_period(const std::array<double, 3>& moments, const std::array<double, 3>& w) {
  double energy = 0, square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    energy += 0.5 * moments[k] * w[k] * w[k];
    square += moments[k] * moments[k] * w[k] * w[k];
  }
  auto [i1, i2, i3] = moments;
  if (square < 2 * energy * i2) std::swap(i1, i3);
  const double a = (i3 - i2) * (square - 2 * energy * i1), b = (i2 - i1) * (2 * energy * i3 - square);
  return 4 * std::comp_ellint_1(std::sqrt(b / a)) / std::sqrt(a / (i1 * i2 * i3));
}

}  // namespace

void tennis_racket(const Setup& setup, Record& record) {
  Table table{
      "Flip period (s)", {"kick across the middle axis (rad/s)", "elliptic functions", "simulated", "error"}, {}};
  double worst = 0;
  for (const float kick : {0.5f, 0.1f, 0.01f}) {
    WorldDef def = world_def(setup);
    def.gravity = {};
    World world(def);
    BodyDef one = body(box({0.05f, 0.15f, 0.3f}), {});  // moments descend along x, y, z
    one.velocity.angular = {kick, 6, 0};
    const BodyId id = world.add(one);
    const SymMat3 inertia = world.mass_properties(id).inertia;
    const double exact =
        elliptic_period({wide(inertia.zz), wide(inertia.yy), wide(inertia.xx)}, {0, 6, wide(kick)}) / 2;
    // A flip is a change of sign of the spin about the middle axis, timed by interpolation between steps.
    double first = 0, last = 0, previous = 6;
    int flips = 0;
    for (int i = 1; i <= 60 * 60; ++i) {
      world.step();
      const double now = wide(inverse_rotate(world.pose(id).rotation, world.velocity(id).angular).y);
      if (now * previous < 0) {
        last = (i - now / (now - previous)) / 60.0;
        if (flips++ == 0) first = last;
      }
      previous = now;
    }
    const double period = flips > 1 ? (last - first) / (flips - 1) : 0;
    if (kick >= 0.1f) worst = std::max(worst, std::abs(period / exact - 1));
    table.rows.push_back({std::to_string(kick), std::to_string(exact), std::to_string(period),
                          std::to_string(100 * (period / exact - 1)) + " %"});
  }
  record.at_most("flip period, relative error, kicks of 0.5 and 0.1 rad/s", worst, 0.02);
  record.note(
      "A kick of 0.01 rad/s differs from the unstable rotation by 3e-6 of the energy, which single precision does not "
      "hold for a minute.");
  record.tables.push_back(std::move(table));
}

}  // namespace fathom::validate
