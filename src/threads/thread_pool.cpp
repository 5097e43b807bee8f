#include "threads/thread_pool.hpp"

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

// The bell's low bits.
constexpr std::uint32_t thread_bits = 11;
constexpr std::uint32_t thread_mask = (1u << thread_bits) - 1;

}  // namespace

ThreadPool::ThreadPool(int threads) : stretches_(static_cast<std::size_t>(threads)) {
  for (std::size_t i = 1; i < stretches_.size(); ++i) workers_.emplace_back([this, i] { work(i); });
}

ThreadPool::~ThreadPool() {
  stop_ = true;
  bell_.store(++number_ << thread_bits);
  bell_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::run(const Loop& loop) {
  loop_ = loop;
  const std::size_t chunks = (loop.count + loop.grain - 1) / loop.grain;
  stretch_count_ = chunks < stretches_.size() ? chunks : stretches_.size();
  for (std::size_t i = 0; i < stretch_count_; ++i) {
    stretches_[i].next.store(i * chunks / stretch_count_, std::memory_order_relaxed);
    stretches_[i].end = (i + 1) * chunks / stretch_count_;
  }
  open_.store(1);
  bell_.store(++number_ << thread_bits | static_cast<std::uint32_t>(stretch_count_));
  if (sleepers_.load() != 0) bell_.notify_all();
  take_chunks(0);
  // Close first, then wait for those inside: a worker that counts itself in after this sees the loop closed.
  open_.store(0);
  for (int spins = 0; inside_.load() != 0; ++spins) {
    if (spins < spins_before_sleep)
      relax_cpu();
    else
      std::this_thread::yield();
  }
}

void ThreadPool::take_chunks(std::size_t thread) {
  const Loop loop = loop_;
  const std::size_t count = stretch_count_;
  for (std::size_t i = 0; i < count; ++i) {
    Stretch& stretch = stretches_[(thread + i) % count];
    while (stretch.next.load(std::memory_order_relaxed) < stretch.end) {
      const std::size_t chunk = stretch.next.fetch_add(1, std::memory_order_relaxed);
      if (chunk >= stretch.end) break;
      const std::size_t begin = chunk * loop.grain;
      loop.call(loop.context, begin, begin + loop.grain < loop.count ? begin + loop.grain : loop.count);
    }
  }
}

void ThreadPool::work(std::size_t thread) {
  std::uint32_t heard = 0;
  while (!stop_.load(std::memory_order_relaxed)) {
    for (int spins = 0; bell_.load() == heard && spins < spins_before_sleep; ++spins) relax_cpu();
    if (bell_.load() == heard) {
      sleepers_.fetch_add(1);
      bell_.wait(heard);
      sleepers_.fetch_sub(1);
    }
    heard = bell_.load();
    if (thread >= (heard & thread_mask)) continue;
    inside_.fetch_add(1);
    if (open_.load() != 0) take_chunks(thread);
    inside_.fetch_sub(1);
  }
}

}  // namespace fathom
