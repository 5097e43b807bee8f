// Triangle meshes and height fields in scene files: every source gives its triangles, and every mistake gets one error
// with its location and remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fathom/mesh.hpp>
#include <fstream>
#include <string>

#include "scene/gltf_file.hpp"
#include "scene/obj_file.hpp"
#include "scene/pgm_file.hpp"
#include "scene/random.hpp"
#include "scene/scene_file.hpp"
#include "test_folder.hpp"

namespace fathom::scene_surfaces_test {
namespace {

constexpr const char* body = "\n[[body]]\nmotion = \"static\"\nshape = \"ground\"\n";

/// The keys begin on line 2.
std::string scene_with(const std::string& keys) { return "[shapes.ground]\n" + keys + body; }

std::string error_of(const std::string& text, const std::string& file = "scene.toml") {
  try {
    parse_scene(text, file);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file) << error.what();
    return error.what();
  }
  return "(no error)";
}

const TriangleMesh& mesh_of(const Scene& scene) {
  EXPECT_EQ(scene.bodies.at(0).shape.type, ShapeType::mesh);
  return static_cast<const TriangleMesh&>(*scene.bodies[0].shape.surface);
}

const HeightField& field_of(const Scene& scene) {
  EXPECT_EQ(scene.bodies.at(0).shape.type, ShapeType::height_field);
  return static_cast<const HeightField&>(*scene.bodies[0].shape.surface);
}

/// Scene files and the files they name are in one folder.
class SceneSurfaces : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  Scene parse(const std::string& keys) const { return parse_scene(scene_with(keys), folder_ / "scene.toml"); }
  /// Without the folder, whose name is arbitrary.
  std::string error(const std::string& keys) const {
    std::string text = error_of(scene_with(keys), folder_ / "scene.toml");
    const std::string here = folder_ / "";
    for (std::size_t at = text.find(here); at != text.npos; at = text.find(here)) text.erase(at, here.size());
    return text;
  }

  test::TestFolder folder_;
};

// Meshes --------------------------------------------------------------------------------------------------------

constexpr const char* pyramid_inline =
    "type = \"mesh\"\n"
    "vertices = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1.5]]\n"
    "triangles = [[3, 2, 1], [3, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]\n";

constexpr const char* pyramid_obj =
    "# a pyramid\n"
    "mtllib none.mtl\n"
    "o pyramid\n"
    "v -1 -1 0\n"
    "v\t1  -1.0 0e0 # and words behind\n"
    "v 1 1 0 1\n"
    "v -1 1 -0.0\n"
    "vt 0.5 0.5\n"
    "vn 0 0 1\n"
    "\n"
    "g base\n"
    "s off\n"
    "f 4/1/1 3/1 2//1 1\n"
    "v 0 0 1.5\n"
    "f 1 2 5\n"
    "  f -4 -3 -1\n"
    "f 3//1 -2//1 5//1\n"
    "f -2/1 -5/1 -1/1";

void expect_equal(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_TRUE(std::ranges::equal(a.indices(), b.indices()));
  EXPECT_TRUE(std::ranges::equal(a.vertices(), b.vertices()));
}

TEST_F(SceneSurfaces, AMeshIsTheSameFromAFileAndFromLists) {
  write("pyramid.obj", pyramid_obj);
  const Scene listed = parse(pyramid_inline), read = parse("type = \"mesh\"\nfile = \"pyramid.obj\"\n");
  EXPECT_EQ(mesh_of(listed).triangle_count(), 6u);
  EXPECT_EQ(mesh_of(listed).vertices().size(), 5u);
  expect_equal(mesh_of(listed), mesh_of(read));
}

TEST_F(SceneSurfaces, LinesOfAMeshMayEndAsTheyDoElsewhere) {
  std::string text = pyramid_obj;
  for (std::size_t at = text.find('\n'); at != text.npos; at = text.find('\n', at + 2)) text.insert(at, 1, '\r');
  write("pyramid.obj", text);
  expect_equal(mesh_of(parse(pyramid_inline)), mesh_of(parse("type = \"mesh\"\nfile = \"pyramid.obj\"\n")));
}

TEST_F(SceneSurfaces, AFilesPathBeginsAtTheSceneFile) {
  std::filesystem::create_directory(folder_ / "meshes");
  write("meshes/pyramid.obj", pyramid_obj);
  const std::string from_root = folder_ / "meshes/pyramid.obj";
  EXPECT_EQ(mesh_of(parse("type = \"mesh\"\nfile = \"meshes/pyramid.obj\"")).triangle_count(), 6u);
  EXPECT_EQ(mesh_of(parse("type = \"mesh\"\nfile = \"" + from_root + "\"")).triangle_count(), 6u);
}

