// The report: one page from a campaign's folder, including other engines if they were measured there.
#pragma once

#include "store.hpp"

namespace fathom::campaign {

/// Writes report.html into the folder and returns its path. Throws `Error{file}`.
std::string write_report(const Store& store);

}  // namespace fathom::campaign
