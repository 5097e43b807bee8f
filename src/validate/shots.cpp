#include "validate/shots.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/chance.hpp"
#include "validate/exact_overlap.hpp"

namespace fathom::validate {
namespace {

/// A crate of 1 m, a plate of 2 cm or of 1 mm, a ball, a capsule or a hull.
Shape free_target(Chance& chance) {
  switch (chance.below(6)) {
    case 0:
      return box({0.5f, 0.5f, 0.5f});
    case 1:
      return box({0.01f, 0.5f, 0.5f});
    case 2:
      return box({0.0005f, 0.5f, 0.5f});
    case 3:
      return sphere(0.3f);
    case 4:
      return capsule(0.1f, 0.4f);
    default:
      break;
  }
  std::vector<Vec3> corners;
  for (int i = 24; i > 0; --i) corners.push_back(0.4f * chance.direction());
  return hull(corners);
}

/// A point in the inner part of the body's bounding box, from its centre in world axes (m).
Vec3 point_of(Chance& chance, const BodyDef& body) {
  const Vec3 half = body.shape.type == ShapeType::box ? body.shape.half_extents : Vec3{0.1f, 0.1f, 0.1f};
  const Vec3 at = chance.vector(0.8);
  return rotate(body.pose.rotation, {half.x * at.x, half.y * at.y, half.z * at.z});
}

/// Extent of the body along the unit vector from its origin (m).
double reach(const BodyDef& body, Vec3 along) {
  const Solid solid(body.shape, body.pose);
  const Vec3d n = to_double(along), origin = to_double(body.pose.position);
  double most = -1e300;
  for (const Vec3d& corner : solid.corners) most = std::max(most, dot(corner - origin, n));
  return most + solid.radius;
}

double bounding_radius(const BodyDef& body) {
  const Solid solid(body.shape, body.pose);
  double most = 0;
  for (const Vec3d& corner : solid.corners) most = std::max(most, length(corner - to_double(body.pose.position)));
  return most + solid.radius;
}

double half_thickness(const BodyDef& body) {
  Chance chance(7);
  double least = 1e300;
  for (int i = 0; i < 200; ++i) {
    const Vec3 n = chance.direction();
    least = std::min(least, 0.5 * (reach(body, n) + reach(body, -n)));
  }
  return least;
}

/// Everything but the bullet's path.
Shot shot_without_aim(Chance& chance) {
  Shot shot;
  shot.dt = 1 / std::vector{30.0f, 60.0f, 120.0f, 240.0f}[static_cast<std::size_t>(chance.below(4))];
  shot.substeps = 2 + chance.below(7);
  shot.target.motion = MotionType::fixed;
  shot.target.shape = chance.shape(chance.log_between(0.005, 10), 0.1);
  shot.target.pose = {chance.vector(3), 0, chance.rotation()};
  shot.target.material.friction = chance.log_float(0.1, 1);
  if (chance.below(3) == 0) shot.target.material.restitution = chance.log_float(0.1, 1);
  shot.bullet.shape = chance.shape(chance.log_between(0.0025, 2), 0.05);
  shot.bullet.pose.rotation = chance.rotation();
  const float speed = chance.log_float(1, 1000);
  shot.bullet.velocity.linear = speed * chance.direction();
  if (chance.below(2) == 0) {
    const double most = std::min(2.5 / wide(shot.dt) * shot.substeps, 300.0);
    shot.bullet.velocity.angular = chance.log_float(1, most) * chance.direction();
  }
  shot.path = wide(speed * shot.dt);
  shot.thinner = std::min(half_thickness(shot.target), half_thickness(shot.bullet));
  return shot;
}

/// Starts the bullet clear of the target, back along its path from `aim` (m, from the target's centre).
void set_start(Shot& shot, Vec3 aim, Chance& chance) {
  const double size = bounding_radius(shot.target) + bounding_radius(shot.bullet) + wide(length(aim));
  const double back = size + shot.path * chance.between(0, 2) + 0.001;
  const Vec3 along = normalize(shot.bullet.velocity.linear);
  shot.bullet.pose.position = shot.target.pose.position + aim - narrow(back) * along;
  shot.steps = static_cast<int>(std::min(3 + 2 * (back + size) / shot.path, 300.0));
}

World world_of(const Shot& shot, const Setup& setup, BodyId& target, BodyId& bullet) {
  WorldDef def = world_def(setup);
  def.gravity = {};
  def.dt = shot.dt;
  def.solver.substeps = shot.substeps;
  World world(def);
  target = world.add(shot.target);
  bullet = world.add(shot.bullet);
  return world;
}

Pose between(const Pose& a, const Pose& b, float part) {
  const Quat p = a.rotation, q = b.rotation;
  const float u = 1 - part, v = dot(p, q) < 0 ? -part : part;
  return {u * a.position + part * b.position, 0,
          normalize(Quat{u * p.w + v * q.w, u * p.x + v * q.x, u * p.y + v * q.y, u * p.z + v * q.z})};
}

/// Whether a bullet's centre has passed from one side of a thin box to the other, not round its edge. The first pose of
/// each pair is the box's.
bool goes_through(const Shape& plate, const std::pair<Pose, Pose>& from, const std::pair<Pose, Pose>& to) {
  const Vec3 half = plate.half_extents;
  if (plate.type != ShapeType::box || half.x > 0.1f * min(half.y, half.z)) return false;
  const auto at = [&](float part) {
    return inverse_transform(between(from.first, to.first, part), between(from.second, to.second, part).position);
  };
  const float side = at(0).x;
  if (!(side * at(1).x < 0)) return false;
  float before = 0, behind = 1;
  while (behind - before > 1e-4f) {
    const float middle = 0.5f * (before + behind);
    (side * at(middle).x > 0 ? before : behind) = middle;
  }
  return std::abs(at(behind).y) < 0.9f * half.y && std::abs(at(behind).z) < 0.9f * half.z;
}

}  // namespace

Shot shot_at(std::uint64_t seed) {
  Chance chance(seed);
  Shot shot = shot_without_aim(chance);
  set_start(shot, narrow(chance.between(-0.6, 0.6) * half_thickness(shot.target)) * chance.direction(), chance);
  return shot;
}

Shot shot_past(std::uint64_t seed) {
  Chance chance(seed);
  Shot shot = shot_without_aim(chance);
  const Vec3 side = normalize(cross(shot.bullet.velocity.linear, chance.direction()));
  const double size = std::max(bounding_radius(shot.target), bounding_radius(shot.bullet));
  shot.clearance = 0.025 + 0.25 * shot.thinner + chance.log_between(0.001, 1) * size;
  set_start(shot, narrow(reach(shot.target, side) + bounding_radius(shot.bullet) + shot.clearance) * side, chance);
  return shot;
}

Shot shot_at_free(std::uint64_t seed) {
  Chance chance(seed);
  Shot shot = shot_without_aim(chance);
  shot.target.motion = MotionType::dynamic;
  shot.target.shape = free_target(chance);
  shot.target.mass = chance.log_float(0.1, 10);
  shot.bullet.bullet = true;
  shot.bullet.mass = *shot.target.mass * chance.log_float(0.01, 100);
  shot.bullet.shape = chance.shape(chance.log_between(0.005, 0.1), 0.2);
  const Vec3 along = normalize(shot.bullet.velocity.linear);
  const float speed = chance.log_float(20, 1000);
  if (chance.below(2) == 0) shot.target.velocity = {chance.vector(5), 0, chance.vector(5), 0};
  shot.path = wide(speed * shot.dt);
  shot.thinner = std::min(half_thickness(shot.target), half_thickness(shot.bullet));
  shot.bullet.velocity.linear = speed * along;
  set_start(shot, point_of(chance, shot.target), chance);
  // Aimed in the frame of the target, and moves along with it.
  shot.bullet.velocity.linear += shot.target.velocity.linear;
  return shot;
}

double too_deep(const Shot& shot, const Setup& setup) {
  BodyId target, bullet;
  World world = world_of(shot, setup, target, bullet);
  const double allowed = std::min(std::max(0.005, 0.1 * shot.thinner), 0.25 * shot.thinner + 0.0005);
  double deepest = 0;
  const auto look = [&](const Pose& of_target, const Pose& of_bullet) {
    const Solid solid(shot.target.shape, of_target);
    deepest = std::max(deepest, overlap_depth(solid, Solid(shot.bullet.shape, of_bullet)));
  };
  Pose before = world.pose(bullet), target_before = world.pose(target);
  for (int i = 0; i < shot.steps; ++i) {
    world.step();
    const Pose now = world.pose(bullet), target_now = world.pose(target);
    look(target_now, now);
    // For fast spins, the rotation half way cannot be inferred from the end poses.
    const float spin = max(length(world.velocity(bullet).angular), length(world.velocity(target).angular));
    if (spin * shot.dt < 0.5f) {
      look(between(target_before, target_now, 0.5f), between(before, now, 0.5f));
      if (goes_through(shot.target.shape, {target_before, before}, {target_now, now}))
        deepest = std::max(deepest, allowed + half_thickness(shot.target));
    }
    before = now, target_before = target_now;
  }
  return std::max(0.0, deepest - allowed);
}

bool leaves_a_trace(const Shot& shot, const Setup& setup) {
  BodyId target, bullet;
  World world = world_of(shot, setup, target, bullet);
  const Vec3 start = shot.bullet.velocity.linear;
  for (int i = 0; i < shot.steps; ++i) {
    world.step();
    if (!world.contacts_begun().empty() || !world.hits().empty()) return true;
    if (length(world.velocity(bullet).linear - start) > 1e-5f * length(start)) return true;
  }
  return false;
}

}  // namespace fathom::validate