TEST_F(SceneSurfaces, AMeshIsScaled) {
  const Aabb twice = mesh_of(parse(pyramid_inline + std::string("scale = 2"))).bounds();
  EXPECT_TRUE(twice.lower == (Vec3{-2, -2, 0}) && twice.upper == (Vec3{2, 2, 3}));
  const Aabb each = mesh_of(parse(pyramid_inline + std::string("scale = [1, 2, 4]"))).bounds();
  EXPECT_TRUE(each.lower == (Vec3{-1, -2, 0}) && each.upper == (Vec3{1, 2, 6}));
}

TEST_F(SceneSurfaces, BodiesShareANamedSurface) {
  const Scene scene = parse(pyramid_inline + std::string(body) + "position = [9, 0, 0]\n");
  ASSERT_EQ(scene.bodies.size(), 2u);
  EXPECT_EQ(scene.bodies[0].shape.surface, scene.bodies[1].shape.surface);
}

// Height fields -------------------------------------------------------------------------------------------------

constexpr const char* three_by_two = "type = \"height_field\"\ncell = [0.5, 2]\ncolumns = 3\nrows = 2\n";

TEST_F(SceneSurfaces, HeightsAreListedAlongX) {
  const Scene scene = parse(three_by_two + std::string("heights = [0, 1, 2, 3, 4, 5]"));
  const HeightField& field = field_of(scene);
  EXPECT_EQ(field.columns(), 3u);
  EXPECT_EQ(field.rows(), 2u);
  EXPECT_EQ(field.cell_x(), 0.5f);
  EXPECT_EQ(field.cell_y(), 2.0f);
  EXPECT_THAT(field.heights(), testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_TRUE(field.bounds().upper == (Vec3{1, 2, 5}));
}

TEST_F(SceneSurfaces, HolesAreCells) {
  const Scene scene = parse(
      "type = \"height_field\"\ncell = 1\ncolumns = 4\nrows = 3\nheights = [0,0,0,0, 0,0,0,0, 0,0,0,0]\n"
      "holes = [[2, 0], [0, 1]]");
  const HeightField& field = field_of(scene);
  for (std::uint32_t cell = 0; cell < 6; ++cell) EXPECT_EQ(field.is_hole(cell), cell == 2 || cell == 3) << cell;
}

TEST_F(SceneSurfaces, TrianglesHaveTheMaterialsOfAFile) {
  // The first triangle stands above every 'usemtl', the last below a name that is not listed.
  write("strips.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nusemtl ice\nf 1 3 4\nf 1 4 2\nusemtl rock\nf 2 4 3\n"
        "usemtl moss\nf 2 3 4\n");
  const Scene scene = parse(
      "type = \"mesh\"\nfile = \"strips.obj\"\nmaterials = [{friction = 0.9}, \"ice\", \"rock\"]\n"
      "[materials.ice]\nfriction = 0.05\n[materials.rock]\nfriction = 0.7");
  const TriangleMesh& mesh = mesh_of(scene);
  ASSERT_EQ(mesh.materials().size(), 3u);
  EXPECT_EQ(mesh.materials()[1].friction, 0.05f);
  EXPECT_THAT(mesh.material_numbers(), testing::UnorderedElementsAre(0, 1, 1, 2, 0));
}

std::string bytes_of(const auto& numbers) {
  return {reinterpret_cast<const char*>(std::data(numbers)), std::size(numbers) * sizeof(numbers[0])};
}

/// A binary glTF file of a square, 2 m wide, y up: two indexed triangles of ice, and a strip of the same without a
/// material, placed by the nodes.
std::string square_glb(std::string nodes) {
  const float corners[] = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1};
  const std::uint16_t indices[] = {0, 1, 2, 0, 2, 3, 0, 1, 3, 2};
  std::string content = bytes_of(corners) + bytes_of(indices);
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + std::move(nodes) +
      R"(,"materials":[{"name":"ice"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0},)"
      R"({"attributes":{"POSITION":0},"indices":2,"mode":5}]}],"buffers":[{"byteLength":68}],"bufferViews":[)"
      R"({"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":20}],"accessors":[)"
      R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]},)"
      R"({"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},)"
      R"({"bufferView":1,"byteOffset":12,"componentType":5123,"count":4,"type":"SCALAR"}]})";
  while (json.size() % 4 != 0) json += ' ';
  const auto word = [](std::size_t number) {
    const auto value = static_cast<std::uint32_t>(number);
    return std::string(reinterpret_cast<const char*>(&value), 4);
  };
  return "glTF" + word(2) + word(12 + 8 + json.size() + 8 + content.size()) + word(json.size()) + "JSON" + json +
         word(content.size()) + std::string("BIN\0", 4) + content;
}

