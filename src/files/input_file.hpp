// How every part of Fathom reads text files.
#pragma once

#include <string>

namespace fathom::files {

/// The whole content of a file. Throws an `Error{file}` that ends with the remedy if it cannot be read completely, for
/// example because it is a folder.
std::string read_file(const std::string& path, const std::string& remedy);

}  // namespace fathom::files
