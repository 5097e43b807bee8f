#include <cstdio>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <fathom/world.hpp>
#include <vector>

using namespace fathom;

int main() {
  World world;

  // A valley of two slopes: four triangles of a mesh, solid below. Meshes are for fixed and kinematic bodies.
  const std::vector<Vec3> vertices{{-10, -10, 4}, {0, -10, 0}, {10, -10, 4}, {-10, 10, 4}, {0, 10, 0}, {10, 10, 4}};
  const std::vector<std::uint32_t> indices{0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
  world.add({.motion = MotionType::fixed, .shape = mesh(vertices, indices)});

  const Material rubber{.friction = 0.9f, .restitution = 0.5f, .rolling_resistance = 0.02f};
  const std::vector<Vec3> tetrahedron{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Shape dumbbell = compound(std::vector<ChildShape>{
      {.shape = sphere(0.4f), .pose = {.position = {0, 0, -0.6f}}},
      {.shape = capsule(0.1f, 0.6f)},
      {.shape = sphere(0.4f), .pose = {.position = {0, 0, 0.6f}}},
  });

  const std::vector<BodyId> bodies = world.add_bodies(std::vector<BodyDef>{
      {.pose = {.position = {-6, -6, 6}}, .shape = sphere(0.5f), .material = rubber},
      {.pose = {.position = {-6, -3, 6}}, .shape = capsule(0.3f, 0.5f), .density = 500},
      {.pose = {.position = {-6, 0, 6}}, .shape = box({0.5f, 0.4f, 0.3f}), .mass = 20.0f},
      {.pose = {.position = {-6, 3, 6}}, .shape = hull(tetrahedron)},
      {.pose = {.position = {-6, 6, 6}}, .shape = dumbbell, .mass = 15.0f},
  });

  for (int i = 0; i < 1200; ++i) world.step();
  for (const BodyId id : bodies) std::printf("%7.1f kg %s\n", world.mass(id), world.is_awake(id) ? "moves" : "sleeps");
}
