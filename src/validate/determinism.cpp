// Equal inputs give equal bits.
#include <cstdio>

#include "validate/bodies.hpp"
#include "validate/case_list.hpp"
#include "validate/golden.hpp"

namespace fathom::validate {
namespace {

std::string hexadecimal(std::uint64_t value) {
  char text[24];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

}  // namespace

void golden_states(const Setup& setup, Record& record) {
  Table table{
      "State hashes", {"environment", "bodies", "steps", "solver", "broad phase", "state", "contact events"}, {}};
  int different = 0, runs = 0;
  for (const Golden& golden : goldens()) {
    const Hashes expected = golden.of(setup.simulator);
    Hashes first;
    for (const int threads : {1, 2, 4}) {
      Setup with = setup;
      with.threads = threads;
      const Hashes found = run_golden(golden, with);
      if (threads == 1) first = found;
      ++runs;
      different += found != expected;
    }
    table.rows.push_back({golden.environment, std::to_string(golden.bodies), std::to_string(golden.steps),
                          golden.solver == Solver::soft ? "soft" : "impulse",
                          golden.broad_phase == BroadPhase::tree ? "tree" : "sweep", hexadecimal(first.state),
                          hexadecimal(first.events)});
  }
  record.at_most(
      "of " + std::to_string(runs) + " runs at 1, 2 and 4 threads, with other hashes than the committed ones",
      different, 0);
  record.tables.push_back(std::move(table));
}

}  // namespace fathom::validate
