// Reported contact impulses: the weight of bodies at rest, and the momentum change of a hit.
#include <cmath>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

/// Sum of the impulses on a body (N·s, over the step); contact normals point towards it.
Vec3d impulse_on(const World& world, BodyId id) {
  Vec3d sum;
  world.for_each_contact([&](const ContactInfo& contact) {
    if (contact.a != id && contact.b != id) return;
    const double sign = contact.b == id ? 1 : -1;
    for (int i = 0; i < contact.point_count; ++i)
      sum += sign * wide(contact.points[i].impulse) * to_double(contact.normal);
  });
  return sum;
}

}  // namespace

// Chrono's utest_CH_compute_contact: the force on the ground equals the weight of all balls.
void stacked_balls(const Setup& setup, Record& record) {
  WorldDef def = world_def(setup);
  def.dt = 5e-3f;
  def.solver.contact_hertz = 100;  // nearly the stiffest that the time step allows
  World world(def);
  const BodyId ground = world.add(floor_slab());
  for (int i = 0; i < 8; ++i) world.add(body(sphere(0.1f), {0, 0, 0.1f + 0.2f * static_cast<float>(i)}));
  const double weight = 8 * g;
  Plot plot{"Ground reaction of eight stacked balls", "t (s)", "force / weight − 1", false, false, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"simulated", {}, {}});
  double worst = 0;
  for (int i = 1; i <= 200; ++i) {
    world.step();
    const double t = 5e-3 * i, force = -impulse_on(world, ground).z / 5e-3;
    curve.add(t, force / weight - 1);
    if (t > 0.25) worst = std::max(worst, std::abs(force / weight - 1));
  }
  record.at_most("force off the weight after 0.25 s, relative", worst, 1e-3);
  record.plots.push_back(std::move(plot));
}

// Reported impulses match their effect: the change of momentum minus gravity's.
void impulse_balance(const Setup& setup, Record& record) {
  World world(world_def(setup));
  world.add(floor_slab());
  BodyId ids[6];
  for (int i = 0; i < 6; ++i)
    ids[i] = world.add(body(box({0.5f, 0.4f, 0.3f}),
                            {0.1f * static_cast<float>(i % 2), 0, 0.3f + 0.6f * static_cast<float>(i)},
                            1.0f + static_cast<float>(i % 3)));
  steps(world, 240);
  double worst = 0;
  for (int i = 0; i < 60; ++i) {
    world.step();
    for (const BodyId id : ids) {
      const double weight = wide(world.mass(id)) * g;
      worst = std::max(worst, std::abs(impulse_on(world, id).z * 60 / weight - 1));
    }
  }
  record.at_most("force on each of six stacked boxes at rest off its weight, relative", worst, 1e-2);

  // A ball without restitution falls on the floor. Over the step of the hit, its contact gives it m v.
  World second(world_def(setup));
  second.add(floor_slab());
  const BodyId ball = second.add(body(sphere(0.25f), {0, 0, 1.25f}, 2.0f));
  double given = 0;
  for (int i = 0; i < 120; ++i) {
    second.step();
    given += impulse_on(second, ball).z;
  }
  const double expected = 2 * g * 120 / 60;  // it ends at rest, so contacts gave back all that gravity gave
  record.at_most("impulses of a fall to rest, relative error of their sum", std::abs(given / expected - 1), 1e-3);
}

}  // namespace fathom::validate
