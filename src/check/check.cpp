#include "check/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace fathom::check {

namespace {
std::atomic<Handler> handler_in_use{nullptr};
}  // namespace

void set_handler(Handler handler) { handler_in_use = handler; }

void fail_on_host(const char* condition, const char* file, int line, std::uint32_t body) {
  const Failure failure{condition, file, line, body, current_step.load()};
  if (const Handler handler = handler_in_use) return handler(failure);
  std::fprintf(stderr, "fathom: %s:%d: step %llu", file, line, static_cast<unsigned long long>(failure.step));
  if (body != no_body) std::fprintf(stderr, ", body %u", body);
  std::fprintf(stderr, ": not true: %s\n", condition);
  std::abort();
}

}  // namespace fathom::check
