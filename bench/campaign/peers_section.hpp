// Other engines on the same scenes, from peers.json.
#pragma once

#include <string>

#include "store.hpp"

namespace fathom::campaign {

inline constexpr const char* peers_file = "peers.json";

/// Empty if the folder has no such file. Throws `Error{file}` if it was not written by `fathom bench peers`.
std::string peers_section(const Store& store);

}  // namespace fathom::campaign
