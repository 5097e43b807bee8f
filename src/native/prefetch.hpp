// Fetching memory ahead of its use, from another core's cache above all.
#pragma once

#include <cstddef>

namespace fathom::native {

inline void prefetch_to_read(const void* line) { __builtin_prefetch(line); }

/// For what is about to be written: asking for that at once saves a second journey between cores.
inline void prefetch_to_write(const void* line) {
#if defined(__x86_64__)
  // The built-in becomes this only where the compiler is told that the processor has it; those without do nothing.
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(line)));
#else
  __builtin_prefetch(line, 1);
#endif
}

/// Calls each of the acts for all of [begin, end), some turns before the next act: what lies anywhere in memory is
/// fetched, step by step, until the last act has it at hand.
template <class... Acts>
void one_after_the_other(std::size_t begin, std::size_t end, const Acts&... acts) {
  constexpr std::size_t turns = 3, last = turns * (sizeof...(acts) - 1);
  for (std::size_t i = begin; i < end + last; ++i) {
    std::size_t late = 0;
    const auto call = [&](const auto& act) {
      if (i >= begin + late && i - late < end) act(i - late);
      late += turns;
    };
    (call(acts), ...);
  }
}

}  // namespace fathom::native
