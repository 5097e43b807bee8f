// Drops a box and prints its height once it has landed.
#include <cstdio>
#include <fathom/version.hpp>
#include <fathom/world.hpp>

static_assert(FATHOM_VERSION >= 100, "the macro of the version");

int main() {
  const fathom::LibraryInfo build = fathom::library_info();
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

  bool refused = false;
  try {
    world.set_pose(id, {{0, 0, 0}, 0, {0, 0, 0, 0}});
  } catch (const fathom::Error& error) {
    refused = error.code() == fathom::ErrorCode::invalid_argument;
  }
  const auto height = static_cast<double>(world.pose(id).position.z);
  std::printf("fathom %s, %s, %s, %s: height %.3f m\n", build.text, build.linkage, build.type, build.simd, height);
  return refused && build.version == FATHOM_VERSION && height > 0.99 && height < 1.01 ? 0 : 1;
}
