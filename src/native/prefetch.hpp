// Prefetches memory, mainly from other cores' caches.
#pragma once

#include <cstddef>

namespace fathom::native {

inline void prefetch_to_read(const void* line) { __builtin_prefetch(line); }

/// For memory about to be written: requesting ownership at once saves a second transfer between cores.
inline void prefetch_to_write(const void* line) {
#if defined(__x86_64__)
  // The built-in compiles to this only if the target is known to have it; processors without it ignore it.
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(line)));
#else
  __builtin_prefetch(line, 1);
#endif
}

/// Calls each act for all of [begin, end), each a few iterations ahead of the next one, so that scattered memory is
/// fetched level by level and the last act finds it in the cache.
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
