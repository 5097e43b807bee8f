#include "published.hpp"

#include <sstream>
#include <utility>

#include "published_data.hpp"

namespace fathom::campaign {
namespace {

std::vector<PublishedRow> parse() {
  std::vector<PublishedRow> rows;
  std::istringstream text(csv);
  bool head = true;
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    if (std::exchange(head, false)) continue;
    std::istringstream cells(line);
    PublishedRow row;
    const auto cell = [&] {
      std::string value;
      std::getline(cells, value, ',');
      return value;
    };
    row.table = cell(), row.environment = cell(), row.bodies = std::stoll(cell());
    row.hardware = cell(), row.simulator = cell();
    for (double* stage : {&row.broad_phase, &row.narrow_phase, &row.collision_resolution})
      *stage = 1e3 * std::stod(cell());
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

const std::vector<PublishedRow>& published_rows() {
  static const std::vector<PublishedRow> rows = parse();
  return rows;
}

}  // namespace fathom::campaign
