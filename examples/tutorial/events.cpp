#include <cstdio>
#include <fathom/world.hpp>

using namespace fathom;

int main() {
  World world;
  const BodyId floor = world.add({.motion = MotionType::fixed, .shape = box({50, 50, 0.5f})});
  const BodyId gate = world.add(
      {.motion = MotionType::fixed, .pose = {.position = {0, 0, 3}}, .shape = box({1, 1, 0.25f}), .sensor = true});
  const Material bouncy{.restitution = 0.5f};
  const BodyId ball = world.add({.pose = {.position = {0, 0, 5}}, .shape = sphere(0.5f), .material = bouncy});

  for (int i = 0; i < 200; ++i) {
    world.step();
    for (const SensorEvent& e : world.sensor_begun())
      if (e.sensor == gate) std::printf("%.2f s: a body comes into the gate\n", world.time());
    for (const HitEvent& e : world.hits()) std::printf("%.2f s: a hit at %.1f m/s\n", world.time(), e.approach_speed);
  }

  // The contacts of a body with their impulses; divided by the time step they are forces.
  world.for_each_contact_of(ball, [&](const ContactInfo& contact) {
    float impulse = 0;
    for (int k = 0; k < contact.point_count; ++k) impulse += contact.points[k].impulse;
    std::printf("the floor carries %.0f N\n", impulse / world.definition().dt);
  });

  // What is under the ball? It starts inside its own shape, so it ignores itself.
  const QueryFilter others{.ignored = {ball}};
  if (const auto hit = world.cast_ray(world.pose(ball).position, {0, 0, -10}, others))
    std::printf("%s below, %.2f m away\n", hit->body == floor ? "the floor is" : "something is", 10 * hit->fraction);
}
