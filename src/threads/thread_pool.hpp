// A fixed set of threads that run loops together. How the native simulator and the host back end of the execution
// layer use their cores is told here, once:
//
// * A step is a sequence of loops; the caller's thread runs every loop too and goes on when all of it is done.
// * A loop's range is cut into chunks. Every thread starts on a stretch of chunks of its own, the same in every loop
//   over the same range, so that what it wrote in one sweep is in its cache in the next. A thread that is done and
//   hears of no new loop for a moment helps with the others' stretches, so a slow thread only takes fewer.
// * Nothing is written by all threads: the caller announces a loop in one cache line that workers watch, claims and
//   completions of a stretch are counted in a line of its owner, and the caller reads those lines in turn. With 16
//   threads a loop of nothing takes a quarter of what one shared counter of finished threads takes.
// * Between loops workers spin for a short while (loops of one step follow each other within microseconds)
//   and then sleep. A worker that comes late finds nothing to claim and harms nobody: the caller waits for chunks, not
//   for threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
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

  /// Threads that there are.
  int size() const { return static_cast<int>(stretches_.size()); }
  /// Threads that loops use.
  int thread_count() const { return static_cast<int>(used()); }
  /// Loops use `threads` threads from now on, or all there are.
  void use(int threads);

  /// Calls body(begin, end) for consecutive chunks of `grain` items of [0, count), on all threads. The chunks are a
  /// function of the range alone, never of the number of threads: what a loop writes per chunk can be read back in
  /// chunk order, which keeps results independent of timing.
  template <class Body>
  void for_each_chunk(std::size_t count, std::size_t grain, Body&& body) {
    // Two chunks are done before another thread has heard of them.
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

  /// Calls body(begin, end) for parts of [0, count) of at least `least` items (as far as there are so many), on as
  /// many threads as that leaves work for. Where the cuts are depends on the number of threads.
  template <class Body>
  void for_each_part(std::size_t count, std::size_t least, Body&& body) {
    if (count == 0) return;
    const std::size_t threads = used(), most = count / least;
    if (threads == 1 || most < 2) return body(0, count);
    // A few parts a thread, so that others can help; the same number for each.
    const std::size_t parts = most < 2 * threads                                    ? (most < threads ? most : threads)
                              : most / threads * threads < parts_a_thread * threads ? most / threads * threads
                                                                                    : parts_a_thread * threads;
    const auto part = [&](std::size_t k) { body(k * count / parts, (k + 1) * count / parts); };
    run(part, parts);
  }

  /// As `for_each_chunk`; meanwhile the caller first calls alone(), whose own loops run on its thread only if there is
  /// more than one chunk. With one thread alone() comes first, too.
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

  /// Cuts of a share, so that others can help with it.
  static constexpr std::size_t parts_a_thread = 4;

  /// Calls body(begin, end) for parts of `shares` shares: those of [cut(i), cut(i + 1)) thread i takes, if it is not
  /// late. Not more shares than threads.
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
  static constexpr std::size_t line = 128;  // two cache lines, because they are fetched in pairs

  struct Loop {
    void (*call)(const void* context, std::size_t chunk) = nullptr;
    const void* context = nullptr;
    std::uint32_t chunks = 0;
    std::uint32_t stretches = 0;
  };

  /// What the caller does before it takes part in a loop.
  struct Before {
    void (*call)(const void* context) = nullptr;
    const void* context = nullptr;
  };

  /// The last two loops. A slot is rewritten two loops later, so a thread that read `number` before and after reading a
  /// slot has read one loop.
  struct alignas(line) Announcement {
    struct Slot {
      std::atomic<void (*)(const void*, std::size_t)> call{nullptr};
      std::atomic<const void*> context{nullptr};
      std::atomic<std::uint32_t> chunks{0}, stretches{0};
    };
    std::atomic<std::uint64_t> number{0};
    Slot slots[2];
  };

  /// A stretch of chunks. `claims` holds the number of the loop and how many chunks have been claimed in it; where the
  /// number is an older one, nobody has claimed any yet.
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
  std::vector<Stretch> stretches_;                        // one a thread
  bool others_are_busy_ = false;                          // with a loop that the caller has not joined yet
  std::vector<std::uint64_t> completed_;                  // what the stretches' counters reach when the loop is done
  alignas(line) std::atomic<std::uint32_t> sleepers_{0};  // of those in use
  std::atomic<std::uint32_t> alarm_{0};                   // what sleepers wait on
  std::atomic<bool> stop_{false};
  std::vector<std::thread> workers_;
};

}  // namespace fathom
