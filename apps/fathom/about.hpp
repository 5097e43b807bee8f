// The build and the machine, for `fathom --version` and error reports.
#pragma once

#include <string>

namespace fathom::cli {

/// Several lines: version and commit, how it was built, the vector instructions in use, back ends, parts.
std::string version_text();
/// Several lines: system, processor, memory, devices.
std::string machine_text();

}  // namespace fathom::cli
