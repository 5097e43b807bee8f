// FATHOM_FLATTEN: the function inlines all that it calls. Otherwise arguments of eight lanes would pass through memory,
// which costs more than the work itself, and results would be computed that are not used.
#pragma once

#if defined(__CUDACC__)
#define FATHOM_FLATTEN
#else
#define FATHOM_FLATTEN [[gnu::flatten]]
#endif
