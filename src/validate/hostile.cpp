// Extreme states that no scene should have: they stay contained and affect nothing else.
#include <cmath>
#include <limits>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr float huge = 3e38f;

/// A pile, and far from it a body that `force` acts on in every step.
std::vector<Pose> pile_beside(const Setup& setup, bool with_victim, Vec3 force, int& quarantined, bool& victim_finite) {
  World world(world_def(setup));
  world.add(floor_slab());
  for (int i = 0; i < 60; ++i)
    world.add(body(box({0.4f, 0.4f, 0.4f}), {0.9f * static_cast<float>(i % 4), 0.9f * static_cast<float>(i / 4 % 4),
                                             0.5f + static_cast<float>(i / 16)}));
  const BodyId victim = world.add(body(sphere(0.5f), {30, 30, 0.5f}));
  for (int i = 0; i < 120; ++i) {
    if (with_victim && i == 30) world.apply_force(victim, force), world.apply_force(victim, force);
    world.step();
    quarantined += static_cast<int>(world.quarantined().size());
  }
  victim_finite = is_finite(world.pose(victim)) && is_finite(world.velocity(victim).linear);
  std::vector<Pose> poses(world.poses().begin(), world.poses().end());
  poses.resize(victim.index);
  return poses;
}

bool equal(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Quat &p = a[i].rotation, &q = b[i].rotation;
    if (!(a[i].position == b[i].position) || p.w != q.w || p.x != q.x || p.y != q.y || p.z != q.z) return false;
  }
  return true;
}

}  // namespace

// Two forces of 3e38 N add up to infinity.
void isolation(const Setup& setup, Record& record) {
  int none = 0, quarantined = 0;
  bool finite = true, victim_finite = false;
  const std::vector<Pose> without = pile_beside(setup, false, {}, none, finite);
  const std::vector<Pose> with = pile_beside(setup, true, {huge, 0, huge}, quarantined, victim_finite);
  record.at_least("reports of the body", quarantined, 1);
  record.at_least("its state is finite", victim_finite, 1);
  record.at_least("the others' poses are bit for bit those without it", equal(with, without), 1);
  int refused = 0;
  World world(world_def(setup));
  const BodyId id = world.add(body(sphere(0.5f), {}));
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    try {
      world.apply_force(id, {bad, 0, 0});
    } catch (const Error&) {
      ++refused;
    }
  }
  record.at_least("forces that are not finite are refused", refused, 2);
}

void extreme_values(const Setup& setup, Record& record) {
  World world(world_def(setup));
  world.add(floor_slab());
  std::vector<BodyId> bystanders;
  for (int i = 0; i < 10; ++i)
    bystanders.push_back(world.add(body(box({0.5f, 0.5f, 0.5f}), {2.0f * static_cast<float>(i), 0, 0.5f})));
  const auto extreme = [&](BodyDef def, Vec3 linear, Vec3 angular) {
    def.velocity.linear = linear;
    def.velocity.angular = angular;
    try {
      world.add(def);
    } catch (const Error&) {
      // Rejected with a reason: as good as surviving it.
    }
  };
  extreme(body(sphere(0.5f), {0, 50, 1}), {1e30f, 0, 0}, {});
  extreme(body(box({0.5f, 0.5f, 0.5f}), {0, 52, 1}), {0, 0, -1e30f}, {1e30f, 0, 0});
  extreme(body(box({0.5f, 0.3f, 0.2f}), {0, 54, 0.3f}, 1e-12f), {}, {});
  extreme(body(box({0.5f, 0.5f, 0.5f}), {0, 54, 1.2f}, 1e12f), {}, {});
  extreme(body(box({0.5f, 0.5f, 0.5f}), {1e7f, 1e7f, 1e7f}), {}, {});
  extreme(body(box({0.5f, 0.5f, 0.5f}), {1e7f, 1e7f, 1e7f}), {}, {});
  extreme(body(sphere(1e-6f), {0, 56, 0.1f}, std::nullopt), {}, {});
  extreme(body(sphere(0.5f), {1e30f, 0, 0}), {}, {});
  extreme(body(capsule(1e-3f, 1e3f), {0, 5000, 5}, std::nullopt), {100, 0, 0}, {0, 100, 100});
  for (int i = 0; i < 4; ++i) extreme(body(box({0.5f, 0.5f, 0.5f}), {0, 70, 0.5f}), {}, {});  // one inside another
  steps(world, 300);
  double moved = 0;
  for (std::size_t i = 0; i < bystanders.size(); ++i)
    moved =
        std::max(moved, wide(distance(world.pose(bystanders[i]).position, {2.0f * static_cast<float>(i), 0, 0.5f})));
  record.at_least("all published states are finite", all_finite(world), 1);
  record.at_most("bystanders moved", moved, 1e-3, "m");
}

}  // namespace fathom::validate
