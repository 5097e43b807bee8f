// The renderer: meshes, cameras, files, and pictures drawn in software.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "render/camera.hpp"
#include "render/egl_context.hpp"
#include "render/image.hpp"
#include "render/shape_mesh.hpp"
#include "render/stage.hpp"
#include "render/web_page.hpp"
#include "scene/environments.hpp"
#include "scene/heap.hpp"
#include "scene/scene_file.hpp"
#include "test_hulls.hpp"

namespace fathom::render::render_test {
namespace {

/// By the divergence theorem; positive if triangles are counter-clockwise seen from outside.
double enclosed_volume(const Mesh& mesh) {
  double volume = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.vertices[mesh.indices[i]].position, b = mesh.vertices[mesh.indices[i + 1]].position,
               c = mesh.vertices[mesh.indices[i + 2]].position;
    volume += static_cast<double>(dot(a, cross(b, c))) / 6;
  }
  return volume;
}

TEST(Mesh, EnclosesTheVolumeOfItsShape) {
  EXPECT_NEAR(enclosed_volume(unit_box()), 8, 1e-5);
  EXPECT_NEAR(enclosed_volume(unit_sphere(4)), 4.0 / 3 * static_cast<double>(pi), 0.02);
  Mesh capsule = unit_capsule(64);
  const float half_length = 2;
  for (MeshVertex& v : capsule.vertices) v.position.z += half_length * v.extra;
  EXPECT_NEAR(enclosed_volume(capsule), (4.0 / 3 + 4) * static_cast<double>(pi), 0.1);
  const Vec3 corners[] = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {2, 2, 2}};
  const Shape solid = hull(corners);
  EXPECT_NEAR(enclosed_volume(hull_mesh(*solid.hull)), static_cast<double>(solid.hull->volume()), 1e-4);
}

TEST(Mesh, NormalsPointOutward) {
  for (const Mesh& mesh : {unit_box(), unit_sphere(2), unit_capsule(16)}) {
    for (const MeshVertex& v : mesh.vertices) {
      EXPECT_NEAR(length(v.normal), 1, 1e-5f);
      EXPECT_GT(dot(v.normal, v.position), 0);
    }
  }
}

TEST(Mesh, HasTheTrianglesOfItsSurface) {
  const float heights[] = {0, 0, 0, 1, 2, 3};
  const bool holes[] = {true, false};
  const Shape field = height_field({3, 2, 1, 1, heights, holes});
  const Mesh mesh = surface_mesh(*field.surface);
  ASSERT_EQ(mesh.indices.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const MeshVertex& v = mesh.vertices[mesh.indices[i]];
    const fathom::Triangle triangle = field.surface->triangle(2 + static_cast<std::uint32_t>(i / 3));
    EXPECT_TRUE(v.position == triangle.corners[i % 3]) << i;
    EXPECT_NEAR(length(v.normal), 1, 1e-6f);
    EXPECT_GT(v.normal.z, 0);
  }
}

TEST(Camera, SeesTheWholeBox) {
  const Aabb box{{-3, 2, 0}, {5, 9, 4}};
  for (const float azimuth : {0.0f, 1.0f, -2.5f}) {
    const Camera camera = camera_on(box, azimuth, 0.4f, 16.0f / 9);
    const Mat4 to_clip = view_projection(camera, 16.0f / 9);
    float widest = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec4 p = to_clip * Vec4{corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                                    corner & 4 ? box.upper.z : box.lower.z, 1};
      ASSERT_GT(p.w, 0);
      widest = max(widest, max(abs(p.x / p.w), abs(p.y / p.w)));
    }
    EXPECT_LE(widest, 1);
    EXPECT_GT(widest, 0.8f);
  }
}

TEST(Camera, DirectionThroughAPointMeetsThatPointAgain) {
  Camera camera;
  camera.eye = {4, -7, 3};
  camera.target = {1, 2, 0};
  const Vec3 direction = direction_through(camera, 1.5f, 0.3f, -0.6f);
  const Vec3 ahead = camera.eye + 10.0f * direction;
  const Vec4 p = view_projection(camera, 1.5f) * Vec4{ahead.x, ahead.y, ahead.z, 1};
  EXPECT_NEAR(p.x / p.w, 0.3f, 1e-5f);
  EXPECT_NEAR(p.y / p.w, -0.6f, 1e-5f);
}

