// The files that comparisons read: what each knows of each thing that it measured.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "store.hpp"

namespace fathom::campaign {

/// What one file knows of one thing.
struct ResultEntry {
  std::string name;
  /// ms; a value for every stretch of steps, the same stretches in all rounds. A run shorter than a stretch is one of
  /// its own.
  std::vector<std::vector<double>> rounds;
  bool in_stretches = false;  ///< of fixed length, so that runs of different lengths have some in common
  std::uint64_t steps = 0;
  bool cut_short = false;  ///< by the limit on a run's time
  std::string hash, trouble;
  std::vector<std::pair<std::uint64_t, Json>> quality;  ///< after so many steps
  bool rests = false;                                   ///< bodies that should stay where they are
};

struct ResultsFile {
  std::string path, kind, machine;
  std::vector<ResultEntry> entries;
  double tolerance = 0;  ///< of instruction counts
};

/// A file of `fathom bench campaign` (campaign.json), `fathom bench peers` (peers.json) or `bench/instructions`. Throws
/// `Error{file}` on anything else.
ResultsFile read_results(const std::string& path);

}  // namespace fathom::campaign
