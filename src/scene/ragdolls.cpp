// Environments of ragdolls, after Box3D's `rain`: 14 capsules held by 9 cone-limited ball joints and 4 hinges, three
// ragdolls per cell of 15 m, on flat ground or on its meshes. Differences from Box3D: all ragdolls fall at once with
// random orientations, where it adds 30 at a time and removes old ones; dimensions are round numbers; ball joints have
// no springs, hinges only friction; balls have no rolling resistance.
#include <algorithm>
#include <array>
#include <cmath>
#include <fathom/mesh.hpp>

#include "scene/environments.hpp"
#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

constexpr std::uint64_t seed = 20260812;
constexpr double cell_side = 15;     // m
constexpr std::int64_t in_cell = 3;  // ragdolls
constexpr double lowest_drop = 20;   // m, height of a cell's first ragdoll above the ground
constexpr float hinge_friction = 5;  // N·m
constexpr float degree = pi / 180;
constexpr Vec3 up{0, 0, 1}, down{0, 0, -1}, left{0, 1, 0};

/// A capsule of a ragdoll that stands at the origin and looks along x, and the joint to its parent.
struct Bone {
  std::size_t parent;  ///< an earlier bone; the first has none
  Vec3 from, to;       ///< m, ends of its axis
  float radius;        ///< m
  Vec3 joint;          ///< m
  Vec3 axis;           ///< twist axis, or the hinge's axis
  float cone;          ///< degrees; 0: a hinge
  float lower, upper;  ///< degrees, of the twist or the hinge
};

constexpr std::array<Bone, 14> bones{{
    {0, {0, -0.07f, 0.95f}, {0, 0.07f, 0.95f}, 0.12f, {}, {}, 0, 0, 0},                         // pelvis
    {0, {0, -0.06f, 1.12f}, {0, 0.06f, 1.12f}, 0.11f, {0, 0, 1.04f}, up, 25, -15, 15},          // lower spine
    {1, {0, -0.07f, 1.25f}, {0, 0.07f, 1.25f}, 0.10f, {0, 0, 1.185f}, up, 25, -15, 15},         // middle spine
    {2, {0, -0.10f, 1.42f}, {0, 0.10f, 1.42f}, 0.13f, {0, 0, 1.33f}, up, 15, -10, 10},          // chest
    {3, {0, 0, 1.58f}, {0, 0, 1.63f}, 0.06f, {0, 0, 1.54f}, up, 45, -15, 15},                   // neck
    {4, {0, 0, 1.76f}, {0, 0, 1.80f}, 0.095f, {0, 0, 1.67f}, up, 15, -15, 15},                  // head
    {0, {0, 0.10f, 0.86f}, {0, 0.10f, 0.54f}, 0.08f, {0, 0.10f, 0.90f}, left, 10, -60, 40},     // left thigh
    {6, {0, 0.10f, 0.44f}, {0, 0.10f, 0.12f}, 0.06f, {0, 0.10f, 0.49f}, left, 0, -5, 45},       // left shin
    {0, {0, -0.10f, 0.86f}, {0, -0.10f, 0.54f}, 0.08f, {0, -0.10f, 0.90f}, left, 10, -60, 40},  // right thigh
    {8, {0, -0.10f, 0.44f}, {0, -0.10f, 0.12f}, 0.06f, {0, -0.10f, 0.49f}, left, 0, -5, 45},    // right shin
    {3, {0, 0.29f, 1.46f}, {0, 0.29f, 1.22f}, 0.05f, {0, 0.27f, 1.50f}, down, 60, -5, 5},       // left upper arm
    {10, {0, 0.29f, 1.12f}, {0, 0.29f, 0.86f}, 0.045f, {0, 0.29f, 1.17f}, left, 0, -60, 5},     // left forearm
    {3, {0, -0.29f, 1.46f}, {0, -0.29f, 1.22f}, 0.05f, {0, -0.27f, 1.50f}, down, 60, -5, 5},    // right upper arm
    {12, {0, -0.29f, 1.12f}, {0, -0.29f, 0.86f}, 0.045f, {0, -0.29f, 1.17f}, left, 0, -60, 5},  // right forearm
}};
constexpr auto bones_each = static_cast<std::int64_t>(bones.size());
constexpr Vec3 middle{0, 0, 1};  // m, centre of rotation of ragdolls

/// Moves a point of the ragdoll at the origin to the ragdoll's pose.
Vec3 placed(const Pose& at, Vec3 point) { return transform(at, point - middle); }

BodyDef body_of(const Bone& bone, const Pose& at) {
  const Vec3 axis = bone.to - bone.from;
  const float length_of_axis = length(axis);
  BodyDef body;
  body.shape = capsule(bone.radius, 0.5f * length_of_axis);
  body.material = {.friction = 0.6f, .restitution = 0};
  body.pose.position = placed(at, 0.5f * (bone.from + bone.to));
  // A capsule's axis is its z. Axes of bones are horizontal or vertical.
  const float half = 0.70710678f;
  const Quat along = axis.y != 0 ? Quat{half, -half, 0, 0} : Quat{};
  body.pose.rotation = normalize(at.rotation * along);
  return body;
}

