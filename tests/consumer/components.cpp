// The installed engine and renderer: a crate falls in the main loop, and a camera looks at where it lies.
#include <fmt/format.h>

#include "engine/engine.hpp"
#include "render/camera.hpp"

int main() {
  using namespace fathom;
  engine::Config config;
  config.set("log.console=false");
  engine::Engine engine(config);
  engine::EntityDef ground;
  ground.physics = BodyDef{.motion = MotionType::fixed, .shape = box({50, 50, 0.5f})};
  engine.world().spawn(ground);
  engine::EntityDef crate;
  crate.physics = BodyDef{.pose = {.position = {0, 0, 3}}, .shape = box({0.5f, 0.5f, 0.5f})};
  const engine::EntityId id = engine.world().spawn(crate);
  engine.run(240);
  const Vec3 where = engine.world().find(id)->pose().position;
  const render::Camera camera = render::camera_on({where, where + Vec3{1, 1, 1}}, 0.5f, 0.5f, 1.6f);
  fmt::print("components: height {:.3f} m, seen from {:.2f} m\n", where.z, length(camera.eye - where));
  return engine.steps() == 240 && where.z > 0.99f && where.z < 1.01f ? 0 : 1;
}
