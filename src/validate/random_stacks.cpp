// Random stacks of boxes and cylinders, in any order of masses, that statics lets stand.
#include <algorithm>
#include <string>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"
#include "validate/chance.hpp"

namespace fathom::validate {
namespace {

struct Stack {
  double size = 0;  ///< m, half of a typical width
  float gap = 0;    ///< m, under each body
  std::vector<BodyDef> bodies;
};

/// 3 to 20 bodies of 1 to `ratio` kg on each other, with gaps of a share of the size. Every centre is within 0.08 of
/// the size of the axis, and no body is narrower than 0.6, so all loads pass well within all bodies.
Stack make_stack(std::uint64_t seed, double ratio, double gap) {
  Chance chance(seed);
  Stack stack;
  stack.size = chance.log_between(0.02, 2);
  stack.gap = narrow(gap * stack.size);
  const bool has_cylinders = chance.below(3) == 0;
  const auto size = [&](double share) { return narrow(stack.size * share); };
  float top = 0;
  for (int i = 3 + chance.below(18); i > 0; --i) {
    const float x = size(chance.between(0.6, 1.4)), y = size(chance.between(0.6, 1.4));
    const float half = size(chance.log_between(0.1, 1));
    const Shape shape = has_cylinders && chance.coin() ? cylinder(x, half) : box({x, y, half});
    const float off_x = size(chance.between(-0.08, 0.08)), off_y = size(chance.between(-0.08, 0.08));
    stack.bodies.push_back(body(shape, {off_x, off_y, top + stack.gap + half}, chance.log_float(1, ratio)));
    stack.bodies.back().pose.rotation = turn_about({0, 0, 1}, chance.between(-0.6, 0.6));
    top += stack.gap + 2 * half;
  }
  return stack;
}

/// Whether no body moves by more than half the stack's size within 20 s, but for the fall that closes the gaps.
bool stands(const Setup& setup, const Stack& stack) {
  World world(world_def(setup));
  world.add(floor_slab());
  std::vector<BodyId> ids;
  for (const BodyDef& def : stack.bodies) ids.push_back(world.add(def));
  steps(world, step_count(world, 20));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    Vec3 moved = world.pose(ids[i]).position - stack.bodies[i].pose.position;
    moved.z += static_cast<float>(i + 1) * stack.gap;
    if (!(length(moved) <= narrow(0.5 * stack.size))) return false;
  }
  return true;
}

}  // namespace

void random_stacks(const Setup& setup, Record& record) {
  const int seeds = setup.full ? 200 : 10;
  const auto judge = [&](int ratio, double gap, const std::string& what) {
    int fell = 0;
    for (int seed = 1; seed <= seeds; ++seed)
      fell += !stands(setup, make_stack(static_cast<std::uint64_t>(seed), ratio, gap));
    record.at_most("of " + std::to_string(seeds) + " stacks " + what + ", fell", fell, 0);
  };
  for (const int ratio : {1, 30, 1000}) judge(ratio, 0, "with masses up to " + std::to_string(ratio) + ":1");
  record.checks.back().known = "a light body under hundreds of times its weight gives way";
  judge(1, 0.01, "of equal masses with gaps of 1 %");
  record.checks.back().known = "an impact compresses tall stacks like springs";
}

}  // namespace fathom::validate