SceneJoint joint_of(const Bone& bone, std::size_t parent, std::size_t child, const Pose& at, const Scene& scene) {
  SceneJoint joint{parent, child, generic_joint({}, {}, {}, {})};
  for (const auto axis : {JointAxisName::x, JointAxisName::y, JointAxisName::z})
    joint.def.axis(axis).mode = AxisMode::locked;
  JointAxis& twist = joint.def.axis(JointAxisName::twist);
  twist.limit(degree * bone.lower, degree * bone.upper);
  if (bone.cone > 0) {
    joint.def.cone_angle = degree * bone.cone;
  } else {
    twist.friction(hinge_friction);
    joint.def.axis(JointAxisName::swing_y).mode = joint.def.axis(JointAxisName::swing_z).mode = AxisMode::locked;
  }
  joint.anchor_at(placed(at, bone.joint), scene.bodies);
  joint.turn_to(at.rotation * joint_frame({}, bone.axis).rotation, scene.bodies);
  return joint;
}

/// Adds a ragdoll with the first `count` bones.
void add_ragdoll(Scene& scene, const Pose& at, std::int64_t count) {
  const std::size_t first = scene.bodies.size();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const Bone& bone = bones[i];
    scene.bodies.push_back(body_of(bone, at));
    if (i > 0) scene.joints.push_back(joint_of(bone, first + bone.parent, first + i, at, scene));
  }
}

/// Cells of a square about the origin.
struct Cells {
  std::int64_t count = 0, across = 0;

  explicit Cells(std::int64_t bodies) {
    constexpr std::int64_t each = in_cell * bones_each;
    count = (bodies + each - 1) / each;
    while (across * across < count) ++across;
  }
  double side() const { return cell_side * static_cast<double>(across); }
  Vec3 middle_of(std::int64_t cell) const {
    const double first = -0.5 * cell_side * static_cast<double>(across - 1);
    return {static_cast<float>(first + cell_side * static_cast<double>(cell % across)),
            static_cast<float>(first + cell_side * static_cast<double>(cell / across)), 0};
  }
};

void add_ragdolls(Scene& scene, const Cells& cells, std::int64_t bodies, float ground) {
  Random random(seed);
  for (std::int64_t i = 0; i * bones_each < bodies; ++i) {
    const auto index = static_cast<double>(i % in_cell);
    Pose at;
    // Side by side, so that they meet on the ground, half of a cell's beside the middle.
    at.position = cells.middle_of(i / in_cell) +
                  Vec3{static_cast<float>(1 + 1.5 * index), 0, ground + static_cast<float>(lowest_drop + 2.5 * index)};
    at.rotation = random_rotation(random);
    add_ragdoll(scene, at, std::min(bones_each, bodies - i * bones_each));
  }
}

/// A horizontal square of 8 × 8 cells about the origin.
Shape square_mesh() {
  constexpr std::uint32_t cells = 8;
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      vertices.push_back({static_cast<float>(cell_side * (static_cast<double>(i) / cells - 0.5)),
                          static_cast<float>(cell_side * (static_cast<double>(j) / cells - 0.5)), 0});
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = j * (cells + 1) + i, b = a + 1, d = a + cells + 1, c = d + 1;
      indices.insert(indices.end(), {a, b, c, a, c, d});
    }
  return mesh(vertices, indices);
}

/// A torus about z of 16 × 16 cells, 512 triangles.
Shape torus_mesh() {
  constexpr std::uint32_t around = 16;
  constexpr double radius = 0.25 * cell_side, thickness = 1;
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j < around; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const Direction ring(static_cast<double>(j) / around), tube(static_cast<double>(i) / around);
      const double out = radius + thickness * tube.x;
      vertices.push_back(
          {static_cast<float>(out * ring.x), static_cast<float>(out * ring.y), static_cast<float>(thickness * tube.y)});
      const std::uint32_t next_j = (j + 1) % around, next_i = (i + 1) % around;
      const std::uint32_t a = j * around + i, b = next_j * around + i;
      const std::uint32_t c = next_j * around + next_i, d = j * around + next_i;
      indices.insert(indices.end(), {a, b, c, a, c, d});
    }
  return mesh(vertices, indices);
}

}  // namespace

Scene ragdolls(std::int64_t bodies) {
  check_size("ragdolls", "bodies", bodies, max_environment_bodies - 1);
  const Cells cells(bodies);
  Scene scene = scene_with_ground("ragdolls", bodies, cells.side());
  scene.world.gravity = {0, 0, -10};
  scene.bodies[0].material.friction = 0.6f;
  add_ragdolls(scene, cells, bodies, *scene.ground_height);
  return scene;
}

Scene rain(std::int64_t bodies) {
  check_size("rain", "bodies", bodies, max_environment_bodies / 2);
  const Cells cells(bodies);
  Cells ground = cells;
  ground.across += 2;  // catches bodies that tumble over the outer cells' edges
  Scene scene = empty_scene("rain", bodies + 2 * ground.across * ground.across);
  scene.world.gravity = {0, 0, -10};
  BodyDef body;
  body.motion = MotionType::fixed;
  body.material.friction = 0.6f;
  const Shape parts[] = {square_mesh(), torus_mesh()};
  for (std::int64_t i = 0; i < ground.across * ground.across; ++i)
    for (const Shape& part : parts) {
      body.shape = part;
      body.pose.position = ground.middle_of(i);
      scene.bodies.push_back(body);
    }
  add_ragdolls(scene, cells, bodies, 0);
  scene.ground_height = 0.0f;
  return scene;
}

}  // namespace fathom
