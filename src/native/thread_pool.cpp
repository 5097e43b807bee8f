#include "native/thread_pool.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace fathom {

namespace {

void relax_cpu() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

// About 50 µs: longer than the gaps between the loops of a step, shorter than a frame's other work.
constexpr int spins_before_sleep = 2000;

}  // namespace

ThreadPool::ThreadPool(int threads) {
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
}

ThreadPool::~ThreadPool() {
  stop_ = true;
  bell_.fetch_add(1);
  bell_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::run(const Loop& loop) {
  loop_ = loop;
  next_.store(0, std::memory_order_relaxed);
  if (++number_ == 0) ++number_;
  open_.store(number_);
  bell_.fetch_add(1);
  if (sleepers_.load() != 0) bell_.notify_all();
  take_chunks();
  // Close first, then wait for those inside: a worker that counts itself in after this sees the loop closed.
  open_.store(0);
  for (int spins = 0; inside_.load() != 0; ++spins) {
    if (spins < spins_before_sleep)
      relax_cpu();
    else
      std::this_thread::yield();
  }
}

void ThreadPool::take_chunks() {
  const Loop loop = loop_;
  for (;;) {
    const std::size_t begin = next_.fetch_add(loop.grain, std::memory_order_relaxed);
    if (begin >= loop.count) return;
    const std::size_t end = begin + loop.grain < loop.count ? begin + loop.grain : loop.count;
    loop.call(loop.context, begin, end);
  }
}

void ThreadPool::work() {
  std::uint32_t heard = 0;
  while (!stop_.load(std::memory_order_relaxed)) {
    for (int spins = 0; bell_.load() == heard && spins < spins_before_sleep; ++spins) relax_cpu();
    if (bell_.load() == heard) {
      sleepers_.fetch_add(1);
      bell_.wait(heard);
      sleepers_.fetch_sub(1);
    }
    heard = bell_.load();
    inside_.fetch_add(1);
    if (open_.load() != 0) take_chunks();
    inside_.fetch_sub(1);
  }
}

}  // namespace fathom
