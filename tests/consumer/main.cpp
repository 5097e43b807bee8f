// Drops a box and prints its height once it has landed.
#include <cstdio>
#include <fathom/world.hpp>

int main() {
  fathom::World world({.threads = 1});
  fathom::BodyDef ground;
  ground.motion = fathom::MotionType::fixed;
  ground.shape = fathom::box({50, 50, 0.5f});
  world.add(ground);

  fathom::BodyDef crate;
  crate.shape = fathom::box({0.5f, 0.5f, 0.5f});
  crate.pose.position = {0, 0, 3};
  const fathom::BodyId id = world.add(crate);
  for (int i = 0; i < 240; ++i) world.step();

  const auto height = static_cast<double>(world.pose(id).position.z);
  std::printf("height %.3f m\n", height);
  return height > 0.99 && height < 1.01 ? 0 : 1;
}
