// Fetching memory ahead of its use, from another core's cache above all.
#pragma once

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

}  // namespace fathom::native
