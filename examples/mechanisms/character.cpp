// A character: a kinematic capsule that walks by casting its shape. It climbs steps, slides along walls, walks up ramps
// that are not too steep, falls, and pushes crates. What moves into it pushes it aside.
//   character [native|device|hybrid]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fathom/world.hpp>
#include <optional>

#include "simulator.hpp"

using namespace fathom;

constexpr float radius = 0.3f, half_length = 0.6f;  // m
constexpr float skin = 0.01f;                       // m, the gap it keeps to everything
constexpr float thin_gap = 1e-4f;                   // m, what is left of the skin where it moves almost along a wall
constexpr float core_radius = 0.02f;                // m, of what nothing enters, wherever it is pushed
constexpr float step_height = 0.35f;                // m
constexpr float max_push = 250;                     // N
constexpr float min_ground_z = 0.7f;                // of the ground's normal: slopes up to 45 degrees

class Character {
 public:
  Character(World& world, Vec3 feet) : world_(world), position_(feet + Vec3{0, 0, radius + half_length + skin}) {
    body_ = world.add({.motion = MotionType::kinematic, .pose = {.position = position_}, .shape = shape_});
    others_.ignored = {body_};
  }

  // Walks at this velocity (m/s, horizontal) for one step; the world must step next.
  void walk(Vec3 velocity) {
    const float dt = world_.definition().dt;
    position_ = apart(position_);
    fall_speed_ = is_on_ground_ ? 0 : fall_speed_ + 9.81f * dt;
    const Vec3 way = dt * velocity;
    push(way);
    const Vec3 along = slide(position_, way);
    // Up, forward and down again, to climb a step: only if that gets farther, and onto ground it can stand on.
    const Vec3 raised = advance(position_, {0, 0, step_height});
    const Vec3 over = slide(raised, way);
    const float gained = dot(over - along, way);
    position_ = is_on_ground_ && gained > 1e-6f && stands_below(over, raised.z - position_.z + skin) ? over : along;
    // Stays on the ground when going down steps and slopes.
    const float down = is_on_ground_ ? step_height + (position_.z - along.z) : fall_speed_ * dt;
    const auto hit = cast(position_, {0, 0, -down - skin});
    is_on_ground_ = hit && can_stand_on(*hit);
    if (is_on_ground_)
      position_ = advance(position_, {0, 0, skin - hit->fraction * (down + skin)});
    else if (fall_speed_ > 0)
      position_ = slide(position_, {0, 0, -down});
    world_.move_to(body_, {.position = position_});
  }

  Vec3 feet() const { return position_ - Vec3{0, 0, radius + half_length + skin}; }

 private:
  // Pushes against a body in its way.
  void push(Vec3 way) {
    if (length_squared(way) < 1e-12f) return;
    const auto hit = world_.cast_shape(shape_, {.position = position_}, way + 2 * skin * normalize(way), others_);
    if (hit && world_.motion(hit->body) == MotionType::dynamic)
      world_.apply_force_at(hit->body, max_push * normalize(way), hit->point);
  }
  // Away from what touches it or nearly does, such as what has moved into it: walls have the last word, and a loose
  // body that it still touches does not hold it. A cast that starts where it touches something has no normal to slide
  // along, but the thin core of the capsule touches nothing.
  Vec3 apart(Vec3 from) {
    obstacles_ = others_;
    const Shape reach = capsule(radius + thin_gap, half_length), core = capsule(core_radius, half_length);
    for (int round = 0; round < 4; ++round) {
      const std::vector<BodyId> near = world_.overlap_shape(reach, {.position = from}, others_);
      if (near.empty()) return from;
      for (const bool loose : {true, false}) {
        for (const BodyId body : near) {
          if ((world_.motion(body) == MotionType::dynamic) != loose) continue;
          const ClosestPoints closest = world_.closest_points(core, {.position = from}, body);
          from = from - std::max(0.0f, radius + thin_gap - core_radius - closest.distance) * closest.normal;
        }
      }
    }
    for (const BodyId body : world_.overlap_shape(shape_, {.position = from}, others_))
      if (world_.motion(body) == MotionType::dynamic) obstacles_.ignored.push_back(body);
    return from;
  }
  std::optional<CastHit> cast(Vec3 from, Vec3 translation) const {
    if (length_squared(translation) < 1e-12f) return {};
    return world_.cast_shape(shape_, {.position = from}, translation, obstacles_);
  }
  // Whether it can stand on what it hit. At the edge of a step the hit's normal is the capsule's; the surface behind
  // the edge decides.
  bool can_stand_on(const CastHit& hit) const {
    if (hit.normal.z >= min_ground_z) return true;
    if (hit.normal.z <= 0.01f) return false;
    const Vec3 behind = hit.point - 0.02f * normalized({hit.normal.x, hit.normal.y, 0});
    const auto top = world_.cast_ray(behind + Vec3{0, 0, 0.02f}, {0, 0, -0.04f}, others_);
    return top && top->normal.z >= min_ground_z;
  }
  bool stands_below(Vec3 from, float down) const {
    const auto hit = cast(from, {0, 0, -down});
    return hit && can_stand_on(*hit) && hit->point.z < feet().z + step_height;
  }
  // End of a straight move, a skin before the first obstacle.
  Vec3 advance(Vec3 from, Vec3 way) const {
    const auto hit = cast(from, way);
    if (!hit) return from + way;
    const float total = length(way), closing = -dot(hit->normal, way) / total;
    const float kept = closing > 0 ? skin / std::max(closing, 0.1f) : 0;
    return from + (std::max(0.0f, hit->fraction * total - kept) / total) * way;
  }
  // End of a move that slides along up to three planes of obstacles.
  Vec3 slide(Vec3 from, Vec3 way) const {
    Vec3 met[3];
    for (int count = 0; count < 3; ++count) {
      const auto hit = cast(from, way + skin * normalized(way));
      if (!hit) return from + way;
      const Vec3 next = advance(from, way);
      way = way - (next - from);
      from = next;
      met[count] = hit->normal;
      for (int i = 0; i <= count; ++i) way = way - std::min(0.0f, dot(way, met[i])) * met[i];
    }
    return from;
  }
  static Vec3 normalized(Vec3 v) { return length_squared(v) > 0 ? normalize(v) : v; }