TEST(Picture, ComesBackFromItsFile) {
  Image image{5, 3, std::vector<std::uint8_t>(45)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<std::uint8_t>(7 * i);
  const std::string path = testing::TempDir() + "/picture.png";
  write_png(image, path);
  const Image back = read_png(path);
  EXPECT_EQ(back.width, 5);
  EXPECT_EQ(back.height, 3);
  EXPECT_EQ(back.pixels, image.pixels);
  EXPECT_EQ(difference(image, back, 0).mean, 0);
  EXPECT_THROW(read_png(path + ".absent"), Error);
  EXPECT_THROW(write_png(image, "/nowhere/picture.png"), Error);
}

TEST(WorldPicture, WallsOfABinAreLeftOut) {
  Scene scene = make_heap(43).scene;
  World world(scene.world);
  const SceneInstance instance(scene, world);
  const std::vector<BodyId> walls(instance.ids().begin() + 1, instance.ids().begin() + 5);
  EXPECT_THAT(bin_walls(world), testing::UnorderedElementsAreArray(walls));
  world.remove(walls[2]);
  EXPECT_THAT(bin_walls(world), testing::IsEmpty());
}

TEST(Gpu, ChoicesAreRead) {
  EXPECT_EQ(parse_gpu("auto").kind, GpuChoice::Kind::automatic);
  EXPECT_EQ(parse_gpu("software").kind, GpuChoice::Kind::software);
  EXPECT_EQ(parse_gpu("2").number, 2);
  EXPECT_THROW(parse_gpu("fast"), Error);
  EXPECT_THROW(parse_gpu("-1"), Error);
}

/// Tests that draw. They use software rendering, so that every machine draws the same.
class Drawing : public testing::Test {
 protected:
  void SetUp() override {
    try {
      context_ = make_offscreen_context({GpuChoice::Kind::software, 0});
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }

  static StageSettings small() {
    StageSettings settings;
    settings.width = 320;
    settings.height = 180;
    settings.renderer.shadow_size = 1024;
    return settings;
  }

  std::unique_ptr<OffscreenContext> context_;
};

Colour pixel(const Image& image, int x, int y) {
  const std::uint8_t* p = image.row(y) + 3 * x;
  return {p[0], p[1], p[2]};
}

/// Draws bodies straight ahead along +y: x is right, z is up.
class Bodies : public Drawing {
 protected:
  void SetUp() override {
    Drawing::SetUp();
    if (IsSkipped()) return;
    RendererSettings settings;
    settings.shadow_size = 512;
    renderer_.emplace(settings);
    target_.emplace(100, 100, 1);
    frame_.camera.eye = {0, -10, 0};
    frame_.camera.target = {0, 0, 0};
    frame_.look = daylight(1e6f);
    frame_.shadows = {{-5, -5, -5}, {5, 5, 5}};
  }

  const Image& draw(const std::vector<DrawnBody>& bodies, const std::vector<Pose>& poses,
                    const std::vector<Colour>& colours) {
    renderer_->set_bodies(bodies);
    renderer_->set_colours(colours);
    renderer_->poses().write(poses);
    renderer_->draw(frame_, target_->framebuffer(), 100, 100);
    target_->read(image_);
    return image_;
  }

  std::optional<Renderer> renderer_;
  std::optional<OffscreenTarget> target_;
  Frame frame_;
  Image image_;
};

bool is_red(Colour c) { return c.r > 2 * c.b && c.r > 2 * c.g; }
bool is_green(Colour c) { return c.g > 2 * c.r && c.g > 2 * c.b; }

TEST_F(Bodies, NearerBodiesHideFartherOnes) {
  const Shape cube = box({1, 1, 1});
  const std::vector<DrawnBody> bodies{{0, cube}, {1, cube}};
  const std::vector<Pose> poses{{.position = {0, 3, 0}}, {.position = {0, -1, 0}}};
  const std::vector<Colour> colours{{200, 20, 20}, {20, 200, 20}};
  EXPECT_TRUE(is_green(pixel(draw(bodies, poses, colours), 50, 50)));
  // In the opposite order the other one is in front.
  EXPECT_TRUE(is_red(pixel(draw(bodies, {poses[1], poses[0]}, colours), 50, 50)));
}

TEST_F(Bodies, EveryShapeIsDrawnWhereItIs) {
  const std::vector<Vec3> corners = test::box_points({0.6f, 0.6f, 0.6f});
  const std::vector<Shape> shapes{box({0.6f, 0.6f, 0.6f}), sphere(0.6f), capsule(0.3f, 0.3f), hull(corners)};
  std::vector<DrawnBody> bodies;
  std::vector<Pose> poses;
  for (std::uint32_t i = 0; i < 4; ++i) {
    bodies.push_back({i, shapes[i]});
    poses.push_back({.position = {i % 2 ? 1.5f : -1.5f, 0, i / 2 ? -1.5f : 1.5f}});
  }
  const Image& image = draw(bodies, poses, std::vector<Colour>(4, Colour{200, 20, 20}));
  // ±1.5 m at 10 m: 0.41 of half the picture.
  for (const int x : {29, 71})
    for (const int y : {29, 71}) EXPECT_TRUE(is_red(pixel(image, x, y))) << x << " " << y;
  EXPECT_FALSE(is_red(pixel(image, 50, 50)));
  EXPECT_FALSE(is_red(pixel(image, 50, 5)));
}

/// A quad of triangles facing the camera.
Shape facing_mesh() {
  const Vec3 corners[] = {{-0.6f, 0, -0.6f}, {0.6f, 0, -0.6f}, {0.6f, 0, 0.6f}, {-0.6f, 0, 0.6f}};
  const std::uint32_t indices[] = {0, 1, 2, 0, 2, 3};
  return mesh(corners, indices);
}

const Quat towards_camera{std::sqrt(0.5f), std::sqrt(0.5f), 0, 0};  // up turns towards the camera, y is up

TEST_F(Bodies, SurfacesAreDrawnWhereTheyAre) {
  const float heights[9] = {};
  const Shape field = height_field({3, 3, 0.6f, 0.6f, heights});
  const std::vector<DrawnBody> bodies{{0, facing_mesh()}, {1, field}};
  const std::vector<Pose> poses{{.position = {-1.5f, 0, 1.5f}},
                                {.position = {0.9f, 0, -2.1f}, .rotation = towards_camera}};
  const Image& image = draw(bodies, poses, std::vector<Colour>(2, Colour{200, 20, 20}));
  EXPECT_TRUE(is_red(pixel(image, 29, 29)));
  EXPECT_TRUE(is_red(pixel(image, 71, 71)));
  // Up to their corners: 0.6 m are 8 pixels.
  for (const int dx : {-6, 6})
    for (const int dy : {-6, 6}) {
      EXPECT_TRUE(is_red(pixel(image, 29 + dx, 29 + dy))) << dx << " " << dy;
      EXPECT_TRUE(is_red(pixel(image, 71 + dx, 71 + dy))) << dx << " " << dy;
      EXPECT_FALSE(is_red(pixel(image, 29 + 2 * dx, 29 + 2 * dy))) << dx << " " << dy;
      EXPECT_FALSE(is_red(pixel(image, 71 + 2 * dx, 71 + 2 * dy))) << dx << " " << dy;
    }
  EXPECT_FALSE(is_red(pixel(image, 29, 71)));
  EXPECT_FALSE(is_red(pixel(image, 50, 50)));
}

TEST_F(Bodies, SurfacesAreSeenFromOutside) {
  const std::vector<DrawnBody> bodies{{0, facing_mesh()}};
  const std::vector<Colour> red{{200, 20, 20}};
  EXPECT_TRUE(is_red(pixel(draw(bodies, {Pose{}}, red), 50, 50)));
  const Pose turned{.position = {}, .rotation = {0, 0, 0, 1}};  // by half a turn about z
  EXPECT_FALSE(is_red(pixel(draw(bodies, {turned}, red), 50, 50)));
}

TEST_F(Bodies, HolesOfAHeightFieldAreSeenThrough) {
  const float heights[9] = {};
  const bool upper_left[4] = {false, false, true, false}, all[4] = {true, true, true, true};
  const Pose pose{.position = {-0.6f, 0, -0.6f}, .rotation = towards_camera};
  const std::vector<Colour> red{{200, 20, 20}};
  const Image& image = draw({{0, height_field({3, 3, 0.6f, 0.6f, heights, upper_left})}}, {pose}, red);
  EXPECT_FALSE(is_red(pixel(image, 46, 46)));
  EXPECT_TRUE(is_red(pixel(image, 54, 46)));
  EXPECT_TRUE(is_red(pixel(image, 46, 54)));
  EXPECT_TRUE(is_red(pixel(image, 54, 54)));
  EXPECT_FALSE(is_red(pixel(draw({{0, height_field({3, 3, 0.6f, 0.6f, heights, all})}}, {pose}, red), 54, 54)));
}

TEST_F(Bodies, SurfacesOfTheGroundHideWhatIsBelow) {
  const std::vector<DrawnBody> bodies{{0, facing_mesh(), true}, {1, box({0.3f, 0.3f, 0.3f})}};
  const std::vector<Colour> colours(2, Colour{200, 20, 20});
  const Pose behind{.position = {0, 2, 0}}, before{.position = {0, -2, 0}};
  EXPECT_FALSE(is_red(pixel(draw(bodies, {Pose{}, behind}, colours), 50, 50)));
  EXPECT_TRUE(is_red(pixel(draw(bodies, {Pose{}, before}, colours), 50, 50)));
}

TEST_F(Bodies, ManyAreDrawnInFewCalls) {
  std::vector<DrawnBody> bodies;
  std::vector<Pose> poses(1000);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    bodies.push_back({i, i % 2 ? box({0.1f, 0.1f, 0.1f}) : sphere(0.1f)});
    poses[i].position = {static_cast<float>(i % 32) * 0.2f - 3.1f, 0, static_cast<float>(i / 32) * 0.2f - 3.1f};
  }
  const Image& image = draw(bodies, poses, std::vector<Colour>(1000, Colour{200, 20, 20}));
  EXPECT_LE(renderer_->draw_calls(), 9);  // two kinds, twice for the shadow map, in full and remaining copies; the sky
  int red = 0;
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) red += is_red(pixel(image, x, y));
  EXPECT_GT(red, 4000);
}

