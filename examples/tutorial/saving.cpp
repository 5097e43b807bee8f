#include <cstddef>
#include <cstdio>
#include <fathom/world.hpp>
#include <vector>

using namespace fathom;

int main() {
  World world;
  world.add({.motion = MotionType::fixed, .shape = box({50, 50, 0.5f})});
  for (int i = 0; i < 10; ++i)
    world.add({.pose = {.position = {0.1f * static_cast<float>(i), 0, 1 + 1.2f * static_cast<float>(i)}},
               .shape = box({0.5f, 0.5f, 0.5f}),
               .mass = 1.0f});
  for (int i = 0; i < 60; ++i) world.step();

  std::vector<std::byte> bytes;
  world.save(bytes);  // write them to a file, send them over a network

  World copy({.threads = 1});  // another number of threads makes no difference
  copy.restore(bytes);
  for (int i = 0; i < 600; ++i) {
    world.step();
    copy.step();
  }
  std::printf("after %llu steps both worlds are %s\n", static_cast<unsigned long long>(copy.step_count()),
              copy.state_hash() == world.state_hash() ? "equal to the last bit" : "different");
}
