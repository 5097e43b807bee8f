// Elimination of a link satisfies its equations: momentum, locked axes, drives.
#include "dynamics/joint_elimination.hpp"

#include <gtest/gtest.h>

#include <random>

namespace fathom::joint_elimination_test {
namespace {

class JointElimination : public testing::Test {
 protected:
  float uniform(float from, float to) { return std::uniform_real_distribution<float>(from, to)(random_); }
  Vec3 vector() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }
  void fill(JointVector& v, float most) {
    for (float& element : v) element = uniform(-most, most);
  }

  /// Three perpendicular unit vectors.
  void frame(Vec3 (&axes)[3]) {
    axes[0] = normalize(vector() + Vec3{2, 0, 0});
    axes[1] = normalize(cross(axes[0], vector() + Vec3{0, 2, 0}));
    axes[2] = cross(axes[0], axes[1]);
  }
  /// A rigid body of `mass` with another hanging off its centre, so that all three matrices are full.
  TreeInertia inertia(float mass) {
    TreeInertia body = tree_inertia(mass, to_matrix(SymMat3{0.3f * mass, 0.2f * mass, 0.4f * mass, 0, 0, 0}));
    add_child(body, tree_link(tree_inertia(uniform(0.1f, 5) * mass, diagonal(0.1f * mass)), vector()), vector());
    return body;
  }
  JointFreedom freedom() {
    JointFreedom f;
    frame(f.along), frame(f.about);
    for (Flag& is_free : f.is_free) is_free = flag(uniform(0, 1) < 0.5f);
    for (int k = 0; k < joint_coordinates; ++k) f.stiffness[k] = f.has(k) && uniform(0, 1) < 0.5f ? uniform(0, 10) : 0;
    return f;
  }

  std::mt19937 random_{7};
};

TEST_F(JointElimination, KeepsMomentumAndFollowsWhatIsLockedOrDriven) {
  for (int trial = 0; trial < 2000; ++trial) {
    const TreeInertia body = inertia(uniform(0.1f, 3));
    const JointFreedom f = freedom();
    const Vec3 arm = vector();
    const EliminatedLink link = eliminated(body, arm, f);
    JointVector drive{}, error{}, parent, change, impulse;
    fill(parent, 2);
    for (int k = 0; k < joint_coordinates; ++k) (f.has(k) ? drive : error)[k] = uniform(-2, 2);
    const TreeLoad load{vector(), vector()};  // about the joint
    const JointLoad reduced = eliminated_load(link, f, load, drive);
    follow_at_joint(link, f, reduced, error, parent, change, impulse);

    for (int k = 0; k < joint_coordinates; ++k) {
      if (f.has(k))
        EXPECT_NEAR(impulse[k], drive[k] - f.stiffness[k] * (change[k] - parent[k]), 2e-3f) << "trial " << trial;
      else
        EXPECT_FLOAT_EQ(change[k], parent[k] - error[k]);
    }
    // The body's momentum about its centre changes by the load and the joint's impulse.
    const Vec3 at_joint = linear_of(f, change), angular = angular_of(f, change);
    const Vec3 linear = at_joint + cross(arm, angular);
    const Vec3 momentum = body.linear * linear + body.mixed * angular;
    const Vec3 spin = transpose_mul(body.mixed, linear) + body.angular * angular;
    const Vec3 force = load.impulse + linear_of(f, impulse), moment = load.moment + angular_of(f, impulse);
    EXPECT_LT(distance(momentum, force), 2e-3f) << "trial " << trial;
    EXPECT_LT(distance(spin, moment + cross(arm, force)), 2e-3f) << "trial " << trial;
    // The parent receives the opposite.
    const TreeLoad handed = handed_on(link, f, reduced, error);
    JointVector felt;
    to_coordinates(f, handed.impulse, handed.moment, felt);
    for (int i = 0; i < joint_coordinates; ++i) {
      for (int j = 0; j < joint_coordinates; ++j) felt[i] -= link.inertia[i][j] * parent[j];
      EXPECT_NEAR(felt[i], -impulse[i], 2e-3f) << "trial " << trial << ", coordinate " << i;
    }
  }
}

TEST_F(JointElimination, LeavesNothingOfWhatIsFree) {
  for (int trial = 0; trial < 200; ++trial) {
    JointFreedom f = freedom();
    for (float& stiffness : f.stiffness) stiffness = 0;
    const EliminatedLink link = eliminated(inertia(1e6f), vector(), f);
    for (int k = 0; k < joint_coordinates; ++k)
      for (int i = 0; f.has(k) && i < joint_coordinates; ++i)
        EXPECT_TRUE(link.inertia[k][i] == 0 && link.inertia[i][k] == 0);
  }
}

TEST_F(JointElimination, HangsOnAParentAsABallJointDoes) {
  for (int trial = 0; trial < 200; ++trial) {
    const TreeInertia body = inertia(2);
    const Vec3 arm = vector(), parent_arm = vector();
    JointFreedom f;
    frame(f.along), frame(f.about);
    for (int k = 3; k < joint_coordinates; ++k) f.is_free[k] = all_set;
    TreeInertia by_coordinates = tree_inertia(1, diagonal(1)), by_blocks = by_coordinates;
    add_child(by_coordinates, eliminated(body, arm, f), f, parent_arm);
    add_child(by_blocks, tree_link(body, arm), parent_arm);
    const auto compare = [&](const Mat3& a, const Mat3& b) {
      EXPECT_LT(distance(a.x, b.x) + distance(a.y, b.y) + distance(a.z, b.z), 1e-4f) << "trial " << trial;
    };
    compare(by_coordinates.linear, by_blocks.linear);
    compare(by_coordinates.mixed, by_blocks.mixed);
    compare(by_coordinates.angular, by_blocks.angular);
  }
}

}  // namespace
}  // namespace fathom::joint_elimination_test