TEST_F(SceneSurfaces, AGltfFileStandsUpright) {
  // The child is mirrored and 3 m to the side of its parent, which is 1 m up.
  write("squares.glb", square_glb(R"([{"mesh":0,"translation":[0,1,0],"children":[1]},)"
                                  R"({"mesh":0,"translation":[3,0,0],"scale":[-1,1,1]}])"));
  const Scene scene = parse(
      "type = \"mesh\"\nfile = \"squares.glb\"\nmaterials = [\"rock\", \"ice\"]\n"
      "[materials.ice]\nfriction = 0.05\n[materials.rock]\nfriction = 0.7");
  const TriangleMesh& mesh = mesh_of(scene);
  EXPECT_TRUE(mesh.bounds().lower == (Vec3{-1, -1, 1}));
  EXPECT_TRUE(mesh.bounds().upper == (Vec3{4, 1, 1}));
  ASSERT_EQ(mesh.triangle_count(), 8u);
  for (std::uint32_t t = 0; t < 8; ++t) {
    const Triangle triangle = mesh.triangle(t);
    EXPECT_GT(cross(triangle.corners[1] - triangle.corners[0], triangle.corners[2] - triangle.corners[0]).z, 0) << t;
  }
  EXPECT_EQ(std::ranges::count(mesh.material_numbers(), 1), 4);
}

TEST_F(SceneSurfaces, MistakesInAGltfFileAreNamed) {
  const std::string one = R"([{"mesh":0}])", sound = square_glb(one);
  const auto with = [&](const std::string& what, const std::string& instead) {
    std::string changed = sound;
    changed.replace(changed.find(what), what.size(), instead);
    write("bad.glb", changed);
    return error("type = \"mesh\"\nfile = \"bad.glb\"");
  };
  EXPECT_THAT(with("glTF", "glTX"), testing::HasSubstr("bad.glb: is no glTF 2.0 file that can be read: "));
  EXPECT_THAT(with("\"count\":4,\"type\":\"VEC3\"", "\"count\":9,\"type\":\"VEC3\""),
              testing::HasSubstr("has an accessor that reaches beyond its buffer"));
  EXPECT_THAT(with("\"componentType\":5126", "\"componentType\":5123"),
              testing::HasSubstr("has positions that are not three floats each"));
  EXPECT_THAT(with("\"POSITION\":0},\"indices\":1", "\"POSITION\":7},\"indices\":1"),
              testing::HasSubstr("refers to accessor 7, but has 3"));
  write("bad.glb", square_glb(R"([{"mesh":0,"children":[0]}])"));
  EXPECT_THAT(error("type = \"mesh\"\nfile = \"bad.glb\""), testing::HasSubstr("has a node that is its own ancestor"));
  write("bad.glb", square_glb(R"([{}])"));
  EXPECT_THAT(error("type = \"mesh\"\nfile = \"bad.glb\""), testing::HasSubstr("has no triangle in its scene"));
}

TEST_F(SceneSurfaces, CellsHaveMaterials) {
  const Scene scene = parse(
      "type = \"height_field\"\ncell = 1\ncolumns = 4\nrows = 3\nheights = [0,0,0,0, 0,0,0,0, 0,0,0,0]\n"
      "materials = [{friction = 0.9}, {friction = 0.05}]\ncell_materials = [[0, 1, 2, 1, 1], [1, 1, 0], [2, 0, 1]]");
  const HeightField& field = field_of(scene);
  ASSERT_EQ(field.materials().size(), 2u);
  EXPECT_EQ(field.materials()[1].friction, 0.05f);
  EXPECT_THAT(field.material_numbers(), testing::ElementsAre(0, 0, 1, 1, 0, 1));
}

constexpr const char* pictured = "type = \"height_field\"\ncell = 1\nfile = \"ground.pgm\"\nscale = 10\n";

/// Seen from above, y up, the ground looks like the picture.
TEST_F(SceneSurfaces, APicturesLowestLineIsTheFirst) {
  write("ground.pgm", std::string("P5\n3 2\n255\n") + std::string("\0\x33\x66\x99\xcc\xff", 6));
  const Scene scene = parse(pictured + std::string("offset = -1"));
  const HeightField& field = field_of(scene);
  EXPECT_EQ(field.columns(), 3u);
  EXPECT_EQ(field.rows(), 2u);
  const float heights[] = {5, 7, 9, -1, 1, 3};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(field.heights()[i], heights[i], 1e-6f) << i;
}

