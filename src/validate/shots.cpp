#include "validate/shots.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/random.hpp"
#include "validate/bodies.hpp"
#include "validate/exact_overlap.hpp"

namespace fathom::validate {
namespace {

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : random_(seed) {}

  double between(double a, double b) { return a + (b - a) * 0.5 * (1 + random_.symmetric(1)); }
  double log_between(double a, double b) { return std::exp(between(std::log(a), std::log(b))); }
  int below(int n) { return std::min(static_cast<int>(between(0, n)), n - 1); }
  float log_float(double a, double b) { return narrow(log_between(a, b)); }
  Vec3 vector(double size) { return {symmetric(size), symmetric(size), symmetric(size)}; }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = vector(1);
      if (const float square = length_squared(v); square > 0.01f && square < 1) return normalize(v);
    }
  }
  Quat rotation() { return normalize(Quat{symmetric(1), symmetric(1), symmetric(1), symmetric(1)}); }

  /// Its longest half side is `size` (m), the others down to `thinnest` of it.
  Shape shape(double size, double thinnest) {
    const auto side = [&] { return narrow(size * log_between(thinnest, 1)); };
    const float longest = narrow(size), x = side(), y = side();
    switch (below(4)) {
      case 0:
        return sphere(longest);
      case 1:
        return capsule(x, longest);
      case 2:
        return box({x, y, longest});
      default:
        break;
    }
    std::vector<Vec3> corners;
    for (int i = 8 + below(16); i > 0; --i) {
      const Vec3 d = direction();
      corners.push_back({x * d.x, y * d.y, longest * d.z});
    }
    return hull(corners);
  }

 private:
  float symmetric(double size) { return narrow(random_.symmetric(size)); }
  Random random_;
};

/// How far the body reaches along the unit vector from its origin (m).
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

/// All but where the bullet flies.
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

/// From `aim` (m, from the target's middle) back along the bullet's way until it is clear of the target.
void place(Shot& shot, Vec3 aim, Chance& chance) {
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

Pose half_way(const Pose& a, const Pose& b) {
  const Quat p = a.rotation, q = b.rotation;
  const float s = dot(p, q) < 0 ? -1.0f : 1.0f;
  return {0.5f * (a.position + b.position), 0,
          normalize(Quat{p.w + s * q.w, p.x + s * q.x, p.y + s * q.y, p.z + s * q.z})};
}

}  // namespace

Shot shot_at(std::uint64_t seed) {
  Chance chance(seed);
  Shot shot = shot_without_aim(chance);
  place(shot, narrow(chance.between(-0.6, 0.6) * half_thickness(shot.target)) * chance.direction(), chance);
  return shot;
}

Shot shot_past(std::uint64_t seed) {
  Chance chance(seed);
  Shot shot = shot_without_aim(chance);
  const Vec3 side = normalize(cross(shot.bullet.velocity.linear, chance.direction()));
  const double size = std::max(bounding_radius(shot.target), bounding_radius(shot.bullet));
  shot.clearance = 0.025 + 0.25 * shot.thinner + chance.log_between(0.001, 1) * size;
  place(shot, narrow(reach(shot.target, side) + bounding_radius(shot.bullet) + shot.clearance) * side, chance);
  return shot;
}

double too_deep(const Shot& shot, const Setup& setup) {
  BodyId target, bullet;
  World world = world_of(shot, setup, target, bullet);
  const double allowed = std::min(std::max(0.005, 0.1 * shot.thinner), 0.25 * shot.thinner + 0.0005);
  const Solid solid(shot.target.shape, shot.target.pose);
  double deepest = 0;
  Pose before = world.pose(bullet);
  for (int i = 0; i < shot.steps; ++i) {
    world.step();
    const Pose now = world.pose(bullet);
    deepest = std::max(deepest, overlap_depth(solid, Solid(shot.bullet.shape, now)));
    // What spins fast is at the middle of its way turned in no way that the ends would tell.
    if (length(world.velocity(bullet).angular) * shot.dt < 0.5f)
      deepest = std::max(deepest, overlap_depth(solid, Solid(shot.bullet.shape, half_way(before, now))));
    before = now;
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
