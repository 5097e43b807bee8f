// Any text as a scene file: refused with one `Error`, or its world takes steps.
#include <string_view>

#include "input.hpp"
#include "scene/scene_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fathom;
  try {
    Scene scene = parse_scene({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
    if (scene.bodies.size() > 200 || scene.world.solver.substeps > 16 || scene.world.solver.iterations > 16) return 0;
    scene.world.threads = 1;
    scene.world.simulator = SimulatorKind::native;
    World world(scene.world);
    SceneInstance instance(scene, world);
    for (int i = 0; i < 3; ++i) {
      instance.prepare_step();
      world.step();
    }
    for (const BodyId id : world.bodies()) fuzz::require(is_finite(world.pose(id)));
  } catch (const Error&) {
  }
  return 0;
}
