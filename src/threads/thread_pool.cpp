#include "threads/thread_pool.hpp"

#include <exception>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace fathom {

namespace {

void relax_cpu() {
#if defined(__x86_64__)
  _mm_pause();
#elif defined(__aarch64__)
  asm volatile("isb");  // takes tens of cycles, unlike `yield` on most cores
#endif
}

// About 100 µs: longer than the gaps between a step's loops, shorter than a frame's other work.
constexpr int spins_before_sleep = 2000;
// About a microsecond: a thread that is on time is done by then, and reading its cache line would only slow it down.
constexpr int spins_before_help = 24;

// Of a stretch's claims, the low bits count chunks and the high bits are the loop's number.
constexpr int claim_bits = 22;
constexpr std::uint64_t claim_mask = (std::uint64_t{1} << claim_bits) - 1;

std::size_t first_chunk(std::size_t stretch, std::uint32_t chunks, std::uint32_t stretches) {
  return stretch * chunks / stretches;
}

/// Claims the next chunk of the stretch of `size` chunks in loop `number`; true, with its index, if there was one.
bool claim(std::atomic<std::uint64_t>& claims, std::uint64_t number, std::size_t size, std::size_t& index) {
  std::uint64_t seen = claims.load(std::memory_order_relaxed);
  for (;;) {
    const std::uint64_t of = seen >> claim_bits;
    if (of > number) return false;  // finished long ago
    index = of == number ? seen & claim_mask : 0;
    if (index >= size) return false;
    if (claims.compare_exchange_weak(seen, number << claim_bits | (index + 1), std::memory_order_relaxed)) return true;
  }
}

}  // namespace

ThreadPool::ThreadPool(int threads)
    : used_(static_cast<std::size_t>(threads)), stretches_(used()), completed_(used(), 0) {
  for (std::size_t i = 1; i < stretches_.size(); ++i) workers_.emplace_back([this, i] { work(i); });
}

ThreadPool::~ThreadPool() {
  stop_ = true;
  announce({});
  wake_all();
  for (std::thread& worker : workers_) worker.join();
}

// --- the caller ----------------------------------------------------------------------------------------------

void ThreadPool::run_loop(Loop loop, const Before& before) {
  loop.stretches = static_cast<std::uint32_t>(loop.chunks < used() ? loop.chunks : used());
  const bool is_endless = loop.chunks / loop.stretches >= claim_mask;  // billions of items in tiny chunks
  if (is_endless || others_are_busy_) {
    if (before.call) before.call(before.context);
    for (std::size_t k = 0; k < loop.chunks; ++k) loop.call(loop.context, k);
    return;
  }
  announce(loop);
  std::exception_ptr failure;  // rethrown at the end: other threads still use the caller's data
  if (before.call) {
    others_are_busy_ = true;
    try {
      before.call(before.context);
    } catch (...) {
      failure = std::current_exception();
    }
    others_are_busy_ = false;
  }
  take_chunks(0, announced_.number.load(std::memory_order_relaxed), loop);
  for (std::size_t i = 0; i < loop.stretches; ++i) wait_for(i, loop);
  if (failure) std::rethrow_exception(failure);
}

void ThreadPool::announce(const Loop& loop) {
  const std::uint64_t number = announced_.number.load(std::memory_order_relaxed) + 1;
  Announcement::Slot& slot = announced_.slots[number % 2];
  slot.call.store(loop.call, std::memory_order_release);
  slot.context.store(loop.context, std::memory_order_release);
  slot.chunks.store(loop.chunks, std::memory_order_release);
  slot.stretches.store(loop.stretches, std::memory_order_release);
  announced_.number.store(number);
  if (sleepers_.load() != 0) wake_all();
}

void ThreadPool::wake_all() {
  alarm_.fetch_add(1);
  alarm_.notify_all();
}

void ThreadPool::use(int threads) {
  const std::size_t wanted = threads < 1 ? 1 : static_cast<std::size_t>(threads);
  const std::size_t before = used_.exchange(wanted < stretches_.size() ? wanted : stretches_.size());
  if (used() > before) wake_all();
}

void ThreadPool::wait_for(std::size_t stretch, const Loop& loop) {
  const std::uint64_t number = announced_.number.load(std::memory_order_relaxed);
  const std::size_t size =
      first_chunk(stretch + 1, loop.chunks, loop.stretches) - first_chunk(stretch, loop.chunks, loop.stretches);
  const std::uint64_t due = completed_[stretch] += size;
  const std::atomic<std::uint64_t>& completed = stretches_[stretch].completed;
  for (int spins = 1; completed.load(std::memory_order_acquire) != due; ++spins) {
    relax_cpu();
    if (spins == spins_before_help) take_chunks(stretch, number, loop);
    if (spins > spins_before_sleep) std::this_thread::yield();
  }
}

// --- all threads ---------------------------------------------------------------------------------------------

void ThreadPool::take_chunks(std::size_t stretch, std::uint64_t number, const Loop& loop) {
  const std::size_t first = first_chunk(stretch, loop.chunks, loop.stretches);
  const std::size_t size = first_chunk(stretch + 1, loop.chunks, loop.stretches) - first;
  std::uint64_t done = 0;
  for (std::size_t index; claim(stretches_[stretch].claims, number, size, index); ++done)
    loop.call(loop.context, first + index);
  if (done != 0) stretches_[stretch].completed.fetch_add(done, std::memory_order_release);
}

// --- workers -------------------------------------------------------------------------------------------------

bool ThreadPool::hear(std::uint64_t number, Loop& loop) const {
  const Announcement::Slot& slot = announced_.slots[number % 2];
  loop.call = slot.call.load(std::memory_order_acquire);
  loop.context = slot.context.load(std::memory_order_acquire);
  loop.chunks = slot.chunks.load(std::memory_order_acquire);
  loop.stretches = slot.stretches.load(std::memory_order_acquire);
  return announced_.number.load(std::memory_order_relaxed) == number;
}

void ThreadPool::help(std::size_t thread, std::uint64_t number, const Loop& loop) {
  for (std::size_t i = 1; i < loop.stretches; ++i) take_chunks((thread + i) % loop.stretches, number, loop);
}

void ThreadPool::work(std::size_t thread) {
  std::uint64_t heard = 0;
  Loop loop;
  while (!stop_.load(std::memory_order_relaxed)) {
    if (!spin_until_new(thread, heard, loop)) sleep_until_new(thread, heard);
    const std::uint64_t number = announced_.number.load(std::memory_order_acquire);
    if (!hear(number, loop)) continue;
    heard = number;
    if (thread < loop.stretches) take_chunks(thread, number, loop);
  }
}

bool ThreadPool::spin_until_new(std::size_t thread, std::uint64_t heard, const Loop& loop) {
  for (int spins = 1; spins < spins_before_sleep; ++spins) {
    if (announced_.number.load(std::memory_order_relaxed) != heard) return true;
    relax_cpu();
    // Once is enough: all chunks have been claimed by then.
    if (spins == spins_before_help && thread < loop.stretches) help(thread, heard, loop);
  }
  return false;
}

// An unused thread is not woken for every loop. Reads the alarm first, so a thread put to use meanwhile wakes.
void ThreadPool::sleep_until_new(std::size_t thread, std::uint64_t heard) {
  const std::uint32_t alarm = alarm_.load();
  const bool in_use = thread < used_.load();
  if (in_use) sleepers_.fetch_add(1);
  if (announced_.number.load() == heard) alarm_.wait(alarm);
  if (in_use) sleepers_.fetch_sub(1);
}

}  // namespace fathom
