// Files as every part of Fathom reads them that reads text.
#pragma once

#include <string>

namespace fathom::files {

/// All that a file holds. Where it cannot be read to its end, e.g. since it is a folder, throws `Error{file}` that ends
/// with the remedy.
std::string read_file(const std::string& path, const std::string& remedy);

}  // namespace fathom::files