TEST_F(SceneSurfaces, PicturesHaveTwoBytesAPixelWhereWhiteIsAbove255) {
  write("ground.pgm",
        std::string("P5 # by hand\n# and more\n 2\t2 # so wide\n65535\n") + std::string("\0\0\xff\xff\x80\0\0\x80", 8));
  const Scene scene = parse(pictured);
  const float heights[] = {327680.0f / 65535, 1280.0f / 65535, 0, 10};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(field_of(scene).heights()[i], heights[i], 1e-5f) << i;
}

/// White is the value in the header, not 255.
TEST_F(SceneSurfaces, PicturesMayHaveAnotherWhite) {
  write("ground.pgm", std::string("P5\n2 2\n100\n") + std::string("\0\x32\x64\0", 4));
  EXPECT_THAT(field_of(parse(pictured)).heights(), testing::ElementsAre(10, 0, 0, 5));
}

std::vector<float> made(const std::string& rule) {
  const Scene scene =
      parse_scene(scene_with("type = \"height_field\"\ncolumns = 40\nrows = 30\ncell = 0.5\n" + rule), "scene.toml");
  const auto heights = field_of(scene).heights();
  return {heights.begin(), heights.end()};
}

TEST(SceneSurface, WavesAndHillsAreOfTheirSeed) {
  for (const std::string rule : {"waves = {height = 2, length = 6", "hills = {height = 2, length = 6"}) {
    SCOPED_TRACE(rule);
    const std::vector<float> first = made(rule + "}");
    EXPECT_EQ(first, made(rule + ", seed = 1}"));
    EXPECT_NE(first, made(rule + ", seed = 2}"));
    const auto [lowest, highest] = std::ranges::minmax(first);
    EXPECT_GE(lowest, -1);
    EXPECT_LE(highest, 1);
    EXPECT_GT(highest - lowest, 0.8f);
    // Nowhere as steep as its total height.
    for (std::size_t i = 40; i < first.size(); ++i) EXPECT_LT(std::abs(first[i] - first[i - 40]), 1) << i;
  }
}

TEST(SceneSurface, RoughHillsHaveSmallOnes) {
  const auto roughness = [](const std::string& value) {
    const std::vector<float> heights = made("hills = {height = 2, length = 8, roughness = " + value + "}");
    double sum = 0;
    for (std::size_t i = 1; i + 1 < heights.size(); ++i)
      if (i % 40 > 0 && i % 40 < 39)
        sum += std::abs(static_cast<double>(heights[i - 1] - 2 * heights[i] + heights[i + 1]));
    return sum;
  };
  EXPECT_GT(roughness("0.8"), 3 * roughness("0"));
}

// Mistakes ------------------------------------------------------------------------------------------------------

struct Mistake {
  std::string keys;
  std::string error;
};

