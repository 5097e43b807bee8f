// How many threads a step starts with.
#include "native/thread_budget.hpp"

#include <gtest/gtest.h>

namespace fathom::native::thread_budget_test {
namespace {

StepCounts counts(std::uint32_t bodies, std::uint32_t manifolds) {
  StepCounts c;
  c.active = bodies, c.manifolds = manifolds;
  return c;
}

TEST(ThreadBudget, WorkIsThatOfBodiesManifoldsAndJoints) {
  EXPECT_EQ(ThreadBudget().next(counts(100, 100), {}, 0, 16), 1);
  EXPECT_GT(ThreadBudget().next(counts(2000, 4000), {}, 0, 16), 8);
  EXPECT_GT(ThreadBudget().next(counts(1000, 0), {1000, 0}, 0, 16), 8);
  EXPECT_GT(ThreadBudget().next(counts(200, 0), {190, 200}, 0, 16), 8);
}

/// Work that takes a millisecond on one thread deserves several, whatever was expected of it.
TEST(ThreadBudget, LongStepsAreSharedThatWereThoughtShort) {
  ThreadBudget budget;
  for (int step = 0; step < 3; ++step) {
    EXPECT_EQ(budget.next(counts(1000, 1500), {}, 200e-6, 16), 1) << step;
    budget.took(4e-3);
  }
  EXPECT_EQ(budget.next(counts(1000, 1500), {}, 200e-6, 16), 16);
}

TEST(ThreadBudget, AnInterruptionIsNoLongStep) {
  ThreadBudget budget;
  for (int step = 0; step < 20; ++step) {
    EXPECT_EQ(budget.next(counts(500, 100), {}, 0, 16), 1) << step;
    budget.took(step % 3 == 1 ? 5e-3 : 50e-6);
  }
}

}  // namespace
}  // namespace fathom::native::thread_budget_test
