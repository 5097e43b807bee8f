// Checks of invariants, for developers: they catch an error where it occurs.
//
// FATHOM_ASSERT is cheap and on in every build except release; FATHOM_VALIDATE may cost as much as a step and is on in
// builds for tests, sanitizers and fuzzers (CMake's FATHOM_CHECKS). Both take a condition and, if it concerns a body,
// that body: its slot, or in device code its device index. Other builds do not evaluate the condition.
#pragma once

#include <atomic>
#include <cstdint>
#include <fathom/math.hpp>

#if defined(__CUDACC__)
#include <cstdio>
#endif

/// 0: none, 1: FATHOM_ASSERT, 2: FATHOM_VALIDATE too.
#ifndef FATHOM_CHECKS
#define FATHOM_CHECKS 0
#endif

namespace fathom::check {

inline constexpr bool asserts = FATHOM_CHECKS >= 1, validates = FATHOM_CHECKS >= 2;
inline constexpr std::uint32_t no_body = 0xffffffffu;

struct Failure {
  const char* condition;
  const char* file;
  int line;
  std::uint32_t body;
  std::uint64_t step;  ///< last step taken by any world
};

/// Handles a failure instead of writing to stderr and aborting; null restores that. May be called from any thread. If
/// it returns, execution continues after the check.
using Handler = void (*)(const Failure&);
void set_handler(Handler handler);

inline std::atomic<std::uint64_t> current_step{0};

void fail_on_host(const char* condition, const char* file, int line, std::uint32_t body);

FATHOM_HD void fail([[maybe_unused]] const char* condition, [[maybe_unused]] const char* file,
                    [[maybe_unused]] int line, [[maybe_unused]] std::uint32_t body = no_body) {
#if defined(__CUDA_ARCH__)
  ::printf("%s:%d: body %u: not true: %s\n", file, line, body, condition);
  __trap();
#elif !defined(FATHOM_SYCL_SOURCE)  // SYCL kernels cannot report failures
  fail_on_host(condition, file, line, body);
#endif
}

}  // namespace fathom::check

#define FATHOM_CHECK_THAT(condition, ...) \
  ((condition) ? void() : ::fathom::check::fail(#condition, __FILE__, __LINE__ __VA_OPT__(, ) __VA_ARGS__))
#define FATHOM_NO_CHECK(condition) static_cast<void>(sizeof((condition) ? 1 : 0))

#if FATHOM_CHECKS >= 1
#define FATHOM_ASSERT(...) FATHOM_CHECK_THAT(__VA_ARGS__)
#else
#define FATHOM_ASSERT(condition, ...) FATHOM_NO_CHECK(condition)
#endif
#if FATHOM_CHECKS >= 2
#define FATHOM_VALIDATE(...) FATHOM_CHECK_THAT(__VA_ARGS__)
#else
#define FATHOM_VALIDATE(condition, ...) FATHOM_NO_CHECK(condition)
#endif
