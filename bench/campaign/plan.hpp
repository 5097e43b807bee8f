// The runs of a campaign on a given machine.
#pragma once

#include <string>
#include <vector>

#include "case.hpp"

namespace fathom::campaign {

/// How much of the campaign to run.
enum class Form {
  quick,  ///< minutes on two cores: sizes up to 1,240 with one thread and with all, 10,000 only on the native simulator
  full,   ///< everything published: all sizes, numbers of threads, devices and sets of algorithms
  huge,   ///< the same, and up to 1,000,000 bodies
};
std::string_view name_of(Form form);

/// What the machine offers.
struct Offer {
  int threads = 1;                   ///< hardware threads
  std::vector<std::string> devices;  ///< selections of `WorldDef::device`: "host", "cuda:0"
  /// The devices that are processors, also through SYCL: they run the device's kernels to test them.
  std::vector<std::string> processors = {"host"};

  bool is_processor(const std::string& device) const;
};
Offer offer_of_this_machine();

/// 1, 2, 4, … up to 32 or the machine's number of threads, and that number itself if it is less than 32.
std::vector<int> thread_counts(int hardware_threads);
/// The native simulator's number of threads in the tables: 8 as published, or all if there are fewer.
int table_threads(int hardware_threads);

/// Scene after scene. Within a scene the simulators alternate, round by round: a slow minute of the machine affects
/// them all.
std::vector<Case> plan(Form form, const Offer& offer, int rounds);

/// Approximate duration of a run on that machine (s), for estimating the remaining time.
double expected_seconds(const Case& what, const Offer& offer);

}  // namespace fathom::campaign
