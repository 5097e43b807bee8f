#include "threads/thread_pool.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <new>
#include <thread>
#include <vector>

namespace fathom::thread_pool_test {
namespace {

bool all_once(const std::vector<int>& seen) {
  return std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; });
}

TEST(ThreadPool, RunsEveryItemOnceWithAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    for (int round = 0; round < 500; ++round) {
      std::vector<int> seen(static_cast<std::size_t>(round), 0);
      pool.for_each_chunk(seen.size(), 7, [&](std::size_t begin, std::size_t end) {
        EXPECT_EQ(begin % 7, 0u);
        for (std::size_t i = begin; i < end; ++i) ++seen[i];
      });
      ASSERT_TRUE(all_once(seen)) << threads << " threads, round " << round;
    }
  }
}

TEST(ThreadPool, PartsCoverTheRangeAndAreNotTooSmall) {
  for (const int threads : {1, 2, 5, 8}) {
    ThreadPool pool(threads);
    for (std::size_t count = 0; count < 300; ++count) {
      std::vector<int> seen(count, 0);
      pool.for_each_part(count, 8, [&](std::size_t begin, std::size_t end) {
        EXPECT_GE(end - begin, std::min<std::size_t>(count, 8));
        for (std::size_t i = begin; i < end; ++i) ++seen[i];
      });
      ASSERT_TRUE(all_once(seen)) << threads << " threads, " << count << " items";
    }
  }
}

TEST(ThreadPool, LoopsOverNothingCallNothing) {
  ThreadPool pool(2);
  pool.for_each_chunk(0, 4, [](std::size_t, std::size_t) { FAIL(); });
  pool.for_each_part(0, 4, [](std::size_t, std::size_t) { FAIL(); });
}

TEST(ThreadPool, ThreadsHelpWithAStretchThatIsSlow) {
  ThreadPool pool(2);
  // The first chunk lasts until all others are done: the second thread must process the remainder of the first one's
  // stretch.
  std::atomic<int> done = 0;
  pool.for_each_chunk(16, 1, [&](std::size_t begin, std::size_t) {
    if (begin == 0)
      while (done < 15) std::this_thread::yield();
    ++done;
  });
  EXPECT_EQ(done, 16);
}

TEST(ThreadPool, UsesAsManyThreadsAsItIsTold) {
  ThreadPool pool(4);
  for (const int threads : {4, 1, 3, 0, 9, 2, 4}) {
    pool.use(threads);
    EXPECT_EQ(pool.thread_count(), std::clamp(threads, 1, 4));
    if (threads == 3) std::this_thread::sleep_for(std::chrono::milliseconds(5));  // the fourth falls asleep
    std::vector<int> seen(100, 0);
    pool.for_each_chunk(seen.size(), 1, [&](std::size_t begin, std::size_t) { ++seen[begin]; });
    ASSERT_TRUE(all_once(seen)) << threads;
  }
}

TEST(ThreadPool, SharesCoverTheRange) {
  for (const int threads : {1, 2, 4}) {
    ThreadPool pool(threads);
    const std::size_t cuts[] = {3, 3, 20, 21, 90};
    for (std::size_t shares = 1; shares <= static_cast<std::size_t>(threads); ++shares) {
      std::vector<int> seen(90, 0);
      pool.for_each_share(
          shares, [&](std::size_t i) { return cuts[i]; },
          [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) ++seen[i];
          });
      for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i], i >= 3 && i < cuts[shares] ? 1 : 0);
    }
  }
}

// The caller's own work may contain loops, which it runs alone while the others are busy.
TEST(ThreadPool, CallerComesLaterToALoopBesideSomethingElse) {
  constexpr std::size_t grain = 3;  // in a shorter loop the others have nothing to do
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    for (std::size_t count = 0; count < 200; ++count) {
      std::vector<int> seen(count, 0), inner(40, 0);
      const std::thread::id caller = std::this_thread::get_id();
      int calls = 0;
      const auto alone = [&] {
        ++calls;
        pool.for_each_part(inner.size(), 1, [&](std::size_t begin, std::size_t end) {
          EXPECT_TRUE(count <= grain || std::this_thread::get_id() == caller);
          for (std::size_t i = begin; i < end; ++i) ++inner[i];
        });
      };
      pool.for_each_chunk_beside(alone, count, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++seen[i];
      });
      ASSERT_EQ(calls, 1);
      ASSERT_TRUE(all_once(seen)) << threads << " threads, " << count << " items";
      ASSERT_TRUE(all_once(inner)) << threads << " threads, " << count << " items";
      pool.for_each_part(inner.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) --inner[i];
      });
      ASSERT_EQ(std::count(inner.begin(), inner.end(), 0), 40) << "the next loop is everybody's";
    }
  }
}

TEST(ThreadPool, ACallerThatFailsBesideALoopLeavesItWhenItIsDone) {
  ThreadPool pool(3);
  std::vector<int> seen(1000, 0);
  const auto fail = [] { throw std::bad_alloc(); };
  const auto count = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ++seen[i];
  };
  EXPECT_THROW(pool.for_each_chunk_beside(fail, seen.size(), 3, count), std::bad_alloc);
  EXPECT_TRUE(all_once(seen));
  seen.assign(seen.size(), 0);
  pool.for_each_chunk(seen.size(), 3, count);
  EXPECT_TRUE(all_once(seen));
}

TEST(ThreadPool, SleepingWorkersWakeUp) {
  ThreadPool pool(3);
  for (int round = 0; round < 20; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    std::vector<int> seen(64, 0);
    pool.for_each_part(seen.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++seen[i];
    });
    ASSERT_TRUE(all_once(seen));
  }
}

}  // namespace
}  // namespace fathom::thread_pool_test