TEST_F(SceneSurfaces, MistakesOfMeshes) {
  const std::string mesh = "type = \"mesh\"\n";
  const std::string lists =
      "lists [x, y, z] of 'vertices' (m) and [0, 1, 2] of 'triangles', or a 'file' (*.obj, *.gltf, *.glb)";
  write("pyramid.obj", pyramid_obj);
  std::filesystem::create_directory(folder_ / "folder.obj");
  const std::string corners = mesh + "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";
  const Mistake mistakes[] = {
      {mesh, "scene.toml:1:1: [shapes.ground] needs 'vertices': " + lists},
      {mesh + "vertices = [[0, 0, 0]]", "scene.toml:1:1: [shapes.ground] needs 'triangles': " + lists},
      {mesh + "vertices = []\ntriangles = []", "scene.toml:4:13: there are no 'vertices' for the triangles; list them"},
      {mesh + "vertices = [[0, 0, 0], [1, 0]]\ntriangles = []",
       "scene.toml:3:24: 'vertices' must have 3 numbers, not 2"},
      {mesh + "vertices = [[0, 0, nan]]\ntriangles = []", "scene.toml:3:20: 'vertices' must be finite"},
      {mesh + "vertices = 3\ntriangles = []", "scene.toml:3:12: 'vertices' must be an array, not an integer"},
      {corners + "triangles = [[0, 1, 3]]",
       "scene.toml:4:14: there is no such vertex in 'triangles': they go from 0 to 2"},
      {corners + "triangles = [[0, -1, 2]]",
       "scene.toml:4:14: there is no such vertex in 'triangles': they go from 0 to 2"},
      {corners + "triangles = [[0, 0.5, 2]]",
       "scene.toml:4:14: there is no such vertex in 'triangles': they go from 0 to 2"},
      {corners + "triangles = [0, 1, 2]", "scene.toml:4:14: 'triangles' must be an array, not an integer"},
      {corners + "triangles = [[0, 1]]", "scene.toml:4:14: 'triangles' must have 3 numbers, not 2"},
      {corners + "triangles = []", "scene.toml:1:1: [shapes.ground]: fathom::mesh: "},
      {corners + "triangles = [[0, 1, 1]]", "scene.toml:1:1: [shapes.ground]: fathom::mesh: "},
      {corners + "triangles = [[0, 1, 2]]\nscale = 0", "scene.toml:5:9: 'scale' must be greater than 0"},
      {corners + "triangles = [[0, 1, 2]]\nscale = [1, 1, -1]",
       "scene.toml:5:9: every component of 'scale' must be greater than 0"},
      {corners + "triangles = [[0, 1, 2]]\nscale = \"large\"",
       "scene.toml:5:9: 'scale' must be an array, not a string"},
      {corners + "triangles = [[0, 1, 2]]\nscale = 1e30", "scene.toml:1:1: [shapes.ground]: fathom::mesh: "},
      {mesh + "file = \"pyramid.obj\"\ntriangle_materials = []",
       "scene.toml:4:22: 'triangle_materials' does not go with 'file'; remove one of them"},
      {mesh + "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\ntriangles = [[0, 1, 2]]\nmaterials = [{}, {}]",
       "scene.toml:1:1: [shapes.ground] needs 'triangle_materials': for each triangle the number of one of "
       "'materials'"},
      {mesh + "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\ntriangles = [[0, 1, 2]]\nmaterials = [{}, {}]\n"
              "triangle_materials = [2]",
       "scene.toml:6:22: there is no such material in 'triangle_materials': 'materials' has 2, counted from 0"},
      {mesh + "file = \"pyramid.obj\"\nvertices = []",
       "scene.toml:4:12: 'vertices' does not go with 'file'; remove one of them"},
      {mesh + "file = \"pyramid.obj\"\ntriangles = []",
       "scene.toml:4:13: 'triangles' does not go with 'file'; remove one of them"},
      {mesh + "file = \"pyramid.obj\"\ncell = 1",
       "scene.toml:4:1: unknown key 'cell' in [shapes.ground]; known: type, file, scale, vertices, triangles"},
      {mesh + "file = 3", "scene.toml:3:8: 'file' must be a string, not an integer"},
      {mesh + "file = \"absent.obj\"",
       "scene.toml:3:8: there is no file absent.obj; give the path of a mesh (*.obj, *.gltf, *.glb) from the scene "
       "file's folder"},
      {mesh + "file = \"\"", "scene.toml:3:8: there is no file named ''; give the path of a mesh "},
      {mesh + "file = \"folder.obj\"",
       "scene.toml:3:8: folder.obj is a folder; give the path of a mesh (*.obj, *.gltf, *.glb) from the scene file's "
       "folder"},
  };
  for (const Mistake& mistake : mistakes)
    EXPECT_THAT(error(mistake.keys), testing::StartsWith(mistake.error)) << mistake.keys;
}

TEST_F(SceneSurfaces, MistakesInObjFiles) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::string no_vertex = ": 3 stand above this line, counted from 1, or from −1 back";
  const Mistake mistakes[] = {
      {"", "ground.obj: has no line 'f', so no triangle; export the mesh with its faces"},
      {corners, "ground.obj: has no line 'f', so no triangle; export the mesh with its faces"},
      {corners + "f 1 2 4\n", "ground.obj:4: there is no vertex 4" + no_vertex},
      {corners + "f 1 2 0\n", "ground.obj:4: there is no vertex 0" + no_vertex},
      {corners + "f 1 -4 2\n", "ground.obj:4: there is no vertex -4" + no_vertex},
      {"f 1 2 3\n" + corners, "ground.obj:1: there is no vertex 1: 0 stand above this line"},
      {corners + "f 1 2 9223372036854775807\n", "ground.obj:4: there is no vertex 9223372036854775807" + no_vertex},
      {corners + "f 1 2 -9223372036854775808\n", "ground.obj:4: there is no vertex -9223372036854775808" + no_vertex},
      {corners + "f 1 2 99999999999999999999\n",
       "ground.obj:4: the corner '99999999999999999999' begins with no whole number; a polygon is 'f 1 2 3'"},
      {corners + "f 1 2 c\n", "ground.obj:4: the corner 'c' begins with no whole number; a polygon is 'f 1 2 3'"},
      {corners + "f 1 2 /3\n", "ground.obj:4: the corner '/3' begins with no whole number; a polygon is 'f 1 2 3'"},
      {corners + "f 1 2\n", "ground.obj:4: a polygon has at least 3 corners, not 2; remove the line"},
      {corners + "f\n", "ground.obj:4: a polygon has at least 3 corners, not 0; remove the line"},
      {"v 0 0\n", "ground.obj:1: a vertex is 'v x y z', three numbers; '' does not fit a float"},
      {"v 0 0 up\n", "ground.obj:1: a vertex is 'v x y z', three numbers; 'up' does not fit a float"},
      {"v 0 0 1e99\n", "ground.obj:1: a vertex is 'v x y z', three numbers; '1e99' does not fit a float"},
      {"\r\nv 0 0 0,5\r\n", "ground.obj:2: a vertex is 'v x y z', three numbers; '0,5' does not fit a float"},
      {"v 0 0 nan\n", "ground.obj:1: the vertex is not finite; export the mesh again"},
      {"v 0 0 -inf\n", "ground.obj:1: the vertex is not finite; export the mesh again"},
      {corners + "f 1 1 2\n", "scene.toml:1:1: [shapes.ground]: fathom::mesh: "},
  };
  for (const Mistake& mistake : mistakes) {
    write("ground.obj", mistake.keys);
    EXPECT_THAT(error("type = \"mesh\"\nfile = \"ground.obj\""), testing::StartsWith(mistake.error)) << mistake.keys;
  }
}