TEST_F(Bodies, SleepersAreDimmed) {
  const std::vector<DrawnBody> bodies{{0, box({2, 2, 2})}};
  const Colour awake = pixel(draw(bodies, {Pose{}}, {{200, 20, 20, 255}}), 50, 50);
  const Colour asleep = pixel(draw(bodies, {Pose{}}, {{200, 20, 20, 128}}), 50, 50);
  EXPECT_LT(asleep.r + 40, awake.r);
}

TEST_F(Bodies, ThrowShadows) {
  // A plate above a table, seen from above, with the sun at the upper left.
  frame_.camera.eye = {0, 0, 20};
  frame_.camera.target = {0, 0, 0};
  const std::vector<DrawnBody> bodies{{0, box({6, 6, 0.1f})}, {1, box({1, 1, 0.1f})}};
  const auto brightness = [&](float height) {
    const Image& image =
        draw(bodies, {Pose{}, {.position = {0, 0, height}}}, std::vector<Colour>(2, Colour{200, 200, 200}));
    // Where the centre of the plate's shadow falls.
    const Vec3 sun = frame_.look.sun_direction;
    const float x = -3 * sun.x / sun.z, y = -3 * sun.y / sun.z;
    const float scale = 50 / (20 * std::tan(0.35f));
    return pixel(image, static_cast<int>(50 + scale * x), static_cast<int>(50 - scale * y)).g;
  };
  EXPECT_LT(brightness(3) + 40, brightness(100));
}

