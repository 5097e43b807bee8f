// Meshes and height fields in snapshots: worlds continue bit for bit, and damaged ones give one error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "test_surfaces.hpp"
#include "world/shape_archive.hpp"
#include "world_fixture.hpp"

namespace fathom::test::surface_archive_test {
namespace {

using testing::HasSubstr;

World heap_on(const std::vector<BodyDef>& grounds, int threads) {
  WorldDef def = sleepy_world();
  def.threads = threads;
  World world(def);
  for (const BodyDef& ground : grounds) world.add(ground);
  for (const BodyDef& body : mixed_bodies(60)) world.add(body);
  return world;
}

TEST(SurfaceArchive, WorldsContinueBitForBit) {
  BodyDef lift = fixed(wavy_mesh(8, 1), {0, 0, -0.5f});
  lift.motion = MotionType::kinematic;
  lift.velocity.linear = {0, 0, 0.2f};
  lift.velocity.angular = {0, 0, 0.3f};
  const Shape rough = wavy_mesh();
  const std::vector<BodyDef> grounds[] = {{fixed(rough), lift},
                                          {fixed(wavy_field(21, 5, {150, 151, 400}), {-5, -5, 0})},
                                          {fixed(rough), fixed(rough, {10, 0, 0}), fixed(wavy_field(), {-5, 5, 0})}};
  for (const std::vector<BodyDef>& ground : grounds)
    for (const int threads : {1, 3})
      for (const int before : {0, 45, 200}) {
        World whole = heap_on(ground, threads);
        run(whole, before);
        World copy;
        copy.restore(saved(whole));
        ASSERT_EQ(copy.state_hash(), whole.state_hash());
        for (int step = 0; step < 90; ++step) {
          whole.step();
          copy.step();
          ASSERT_EQ(copy.state_hash(), whole.state_hash()) << before << " + " << step << ", " << threads << " threads";
          ASSERT_EQ(copy.contacts_begun().size(), whole.contacts_begun().size());
        }
      }
}

TEST(SurfaceArchive, SharedSurfacesAreWrittenOnce) {
  const Shape rough = wavy_mesh(30);
  const auto size_with = [&](int bodies) {
    World world;
    for (int i = 0; i < bodies; ++i) world.add(fixed(rough, {static_cast<float>(20 * i), 0, 0}));
    return saved(world).size();
  };
  EXPECT_GT(size_with(1), rough.surface->memory_bytes() / 2);
  EXPECT_LT(size_with(5) - size_with(1), 4000u);
  World world, copy;
  world.add(fixed(rough)), world.add(fixed(rough));
  copy.restore(saved(world));
  const auto ids = copy.bodies();
  EXPECT_EQ(copy.shape(ids[0]).surface, copy.shape(ids[1]).surface);
}

/// Two triangles of different materials.
Shape two_materials() {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  const std::vector<Material> materials{{.friction = 0.1f}, {.restitution = 0.5f, .surface_velocity = {1, 2, 3}}};
  const std::vector<std::uint8_t> numbers{1, 0};
  return mesh(corners, indices, {materials, numbers});
}

std::vector<std::byte> written(std::initializer_list<Shape> shapes) {
  std::vector<std::byte> bytes;
  ByteWriter out(bytes);
  ShapeWriter writer(out);
  for (const Shape& shape : shapes) writer.write(shape);
  return bytes;
}

/// Reads `count` shapes; returns the error message, or nothing.
std::string refusal(std::span<const std::byte> bytes, int count = 1, std::vector<Shape>* shapes = nullptr) {
  ByteReader in(bytes, "test");
  ShapeReader reader(in);
  try {
    for (int i = 0; i < count; ++i) {
      const Shape shape = reader.read();
      if (shapes) shapes->push_back(shape);
    }
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file);
    return error.what();
  }
  return "";
}

TEST(SurfaceArchive, ComesBackAsItWas) {
  for (const Shape& shape : {wavy_mesh(1), wavy_mesh(), wavy_field(), wavy_field(9, 3, {5, 63}), two_materials()}) {
    std::vector<Shape> read;
    ASSERT_EQ(refusal(written({shape}), 1, &read), "");
    const Surface &was = *shape.surface, &is = *read[0].surface;
    ASSERT_EQ(read[0].type, shape.type);
    ASSERT_EQ(is.triangle_count(), was.triangle_count());
    EXPECT_TRUE(is.bounds().lower == was.bounds().lower && is.bounds().upper == was.bounds().upper);
    for (std::uint32_t t = 0; t < was.triangle_count(); ++t) {
      EXPECT_EQ(is.has(t), was.has(t));
      EXPECT_EQ(is.material_of(t), was.material_of(t));
      const Triangle a = was.triangle(t), b = is.triangle(t);
      for (int k = 0; k < 3; ++k) {
        EXPECT_TRUE(a.corners[k] == b.corners[k]);
        EXPECT_EQ(a.vertices[k], b.vertices[k]);
      }
    }
    ASSERT_EQ(is.materials().size(), was.materials().size());
    for (std::size_t i = 0; i < was.materials().size(); ++i) {
      EXPECT_EQ(is.materials()[i].friction, was.materials()[i].friction);
      EXPECT_EQ(is.materials()[i].restitution, was.materials()[i].restitution);
      EXPECT_TRUE(is.materials()[i].surface_velocity == was.materials()[i].surface_velocity);
    }
    for (const Aabb& box : {Aabb{{-1, -1, -1}, {1, 1, 1}}, Aabb{{0.4f, 2, -9}, {0.5f, 2.1f, 9}}}) {
      std::vector<std::uint32_t> a, b;
      was.find(box, a);
      is.find(box, b);
      EXPECT_EQ(a, b);
    }
  }
}

TEST(SurfaceArchive, EveryTruncationIsRefused) {
  for (const Shape& shape : {wavy_mesh(3), wavy_field(5, 2, {3}), two_materials()}) {
    const std::vector<std::byte> good = written({shape});
    for (std::size_t size = 0; size < good.size(); ++size) EXPECT_NE(refusal(std::span(good).first(size)), "") << size;
  }
}

/// Reads an archived surface with one value changed, `offset` bytes after the end of the shape's header.
template <class T>
std::string refusal_with(const Shape& shape, std::size_t offset, T value) {
  constexpr std::size_t head = sizeof(ShapeType) + sizeof(float) + sizeof(Vec3) + sizeof(std::uint32_t);
  std::vector<std::byte> bytes = written({shape});
  std::memcpy(bytes.data() + head + offset, &value, sizeof value);
  return refusal(bytes);
}

TEST(SurfaceArchive, MeshesThatContradictThemselvesAreRefused) {
  const Shape shape = wavy_mesh(4);  // 25 vertices, 32 triangles: 8 leaves, 15 nodes
  const auto& grid = static_cast<const TriangleMesh&>(*shape.surface);
  ASSERT_EQ(grid.vertices().size(), 25u);
  ASSERT_EQ(grid.triangle_count(), 32u);
  const std::size_t vertices = 8, indices = vertices + 25 * sizeof(Vec3) + 8, nodes = indices + 32 * 3 * 4 + 8;
  constexpr std::size_t next = 12, count = 28, size = sizeof(TriangleMesh::Node);
  EXPECT_EQ(refusal_with(shape, nodes + next, std::uint32_t{8}), "") << "what the second child is";
  const auto contradicts = HasSubstr("contradicts itself");
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -2e6f})
    EXPECT_THAT(refusal_with(shape, vertices, bad), contradicts);
  EXPECT_THAT(refusal_with(shape, indices, std::uint32_t{25}), contradicts);
  EXPECT_THAT(refusal_with(shape, indices, grid.indices()[1]), contradicts) << "a triangle without area";
  for (const std::uint32_t bad : {0u, 1u, 7u, 9u, 14u, 15u, 0xffffffffu})
    EXPECT_THAT(refusal_with(shape, nodes + next, bad), contradicts) << bad;
  EXPECT_THAT(refusal_with(shape, nodes + count, std::uint32_t{32}), contradicts)
      << "the root is a leaf, and there is more";
  for (const std::uint32_t bad : {0u, 3u, 5u, 0xffffffffu})
    EXPECT_THAT(refusal_with(shape, nodes + 14 * size + count, bad), contradicts) << "the last leaf has " << bad;
  EXPECT_THAT(refusal_with(shape, nodes + 14 * size + next, std::uint32_t{0}), contradicts);
  EXPECT_THAT(refusal_with(shape, 0, std::uint64_t{1} << 62), HasSubstr("ends too early"));
  // Boxes are recomputed.
  std::vector<std::byte> bytes = written({shape});
  std::vector<Shape> read;
  std::memset(bytes.data() + 21 + nodes, 0x7f, sizeof(Vec3));
  EXPECT_EQ(refusal(bytes, 1, &read), "");
  EXPECT_TRUE(read.at(0).surface->bounds().lower == shape.surface->bounds().lower);
}

