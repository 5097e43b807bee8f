// One row per step: each stage's milliseconds and the counts.
#pragma once

#include <fathom/profile.hpp>
#include <iosfwd>

namespace fathom::cli {

void write_csv_head(std::ostream& out);
void write_csv_row(std::ostream& out, const Profile& profile, double step_ms);

}  // namespace fathom::cli
