// The files that comparisons read: what each contains about each thing it measured.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "store.hpp"

namespace fathom::campaign {

/// What one file contains about one thing.
struct ResultEntry {
  std::string name;
  /// ms; a value for every stretch of steps, with the same stretches in all rounds. A run shorter than a stretch counts
  /// as one.
  std::vector<std::vector<double>> rounds;
  bool in_stretches = false;  ///< of fixed length, so that runs of different lengths have some in common
  std::uint64_t steps = 0;
  bool cut_short = false;  ///< by the limit on a run's time
  std::string hash, trouble;
  std::vector<std::pair<std::uint64_t, Json>> quality;  ///< with its number of steps
  bool rests = false;                                   ///< whether bodies should stay in place
};

struct ResultsFile {
  std::string path, kind, machine;
  std::vector<ResultEntry> entries;
  double tolerance = 0;  ///< of instruction counts
};

/// Reads a file of `fathom bench campaign` (campaign.json), `fathom bench peers` (peers.json) or `bench/instructions`.
/// Throws `Error{file}` for anything else.
ResultsFile read_results(const std::string& path);

}  // namespace fathom::campaign
