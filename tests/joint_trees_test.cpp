// Random trees of joints of every type, hanging, spinning or falling: they gain no energy and hold together.
#include <gtest/gtest.h>

#include <cmath>
#include <fathom/world.hpp>
#include <random>
#include <vector>

namespace fathom::joint_trees_test {
namespace {

class Tree {
 public:
  explicit Tree(unsigned seed, int threads = 1) : random_(seed), world_(definition(threads)) {
    BodyDef post;
    post.motion = MotionType::fixed, post.shape = box({0.2f, 0.2f, 0.2f}), post.pose.position = {0, 0, 8};
    bodies_.push_back(world_.add(post));
    masses_.push_back({});
    const int count = 2 + choice(14);
    const bool hangs = choice(2) == 1;
    for (int i = 0; i < count; ++i) add_link(i > 0 || hangs);
  }

  World& world() { return world_; }
  /// J
  double energy() const {
    double sum = 0;
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      const Velocity v = world_.velocity(bodies_[i]);
      const Pose& pose = world_.pose(bodies_[i]);
      const Vec3 spin = inverse_rotate(pose.rotation, v.angular);
      const MassProperties& m = masses_[i];
      const float moving = 0.5f * (m.mass * length_squared(v.linear) + dot(spin, m.inertia * spin));
      sum += static_cast<double>(moving) + static_cast<double>(9.81f * m.mass) * static_cast<double>(pose.position.z);
    }
    return sum;
  }
  /// J, for a fall of 8 m
  double fall() const {
    float mass = 0;
    for (const MassProperties& m : masses_) mass += m.mass;
    return static_cast<double>(9.81f * 8 * mass);
  }
  /// m, of anchors that should coincide
  float widest_gap() const {
    float widest = 0;
    for (const JointId id : joints_) {
      const JointDef& def = world_.joint(id);
      if (def.type == JointType::distance) continue;
      const JointPositions at = world_.joint_positions(id);
      if (def.type == JointType::generic) {
        for (std::size_t k = 0; k < 3; ++k)
          if (def.axes[k].mode == AxisMode::locked) widest = std::max(widest, std::fabs(at[k]));
      } else {
        widest = std::max(widest, distance(transform(world_.pose(def.a), def.frame_a.position),
                                           transform(world_.pose(def.b), def.frame_b.position)));
      }
    }
    return widest;
  }

 private:
  static WorldDef definition(int threads) {
    WorldDef def;
    def.sleep.enabled = false;
    def.threads = threads;
    return def;
  }
  float uniform(float from, float to) { return std::uniform_real_distribution<float>(from, to)(random_); }
  int choice(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  Vec3 vector(float most) { return {uniform(-most, most), uniform(-most, most), uniform(-most, most)}; }
  Quat rotation() { return normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}); }

  void add_link(bool joins) {
    const BodyId parent =
        bodies_[bodies_.size() == 1 ? 0 : static_cast<std::size_t>(choice(static_cast<int>(bodies_.size())))];
    const Pose of_parent = world_.pose(parent);
    const Vec3 size{uniform(0.05f, 0.5f), uniform(0.05f, 0.5f), uniform(0.05f, 0.5f)};
    const Quat frame = rotation();
    Pose on_a, on_b;
    on_a.position = vector(0.4f), on_a.rotation = conjugate(of_parent.rotation) * frame;
    BodyDef body;
    body.shape = box(size), body.mass = std::exp(uniform(std::log(0.5f), std::log(20.0f))), body.filter = {2, 0};
    body.pose.rotation = rotation();
    const Vec3 corner = vector(1);
    on_b.position = {corner.x * size.x, corner.y * size.y, corner.z * size.z};
    on_b.rotation = conjugate(body.pose.rotation) * frame;
    body.pose.position =
        joins ? transform(of_parent, on_a.position) - rotate(body.pose.rotation, on_b.position) : Vec3{0, 0, 8};
    const BodyId id = world_.add(body);
    bodies_.push_back(id);
    masses_.push_back(mass_properties(body.shape, *body.mass));
    if (!joins) return;
    JointDef def = joint(parent, id, on_a, on_b);
    if (choice(2)) std::swap(def.a, def.b), std::swap(def.frame_a, def.frame_b);
    joints_.push_back(world_.add_joint(def));
  }

