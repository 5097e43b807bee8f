// Grey images as heights: binary PGM files (P5) with 8 or 16 bits per pixel.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace fathom {

struct GreyPicture {
  std::uint32_t width = 0, height = 0;
  std::vector<float> pixels;  ///< 0 (black) to 1 (white), row by row from the top
};

/// Throws `Error{file}` that names `file` and a remedy if it is not such an image, is truncated, or has more than
/// `most` pixels.
GreyPicture parse_pgm(std::string_view bytes, const std::string& file, std::uint64_t most);

}  // namespace fathom
