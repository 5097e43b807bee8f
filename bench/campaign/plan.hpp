// Which runs a campaign consists of, on a given machine.
#pragma once

#include <string>
#include <vector>

#include "case.hpp"

namespace fathom::campaign {

/// How much of the campaign is run.
enum class Form {
  quick,  ///< minutes on two cores: sizes up to 1,240 with one thread and with all, 10,000 on the native simulator
          ///< alone
  full,   ///< everything published: all sizes, numbers of threads, devices and sets of algorithms
  huge,   ///< and up to 1,000,000 bodies
};
std::string_view name_of(Form form);

/// What the machine offers.
struct Offer {
  int threads = 1;                   ///< hardware threads
  std::vector<std::string> devices;  ///< selections of `WorldDef::device`: "host", "cuda:0"
  /// Those of them that are processors, through SYCL too: they run the device's kernels to test them.
  std::vector<std::string> processors = {"host"};

  bool is_processor(const std::string& device) const;
};
Offer offer_of_this_machine();

/// 1, 2, 4, … up to 32 as far as the machine has them, and what it has if that is less than 32.
std::vector<int> thread_counts(int hardware_threads);
/// With how many threads the native simulator stands in the tables: 8 as published, or all where there are fewer.
int table_threads(int hardware_threads);

/// Scene after scene; within a scene the simulators take turns, round by round, so that a slow minute of the machine
/// meets them all.
std::vector<Case> plan(Form form, const Offer& offer, int rounds);

/// About how long a run takes there (s), for the time that remains.
double expected_seconds(const Case& what, const Offer& offer);

}  // namespace fathom::campaign
