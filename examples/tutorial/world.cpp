#include <cstdio>
#include <fathom/world.hpp>

int main() {
  fathom::World world;
  world.add({.motion = fathom::MotionType::fixed, .shape = fathom::box({50, 50, 0.5f})});
  const fathom::BodyId crate =
      world.add({.pose = {.position = {0, 0, 5}}, .shape = fathom::box({0.5f, 0.5f, 0.5f}), .mass = 10.0f});
  for (int i = 1; i <= 120; ++i) {
    world.step();
    if (i % 30 == 0) std::printf("%.1f s: z = %.2f m\n", world.time(), world.pose(crate).position.z);
  }
}