  World& world_;
  Shape shape_ = capsule(radius, half_length);
  BodyId body_;
  QueryFilter others_, obstacles_;
  Vec3 position_;  // of its centre
  float fall_speed_ = 0;
  bool is_on_ground_ = false;
};

int main(int argc, char** argv) try {
  World world(world_definition(argc, argv));
  const auto add = [&](Vec3 position, Vec3 half_extents, Quat rotation = {}) {
    return world.add({.motion = MotionType::fixed,
                      .pose = {.position = position, .rotation = rotation},
                      .shape = box(half_extents)});
  };
  add({0, 0, -0.5f}, {50, 50, 0.5f});
  // Ten steps of 0.25 m, and a platform.
  for (int i = 0; i < 10; ++i) {
    const float top = 0.25f * static_cast<float>(i + 1);
    add({3.2f + 0.4f * static_cast<float>(i), 0, 0.5f * top}, {0.2f, 2, 0.5f * top});
  }
  add({9, 0, 1.25f}, {2, 2, 1.25f});
  const auto turned = [](Vec3 axis, float angle) {
    return Quat{std::cos(0.5f * angle), std::sin(0.5f * angle) * axis.x, std::sin(0.5f * angle) * axis.y,
                std::sin(0.5f * angle) * axis.z};
  };
  add({18, 0, 1}, {0.1f, 4, 1}, turned({0, 0, 1}, 0.7f));      // a wall in its way, at an angle
  add({24, 0, 0}, {4, 10, 0.5f}, turned({0, 1, 0}, -0.4f));    // a ramp, 23 degrees
  add({4, 20, 1.6f}, {3, 3, 0.05f}, turned({0, 1, 0}, 0.3f));  // a slanted roof, too low at its far end
  const BodyId crate = world.add({.pose = {.position = {14, 0, 0.3f}}, .shape = box({0.3f, 0.3f, 0.3f}), .mass = 20});

  Character character(world, {0, 0, 0}), other(world, {0, 20, 0});
  float top = 0, push = 0, under = 0;
  for (int i = 0; i < 60 * 12; ++i) {
    // Goes around the crate, which it would otherwise push against the wall.
    const bool sidesteps = i >= 380 && i < 416;
    character.walk(sidesteps ? Vec3{0, -2.5f, 0} : Vec3{2.5f, 0, 0});
    other.walk({i < 360 ? 2.5f : -2.5f, 0, 0});
    world.step();
    under = std::max(under, other.feet().x);
    top = std::max(top, character.feet().z);
    push = std::max(push, world.pose(crate).position.x - 14);
  }
  const Vec3 end = character.feet();
  std::printf(
      "was on the stairs at z = %.2f m, pushed the crate by %.1f m, slid by %.1f m along the wall, ends at z = %.1f "
      "m; another came %.1f m back from under a roof\n",
      top, push, std::abs(end.y) - 1.5f, end.z, under - other.feet().x);
} catch (const Error& error) {
  std::fprintf(stderr, "character: %s\n", error.what());
  return 2;
}