TEST_F(SceneSurfaces, MistakesOfHeightFields) {
  const std::string field = "type = \"height_field\"\n", cells = field + "cell = 1\n";
  const std::string two = cells + "columns = 2\nrows = 2\n", flat = two + "heights = [0, 0, 0, 0]\n";
  write("ground.pgm", "P5\n2 2\n255\n1234");
  const Mistake mistakes[] = {
      {field,
       "scene.toml:1:1: [shapes.ground] needs one of 'heights' (a list, m), 'file' (*.pgm), 'waves' and "
       "'hills': where its heights come from"},
      {flat + "file = \"ground.pgm\"",
       "scene.toml:7:8: [shapes.ground] has both 'heights' and 'file'; remove one of them"},
      {two + "waves = {height = 1, length = 4}\nhills = {height = 1, length = 4}",
       "scene.toml:7:9: [shapes.ground] has both 'waves' and 'hills'; remove one of them"},
      {flat + "scale = 2", "scene.toml:7:9: 'scale' does not go with 'heights'; remove one of them"},
      {two + "hills = {height = 1, length = 4}\noffset = 2",
       "scene.toml:7:10: 'offset' does not go with 'hills'; remove one of them"},
      {cells + "file = \"ground.pgm\"\nscale = 1\nrows = 2",
       "scene.toml:6:8: 'rows' does not go with 'file'; remove one of them"},
      {flat + "vertices = []", "scene.toml:7:1: unknown key 'vertices' in [shapes.ground]; known: type, columns, "},
      {field + "heights = [0]",
       "scene.toml:1:1: [shapes.ground] needs 'cell': m between heights, one number, or [x, y]"},
      {field + "cell = 0\nheights = [0]", "scene.toml:3:8: 'cell' must be greater than 0"},
      {field + "cell = [1, -1]\nheights = [0]", "scene.toml:3:8: 'cell' must be greater than 0"},
      {field + "cell = [1, 1, 1]\nheights = [0]", "scene.toml:3:8: 'cell' must have 2 numbers, not 3"},
      {field + "cell = nan\nheights = [0]", "scene.toml:3:8: 'cell' must be finite"},
      {cells + "heights = [0]", "scene.toml:1:1: [shapes.ground] needs 'columns': how many heights there are along x"},
      {cells + "columns = 2\nheights = [0]",
       "scene.toml:1:1: [shapes.ground] needs 'rows': how many heights there are along y"},
      {cells + "columns = 1\nrows = 2\nheights = [0, 0]",
       "scene.toml:4:11: 'columns' must be between 2 and 1048576, not 1"},
      {cells + "columns = 2\nrows = 2000000\nheights = [0, 0]",
       "scene.toml:5:8: 'rows' must be between 2 and 1048576, not 2000000"},
      {cells + "columns = 10000\nrows = 10000\nwaves = {height = 1, length = 4}",
       "scene.toml:1:1: 'columns' × 'rows' are 100000000 heights; at most 67108864 are possible"},
      {two + "heights = [0, 0, 0]", "scene.toml:6:11: 'heights' must have 4 numbers, not 3"},
      {two + "heights = [0, 0, 0, inf]", "scene.toml:6:21: 'heights' must be finite"},
      {two + "heights = [0, 0, 0, 1e7]", "scene.toml:1:1: [shapes.ground]: fathom::height_field: height (1, 1) is "},
      {field + "cell = 1e7\ncolumns = 2\nrows = 2\nheights = [0, 0, 0, 0]",
       "scene.toml:1:1: [shapes.ground]: fathom::height_field: cell_x is "},
      {flat + "holes = [[1, 0]]", "scene.toml:7:10: there is no such cell in 'holes': they go from 0 to 0"},
      {flat + "holes = [0, 0]", "scene.toml:7:10: 'holes' must be an array, not an integer"},
      {flat + "cell_materials = []", "scene.toml:7:18: 'cell_materials' needs a list of 'materials'"},
      {flat + "materials = [{}]",
       "scene.toml:1:1: [shapes.ground] needs 'cell_materials': arrays [i, j, number] of cells and numbers of "
       "'materials'"},
      {flat + "materials = []", "scene.toml:7:13: 'materials' is empty; list some, or leave it out"},
      {flat + "materials = [3]", "scene.toml:7:14: 'materials' is a list of tables and names of [materials]"},
      {flat + "materials = [\"ice\"]",
       "scene.toml:7:14: there is no [materials.ice]; write one, or the material itself as a table"},
      {flat + "materials = [{}]\ncell_materials = [[0, 0, 1]]",
       "scene.toml:8:19: there is no such material in 'cell_materials': 'materials' has 1, counted from 0"},
      {flat + "materials = [{}]\ncell_materials = [[1, 0, 0]]",
       "scene.toml:8:19: there is no such cell in 'cell_materials': they go from 0 to 0"},
      {flat + "materials = [{}]\ncell_materials = [[0, 0]]",
       "scene.toml:8:19: 'cell_materials' has arrays [i, j, number] for a cell, or [i, j, k, l, number] for those from "
       "(i, j) to (k, l)"},
      {two + "waves = 3", "scene.toml:6:9: 'waves' must be a table, not an integer"},
      {two + "waves = {length = 4}",
       "scene.toml:6:9: waves needs 'height': from the lowest to the highest that there may be (m)"},
      {two + "hills = {height = 1}", "scene.toml:6:9: hills needs 'length': width of the largest (m)"},
      {two + "hills = {height = 1, length = 1.5}",
       "scene.toml:6:31: 'length' must be at least two cells, or the ground cannot show it"},
      {two + "waves = {height = 1, length = 4, roughness = 1}",
       "scene.toml:6:34: unknown key 'roughness' in waves; known: height, length, seed"},
      {two + "hills = {height = 1, length = 4, roughness = 2}", "scene.toml:6:46: 'roughness' must be between 0 and 1"},
      {two + "hills = {height = 1, length = 4, seed = -1}", "scene.toml:6:41: 'seed' must be between 0 and "},
      {cells + "file = \"ground.pgm\"",
       "scene.toml:1:1: [shapes.ground] needs 'scale': height of white above black (m)"},
      {cells + "scale = 1\nfile = \"absent.pgm\"",
       "scene.toml:5:8: there is no file absent.pgm; give the path of a grey picture (*.pgm) from the scene file's "
       "folder"},
  };
  for (const Mistake& mistake : mistakes)
    EXPECT_THAT(error(mistake.keys), testing::StartsWith(mistake.error)) << mistake.keys;
}

