#include "scene/quality.hpp"

#include <algorithm>
#include <cmath>
#include <fathom/compound.hpp>
#include <fathom/mesh.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "scene/overlaps.hpp"

namespace fathom {
namespace {

constexpr double below_ground_margin = 0.5;  // m

bool is_finite(const Pose& pose, const Velocity& velocity) {
  return fathom::is_finite(pose) && fathom::is_finite(velocity.linear) && fathom::is_finite(velocity.angular);
}

float extent(const Surface& surface, Vec3 direction) {
  float farthest = -std::numeric_limits<float>::infinity();
  for (std::uint32_t i = 0; i < surface.triangle_count(); ++i)
    if (surface.has(i))
      for (const Vec3 corner : surface.triangle(i).corners) farthest = max(farthest, dot(corner, direction));
  return farthest;
}

/// Extent of the shape from its centre along the unit direction, in body axes.
float extent(const Shape& shape, Vec3 direction);

float extent(const Compound& compound, Vec3 direction) {
  float farthest = 0;
  for (const ChildShape& child : compound.children())
    farthest = max(farthest, dot(child.pose.position, direction) +
                                 extent(child.shape, inverse_rotate(child.pose.rotation, direction)));
  return farthest;
}

float extent(const Shape& shape, Vec3 direction) {
  switch (shape.type) {
    case ShapeType::sphere:
      return shape.radius;
    case ShapeType::capsule:
      return shape.radius + shape.half_extents.z * abs(direction.z);
    case ShapeType::box:
      return dot(shape.half_extents, abs(direction));
    case ShapeType::mesh:
    case ShapeType::height_field:
      return extent(*shape.surface, direction);
    case ShapeType::compound:
      return extent(*shape.compound, direction);
    case ShapeType::hull:
      break;
  }
  float farthest = 0;
  for (const Vec3 vertex : shape.hull->vertices()) farthest = max(farthest, dot(vertex, direction));
  return farthest + shape.radius;
}

double kinetic_energy(const BodyDef& body, const Pose& pose, const Velocity& velocity) {
  const float mass = body.mass ? *body.mass : body.density * volume(body.shape);
  const SymMat3 inertia = body.inertia ? *body.inertia : mass_properties(body.shape, mass).inertia;
  const Vec3 spin = inverse_rotate(pose.rotation, velocity.angular);
  return 0.5 * static_cast<double>(mass * length_squared(velocity.linear) + dot(spin, inertia * spin));
}

/// How far `value` is beyond what the axis allows.
float excess(const JointAxis& axis, float value) {
  if (axis.mode == AxisMode::free) return 0;
  return axis.mode == AxisMode::locked ? value : max(axis.lower - value, max(value - axis.upper, 0.0f));
}

double widest_gap(const Scene& scene, std::span<const Pose> poses) {
  float widest = 0;
  for (const SceneJoint& joint : scene.joints) {
    const float gap = joint_gap(scene, joint, poses);
    if (joint.def.hertz == 0 && fathom::is_finite(Vec3{gap, 0, 0})) widest = max(widest, gap);
  }
  return static_cast<double>(widest);
}

void measure_against_ground(Quality& quality, double depth) {
  quality.ground_penetration_max = std::max(quality.ground_penetration_max, depth);
  if (depth > below_ground_margin) ++quality.bodies_below_ground;
}

double height(const Pose& pose) { return static_cast<double>(pose.position.z); }

}  // namespace

float joint_gap(const Scene& scene, const SceneJoint& joint, std::span<const Pose> poses) {
  const JointDef& def = joint.def;
  const Vec3 gap = transform(poses[joint.b], def.frame_b.position) - transform(poses[joint.a], def.frame_a.position);
  if (def.type == JointType::ball) return length(gap);
  if (def.type == JointType::distance) return excess(def.axis(JointAxisName::x), length(gap));
  const bool in_b = scene.bodies[joint.b].motion != MotionType::dynamic;
  const Quat frame = poses[in_b ? joint.b : joint.a].rotation * (in_b ? def.frame_b : def.frame_a).rotation;
  const Vec3 along = inverse_rotate(normalize(frame), gap);
  return length(Vec3{excess(def.axes[0], along.x), excess(def.axes[1], along.y), excess(def.axes[2], along.z)});
}

float lowest_point(const Shape& shape, const Pose& pose) {
  const Vec3 down = inverse_rotate(pose.rotation, {0, 0, -1});
  return pose.position.z - extent(shape, down);
}

Quality measure_quality(const Scene& scene, std::span<const Pose> poses, std::span<const Velocity> velocities) {
  Quality quality;
  std::optional<std::size_t> top;
  double energy = 0;
  std::size_t measured = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyDef& body = scene.bodies[i];
    if (body.motion != MotionType::dynamic) continue;
    if (!is_finite(poses[i], velocities[i])) {
      ++quality.non_finite;
      continue;
    }
    ++measured;
    const double moved = static_cast<double>(distance(poses[i].position, body.pose.position));
    quality.displacement_max = std::max(quality.displacement_max, moved);
    if (scene.container && !contains(*scene.container, {poses[i].position, poses[i].position})) ++quality.escaped;
    energy += kinetic_energy(body, poses[i], velocities[i]);
    if (scene.ground_height) {
      measure_against_ground(quality, static_cast<double>(*scene.ground_height - lowest_point(body.shape, poses[i])));
    }
    if (!top || height(body.pose) > height(scene.bodies[*top].pose)) top = i;
  }
  if (measured > 0) quality.kinetic_energy_per_body = energy / static_cast<double>(measured);
  if (top) quality.top_drop = height(scene.bodies[*top].pose) - height(poses[*top]);
  quality.overlap_max = deepest_overlap(scene, poses);
  quality.joint_gap_max = widest_gap(scene, poses);
  return quality;
}

Quality measure_quality(const Scene& scene, const SceneInstance& instance, const World& world) {
  std::vector<Pose> poses;
  std::vector<Velocity> velocities;
  poses.reserve(instance.ids().size());
  velocities.reserve(instance.ids().size());
  for (const BodyId id : instance.ids()) {
    poses.push_back(world.pose(id));
    velocities.push_back(world.velocity(id));
  }
  return measure_quality(scene, poses, velocities);
}

}  // namespace fathom
