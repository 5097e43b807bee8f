// A fixed set of threads that run loops together. How the native simulator and the host back end of the execution
// layer use their cores is told here, once:
//
// * A step is a sequence of loops; the caller's thread runs every loop too and goes on when all of it is done.
// * A loop's range is cut into chunks. Every thread starts on a stretch of chunks of its own, the same in every loop
//   over the same range, so that what it wrote in one sweep is in its cache in the next; when it is done it helps
//   with the others' stretches, so a slow thread only takes fewer. Chunks are a function of the range alone, never of
//   the number of threads: what a loop writes per chunk can be read back in chunk order, which keeps results
//   independent of timing.
// * Between loops workers spin for a short while (loops of one step follow each other within microseconds)
//   and then sleep. A loop of few chunks calls only as many threads as it has chunks; the others do not even look. A
//   worker that wakes late finds the loop closed and harms nobody: the caller waits only for workers that entered.
#pragma once

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace fathom {

class ThreadPool {
 public:
  /// `threads` ≥ 1 counts the caller's thread.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int thread_count() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls body(begin, end) for consecutive chunks of `grain` items of [0, count), on all threads.
  template <class Body>
  void for_each_chunk(std::size_t count, std::size_t grain, Body&& body) {
    if (count == 0) return;
    // Two chunks are done before another thread has heard of them.
    if (workers_.empty() || count <= 2 * grain) {
      for (std::size_t begin = 0; begin < count; begin += grain)
        body(begin, begin + grain < count ? begin + grain : count);
      return;
    }
    run({[](void* context, std::size_t begin, std::size_t end) { (*static_cast<Body*>(context))(begin, end); },
         const_cast<void*>(static_cast<const void*>(&body)), count, grain});
  }

 private:
  struct Loop {
    void (*call)(void* context, std::size_t begin, std::size_t end) = nullptr;
    void* context = nullptr;
    std::size_t count = 0;
    std::size_t grain = 1;
  };

  void run(const Loop& loop);
  void take_chunks(std::size_t thread);
  void work(std::size_t thread);

  /// A stretch of chunks; a cache line each, because its counter is hot.
  struct alignas(64) Stretch {
    std::atomic<std::size_t> next{0};
    std::size_t end = 0;
  };

  Loop loop_;
  std::vector<Stretch> stretches_;                    // one a thread
  std::size_t stretch_count_ = 0;                     // in use by the loop
  alignas(64) std::atomic<std::uint32_t> open_{0};    // 1 while workers may enter the loop
  alignas(64) std::atomic<std::uint32_t> inside_{0};  // workers in or about to look into a loop
  alignas(64) std::atomic<std::uint32_t> bell_{0};  // rung when a loop opens: its number, and how many threads it wants
  std::atomic<std::uint32_t> sleepers_{0};
  std::atomic<bool> stop_{false};
  std::uint32_t number_ = 0;
  std::vector<std::thread> workers_;
};

}  // namespace fathom
