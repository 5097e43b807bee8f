// The dissertation's own figures: tables 4.2 to 4.5.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace fathom::campaign {

struct PublishedRow {
  std::string table, environment;
  std::int64_t bodies = 0;
  std::string hardware, simulator;
  double broad_phase = 0, narrow_phase = 0, collision_resolution = 0;  ///< ms, averages per step

  double total() const { return broad_phase + narrow_phase + collision_resolution; }
};

const std::vector<PublishedRow>& published_rows();

}  // namespace fathom::campaign
