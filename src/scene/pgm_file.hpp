// Grey pictures as heights: binary PGM files (P5) with 8 or 16 bits a pixel.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace fathom {

struct GreyPicture {
  std::uint32_t width = 0, height = 0;
  std::vector<float> pixels;  ///< 0 (black) to 1 (white), line by line from the top
};

/// Throws `Error{file}` that names `file` and what to do where it is no such picture, is cut off, or has more than
/// `most` pixels.
GreyPicture parse_pgm(std::string_view bytes, const std::string& file, std::uint64_t most);

}  // namespace fathom
