#include <fathom/world.hpp>

int main() {
  fathom::World world;
  world.add({.motion = fathom::MotionType::fixed, .shape = fathom::box({50, 50, 0.5f})});
  const fathom::BodyId crate =
      world.add({.pose = {.position = {0, 0, 5}}, .shape = fathom::box({0.5f, 0.5f, 0.5f}), .mass = 10.0f});
  for (int i = 0; i < 120; ++i) world.step();  // 2 s in fixed steps of 1/60 s
  return world.pose(crate).position.z < 1.1f ? 0 : 1;
}