TEST(SurfaceArchive, TreesThatGoDeepAreRefused) {
  // 66 triangles, each node's first child a leaf except for the second, and vice versa.
  for (const bool to_the_left : {false, true}) {
    constexpr std::uint32_t triangles = 70;
    std::vector<Vec3> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    std::vector<std::uint32_t> indices;
    for (std::uint32_t t = 0; t < triangles; ++t) indices.insert(indices.end(), {0, 1, 2});
    std::vector<TriangleMesh::Node> nodes;
    for (std::uint32_t t = 0; t + 1 < triangles && to_the_left; ++t)
      nodes.push_back({{}, 2 * triangles - 2 - t, {}, 0});
    for (std::uint32_t t = 0; t < triangles; ++t) {
      if (!to_the_left && t + 1 < triangles) nodes.push_back({{}, static_cast<std::uint32_t>(nodes.size()) + 2, {}, 0});
      nodes.push_back({{}, t, {}, 1});
    }
    std::vector<std::byte> bytes;
    ByteWriter out(bytes);
    out(ShapeType::mesh, 0.0f, Vec3{}, std::uint32_t{0}, vertices, indices, nodes, std::uint32_t{0},
        std::vector<std::uint8_t>{});
    EXPECT_EQ(refusal(bytes) == "", !to_the_left) << "a search keeps but one second child";
  }
}

