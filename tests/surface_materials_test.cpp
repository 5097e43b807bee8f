// Materials of a mesh's triangles and of a height field's cells.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fathom/error.hpp>
#include <fathom/mesh.hpp>

#include "geometry/support.hpp"
#include "random.hpp"
#include "test_surfaces.hpp"
#include "world_fixture.hpp"

namespace fathom::test::surface_materials_test {
namespace {

using testing::HasSubstr;

constexpr std::uint8_t rough = 0, ice = 1, belt = 2, springy = 3;
const std::vector<Material> materials{
    {.friction = 0.6f},
    {.friction = 0, .friction_rule = CombineRule::multiply},
    {.friction = 0.6f, .surface_velocity = {0, 1, 0}},
    {.friction = 0.6f, .restitution = 0.8f, .rolling_resistance = 0.1f},
};

/// 20 m wide around the origin with cells of half a metre: strips along y, one for each material.
constexpr int cells = 40;
std::uint8_t strip_of(int i) { return static_cast<std::uint8_t>(i / (cells / 4)); }
constexpr float middle_of_strip[] = {-7.5f, -2.5f, 2.5f, 7.5f};

std::vector<std::uint8_t> strip_numbers(int per_cell) {
  std::vector<std::uint8_t> numbers;
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) numbers.insert(numbers.end(), static_cast<std::size_t>(per_cell), strip_of(i));
  return numbers;
}

Shape mesh_of_strips() {
  const Shape whole = flat_mesh(cells, 10);
  const auto& flat = static_cast<const TriangleMesh&>(*whole.surface);
  std::vector<std::uint8_t> numbers;  // of triangles in the mesh's own order
  for (std::uint32_t t = 0; t < flat.triangle_count(); ++t) {
    const Triangle triangle = flat.triangle(t);
    const float x = (triangle.corners[0].x + triangle.corners[1].x + triangle.corners[2].x) / 3;
    numbers.push_back(strip_of(static_cast<int>((x + 10) * 2)));
  }
  return mesh(flat.vertices(), flat.indices(), {materials, numbers});
}

Shape field_of_strips() {
  const std::vector<float> heights((cells + 1) * (cells + 1));
  const std::vector<std::uint8_t> numbers = strip_numbers(1);
  return height_field({cells + 1, cells + 1, 0.5f, 0.5f, heights, {}, {materials, numbers}});
}

BodyDef strips(bool of_mesh) {
  BodyDef def = fixed(of_mesh ? mesh_of_strips() : field_of_strips());
  if (!of_mesh) def.pose.position = {-10, -10, 0};
  return def;
}

BodyDef crate(Vec3 position, Vec3 velocity = {}) {
  BodyDef def = dynamic(box({0.3f, 0.3f, 0.3f}), position);
  def.material.friction = 0.6f;
  def.velocity.linear = velocity;
  return def;
}

TEST(SurfaceMaterials, ActWhereTheyAre) {
  for (const bool of_mesh : {false, true}) {
    World world(quiet_world());
    world.add(strips(of_mesh));
    const auto crate_on = [&](std::uint8_t material) {
      return world.add(crate({middle_of_strip[material], -6, 0.3f}, {0, 3, 0}));
    };
    const BodyId on_rough = crate_on(rough), on_ice = crate_on(ice), on_belt = crate_on(belt);
    BodyDef ball = dynamic(sphere(0.2f), {middle_of_strip[springy], -6, 1.2f});
    ball.material.restitution = 0;
    const BodyId bounces = world.add(ball);
    ball.pose.position = {middle_of_strip[springy], 0, 0.2f};
    ball.velocity = {.linear = {0, 2, 0}, .angular = {-10, 0, 0}};
    const BodyId rolls = world.add(ball);
    float highest = 0;
    for (int i = 0; i < 120; ++i) {
      world.step();
      if (i > 40) highest = std::max(highest, world.pose(bounces).position.z);
    }
    const auto way = [&](BodyId id) { return world.pose(id).position.y + 6; };
    EXPECT_NEAR(way(on_rough), 9 / (2 * 0.6f * 9.81f), 0.02f) << "v²/2µg";
    EXPECT_NEAR(way(on_ice), 6, 1e-3f);
    EXPECT_NEAR(world.velocity(on_belt).linear.y, 1, 1e-3f);
    EXPECT_NEAR(highest, 0.2f + 0.64f, 0.03f) << "e²h";
    EXPECT_NEAR(world.pose(rolls).position.y, 4 - 2 * 5.0f / 7.0f * 0.1f * 9.81f, 0.05f) << "2 s of resistance";
  }
}

// A body across two materials has a contact with each, and what slides over the border does not catch.
TEST(SurfaceMaterials, MeetUnderOneBody) {
  for (const bool of_mesh : {false, true}) {
    World world(quiet_world());
    const BodyId ground = world.add(strips(of_mesh));
    const BodyId across = world.add(crate({-5, 0, 0.3f}));
    const BodyId over = world.add(crate({-2.5f, 5, 0.3f}, {-4, 0, 0}));  // from ice onto rough ground
    run(world, 60);
    std::vector<std::uint32_t> touched;
    world.for_each_contact_of(across, [&](const ContactInfo& c) {
      EXPECT_EQ(c.a, ground);
      EXPECT_EQ(c.point_count, 4);
      touched.push_back(c.child_a);
    });
    EXPECT_THAT(touched, testing::UnorderedElementsAre(rough, ice));
    EXPECT_NEAR(world.pose(across).position.x, -5, 1e-3f);
    EXPECT_NEAR(world.pose(over).position.z, 0.3f, 2e-3f);
    run(world, 60);
    EXPECT_LT(world.pose(over).position.x, -5.6f);
    EXPECT_NEAR(world.velocity(over).linear.x, 0, 1e-3f);
  }
}

TEST(SurfaceMaterials, GoOnAlikeFromASnapshotAndOnMoreThreads) {
  const auto make = [](int threads) {
    World world(sleepy_world(threads));
    world.add(strips(true));
    Generator random(3);
    for (int i = 0; i < 60; ++i) {
      const Vec3 at{uniform(random, -9, 9), uniform(random, -9, 9), uniform(random, 0.5f, 3)};
      world.add(i % 2 == 0 ? crate(at, {uniform(random, -3, 3), 0, 0}) : dynamic(sphere(0.3f), at));
    }
    return world;
  };
  World one = make(1), two = make(2);
  run(one, 90), run(two, 90);
  EXPECT_EQ(one.state_hash(), two.state_hash());
  World restored(sleepy_world(2));
  restored.restore(saved(one));
  run(one, 60), run(restored, 60);
  EXPECT_EQ(one.state_hash(), restored.state_hash());
}

TEST(SurfaceMaterials, StayWithTheirTriangles) {
  // One triangle in three has no area and is left out.
  Generator random(7);
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<std::uint8_t> numbers;
  for (std::uint32_t t = 0; t < 300; ++t) {
    const auto number = static_cast<std::uint8_t>(t % 4);
    const Vec3 at{uniform(random, -9, 9), uniform(random, -9, 9), static_cast<float>(number)};
    for (const Vec3 corner : {Vec3{}, Vec3{1, 0, 0}, t % 3 == 0 ? Vec3{2, 0, 0} : Vec3{0, 1, 0}}) {
      indices.push_back(static_cast<std::uint32_t>(vertices.size()));
      vertices.push_back(at + corner);
    }
    numbers.push_back(number);
  }
  const Shape shape = mesh(vertices, indices, {materials, numbers});
  const Surface& surface = *shape.surface;
  EXPECT_EQ(surface.triangle_count(), 200u);
  for (std::uint32_t t = 0; t < surface.triangle_count(); ++t)
    EXPECT_EQ(static_cast<float>(surface.material_of(t)), surface.triangle(t).corners[0].z);
  EXPECT_EQ(flat_mesh(2, 1).surface->material_of(5), 0u);
  const Shape field = field_of_strips();
  for (std::uint32_t t = 0; t < field.surface->triangle_count(); ++t)
    EXPECT_EQ(field.surface->material_of(t), strip_of(static_cast<int>(t / 2 % cells)));
}

std::string refusal(const SurfaceMaterials& given) {
  try {
    const std::vector<float> heights(6);
    height_field({3, 2, 1, 1, heights, {}, given});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(SurfaceMaterials, MistakesAreNamed) {
  const std::vector<std::uint8_t> both{0, 1}, one{0}, wrong{0, 4};
  EXPECT_EQ(refusal({materials, both}), "");
  EXPECT_THAT(refusal({{}, both}), HasSubstr("but the list of materials is empty"));
  EXPECT_THAT(refusal({materials, one}), HasSubstr("there are 1 material numbers for 2 cells; give one for each"));
  EXPECT_THAT(refusal({materials, wrong}), HasSubstr("the material number of cell 1 is 4, but there are 4 materials"));
  const std::vector<Material> invalid{{}, {.friction = -1}};
  EXPECT_THAT(refusal({invalid, both}), HasSubstr("fathom::height_field: material 1: the friction is -1"));
  const std::vector<Material> many(257);
  EXPECT_THAT(refusal({many, both}), HasSubstr("there are 257 materials; at most 256 are possible"));
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<std::uint32_t> triangle{0, 1, 2};
  try {
    mesh(corners, triangle, {materials, both});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("there are 2 material numbers for 1 triangles; give one for each"));
  }
}

}  // namespace
}  // namespace fathom::test::surface_materials_test
