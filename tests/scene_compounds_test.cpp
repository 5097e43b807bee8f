// Compounds in scene files.
#include <gtest/gtest.h>

#include <fathom/compound.hpp>
#include <string>

#include "scene/scene_file.hpp"

namespace fathom::scene_compounds_test {
namespace {

std::string scene_with(const std::string& children, const std::string& more = "") {
  return "[shapes.thing]\ntype = \"compound\"\nchildren = [" + children + "]\n" + more +
         "\n[[body]]\nmotion = \"dynamic\"\nshape = \"thing\"\nmass = 3\n";
}

std::string error_of(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file) << error.what();
    return error.what();
  }
  return "(no error)";
}

constexpr const char* ball = "{shape = {type = \"sphere\", radius = 0.5}}";

TEST(SceneCompounds, AreReadWithAllTheirKeys) {
  const Scene scene = parse_scene(
      scene_with("{shape = \"block\", position = [1, 2, 3], rotation = [0, 1, 0, 0], density = 2, material = \"ice\","
                 " filter = {category = 4, mask = 5}, user_data = 9}, " +
                     std::string(ball),
                 "[shapes.block]\ntype = \"box\"\nhalf_extents = [1, 1, 1]\n[materials.ice]\nfriction = 0.01\n"),
      "scene.toml");
  const Shape& shape = scene.bodies.at(0).shape;
  ASSERT_EQ(shape.type, ShapeType::compound);
  const auto children = shape.compound->children();
  ASSERT_EQ(children.size(), 2u);
  EXPECT_EQ(children[0].shape.type, ShapeType::box);
  EXPECT_EQ(children[0].density, 2);
  EXPECT_EQ(children[0].user_data, 9u);
  EXPECT_EQ(children[0].pose.rotation.x, 1);
  ASSERT_TRUE(children[0].material && children[0].filter);
  EXPECT_EQ(children[0].material->friction, 0.01f);
  EXPECT_EQ(children[0].filter->category, 4u);
  EXPECT_EQ(children[0].filter->mask, 5u);
  EXPECT_FALSE(children[1].material || children[1].filter);
  const Vec3 between = children[0].pose.position - children[1].pose.position;
  EXPECT_NEAR(length(between - Vec3{1, 2, 3}), 0, 1e-5f);
}

TEST(SceneCompounds, MistakesHaveTheirPlace) {
  EXPECT_EQ(error_of(scene_with("")),
            "scene.toml:1:1: [shapes.thing]: compound: there are no children; give it at least one shape");
  EXPECT_EQ(error_of("[shapes.thing]\ntype = \"compound\"\n[[body]]\nshape = \"thing\"\n"),
            "scene.toml:1:1: [shapes.thing] needs 'children': a list of tables, each with a shape and a position (m)");
  EXPECT_NE(error_of(scene_with("{shape = \"blok\"}", "[shapes.block]\ntype = \"box\"\nhalf_extents = [1, 1, 1]\n"))
                .find("scene.toml:3:22: there is no [shapes.blok]; did you mean 'block'?"),
            std::string::npos);
  EXPECT_NE(error_of(scene_with("{shape = \"thing\"}")).find("a child is one convex shape, not a compound"),
            std::string::npos);
  EXPECT_NE(
      error_of(scene_with(std::string(ball) + ", {shape = {type = \"sphere\", radius = -1}}")).find("scene.toml:3"),
      std::string::npos);
  EXPECT_NE(error_of(scene_with("{position = [0, 0, 0]}")).find("child 0 needs 'shape'"), std::string::npos);
  EXPECT_NE(error_of(scene_with("{shape = {type = \"sphere\", radius = 1}, positon = [0, 0, 0]}")).find("position"),
            std::string::npos);
  EXPECT_NE(error_of(scene_with("{shape = {type = \"sphere\", radius = 1}, density = 0}")).find("density"),
            std::string::npos);
  EXPECT_NE(
      error_of(scene_with("{shape = {type = \"height_field\", cell = 1, columns = 2, rows = 2, heights = [0,0,0,0]}}"))
          .find("child 0: the shape is no convex one"),
      std::string::npos);
}

}  // namespace
}  // namespace fathom::scene_compounds_test
