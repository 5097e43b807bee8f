// The engine's window. Needs a display: `viewer.engine_window` provides Xvfb.
#include "viewer/engine_window.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/engine.hpp"
#include "render/image.hpp"

namespace fathom::viewer::engine_window_test {
namespace {

TEST(EngineWindow, DrawsEntitiesWhereTheyAre) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display here";
  EngineWindow window({.title = "test", .width = 320, .height = 200, .wait_for_display = false});
  engine::Engine engine({}, &window);
  engine::EntityDef crate;
  crate.physics = BodyDef{.motion = MotionType::fixed, .shape = box({1, 1, 1})};
  crate.graphics = engine::GraphicsBody{crate.physics->shape, {0.6f, 0.01f, 0.01f, 1}, {}};
  const engine::EntityId id = engine.world().spawn(crate);
  engine.camera() = {.eye = {0, -10, 0}, .target = {0, 0, 0}};
  engine.run(2);
  const std::string path = testing::TempDir() + "/engine-window.png";
  const auto middle_is_red = [&] {
    window.save(path);
    const render::Image image = render::read_png(path);
    EXPECT_EQ(image.width, 320);
    const std::uint8_t* p = image.row(100) + 3 * 160;
    return p[0] > 2 * p[1] && p[0] > 2 * p[2];
  };
  EXPECT_TRUE(middle_is_red());
  engine.world().destroy(id);
  engine.run(2);
  EXPECT_FALSE(middle_is_red());
}

}  // namespace
}  // namespace fathom::viewer::engine_window_test