TEST_F(Bodies, PosesMayBecomeMoreFromFrameToFrame) {
  for (const std::uint32_t count : {1u, 10u, 5000u, 20u}) {
    std::vector<DrawnBody> bodies;
    for (std::uint32_t i = 0; i < count; ++i) bodies.push_back({i, box({1, 1, 1})});
    const Image& image = draw(bodies, std::vector<Pose>(count), std::vector<Colour>(count, Colour{200, 20, 20}));
    EXPECT_TRUE(is_red(pixel(image, 50, 50))) << count;
  }
}

TEST_F(Bodies, MarksAreDrawnOnTop) {
  const std::vector<Mark> marks{{{-1, 0, 0}, 5, {1, 0, 0}, {20, 220, 20}}};
  frame_.marks_on_top = marks;
  const Image& image = draw({{0, box({2, 2, 2})}}, {Pose{}}, {{200, 20, 20}});
  EXPECT_TRUE(is_green(pixel(image, 50, 50)));
  EXPECT_TRUE(is_red(pixel(image, 50, 60)));
}

/// One picture of each environment after a second of simulated time, against tests/images. If the variable
/// FATHOM_UPDATE_IMAGES is set, the pictures are rewritten; look at them before you keep them.
class Environments : public Drawing, public testing::WithParamInterface<const char*> {};

