// Two sets of results side by side: what got slower or less stable beyond noise.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "store.hpp"

namespace fathom::campaign {

struct CompareSettings {
  /// How far two runs of the same program are taken to differ (share, 95 of 100 times) where the files hold one round
  /// each and cannot tell.
  double noise = 0.05;
};

/// One thing that both files measured.
struct Difference {
  std::string name;
  std::string unit;  ///< of `before` and `after`
  double before = 0, after = 0;
  double ratio = 1, low = 1, high = 1;  ///< after over before, with its 95 % confidence interval
  bool slower = false, faster = false;  ///< beyond noise
  std::string less_stable;              ///< in words; empty where it is not
  std::string not_compared;             ///< why the times tell nothing, e.g. of other numbers of steps
  std::string cut_short;                ///< which of the two ended before its time, in words

  /// A row with a name of this width.
  std::string text(std::size_t width) const;
};

struct Comparison {
  std::vector<Difference> differences;
  std::vector<std::string> notes;  ///< that the machines differ, what only one file has

  bool worse() const;
  /// Of no entry that both files have could the times be compared.
  bool nothing_compared() const;
  std::string text() const;
};

/// Files of `fathom bench campaign` (campaign.json), `fathom bench peers` (peers.json) or `bench/instructions`, both of
/// the same kind. Throws `Error{file}` on anything else.
Comparison compare(const std::string& before, const std::string& after, const CompareSettings& settings);

}  // namespace fathom::campaign
