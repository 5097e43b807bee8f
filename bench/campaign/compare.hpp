// Compares two sets of results: what became slower or less stable beyond noise.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "store.hpp"

namespace fathom::campaign {

struct CompareSettings {
  /// Assumed difference of two runs of the same program (fraction, 95 times out of 100) if the files hold only one
  /// round each.
  double noise = 0.05;
};

/// Something that both files measured.
struct Difference {
  std::string name;
  std::string unit;  ///< of `before` and `after`
  double before = 0, after = 0;
  double ratio = 1, low = 1, high = 1;  ///< after over before, with its 95 % confidence interval
  bool slower = false, faster = false;  ///< beyond noise
  std::string less_stable;              ///< in words; empty if it is not
  std::string not_compared;             ///< why the times cannot be compared, e.g. different numbers of steps
  std::string cut_short;                ///< which of the two ended early, in words

  /// A row with the name padded to this width.
  std::string text(std::size_t width) const;
};

struct Comparison {
  std::vector<Difference> differences;
  std::vector<std::string> notes;  ///< differences of the machines, entries in only one file

  bool worse() const;
  /// Whether no entry in both files had comparable times.
  bool nothing_compared() const;
  std::string text() const;
};

/// Compares files of `fathom bench campaign` (campaign.json), `fathom bench peers` (peers.json) or
/// `bench/instructions`, both of the same kind. Throws `Error{file}` for anything else.
Comparison compare(const std::string& before, const std::string& after, const CompareSettings& settings);

}  // namespace fathom::campaign