TEST_P(Environments, LookAsTheyDid) {
  const std::string name = GetParam();
  Scene scene = name == "shapes" ? load_scene(FATHOM_SOURCE_DIR "/examples/scenes/shapes.toml")
                                 : find_environment(name)->make(name == "pyramid" ? 91 : 200);
  World world(scene.world);
  SceneInstance instance(scene, world);
  StageSettings settings = small();
  if (name == "drift") settings.look = LookKind::water;
  for (int i = 0; i < 60; ++i) {
    instance.prepare_step();
    world.step();
  }
  Stage stage(settings);
  const Image& image = stage.draw(world);
  const std::string path = std::string(FATHOM_SOURCE_DIR "/tests/images/") + name + ".png";
  if (std::getenv("FATHOM_UPDATE_IMAGES")) return write_png(image, path);
  const ImageDifference apart = difference(image, read_png(path), 32);
  write_png(image, testing::TempDir() + "/fathom-" + name + ".png");
  EXPECT_LT(apart.mean, 1.5) << "see " << testing::TempDir() << "/fathom-" << name << ".png beside " << path;
  EXPECT_LT(apart.share_beyond, 0.02);
}

INSTANTIATE_TEST_SUITE_P(All, Environments, testing::Values("drift", "layers", "spread", "pyramid", "shapes"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST_F(Drawing, SameWorldGivesTheSamePicture) {
  const Scene scene = pyramid(4);
  World world(scene.world);
  const SceneInstance instance(scene, world);
  Stage first(small()), second(small());
  EXPECT_EQ(first.draw(world).pixels, second.draw(world).pixels);
}

TEST_F(Drawing, CameraStepsBackForWhatSpreads) {
  World world({.gravity = {0, 0, 0}});
  world.add({.shape = box({0.5f, 0.5f, 0.5f})});
  const BodyId away = world.add(
      {.pose = {.position = {2, 0, 0}}, .velocity = {.linear = {50, 0, 0}}, .shape = box({0.5f, 0.5f, 0.5f})});
  const Aabb before = moving_bounds(world);
  for (int i = 0; i < 60; ++i) world.step();
  EXPECT_GT(moving_bounds(world).upper.x, before.upper.x + 40);
  EXPECT_TRUE(world.contains(away));
}

TEST(WebPage, HoldsAThousandBodiesForTenSecondsInFiveMegabytes) {
  const Scene scene = drift(1000);  // all of them move all the time
  World world(scene.world);
  SceneInstance instance(scene, world);
  WebPage page("drift", 30);
  for (int i = 0; i <= 600; ++i) {
    if (i % 2 == 0) page.add(world);
    instance.prepare_step();
    world.step();
  }
  EXPECT_EQ(page.frames(), 301u);
  const std::string html = page.html(true, 0, 0.4f);
  EXPECT_LT(html.size(), 5'000'000u);
  EXPECT_EQ(html.find("{{"), std::string::npos);
  // Nothing is loaded from elsewhere. Frames are base64, which may contain any letters, but no colon.
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("http:")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("https:")));
}

}  // namespace
}  // namespace fathom::render::render_test
