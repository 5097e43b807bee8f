#include <cstdio>
#include <fathom/world.hpp>

using namespace fathom;

int main(int argc, char** argv) try {
  WorldDef def;
  def.simulator = SimulatorKind::device;
  def.device = argc > 1 ? argv[1] : "host";  // host, cuda, cuda:1, sycl, or auto: the first GPU, else the host
  def.ahead = 2;                             // `step` returns while up to two steps are still in flight

  // From here on the code is the same as for the native simulator.
  World world(def);
  world.add({.motion = MotionType::fixed, .shape = box({50, 50, 0.5f})});
  for (int i = 0; i < 100; ++i) {
    const Vec3 position{1.1f * static_cast<float>(i % 10), 1.1f * static_cast<float>(i / 10), 3};
    world.add({.pose = {.position = position}, .shape = box({0.5f, 0.5f, 0.5f}), .mass = 1.0f});
  }
  for (int i = 0; i < 120; ++i) world.step();
  world.wait();  // with `ahead`: after this, results are those of the last step
  std::printf("the last crate is at z = %.3f m\n", world.pose(world.bodies().back()).position.z);
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());  // for instance: this build or this machine has no such device
  return 1;
}
