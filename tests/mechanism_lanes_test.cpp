// Mechanisms of the same shape, which the native simulator solves side by side: each gets the same bits as alone. With
// more threads than mechanisms each is alone; with one thread they share lanes.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "joint_worlds.hpp"
#include "random.hpp"

namespace fathom::test::mechanism_lanes_test {
namespace {

/// Common to all copies of a mechanism: a tree, and the kinds of its joints.
struct Plan {
  struct Link {
    unsigned parent, type;
    bool is_round, joins_backwards;
    std::array<unsigned, joint_axis_count> axes;
  };
  std::vector<Link> links;
  bool hangs = false;
  float spin = 9;  ///< rad/s, at most

  explicit Plan(Generator& random) {
    const auto count = 2 + random() % 9;
    for (unsigned i = 0; i < count; ++i) {
      Link link{i > 0 ? static_cast<unsigned>(random() % i) : 0,
                static_cast<unsigned>(random() % 6),
                random() % 3 == 0,
                random() % 2 == 0,
                {}};
      for (unsigned& axis : link.axes) axis = static_cast<unsigned>(random() % 8);
      links.push_back(link);
    }
    hangs = random() % 3 == 0;
    if (random() % 3 == 0) spin = 300;  // so that some substeps take other branches
  }
};

JointAxis axis_of(Generator& random, unsigned kind, float reach) {
  JointAxis axis;
  axis.mode = kind < 4 ? AxisMode::locked : kind == 4 ? AxisMode::free : AxisMode::limited;
  if (axis.mode == AxisMode::limited)
    axis.limit(uniform(random, -reach, -0.1f * reach), uniform(random, 0.1f * reach, reach));
  if (kind == 6) axis.drive_velocity(uniform(random, -2, 2), uniform(random, 0.1f, 5));
  if (kind == 7) axis.drive_position(uniform(random, -reach, reach), 1e2f, 5, 50);
  if (kind == 5) axis.restitution = 0.4f;
  if (kind == 6) axis.armature = 0.01f;
  return axis;
}

void add_copy(World& world, const Plan& plan, Generator& random, Vec3 at) {
  std::vector<BodyId> ids;
  std::vector<Pose> poses;
  for (const Plan::Link& link : plan.links) {
    const bool is_first = ids.empty();
    const Vec3 way = normalize(Vec3{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -0.2f, 1)});
    const Pose pose{.position = is_first ? at : poses[link.parent].position + 0.4f * way,
                    .rotation = axis_angle(way, uniform(random, -3, 3))};
    BodyDef body =
        dynamic(link.is_round ? sphere(0.1f) : box({0.05f, 0.12f, 0.08f}), pose.position, uniform(random, 0.2f, 3));
    body.pose = pose;
    body.velocity = {
        {uniform(random, -3, 3), uniform(random, -3, 3), 0}, 0, {uniform(random, -plan.spin, plan.spin), 1, 0}};
    ids.push_back(world.add(body));
    poses.push_back(pose);
    if (is_first && !plan.hangs) continue;
    const Vec3 middle = is_first ? at : 0.5f * (pose.position + poses[link.parent].position);
    const Pose frame{.position = middle, .rotation = axis_angle(way, 1)};
    const Pose parent_pose{.position = at + Vec3{0, 0, 0.3f}};
    const BodyId parent = is_first ? add_anchor(world, parent_pose.position) : ids[link.parent];
    const Pose on_parent = relative(is_first ? parent_pose : poses[link.parent], frame),
               on_body = relative(pose, frame);
    JointDef def = generic_joint(parent, ids.back(), on_parent, on_body);
    if (link.joins_backwards) def = generic_joint(ids.back(), parent, on_body, on_parent);
    if (link.type == 0) {
      def = ball_joint(def.a, def.b, def.frame_a.position, def.frame_b.position);
    } else if (link.type == 1) {
      def = distance_joint(def.a, def.b, def.frame_a.position, def.frame_b.position, 0, 0.2f);
    } else {
      for (std::size_t i = 0; i < joint_axis_count; ++i)
        def.axes[i] =
            i < 3 && link.type < 5 ? axis_of(random, 0, 0) : axis_of(random, link.axes[i], i < 3 ? 0.1f : 0.6f);
      if (link.type == 2) def.axes[4] = def.axes[5] = {}, def.cone_angle = uniform(random, 0.2f, 1);
    }
    world.add_joint(def);
  }
}

std::uint64_t hash_of(unsigned seed, int threads) {
  Generator random(seed);
  WorldDef def;
  def.threads = threads;
  World world(def);
  world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, -0.5f}}, .shape = box({90, 90, 0.5f})});
  const Plan plan(random);
  for (int i = 0; i < 11; ++i) add_copy(world, plan, random, {static_cast<float>(3 * i), 0, 1.5f});
  for (int step = 0; step < 90; ++step) world.step();
  EXPECT_TRUE(world.quarantined().empty());
  return world.state_hash();
}

class MechanismLanes : public testing::TestWithParam<unsigned> {};

TEST_P(MechanismLanes, HaveTheBitsThatEachHasAlone) {
  for (unsigned seed = 20 * GetParam(); seed < 20 * (GetParam() + 1); ++seed)
    EXPECT_EQ(hash_of(seed, 1), hash_of(seed, 12)) << "seed " << seed;
}

INSTANTIATE_TEST_SUITE_P(Seeds, MechanismLanes, testing::Range(0u, 3u));

}  // namespace
}  // namespace fathom::test::mechanism_lanes_test
