// What build this is and what machine it runs on, for `fathom --version` and reports of errors.
#pragma once

#include <string>

namespace fathom::cli {

/// Several lines: version and commit, how it was built, which vector instructions run here, back ends, parts.
std::string version_text();
/// Several lines: system, processor, memory, devices.
std::string machine_text();

}  // namespace fathom::cli
