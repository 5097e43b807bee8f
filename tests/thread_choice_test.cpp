#include "threads/thread_choice.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace fathom::thread_choice_test {
namespace {

using Cost = std::function<double(int threads)>;

/// Steps of a scene, and their results.
struct Scene {
  ThreadChoice choice;
  int threads = 0, changes = 0;
  double start = 0;            // 0: the guess
  double spent = 0, best = 0;  // s, and if all steps had been taken with `best_threads`

  void steps(int count, double guess, int most, int best_threads, const Cost& cost) {
    for (int i = 0; i < count; ++i) {
      const int now = choice.next(guess, start > 0 ? start : guess, most);
      changes += threads != 0 && now != threads;
      threads = now;
      const double seconds = cost(now);
      choice.took(seconds);
      spent += seconds;
      best += cost(best_threads);
    }
  }
};

/// A shared part, a serial part, and the cost of each additional thread (s).
Cost amdahl(double shared, double alone, double each) {
  return [=](int threads) { return shared / threads + alone + each * threads; };
}

TEST(ThreadChoice, FollowsItsGuessWhereThatIsRight) {
  Scene run;
  run.steps(10000, 8, 16, 8, amdahl(400e-6, 20e-6, 6e-6));
  EXPECT_EQ(run.threads, 8);
  EXPECT_LT(run.spent, 1.01 * run.best);
}

TEST(ThreadChoice, FindsThatFewerAreFaster) {
  Scene run;
  run.steps(600, 16, 16, 1, amdahl(100e-6, 100e-6, 30e-6));
  EXPECT_LE(run.threads, 2);
  Scene two;
  two.steps(200, 2, 2, 1, [](int threads) { return threads == 1 ? 204e-6 : 257e-6; });
  EXPECT_EQ(two.threads, 1);
}

TEST(ThreadChoice, FindsThatMoreAreFaster) {
  Scene run;
  run.start = 1;
  run.steps(1200, 8, 8, 8, amdahl(400e-6, 0, 0));
  EXPECT_EQ(run.threads, 8);
}

TEST(ThreadChoice, LeapsOverNumbersThatAreSlower) {
  // Threads that wait for each other a hundred times per step: two of them are slower than one, eight are not.
  const Cost heap = [](int threads) { return threads == 1 ? 200e-6 : 200e-6 / threads + 120e-6; };
  Scene up;
  up.start = 1;
  up.steps(1200, 13, 16, 16, heap);
  EXPECT_GT(up.threads, 4);
  Scene down;
  down.steps(2000, 4, 4, 1, [](int threads) { return threads == 1 ? 200e-6 : 200e-6 / threads + 170e-6; });
  EXPECT_EQ(down.threads, 1);
}

TEST(ThreadChoice, CostsLittleWhereItIsRight) {
  for (const int threads : {1, 2, 16}) {
    Scene run;
    run.steps(20000, threads, 16, threads, [=](int n) {
      return n == threads ? 200e-6 : n > threads ? 300e-6 : 400e-6;
    });
    EXPECT_EQ(run.threads, threads);
    EXPECT_LT(run.spent, 1.01 * run.best) << threads;
  }
}

TEST(ThreadChoice, StaysWhereNumbersAreEquallyGood) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.05);
  std::bernoulli_distribution interrupted(0.03);
  Scene run;
  run.steps(20000, 2, 2, 2, [&](int) { return 100e-6 * (1 + noise(random)) + (interrupted(random) ? 1e-3 : 0); });
  // There and back for some thirty trials, and occasionally one that succeeds by chance.
  EXPECT_LE(run.changes, 80);
}

TEST(ThreadChoice, IsNotMisledByAMachineThatGetsSlower) {
  Scene run;
  int step = 0;
  run.steps(5000, 8, 8, 8, [&](int threads) {
    const double speed = 1 + 0.4 * ((++step / 400) % 2);  // on for 400 steps, then off for 400
    return speed * (threads == 8 ? 100e-6 : 130e-6);
  });
  EXPECT_EQ(run.threads, 8);
}

TEST(ThreadChoice, NeverTriesLongSteps) {
  Scene run;
  run.steps(5000, 4, 8, 4, [](int threads) { return 8e-3 / threads; });
  EXPECT_EQ(run.threads, 4);
  EXPECT_EQ(run.changes, 0);
}

TEST(ThreadChoice, NeverTriesOneThreadWhereThatWouldBeASpike) {
  Scene run;  // 2.4 ms of work
  run.steps(20000, 120, 16, 16, [&](int threads) {
    EXPECT_GT(threads, 4);
    return 2.4e-3 / threads + 100e-6;
  });
  EXPECT_EQ(run.threads, 16);
}

TEST(ThreadChoice, KeepsWhatItMeasuredWhenTheGuessChanges) {
  Scene run;
  run.steps(600, 4, 16, 2, [](int threads) { return threads == 2 ? 100e-6 : 150e-6; });
  ASSERT_EQ(run.threads, 2);
  EXPECT_EQ(run.choice.next(4.9, 4.9, 16), 2);  // less than a quarter more
  EXPECT_EQ(run.choice.next(8, 8, 16), 4);
  EXPECT_EQ(run.choice.next(100, 100, 16), 16);
  EXPECT_EQ(run.choice.next(0.1, 1, 16), 1);
}

TEST(ThreadChoice, TakesAllThreadsAgainWhenThereIsMuchMoreToDo) {
  Scene run;
  run.steps(400, 40, 16, 8, [](int threads) { return threads == 8 ? 500e-6 : 600e-6; });
  ASSERT_EQ(run.threads, 8);
  run.steps(400, 400, 16, 16, [](int threads) { return 40e-3 / threads; });
  EXPECT_EQ(run.threads, 16);
}

TEST(ThreadChoice, UsesNoMoreThanThereAre) {
  Scene run;
  for (const int most : {1, 3, 16}) {
    run.steps(300, 12, most, most, [&](int threads) {
      EXPECT_GE(threads, 1);
      EXPECT_LE(threads, most);
      return 100e-6;
    });
  }
}

}  // namespace
}  // namespace fathom::thread_choice_test