TEST(SurfaceArchive, HeightFieldsThatContradictThemselvesAreRefused) {
  const Shape shape = wavy_field(5, 2, {3});
  const auto contradicts = HasSubstr("contradicts itself");
  for (const std::size_t at : {0u, 4u}) {
    for (const std::uint32_t bad : {0u, 1u, 4u, 6u, 0x80000000u, 0xffffffffu})
      EXPECT_THAT(refusal_with(shape, at, bad), contradicts) << bad;
  }
  for (const float bad : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(), 1e6f})
    for (const std::size_t at : {8u, 12u}) EXPECT_THAT(refusal_with(shape, at, bad), contradicts) << bad;
  for (const float bad : {2e6f, -2e6f, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_THAT(refusal_with(shape, 24 + 24 * 4, bad), contradicts) << bad;
  EXPECT_THAT(refusal_with(shape, 24 + 25 * 4, std::uint64_t{1000}), HasSubstr("ends too early"));
}

TEST(SurfaceArchive, MaterialsThatNoBodyCouldHaveAreRefused) {
  const std::vector<std::byte> good = written({two_materials()});
  // The last material ends the bytes: friction, restitution, two rules, rolling resistance, surface velocity, friction
  // axis, friction along it.
  const std::size_t friction = good.size() - (4 + 4 + 1 + 1 + 4 + 12 + 12 + 4), rule = friction + 8;
  for (const float bad : {-1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    std::vector<std::byte> bytes = good;
    std::memcpy(bytes.data() + friction, &bad, sizeof bad);
    EXPECT_THAT(refusal(bytes), HasSubstr("material: the friction is"));
  }
  std::vector<std::byte> bytes = good;
  bytes[rule] = std::byte{99};
  EXPECT_THAT(refusal(bytes), HasSubstr("friction rule"));
}

TEST(SurfaceArchive, NumbersAndTypesMustFit) {
  const Shape net = wavy_mesh(2), field = wavy_field(3);
  std::vector<std::byte> bytes = written({net, field, net, field});
  std::vector<Shape> read;
  ASSERT_EQ(refusal(bytes, 4, &read), "");
  EXPECT_EQ(read[0].surface, read[2].surface);
  EXPECT_EQ(read[1].surface, read[3].surface);
  const std::size_t last = bytes.size() - 4;
  bytes[last] = std::byte{0};
  EXPECT_THAT(refusal(bytes, 4), HasSubstr("contradicts itself")) << "a height field's number is a mesh's";
  bytes[last] = std::byte{3};
  EXPECT_THAT(refusal(bytes, 4), HasSubstr("contradicts itself"));
  bytes[0] = std::byte{6};
  EXPECT_THAT(refusal(bytes, 1), HasSubstr("contradicts itself"));
}

/// Whatever passes can be queried in every way.
TEST(SurfaceArchive, AlteredBytesAreRefusedOrSound) {
  std::mt19937 random(1);
  int refused = 0, read = 0;
  for (const Shape& shape : {wavy_mesh(6), wavy_field(7, 2, {3, 30}), two_materials()}) {
    const std::vector<std::byte> good = written({shape});
    for (int i = 0; i < 3000; ++i) {
      std::vector<std::byte> bytes = good;
      for (std::size_t edits = random() % 3 + 1; edits > 0; --edits)
        bytes[random() % bytes.size()] = static_cast<std::byte>(random() % 4 == 0 ? random() : random() % 8);
      std::vector<Shape> shapes;
      refused += refusal(bytes, 1, &shapes) != "";
      if (shapes.empty() || !shapes[0].is_surface()) continue;
      ++read;
      const Surface& surface = *shapes[0].surface;
      std::vector<std::uint32_t> found;
      surface.find(surface.bounds(), found);
      EXPECT_LE(found.size(), surface.triangle_count());
      for (const std::uint32_t t : found)
        for (const Vec3 corner : surface.triangle(t).corners)
          EXPECT_TRUE(contains(surface.bounds(), Aabb{corner, corner}));
    }
  }
  EXPECT_GT(refused, 500);
  EXPECT_GT(read, 500);
}

}  // namespace
}  // namespace fathom::test::surface_archive_test
