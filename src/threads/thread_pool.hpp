// A fixed set of threads that run loops together, used by the native simulator and the host back end of the execution
// layer:
//
// * A step is a sequence of loops. The caller's thread takes part in every loop and continues when it is complete.
// * A loop's range is cut into chunks. Every thread starts on its own stretch of chunks, the same in every loop over
//   the same range: what it wrote in one sweep is in its cache in the next. A thread that is done and sees no new loop
//   for a moment steals chunks from others' stretches (`help`): a slow thread simply takes fewer.
// * No cache line is written by all threads. The caller announces a loop in one line that workers watch; a stretch's
//   claims and completions are counted in its owner's line; the caller reads those lines one by one. With 16 threads an
//   empty loop takes a quarter of the time that a shared counter of finished threads takes.
// * Between loops workers spin briefly (a step's loops follow each other within microseconds), then sleep. A late
// worker
//   finds nothing to claim and does no harm: the caller waits for chunks, not for threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace fathom {

class ThreadPool {
 public:
  /// `threads` ≥ 1 includes the caller's thread.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Number of all threads.
  int size() const { return static_cast<int>(stretches_.size()); }
  /// Number of threads that loops use.
  int thread_count() const { return static_cast<int>(used()); }
  /// From now on loops use `threads` threads, or all if there are fewer.
  void use(int threads);

  /// Calls body(begin, end) for consecutive chunks of `grain` items of [0, count), on all threads. The chunks are a
  /// function of the range alone, never of the number of threads: what a loop writes per chunk can be read back in
  /// chunk order, which keeps results independent of timing.
  template <class Body>
  void for_each_chunk(std::size_t count, std::size_t grain, Body&& body) {
    // Two chunks finish before another thread would notice them.
    if (used() == 1 || count <= 2 * grain) {
      for (std::size_t begin = 0; begin < count; begin += grain)
        body(begin, begin + grain < count ? begin + grain : count);
      return;
    }
    const auto chunk = [&](std::size_t k) {
      const std::size_t begin = k * grain;
      body(begin, begin + grain < count ? begin + grain : count);
    };
    run(chunk, (count + grain - 1) / grain);
  }

  /// Calls body(begin, end) for parts of [0, count) of at least `least` items (fewer only if `count` is smaller), on as
  /// many threads as there are parts for. The division depends on the number of threads.
  template <class Body>
  void for_each_part(std::size_t count, std::size_t least, Body&& body) {
    if (count == 0) return;
    const std::size_t threads = used(), most = count / least;
    if (threads == 1 || most < 2) return body(0, count);
    // A few parts per thread, for others to steal; the same number for each.
    const std::size_t parts = most < 2 * threads                                    ? (most < threads ? most : threads)
                              : most / threads * threads < parts_a_thread * threads ? most / threads * threads
                                                                                    : parts_a_thread * threads;
    const auto part = [&](std::size_t k) { body(k * count / parts, (k + 1) * count / parts); };
    run(part, parts);
  }

  /// Like `for_each_chunk`, but the caller first calls alone(), whose own loops run only on its thread if there is more
  /// than one chunk. With one thread alone() also comes first.
  template <class Alone, class Body>
  void for_each_chunk_beside(const Alone& alone, std::size_t count, std::size_t grain, Body&& body) {
    if (used() == 1 || count <= grain) {
      alone();
      return for_each_chunk(count, grain, body);
    }
    const auto chunk = [&](std::size_t k) {
      const std::size_t begin = k * grain;
      body(begin, begin + grain < count ? begin + grain : count);
    };
    run_loop(loop_of(chunk, (count + grain - 1) / grain),
             {[](const void* context) { (*static_cast<const Alone*>(context))(); }, &alone});
  }

  /// Parts of a share, for others to steal.
  static constexpr std::size_t parts_a_thread = 4;

  /// Calls body(begin, end) for parts of `shares` shares; thread i takes [cut(i), cut(i + 1)) unless it is late. At
  /// most as many shares as threads.
  template <class Cut, class Body>
  void for_each_share(std::size_t shares, const Cut& cut, Body&& body) {
    if (used() == 1 || shares < 2) return body(cut(0), cut(shares));
    const std::size_t parts = shares < used() ? 1 : parts_a_thread;
    const auto part = [&](std::size_t k) {
      const std::size_t first = cut(k / parts), size = cut(k / parts + 1) - first;
      const std::size_t begin = first + k % parts * size / parts, end = first + (k % parts + 1) * size / parts;
      if (begin != end) body(begin, end);
    };
    run(part, shares * parts);
  }

 private:
  static constexpr std::size_t line = 128;  // two cache lines: they are fetched in pairs

  struct Loop {
    void (*call)(const void* context, std::size_t chunk) = nullptr;
    const void* context = nullptr;
    std::uint32_t chunks = 0;
    std::uint32_t stretches = 0;
  };

  /// What the caller does before it joins a loop.
  struct Before {
    void (*call)(const void* context) = nullptr;
    const void* context = nullptr;
  };

  /// The last two loops. A slot is rewritten two loops later, so a thread that reads the same `number` before and after
  /// reading a slot has read one loop.
  struct alignas(line) Announcement {
    struct Slot {
      std::atomic<void (*)(const void*, std::size_t)> call{nullptr};
      std::atomic<const void*> context{nullptr};
      std::atomic<std::uint32_t> chunks{0}, stretches{0};
    };
    std::atomic<std::uint64_t> number{0};
    Slot slots[2];
  };

  /// A stretch of chunks. `claims` is the loop's number and how many chunks have been claimed in it; with an older
  /// number, none has been claimed yet.
  struct alignas(line) Stretch {
    std::atomic<std::uint64_t> claims{0};
    std::atomic<std::uint64_t> completed{0};  // chunks, of all loops so far
  };

  template <class Chunk>
  static Loop loop_of(const Chunk& chunk, std::size_t chunks) {
    return {[](const void* context, std::size_t k) { (*static_cast<const Chunk*>(context))(k); }, &chunk,
            static_cast<std::uint32_t>(chunks), 0};
  }
  template <class Chunk>
  void run(const Chunk& chunk, std::size_t chunks) {
    run_loop(loop_of(chunk, chunks), Before{});
  }
  std::size_t used() const { return used_.load(std::memory_order_relaxed); }
  void run_loop(Loop loop, const Before& before);
  void announce(const Loop& loop);
  void wait_for(std::size_t stretch, const Loop& loop);
  bool hear(std::uint64_t number, Loop& loop) const;
  void take_chunks(std::size_t stretch, std::uint64_t number, const Loop& loop);
  void help(std::size_t thread, std::uint64_t number, const Loop& loop);
  void work(std::size_t thread);
  bool spin_until_new(std::size_t thread, std::uint64_t heard, const Loop& loop);
  void sleep_until_new(std::size_t thread, std::uint64_t heard);
  void wake_all();

  std::atomic<std::size_t> used_;
  Announcement announced_;
  std::vector<Stretch> stretches_;                        // one per thread
  bool others_are_busy_ = false;                          // with a loop that the caller has yet to join
  std::vector<std::uint64_t> completed_;                  // values of the stretches' counters when the loop is complete
  alignas(line) std::atomic<std::uint32_t> sleepers_{0};  // of the threads in use
  std::atomic<std::uint32_t> alarm_{0};                   // what sleepers wait on
  std::atomic<bool> stop_{false};
  std::vector<std::thread> workers_;
};

}  // namespace fathom