  JointDef joint(BodyId a, BodyId b, const Pose& on_a, const Pose& on_b) {
    JointDef def;
    switch (choice(7)) {
      case 0:
        return fixed_joint(a, b, on_a, on_b);
      case 1:
        def = revolute_joint(a, b, on_a, on_b);
        if (choice(2)) def.axis(JointAxisName::twist).limit(-uniform(0.1f, 2), uniform(0.1f, 2));
        return def;
      case 2:
        def = prismatic_joint(a, b, on_a, on_b);
        def.axis(JointAxisName::x).limit(-0.5f, 0.5f);
        return def;
      case 3:
        return universal_joint(a, b, on_a, on_b);
      case 4:
        return ball_joint(a, b, on_a.position, on_b.position);
      case 5:
        def = generic_joint(a, b, on_a, on_b);
        for (std::size_t k = 0; k < 3; ++k) def.axes[k].mode = AxisMode::locked;
        def.cone_angle = uniform(0.3f, 1.5f);
        return def;
      default:
        return distance_joint(a, b, on_a.position, on_b.position, 0, 0.4f);
    }
  }

  std::mt19937 random_;
  World world_;
  std::vector<BodyId> bodies_;
  std::vector<MassProperties> masses_;
  std::vector<JointId> joints_;
};

TEST(JointTrees, GainNoEnergyAndKeepTogether) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Tree tree(seed);
    const double before = tree.energy();
    double most = before;
    float widest = 0;
    for (int step = 0; step < 300; ++step) {
      tree.world().step();
      most = std::max(most, tree.energy());
      widest = std::max(widest, tree.widest_gap());
    }
    EXPECT_LT(most - before, 0.01 * tree.fall()) << "seed " << seed;
    EXPECT_LT(widest, 0.05f) << "seed " << seed;
    EXPECT_TRUE(tree.world().quarantined().empty()) << "seed " << seed;
  }
}

TEST(JointTrees, MoveAlikeOnSeveralThreads) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Tree one(seed), four(seed, 4);
    for (int step = 0; step < 120; ++step) one.world().step(), four.world().step();
    EXPECT_EQ(one.world().state_hash(), four.world().state_hash()) << "seed " << seed;
  }
}

/// A swinging chain of ten equal links, with a load as heavy as all of them.
float gap_of_a_chain(SimulatorKind simulator, bool direct) {
  WorldDef def;
  def.simulator = simulator;
  def.solver.direct_joints = direct;
  World world(def);
  BodyId last = world.add({.motion = MotionType::fixed, .shape = sphere(0.1f)});
  std::vector<BodyId> links{last};
  for (int i = 0; i < 10; ++i) {
    const float z = -0.2f - 0.4f * static_cast<float>(i);
    links.push_back(
        world.add({.pose = {.position = {0.3f * -z, 0, z}}, .shape = box({0.05f, 0.05f, 0.2f}), .mass = 1}));
  }
  world.set_mass(links.back(), 10);
  for (std::size_t i = 1; i < links.size(); ++i)
    world.add_joint(ball_joint(links[i - 1], links[i], {0, 0, i == 1 ? 0.0f : -0.2f}, {0, 0, 0.2f}));
  float widest = 0;
  for (int step = 0; step < 300; ++step) {
    world.step();
    if (step < 60) continue;  // the links start apart
    for (std::size_t i = 1; i < links.size(); ++i)
      widest = std::max(widest, distance(transform(world.pose(links[i - 1]), {0, 0, i == 1 ? 0.0f : -0.2f}),
                                         transform(world.pose(links[i]), {0, 0, 0.2f})));
  }
  return widest;
}

TEST(JointTrees, AreLeftToSweepsWhereOneAsks) {
  for (const SimulatorKind simulator : {SimulatorKind::native, SimulatorKind::device, SimulatorKind::hybrid}) {
    EXPECT_LT(gap_of_a_chain(simulator, true), 2e-5f);
    const float by_sweeps = gap_of_a_chain(simulator, false);
    EXPECT_GT(by_sweeps, 2e-4f);
    EXPECT_LT(by_sweeps, 0.02f);
  }
}

}  // namespace
}  // namespace fathom::joint_trees_test
