// Fast bodies do not pass through thin ones.
#include <cmath>
#include <vector>

#include "scene/random.hpp"
#include "validate/bodies.hpp"
#include "validate/case_list.hpp"
#include "validate/shots.hpp"

namespace fathom::validate {
namespace {

/// A fixed plate of 1 cm in the plane x = 0.
BodyDef plate(float half_side = 5) {
  BodyDef def;
  def.motion = MotionType::fixed;
  def.shape = box({0.005f, half_side, half_side});
  return def;
}

/// Number of listed bodies whose centre is beyond x = 0.
int beyond(const World& world, const std::vector<BodyId>& ids) {
  int count = 0;
  for (const BodyId id : ids) count += world.pose(id).position.x > 0;
  return count;
}

/// Whether the path of a step has crossed the middle of a plate of 1 m across x, not gone round it.
bool goes_through(const World& world, BodyId plate, Vec3 from, Vec3 to) {
  const Vec3 at = world.pose(plate).position;
  if (!(from.x < at.x && to.x > at.x)) return false;
  const Vec3 crossing = from + ((at.x - from.x) / (to.x - from.x)) * (to - from) - at;
  return std::abs(crossing.y) < 0.5f && std::abs(crossing.z) < 0.5f;
}

}  // namespace

// Balls, boxes and capsules of 1 cm at 300 m/s, started so that they arrive at all phases of a step.
void bullets(const Setup& setup, Record& record) {
  const Shape shapes[] = {sphere(0.005f), box({0.005f, 0.005f, 0.005f}), capsule(0.0025f, 0.0025f)};
  for (const float dt : {1.0f / 60, 1.0f / 240}) {
    int passed = 0, passed_oblique = 0, passed_free = 0, shots = 0;
    for (int i = 0; i < (setup.full ? 300 : 60); ++i) {
      WorldDef def = world_def(setup);
      def.gravity = {};
      def.dt = dt;
      World world(def);
      world.add(plate(10));  // too wide to slide past
      std::vector<BodyId> straight, oblique;
      const Vec3 at{-10.0f - 5.0f * dt * static_cast<float>(i), 0, 0};
      for (int s = 0; s < 3; ++s) {
        BodyDef bullet = body(shapes[s], at + Vec3{0, static_cast<float>(s), 0}, 0.01f);
        bullet.velocity.linear = {300, 0, 0};
        bullet.velocity.angular = {0, 50, 7};
        straight.push_back(world.add(bullet));
        bullet.pose.position = at + Vec3{0, static_cast<float>(s) - 3, -1};
        bullet.velocity.linear = {300, 30, 40};
        oblique.push_back(world.add(bullet));
      }
      // A plate that can move, which must take the bullet's momentum.
      BodyDef target = body(box({0.005f, 0.5f, 0.5f}), {-5, 20, 0}, 10.0f);
      const BodyId target_id = world.add(target);
      BodyDef bullet = body(shapes[i % 3], {at.x - 5, 20, 0}, 0.01f);
      bullet.velocity.linear = {300, 0, 0};
      const BodyId free_bullet = world.add(bullet);
      ++shots;
      for (int step = step_count(world, 0.15); step > 0; --step) {
        const Pose before = world.pose(free_bullet);
        world.step();
        passed_free += goes_through(world, target_id, before.position, world.pose(free_bullet).position);
      }
      passed += beyond(world, straight);
      passed_oblique += beyond(world, oblique);
    }
    const std::string at = dt > 0.01f ? ", Δt 1/60 s" : ", Δt 1/240 s";
    record.at_most("of " + std::to_string(3 * shots) + " bullets through a fixed plate" + at, passed, 0);
    record.at_most("of " + std::to_string(3 * shots) + " oblique ones" + at, passed_oblique, 0);
    record.at_most("of " + std::to_string(shots) + " through a plate of 10 kg that can move" + at, passed_free, 0);
  }
}

// Rods of 2 m, spinning at up to 30 rad/s, are thrown at a plate.
void spinning_rods(const Setup& setup, Record& record) {
  int passed = 0, thrown = 0;
  for (const float spin : {5.0f, 15.0f, 30.0f}) {
    for (int i = 0; i < (setup.full ? 40 : 10); ++i) {
      WorldDef def = world_def(setup);
      def.gravity = {};
      World world(def);
      world.add(plate(20));
      std::vector<BodyId> rods;
      for (int s = 0; s < 2; ++s) {
        BodyDef rod = body(s == 0 ? capsule(0.02f, 0.98f) : box({0.02f, 0.02f, 1}),
                           {-3 - 0.01f * static_cast<float>(i), 4 * static_cast<float>(s), 0});
        rod.pose.rotation = turn_about({0, 1, 0}, 0.15 * i);
        rod.velocity.linear = {20, 0, 0};
        rod.velocity.angular = {0, spin, 0};
        rods.push_back(world.add(rod));
      }
      thrown += 2;
      steps(world, 120);
      passed += beyond(world, rods);
    }
  }
  record.at_most("of " + std::to_string(thrown) + " spinning rods through a plate", passed, 0);
}

void boxes_into_wall(const Setup& setup, Record& record) {
  WorldDef def = world_def(setup);
  World world(def);
  world.add(floor_slab());
  BodyDef wall = plate(50);
  wall.shape = box({0.05f, 50, 50});
  world.add(wall);
  Random random(3);
  std::vector<BodyId> ids;
  const int count = setup.full ? 1000 : 200;
  for (int i = 0; i < count; ++i) {
    BodyDef one = body(box({0.25f, 0.25f, 0.25f}),
                       {-8.0f - 0.8f * static_cast<float>(i / 100), -4 + 0.8f * static_cast<float>(i % 10),
                        0.5f + 0.8f * static_cast<float>(i / 10 % 10)});
    one.velocity.linear = {50, narrow(random.symmetric(1)), narrow(random.symmetric(1))};
    ids.push_back(world.add(one));
  }
  int passed = 0;
  for (int i = 0; i < 300; ++i) {
    world.step();
    passed = std::max(passed, beyond(world, ids));
  }
  int below = 0;
  for (const BodyId id : ids) below += world.pose(id).position.z < 0;
  record.at_most("of " + std::to_string(count) + " boxes through the wall", passed, 0);
  record.at_most("through the floor", below, 0);
}

void random_shots(const Setup& setup, Record& record) {
  const int shots = setup.full ? 3000 : 1000;
  int inside = 0;
  for (int i = 1; i <= shots; ++i) inside += too_deep(shot_at(static_cast<std::uint64_t>(i)), setup) > 0;
  // The remainder moves and spins within a step by more than its end poses show.
  record.at_most("of " + std::to_string(shots) + " shots found inside or behind what they hit", inside, 0.003 * shots);
}

void free_shots(const Setup& setup, Record& record) {
  const int shots = setup.full ? 3000 : 1000;
  int inside = 0;
  for (int i = 1; i <= shots; ++i) inside += too_deep(shot_at_free(static_cast<std::uint64_t>(i)), setup) > 0;
  record.at_most("of " + std::to_string(shots) + " shots found inside or behind what they hit", inside, 0.003 * shots);
}

void near_misses(const Setup& setup, Record& record) {
  const int shots = setup.full ? 3000 : 300;
  int traces = 0;
  for (int i = 1; i <= shots; ++i) traces += leaves_a_trace(shot_past(static_cast<std::uint64_t>(i)), setup);
  record.at_most("of " + std::to_string(shots) + " near misses with an event or a change of velocity", traces, 0);
}

}  // namespace fathom::validate