TEST_F(SceneSurfaces, MistakesInPictures) {
  const std::string head =
      "ground.pgm: has a head that makes no sense; it is 'P5', width, height and the value of "
      "white, at most 65535";
  const std::string kind = "ground.pgm: is not a binary grey picture; save it as PGM (P5) with 8 or 16 bits per pixel";
  const Mistake mistakes[] = {
      {"", kind},
      {"P2\n2 2\n255\n1 2 3 4\n", kind},
      {"P6\n2 2\n255\n", kind},
      {"\x89PNG\r\n", kind},
      {"P5", head},
      {"P5\n2 2\n255", head},
      {"P5\n0 2\n255\n", head},
      {"P5\n2 -2\n255\n", head},
      {"P5\n2 2\n65536\n", head},
      {"P5\n2 2\n0\n1234", head},
      {"P5\n99999999999999999999 2\n255\n", head},
      {"P5 # without an end", head},
      {"P5\n60000000 60000000\n255\n", "ground.pgm: has 3600000000000000 pixels; 67108864 are the most, so reduce it"},
      {"P5\n2 2\n255\n123", "ground.pgm: is cut off: it holds 3 of its 4 pixels; copy it again"},
      {"P5\n2 2\n256\n1234567", "ground.pgm: is cut off: it holds 3 of its 4 pixels; copy it again"},
      {"P5\n1 4\n255\n1234", "scene.toml:1:1: [shapes.ground]: fathom::height_field: it has 1 × 4 samples; at least "},
  };
  for (const Mistake& mistake : mistakes) {
    write("ground.pgm", mistake.keys);
    EXPECT_THAT(error(pictured), testing::StartsWith(mistake.error)) << mistake.keys;
  }
}

