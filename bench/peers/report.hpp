// The campaign's figures as a table and as JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "campaign.hpp"

namespace fathom::peers {

/// Mean step of the engine over Fathom's on the same scene with the same number of threads (engines without threads:
/// with the first number requested); 0 if Fathom did not run.
double ratio_to_fathom(const Result& result, const std::vector<Result>& all);

std::string table_of(const std::vector<Result>& results);
nlohmann::ordered_json to_json(const std::vector<Result>& results);

}  // namespace fathom::peers
