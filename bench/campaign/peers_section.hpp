// Other engines on the same scenes, from peers.json.
#pragma once

#include <string>

#include "store.hpp"

namespace fathom::campaign {

inline constexpr const char* peers_file = "peers.json";

/// Empty words where the folder has no such file. Throws `Error{file}` where it is not what `fathom bench peers` wrote.
std::string peers_section(const Store& store);

}  // namespace fathom::campaign