TEST(SceneSurface, MovesByItselfNowhere) {
  std::string text = scene_with(pyramid_inline);
  text.replace(text.find("static"), 6, "dynamic");
  EXPECT_EQ(error_of(text),
            "scene.toml:6:1: a mesh or height field cannot be dynamic; make the body fixed or kinematic, or its shape "
            "of hulls");
  text.replace(text.find("dynamic"), 7, "kinematic");
  EXPECT_EQ(parse_scene(text, "scene.toml").bodies[0].motion, MotionType::kinematic);
}

// Anything at all -----------------------------------------------------------------------------------------------

/// Truncated somewhere, or with some bytes changed.
std::string altered(std::string text, Random& random) {
  if (random.bits() % 3 == 0) text.resize(random.bits() % (text.size() + 1));
  for (std::uint64_t edits = random.bits() % 6; edits > 0 && !text.empty(); --edits) {
    constexpr std::string_view likely = "0123456789-.e/ \n#vf[]{}=,\"\0\xff";
    const std::uint64_t which = random.bits();
    text[random.bits() % text.size()] =
        which % 4 == 0 ? static_cast<char>(which >> 8) : likely[(which >> 8) % likely.size()];
  }
  return text;
}

/// How many of them could be read; any other outcome is an `Error`.
template <class Parse>
int read_of(int count, const std::string& sound, const Parse& parse) {
  Random random(7);
  int read = 0;
  for (int i = 0; i < count; ++i) {
    const std::string text = altered(sound, random);
    try {
      parse(text);
      ++read;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::file) << text;
      EXPECT_STRNE(error.what(), "");
    }
  }
  return read;
}

TEST_F(SceneSurfaces, WhateverIsInAFileIsReadOrRefused) {
  constexpr int count = 4000;
  const int meshes = read_of(count, pyramid_obj, [](const std::string& text) {
    const FileTriangles read = parse_obj(text, "ground.obj");
    for (const std::uint32_t index : read.indices) ASSERT_LT(index, read.vertices.size());
  });
  EXPECT_GT(meshes, count / 20);
  EXPECT_LT(meshes, count * 19 / 20);
  const std::string glb = square_glb(R"([{"mesh":0,"translation":[0,1,0],"children":[1]},{"mesh":0}])");
  read_of(count, glb, [](const std::string& text) {
    const FileTriangles read = parse_gltf(text, "ground.glb");
    for (const std::uint32_t index : read.indices) ASSERT_LT(index, read.vertices.size());
  });
  for (const char* white : {"255", "65535"}) {
    const std::string sound = "P5\n# grey\n4 3\n" + std::string(white) + "\n" + std::string(24, 'g');
    const int pictures = read_of(count, sound, [](const std::string& text) {
      const GreyPicture read = parse_pgm(text, "ground.pgm", 1 << 20);
      ASSERT_EQ(read.pixels.size(), std::size_t{read.width} * read.height);
    });
    EXPECT_GT(pictures, count / 20);
    EXPECT_LT(pictures, count * 19 / 20);
  }
  write("pyramid.obj", pyramid_obj);
  write("ground.pgm", "P5\n2 2\n255\n1234");
  const std::string scenes[] = {
      scene_with(pyramid_inline),
      scene_with("type = \"mesh\"\nfile = \"pyramid.obj\"\nscale = 2"),
      scene_with(std::string(pictured) + "offset = -1\nholes = [[0, 0]]"),
      scene_with(std::string(three_by_two) + "heights = [0, 1, 2, 3, 4, 5]\nholes = [[0, 0], [1, 0]]"),
      scene_with(std::string(three_by_two) + "waves = {height = 1, length = 8, seed = 3}"),
      scene_with(std::string(three_by_two) + "hills = {height = 1, length = 8, roughness = 0.4, seed = 3}")};
  for (const std::string& scene : scenes) {
    const int read =
        read_of(count / 10, scene, [&](const std::string& text) { parse_scene(text, folder_ / "scene.toml"); });
    EXPECT_GT(read, 5) << scene;
    EXPECT_LT(read, count / 10) << scene;
  }
}

}  // namespace
}  // namespace fathom::scene_surfaces_test
