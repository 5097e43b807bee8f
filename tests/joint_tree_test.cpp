// The direct solution of trees of joints against its defining equations, on random trees.
#include "dynamics/joint_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "random.hpp"

namespace fathom::test::joint_tree_test {
namespace {

struct TreeBody {
  float mass;
  Mat3 inertia;
  int parent;  // −1: an obstacle that stands still, −2: none
  Vec3 arm, parent_arm;
  Vec3 linear, angular;
  Vec3 impulse{};  // on it at its anchor
};

Mat3 random_inertia(Generator& random, float mass, float size) {
  const float scale = mass * size * size;
  const SymMat3 moments{
      scale * uniform(random, 0.1f, 0.4f), scale * uniform(random, 0.2f, 0.4f), scale * 0.3f, 0, 0, 0};
  return to_matrix(rotated(to_matrix(normalize(Quat{1, uniform(random, -1, 1), uniform(random, -1, 1), 0})), moments));
}

Vec3 speed_apart(const std::vector<TreeBody>& tree, const TreeBody& b) {
  const Vec3 at = b.linear + cross(b.angular, b.arm);
  if (b.parent < 0) return at;
  const TreeBody& p = tree[static_cast<std::size_t>(b.parent)];
  return at - (p.linear + cross(p.angular, b.parent_arm));
}

void solve(std::vector<TreeBody>& tree) {
  const std::size_t n = tree.size();
  std::vector<TreeInertia> inertia;
  std::vector<TreeLink> links(n);
  std::vector<TreeLoad> loads(n);
  std::vector<TreeChange> changes(n);
  for (const TreeBody& b : tree) inertia.push_back(tree_inertia(b.mass, b.inertia));
  for (std::size_t i = n; i-- > 0;) {
    const TreeBody& b = tree[i];
    links[i] = tree_link(inertia[i], b.parent == -2 ? Vec3{} : b.arm);
    loads[i] = at_anchor(links[i], loads[i]);
    if (b.parent < 0) continue;
    const auto p = static_cast<std::size_t>(b.parent);
    add_child(inertia[p], links[i], b.parent_arm);
    const Vec3 impulse = handed_on(links[i], loads[i], speed_apart(tree, b));
    loads[p].impulse += impulse;
    loads[p].moment += cross(b.parent_arm, impulse);
  }
  for (std::size_t i = 0; i < n; ++i) {
    TreeBody& b = tree[i];
    if (b.parent == -2) {
      changes[i] = root_change(links[i], loads[i]);
      continue;
    }
    Vec3 change = -speed_apart(tree, b);
    if (b.parent >= 0) {
      const TreeChange& p = changes[static_cast<std::size_t>(b.parent)];
      change += p.linear + cross(p.angular, b.parent_arm);
    }
    b.impulse = impulse_on(links[i], loads[i], change);
    changes[i] = follow(links[i], loads[i], change);
  }
  for (std::size_t i = 0; i < n; ++i) tree[i].linear += changes[i].linear, tree[i].angular += changes[i].angular;
}

// All joints hold, and only their impulses change the bodies: these two conditions determine the solution.
TEST(JointTree, AllJointsHoldByTheirImpulsesAlone) {
  for (unsigned seed = 0; seed < 2000; ++seed) {
    Generator random(seed);
    const float size = uniform(random, 0.01f, 10), ratio = seed % 3 == 0 ? 1000.0f : 10.0f;
    std::vector<TreeBody> tree;
    const int count = 1 + static_cast<int>(random() % 30);
    for (int i = 0; i < count; ++i) {
      TreeBody b;
      b.mass = uniform(random, 1, ratio);
      b.inertia = random_inertia(random, b.mass, size);
      b.parent = i == 0 ? (seed % 2 ? -1 : -2) : static_cast<int>(random() % static_cast<unsigned>(i));
      b.arm = size * in_cube(random), b.parent_arm = size * in_cube(random);
      b.linear = in_cube(random), b.angular = (1 / size) * in_cube(random);
      tree.push_back(b);
    }
    const std::vector<TreeBody> before = tree;
    solve(tree);
    std::vector<Vec3> impulses(tree.size()), moments(tree.size());
    for (std::size_t i = 0; i < tree.size(); ++i) {
      if (tree[i].parent == -2) continue;
      EXPECT_LT(length(speed_apart(tree, tree[i])), 2e-3f) << seed;
      impulses[i] += tree[i].impulse, moments[i] += cross(tree[i].arm, tree[i].impulse);
      if (tree[i].parent < 0) continue;
      const auto p = static_cast<std::size_t>(tree[i].parent);
      impulses[p] -= tree[i].impulse, moments[p] -= cross(tree[i].parent_arm, tree[i].impulse);
    }
    for (std::size_t i = 0; i < tree.size(); ++i) {
      const TreeBody &b = tree[i], &old = before[i];
      const float scale = length(impulses[i]) + b.mass * (length(b.linear) + length(old.linear)) + ratio;
      EXPECT_LT(length(b.mass * (b.linear - old.linear) - impulses[i]), 2e-3f * scale) << seed;
      EXPECT_LT(length(b.inertia * (b.angular - old.angular) - moments[i]), 4e-3f * size * scale) << seed;
    }
  }
}

double kinetic_energy(const std::vector<TreeBody>& tree) {
  double sum = 0;
  for (const TreeBody& b : tree)
    sum += 0.5 * static_cast<double>(b.mass * dot(b.linear, b.linear) + dot(b.angular, b.inertia * b.angular));
  return sum;
}

// Thin rods in random directions, the last one up to 10,000 times as heavy: a link turns far more easily about its own
// axis than across it, and has far less mass than what hangs on it. Joints remove energy from bodies that separate, and
// add none.
TEST(JointTree, FoldedChainsWithHeavyEndsGainNoEnergy) {
  double most = 0;
  for (unsigned seed = 0; seed < 5000; ++seed) {
    Generator random(seed);
    const int count = 2 + static_cast<int>(random() % 14);
    const float heavy = std::pow(10.0f, uniform(random, 0, 4)), thin = std::pow(10.0f, uniform(random, -2, -0.5f));
    std::vector<TreeBody> tree;
    for (int i = 0; i < count; ++i) {
      TreeBody b;
      b.mass = i + 1 == count ? heavy : 1.0f;
      const float across = b.mass / 12, about = b.mass * thin * thin;
      const Quat turned = normalize(Quat{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1), 1});
      b.inertia = to_matrix(rotated(to_matrix(turned), SymMat3{about, across, across, 0, 0, 0}));
      b.parent = i - 1;
      b.arm = rotate(turned, {-0.5f, 0, 0});
      if (i > 0) b.parent_arm = -tree.back().arm;
      b.linear = in_cube(random), b.angular = 10 * in_cube(random);
      tree.push_back(b);
    }
    const double before = kinetic_energy(tree);
    solve(tree);
    most = std::max(most, kinetic_energy(tree) / before);
    for (const TreeBody& b : tree) ASSERT_LT(length(speed_apart(tree, b)), 0.02f) << seed;
  }
  EXPECT_LT(most, 1.0001);
}

}  // namespace
}  // namespace fathom::test::joint_tree_test
