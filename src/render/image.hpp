// Pictures in memory and as PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fathom::render {

/// sRGB, 8 bits a channel, rows from the top, three bytes a pixel.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  std::uint8_t* row(int y) { return pixels.data() + static_cast<std::size_t>(y) * width * 3; }
  const std::uint8_t* row(int y) const { return pixels.data() + static_cast<std::size_t>(y) * width * 3; }
};

/// Throws `Error{file}` where the file cannot be written to its end.
void write_png(const Image& image, const std::string& path);
/// Throws `Error{file}` where the file cannot be read or is no PNG.
Image read_png(const std::string& path);

/// How far two pictures of one size are apart, in steps of 255.
struct ImageDifference {
  double mean = 0;          ///< mean absolute difference of a channel
  double share_beyond = 0;  ///< share of the pixels with a channel more than `limit` apart
};
/// Throws `Error{invalid_argument}` where the sizes differ.
ImageDifference difference(const Image& a, const Image& b, int limit);

}  // namespace fathom::render
