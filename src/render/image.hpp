// Pictures in memory and as PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fathom::render {

/// sRGB, 8 bits per channel, rows from the top, three bytes per pixel.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  std::uint8_t* row(int y) { return pixels.data() + static_cast<std::size_t>(y) * width * 3; }
  const std::uint8_t* row(int y) const { return pixels.data() + static_cast<std::size_t>(y) * width * 3; }
};

/// Throws `Error{file}` if the file cannot be written completely.
void write_png(const Image& image, const std::string& path);
/// Throws `Error{file}` if the file cannot be read or is not a PNG.
Image read_png(const std::string& path);

/// Difference of two pictures of the same size, in steps of 255.
struct ImageDifference {
  double mean = 0;          ///< mean absolute difference per channel
  double share_beyond = 0;  ///< share of pixels with a channel that differs by more than `limit`
};
/// Throws `Error{invalid_argument}` if the sizes differ.
ImageDifference difference(const Image& a, const Image& b, int limit);

}  // namespace fathom::render
